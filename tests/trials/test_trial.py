"""Trials against closed forms: where the robot is, what it measures, and when its steps begin."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.sim.injected_faults import BlockedJoint
from kbot.text import KbotError
from kbot.trials import (
    AddObject,
    Bound,
    Check,
    Command,
    Goal,
    InjectFault,
    NeverTouches,
    PassesThrough,
    Push,
    Range,
    Reaches,
    RobotSource,
    RunScript,
    Scenario,
    Settles,
    StaysUpright,
    Step,
    run_trial,
)

KBOT = RobotSource("kbot")
STRAIGHT = (Step(Command(0.2)), Step(Command(), at=8.0))


def test_a_straight_drive_ends_where_its_commands_lead() -> None:
    # the deceleration takes as long as the acceleration, so the way is speed times time
    expect = [
        Bound("final_forward", 1.598, 1.602),
        Bound("max_left", max=0.001),
        Reaches(1.6, 0.0, within=0.005, yaw=0.0, yaw_within=0.01, before=8.5),
        PassesThrough(0.8, 0.0, within=0.005),
        NeverTouches(),
        StaysUpright(),
        Settles(1.0),
    ]
    result = run_trial(Scenario("straight", 10.0, STRAIGHT, expect, KBOT))
    assert result.passed, result.reason
    assert len(result.state_sha256) == 64


def test_a_circle_returns_to_its_start() -> None:
    circle = 2.0 * math.pi / 0.5
    steps = [Step(Command(0.2, 0.5)), Step(Command(), at=circle)]
    result = run_trial(Scenario("circle", circle + 1.0, steps, [Reaches(0.0, 0.0, 0.02)], KBOT))
    assert result.passed, result.reason


def test_equal_trials_have_equal_states_and_a_seed_names_the_world() -> None:
    scenario = Scenario("maze", 6.0, STRAIGHT[:1], robot=KBOT, world="boxes:seed={seed}", seeds=(1, 2))
    first, again, other = (run_trial(scenario, seed, with_all_values=True) for seed in (1, 1, 2))
    assert first.state_sha256 == again.state_sha256
    assert first.all_values["clearance"] != other.all_values["clearance"]


def test_a_wall_is_touched_and_named() -> None:
    scenario = Scenario("wall", 6.0, [Step(Command(0.3))], [NeverTouches()], KBOT, "corridor:length=2")
    result = run_trial(scenario)
    assert not result.passed
    assert result.reason == "contacts is 1, above 0 (end_wall)"


def test_a_step_waits_for_its_condition_and_for_the_step_before() -> None:
    steps = [
        Step(Command(0.2)),
        Step(AddObject("wall", 0.8, 0.0, size=(0.05, 1.0, 0.3)), when={"distance": Range(min=0.4)}),
        Step(Command(), when={"clearance": Range(max=0.1)}),
    ]
    scenario = Scenario("obstacle", 10.0, steps, [NeverTouches(), Bound("clearance", 0.05, 0.1)], KBOT)
    result = run_trial(scenario, with_trace=True)
    assert result.passed, result.reason
    assert result.trace is not None
    start, added, stopped = result.trace.events
    # 0.4 m at 0.2 m/s, after an acceleration that costs half its duration
    assert added.time == pytest.approx(2.0, abs=0.2)
    assert start.time < added.time < stopped.time


def test_a_step_that_never_begins_fails_the_trial() -> None:
    steps = [Step(Command(0.2)), Step(Command(), when={"distance": Range(min=5.0)})]
    result = run_trial(Scenario("short", 1.0, steps, [NeverTouches()], KBOT))
    assert (result.reason or "").startswith(
        "steps_begun is 1, below 2 (step 2 still waits for its condition: distance is 0.1"
    )


def test_an_object_that_is_never_there_cannot_be_expected() -> None:
    steps = [Step(AddObject("crate", 3.0, 0.0), at=0.1)]
    scenario = Scenario("far", 0.2, steps, [NeverTouches(("crate", "end_wall"))], KBOT, "corridor")
    assert run_trial(scenario).passed
    misspelt = replace(scenario, expect=[NeverTouches(("crat",))])
    assert run_trial(misspelt).reason == (
        "never_touches: no object has the name 'crat': did you mean 'crate'?"
    )


def test_a_missed_place_names_where_the_robot_ends() -> None:
    # the deceleration takes as long as the acceleration, so the way is 0.2 m/s for 8 s
    result = run_trial(Scenario("straight", 10.0, STRAIGHT, [Reaches(1.0, 0.0, 0.01)], KBOT))
    assert result.reason == "distance_to_target is 0.6 m, above 0.01 m (it ends at 1.6, 0)"


def test_until_ends_a_run_at_its_goal() -> None:
    scenario = Scenario(
        "room",
        60.0,
        [Step(Goal(1.0, 0.0))],
        [Bound("goals_reached", min=1), Bound("goal_time", max=30.0)],
        KBOT,
        "rooms",
        until={"goals_reached": Range(min=1)},
    )
    result = run_trial(scenario, with_trace=True)
    assert result.passed, result.reason
    assert result.trace is not None
    assert result.trace["time"][-1] < 30.0


def test_a_blocked_wheel_and_a_push_change_the_run() -> None:
    blocked = [*STRAIGHT, Step(InjectFault(BlockedJoint("left_wheel_joint")), at=8.0)]
    blocked[1], blocked[2] = Step(InjectFault(BlockedJoint("left_wheel_joint")), at=2.0), blocked[1]
    result = run_trial(Scenario("blocked", 10.0, blocked, [Bound("final_turn", -0.1, 0.1)], KBOT))
    assert "final_turn" in (result.reason or "")
    pushed = Scenario(
        "push", 3.0, [Step(Push((30.0, 0.0, 0.0), 0.2), at=1.0)], [Bound("path_length", max=1e-4)], KBOT
    )
    assert "path_length" in (run_trial(pushed).reason or "")


def test_a_script_drives_and_ends_with_the_scenario(tmp_path: Path) -> None:
    script = tmp_path / "drive.py"
    script.write_text(
        "def drive(sim):\n    while True:\n        sim.cmd_vel(0.1, 0.0)\n        sim.run(0.1)\n"
    )
    scenario = Scenario(
        "script", 4.0, [Step(RunScript(str(script)))], [Bound("final_forward", 0.36, 0.4)], KBOT
    )
    assert run_trial(scenario).passed

    def drive(sim: Simulation) -> None:
        sim.cmd_vel(0.1, 0.0)

    scenario = Scenario("function", 4.0, [Step(RunScript(drive))], [Bound("final_forward", 0.36, 0.4)], KBOT)
    assert run_trial(scenario).passed


def test_a_script_that_fails_is_reported_at_its_line(tmp_path: Path) -> None:
    script = tmp_path / "drive.py"
    script.write_text("def drive(sim):\n    sim.run(0.5)\n    assert sim.ground_truth.pose.x > 1.0\n")
    result = run_trial(Scenario("script", 4.0, [Step(RunScript(str(script)))], robot=KBOT))
    assert not result.passed
    assert f"{script}:3" in result.error


def test_a_robot_that_does_not_expand_is_reported_at_its_line(tmp_path: Path) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n  <link name="${oops}"/>\n</robot>\n'
    )
    result = run_trial(Scenario("broken", 1.0, robot=RobotSource(str(file))))
    assert f"{file}:2:" in result.error
    assert "oops" in result.error


def test_a_check_computes_any_number() -> None:
    check = Check("mean_speed", lambda trace: float(trace["speed"].mean()), min=0.1)
    result = run_trial(Scenario("check", 8.0, STRAIGHT, [check], KBOT))
    assert result.passed, result.reason


def test_the_weight_rests_on_wheels_and_caster() -> None:
    result = run_trial(Scenario("still", 2.0, robot=KBOT), with_all_values=True)
    support = sum(value for name, value in result.all_values.items() if name.startswith("support/"))
    from kbot.kinematics.bodies import total_mass
    from kbot.trials.trial import load_source

    assert support == pytest.approx(total_mass(load_source(KBOT)) * 9.80665, rel=0.01)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Bound("max_tlt", max=1.0), "did you mean 'max_tilt'"),
        (lambda: Bound("max_tilt"), "needs a bound"),
        (lambda: Bound("max_tilt", 2.0, 1.0), "exclude every value"),
        (lambda: Step(Command(), when={"sped": Range()}), "did you mean 'speed'"),
        (lambda: Step(Command(), at=-1.0), "time of a step"),
        (lambda: Scenario("x", 0.0), "duration"),
        (lambda: Scenario("x", 1.0, seeds=()), "seeds"),
        (lambda: Scenario("x", 1.0, [Step(Command(), at=2.0)]), "after the scenario ends"),
        (lambda: Scenario("x", 9.0, [Step(Command(), at=2.0), Step(Command(), at=1.0)]), "order of time"),
        (lambda: Range(5.0, 1.0), "can never hold"),
        (lambda: Reaches(0.0, 0.0, 0.0), "above 0"),
    ],
)
def test_mistakes_are_refused_when_a_scenario_is_made(make, message) -> None:
    with pytest.raises(KbotError, match=message):
        make()


def test_a_step_that_is_not_possible_is_named() -> None:
    steps = [Step(Command(0.1)), Step(Push((1.0, 0.0, 0.0), 0.1, "whel"), at=0.5)]
    result = run_trial(Scenario("push", 1.0, steps, robot=KBOT))
    assert result.error.startswith("step 2, push whel: no link of 'kbot'")


def test_sensors_that_nothing_reads_do_not_change_a_run_and_scripts_read_them() -> None:
    with_lidar = RobotSource("kbot", {"lidar": "true"})
    scenario = Scenario("straight", 1.0, STRAIGHT[:1], robot=with_lidar, world="rooms")
    watched = run_trial(scenario, watch=lambda simulation: None)
    assert run_trial(scenario).state_sha256 == watched.state_sha256
    readings = []

    def read(simulation: Simulation) -> None:
        simulation.run(0.2)
        readings.append(mount_declared(simulation)[0]["lidar"].latest)

    run_trial(Scenario("script", 1.0, [Step(RunScript(read))], robot=with_lidar, world="rooms"))
    assert readings[0] is not None


def test_a_property_that_the_robot_does_not_have_is_an_error() -> None:
    result = run_trial(Scenario("own", 0.1, robot=RobotSource("kbot", properties={"base_mas": "1"})))
    assert "there is no top-level property 'base_mas'" in result.error
    assert "base_mass (property)" in result.error


def test_a_part_that_the_robot_does_not_have_is_named_with_the_known_ones() -> None:
    result = run_trial(Scenario("own", 0.1, expect=[Bound("support/caster", 0.0)], robot=RobotSource("kbot")))
    assert result.reason is not None
    assert result.reason.startswith("support/caster has no value (")
    assert "caster_wheel" in result.reason
