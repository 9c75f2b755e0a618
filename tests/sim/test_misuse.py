"""Invalid calls of a simulation raise one clear sentence."""

import numpy as np
import pytest

from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError


@pytest.mark.parametrize("steps", [-1, 1.5, "a", None])
def test_steps_must_be_whole_numbers(sim, steps):
    with pytest.raises(KbotError, match="number of steps must be a whole number"):
        sim.step(steps)
    sim.step(np.int64(3))
    assert sim.steps == 3


@pytest.mark.parametrize("command", [("a", 0.0), (0.0, None), (float("nan"), 0.0)])
def test_commands_must_be_finite_numbers(sim, command):
    with pytest.raises(KbotError, match="two finite numbers"):
        sim.cmd_vel(*command)


def test_times_poses_and_positions_must_be_numbers(sim):
    with pytest.raises(KbotError, match="time to run must be from 0"):
        sim.run("soon")
    with pytest.raises(KbotError, match="a pose must be three finite numbers"):
        sim.models.set_pose(0.0, "there", 0.0)


@pytest.mark.parametrize(
    ("timestep", "seconds", "steps"),
    [
        (0.002, 0.0, 0),
        (0.002, 1e-12, 0),  # a rounding error, as of `end - sim.time`
        (0.002, 0.0005, None),
        (0.002, 0.001, None),  # half a step
        (0.002, 0.0011, 1),
        (0.002, 1 / 60, 8),  # 8.3 steps
        (0.002, 0.05, 25),
        (0.001, 0.001, 1),
        (0.0005, 0.001, 2),
        (0.02, 0.005, None),
    ],
)
def test_a_run_makes_the_nearest_number_of_steps_and_never_silently_none(
    kbot_robot, timestep, seconds, steps
):
    sim = Simulation(kbot_robot, timestep=timestep)
    if steps is None:
        with pytest.raises(KbotError, match=rf"{seconds:g} s, rounds to no step: .* is {timestep:g} s"):
            sim.run(seconds)
        assert sim.steps == 0
    else:
        sim.run(seconds)
        assert sim.steps == steps


@pytest.mark.parametrize("seed", ["a", 1.5, -1, None, True])
def test_seed_must_be_a_whole_number(kbot_robot, seed):
    with pytest.raises(KbotError, match="seed must be a whole number"):
        Simulation(kbot_robot, seed=seed)


def test_timestep_must_be_in_range(kbot_robot):
    with pytest.raises(KbotError, match=r"timestep must be from 0\.00001 to 0\.02 seconds"):
        Simulation(kbot_robot, timestep="short")


def test_robot_can_be_a_file_name(kbot_robot):
    assert Simulation("kbot").state_sha256() == Simulation(kbot_robot).state_sha256()
    with pytest.raises(DescriptionError, match=r"gone\.xacro does not exist"):
        Simulation("gone.xacro")
    with pytest.raises(KbotError, match=r"kbot\.load\(FILE\), not 3"):
        Simulation(3)
