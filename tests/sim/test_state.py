"""Reruns, chunks, resets, restores and processes give the same bytes."""

import math
import subprocess
import sys

import pytest

from kbot.messages import Odometry
from kbot.sim import Simulation
from kbot.text import KbotError

SCRIPT = """
from kbot.model.load import load_robot
from kbot.sim import Simulation
sim = Simulation(load_robot("kbot").require(), world="boxes", seed=3)
sim.cmd_vel(0.3, 0.4)
sim.run(2.0)
print(sim.state_sha256())
"""


def drive(sim: Simulation) -> str:
    sim.cmd_vel(0.3, 0.4)
    sim.run(1.0)
    sim.cmd_vel(0.1, -1.0)
    sim.run(1.0)
    return sim.state_sha256()


def test_two_runs_are_equal(kbot_robot):
    assert drive(Simulation(kbot_robot)) == drive(Simulation(kbot_robot))


def test_run_after_a_reset_is_the_same(sim):
    first = drive(sim)
    odometry = sim.odometry
    sim.reset()
    assert sim.time == 0.0
    assert sim.odometry.pose.x == 0.0
    assert drive(sim) == first
    assert sim.odometry == odometry


def test_result_does_not_depend_on_how_steps_are_requested(kbot_robot):
    """Single steps, hundreds of steps, and steps with a watcher give the same bytes."""
    whole, single, watched = (Simulation(kbot_robot) for _ in range(3))
    for sim in (whole, single, watched):
        sim.cmd_vel(0.3, 0.4)
    whole.step(333)
    received = []
    watched.bus.subscribe("/odom", Odometry, received.append)
    for _ in range(333):
        single.step()
        watched.step()
        watched.link_poses()
        watched.ground_truth  # noqa: B018 - reading must not change the run
    assert single.state_sha256() == whole.state_sha256() == watched.state_sha256()
    assert single.odometry == whole.odometry == watched.odometry
    assert len(received) == 33


def test_runs_in_several_processes_are_equal():
    results = {
        subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    }
    assert len(results) == 1


@pytest.mark.parametrize("steps", [50, 73])
def test_run_continues_from_a_restored_state_bit_for_bit(sim, steps):
    """This also holds within a control period and during acceleration."""
    sim.cmd_vel(0.3, 0.4)
    sim.step(steps)
    saved = sim.state()
    sim.step(400)
    after, odometry = sim.state_sha256(), sim.odometry
    sim.cmd_vel(0.0, 2.0)
    sim.step(99)
    sim.restore(saved)
    assert sim.steps == steps
    sim.step(400)
    assert sim.state_sha256() == after
    assert sim.odometry == odometry


@pytest.mark.skipif(sys.platform != "linux", reason="reads the memory of a process from /proc")
def test_states_take_no_more_memory_than_their_size():
    """A page keeps 350 of them. The size also limits how many it keeps of a large world."""
    program = """
import kbot
sim = kbot.Simulation("kbot", "boxes")
def pages():
    return int(open("/proc/self/statm").read().split()[1])
kept = [sim.state()]  # with what the first one imports
before = pages()
kept += [sim.state() for _ in range(200)]
print((pages() - before) * 4096 / sum(state.size for state in kept))
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert float(ran.stdout) < 2.0


def test_state_of_another_robot_is_rejected(sim, ball):
    with pytest.raises(KbotError, match="other robots or another world"):
        sim.restore(Simulation(ball).state())


def test_robot_can_be_moved_to_another_pose(sim):
    sim.cmd_vel(0.2, 0.3)
    sim.run(1.0)
    before = sim.odometry.pose
    sim.models.set_pose(2.0, -1.0, 7.0)
    truth = sim.ground_truth.pose
    assert (truth.x, truth.y, truth.yaw) == pytest.approx((2.0, -1.0, 7.0 - 2.0 * math.pi))
    assert sim.odometry.pose == before
    with pytest.raises(KbotError, match="finite"):
        sim.models.set_pose(float("nan"), 0.0, 0.0)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    assert sim.link_pose("base_link").translation[2] == pytest.approx(0.04, abs=1e-4)


def test_changed_robot_continues_from_the_old_ones_state(sim):
    from kbot.model.load import load_robot

    sim.cmd_vel(0.2, 0.5)
    sim.run(3.0)
    larger = load_robot("kbot", {"wheel_radius": "0.045"}).require()
    other = sim.with_robot(larger)
    assert other.time == sim.time
    assert other.joint_positions == pytest.approx(sim.joint_positions)
    for mine, theirs in ((other.ground_truth, sim.ground_truth), (other.odometry, sim.odometry)):
        a, b = mine.pose, theirs.pose
        assert (a.x, a.y, a.yaw) == pytest.approx((b.x, b.y, b.yaw))
    other.run(1.0)
    assert other.robots.first.twist.x == pytest.approx(0.2)
    assert other.link_pose("base_link").translation[2] == pytest.approx(0.05, abs=1e-4)
    off = other.odometry.pose.yaw - other.ground_truth.pose.yaw
    assert abs(off) < 1e-3
