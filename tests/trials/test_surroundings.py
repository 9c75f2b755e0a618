"""The map of a trial and the lines of a robot that a failure concerns."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from kbot.trials import (
    AddObject,
    Bound,
    Command,
    Goal,
    MoveObject,
    NeverTouches,
    PassesThrough,
    Reaches,
    RobotSource,
    Scenario,
    Step,
    TrialResult,
    run_trial,
)

KBOT = RobotSource("kbot")
WHEEL = "support/left_wheel"


@pytest.fixture(scope="module")
def crash() -> TrialResult:
    """KBot drives into a box, which moved before."""
    steps = [
        Step(AddObject("box", 2.0, 2.0, size=(0.2, 1.0, 0.3))),
        Step(MoveObject("box", 0.6, 0.0)),
        Step(Command(0.3)),
        Step(Goal(5.0, 5.0), at=3.0),
    ]
    expect = [NeverTouches(), Reaches(1.0, 0.5, 0.05), PassesThrough(0.2, 0.0, 0.1), Bound(WHEEL, min=1000.0)]
    return run_trial(Scenario("crash", 3.0, steps, expect, KBOT), with_trace=True)


def test_the_map_shows_where_things_are_at_the_end(crash: TrialResult) -> None:
    shown = crash.surroundings
    assert shown is not None
    (box,) = [part for part in shown.parts if part.name == "box"]
    assert not box.is_ground
    # the robot, 0.06 m long before its base, pushes the box of 0.2 m x 1 m
    xs, ys = zip(*box.corners, strict=True)
    assert max(xs) - min(xs) == pytest.approx(0.2, abs=0.02)
    assert max(ys) - min(ys) == pytest.approx(1.0, abs=0.02)
    assert crash.trace is not None
    assert min(xs) == pytest.approx(crash.trace["x"][-1] + 0.06, abs=0.01)
    # the plate is 0.16 m long, centred 0.02 m behind the axle, and the wheels are 0.179 m apart outside
    fore, side = zip(*shown.robot, strict=True)
    assert (min(fore), max(fore)) == pytest.approx((-0.1, 0.06), abs=1e-6)
    assert (min(side), max(side)) == pytest.approx((-0.0895, 0.0895), abs=1e-6)


def test_targets_are_on_the_map(crash: TrialResult) -> None:
    assert crash.surroundings is not None
    assert [(target.kind, target.x, target.y, target.within) for target in crash.surroundings.targets] == [
        ("goal", 5.0, 5.0, 0.0),
        ("reach", 1.0, 0.5, 0.05),
        ("pass", 0.2, 0.0, 0.1),
    ]


def test_the_link_that_touched_is_named_with_its_line(crash: TrialResult) -> None:
    assert crash.trace is not None
    assert crash.trace.touched_with == {"box": "base_link"}
    touch = next(event for event in crash.trace.events if event.kind == "touch")
    assert touch.text == "link 'base_link' touches 'box'"
    found = {related.message: related.origin.span for related in crash.source_lines}
    plate = found["link 'base_link' touches 'box'"]
    assert Path(plate.file).name == "kbot.xacro"
    assert "<box size=" in plate.source.line(plate.line)
    wheel = found["link 'left_wheel' of support"]
    assert "<link" in wheel.source.line(wheel.line)


def test_a_result_with_all_of_it_can_be_sent_to_another_process(crash: TrialResult) -> None:
    again = pickle.loads(pickle.dumps(crash))
    assert again.surroundings == crash.surroundings
    assert [str(each.origin) for each in again.source_lines] == [
        str(each.origin) for each in crash.source_lines
    ]


def test_a_trial_without_trace_has_no_map() -> None:
    result = run_trial(Scenario("rest", 0.1, robot=KBOT))
    assert result.surroundings is None
    assert result.source_lines == ()


def test_a_touched_link_of_a_model_is_found_on_the_map(tmp_path: Path) -> None:
    """Of a gate of two posts, KBot touches the left one."""
    posts = "".join(
        f'<link name="{name}"><pose>0.5 {y} 0.1 0 0 0</pose><inertial><mass>50</mass></inertial>'
        f'<collision name="c"><geometry><box>'
        f"<size>0.05 0.05 0.2</size></box></geometry></collision></link>"
        for name, y in (("left", 0.05), ("right", -0.5))
    )
    (tmp_path / "gate.sdf").write_text(
        '<sdf version="1.6"><world name="w"><model name="floor"><static>true</static><link name="l">'
        '<collision name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link>'
        f'</model><model name="gate">{posts}</model></world></sdf>'
    )
    scenario = Scenario("gate", 3.0, [Step(Command(0.3))], [NeverTouches()], KBOT, str(tmp_path / "gate.sdf"))
    result = run_trial(scenario, with_trace=True)
    assert result.trace is not None
    assert result.surroundings is not None
    (touched,) = result.trace.touched
    (part,) = [part for part in result.surroundings.parts if part.name == touched]
    assert min(y for _, y in part.corners) == pytest.approx(0.025, abs=1e-3)  # KBot moves 50 kg only a little
