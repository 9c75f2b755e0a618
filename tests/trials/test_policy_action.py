"""The action `policy` of scenarios: a policy drives to a goal."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.learn import Policy, save_policy
from kbot.text import Diagnostic, KbotError
from kbot.trials import Bound, Command, DriveWithPolicy, Goal, Point, RobotSource, Scenario, Step, run_trial
from kbot.trials.python_file import read_python_scenarios
from kbot.trials.scenario_file import yaml_scenarios

ROBOT = RobotSource("kbot", {"lidar": "true"})


def scenario(*steps: Step, robot: RobotSource = ROBOT, goals: float = 1.0, world: str = "rooms") -> Scenario:
    return Scenario("policy", 8.0, steps, [Bound("goals_reached", goals, goals)], robot, world)


def test_a_policy_reaches_its_goal(straight_policy: Path) -> None:
    step = Step(DriveWithPolicy(str(straight_policy), Point(0.6, -0.5)))
    first, second = (run_trial(scenario(step), with_trace=True) for _ in range(2))
    assert first.passed, first.reason
    assert first.state_sha256 == second.state_sha256
    assert [event.text for event in first.trace.events] == ["policy to 0.6, -0.5", "goal reached"]


def test_the_time_limit_and_the_arrival_radius_count(straight_policy: Path) -> None:
    file = str(straight_policy)
    late = run_trial(scenario(Step(DriveWithPolicy(file, Point(2.0, 0.0), timeout=1.0))), with_trace=True)
    assert not late.passed
    assert late.trace.events[-1].text.startswith("goal stuck: out of time")
    assert run_trial(scenario(Step(DriveWithPolicy(file, Point(2.0, 0.0), arrive=1.5)))).passed


def test_policies_and_goals_replace_each_other(straight_policy: Path) -> None:
    """Two of four goals are replaced before they are reached."""
    file = str(straight_policy)
    steps = [
        Step(DriveWithPolicy(file, Point(0.9, 0.0))),
        Step(Goal(0.3, 0.0), at=0.5),
        Step(DriveWithPolicy(file, Point(0.5, 0.6)), at=4.0),
        Step(DriveWithPolicy(file, Point(0.6, 0.2)), at=4.5),
    ]
    result = run_trial(scenario(*steps, goals=2.0), with_trace=True)
    assert result.passed, result.reason
    goals = [event.text for event in result.trace.events if event.text.startswith("goal ")]
    replaced = "goal cancelled: another goal replaced it"
    assert goals == ["goal 0.3, 0", replaced, "goal reached", replaced, "goal reached"]


def test_the_pose_estimate_continues_from_step_to_step(straight_policy: Path) -> None:
    """The wheels slip at the wall of the room, and odometry reaches the goal. So the robot is there again at
    once."""
    drive = DriveWithPolicy(str(straight_policy), Point(1.8, 1.8))
    steps = [Step(drive), Step(drive, at=9.5)]
    result = run_trial(replace(scenario(), steps=steps, duration=12.0), with_trace=True)
    first, second = (event.time for event in result.trace.events if event.text == "goal reached")
    assert first < 9.5
    assert second == pytest.approx(9.5, abs=0.15)


def test_a_robot_without_the_policys_lidar_is_an_error(straight_policy: Path) -> None:
    step = Step(DriveWithPolicy(str(straight_policy), Point(1.0, 0.0)))
    result = run_trial(scenario(step, robot=RobotSource("kbot")))
    assert "step 1, policy to 1, 0: the policy sees obstacles with a lidar" in result.error


def test_a_policy_that_is_faster_than_the_robot_is_a_finding(tmp_path: Path, straight_policy: Path) -> None:
    policy = Policy.read(straight_policy)
    faster = replace(policy.required_interface, linear=(0.0, 2.0))
    save_policy(policy.network.data, faster, tmp_path / "fast.onnx")
    step = Step(DriveWithPolicy(str(tmp_path / "fast.onnx"), Point(0.6, 0.0)))
    result = run_trial(replace(scenario(step), duration=0.2))
    assert [found.code for found in result.findings] == ["W308"]


def test_a_policy_that_does_not_fit_is_an_error_before_the_run(straight_policy: Path) -> None:
    steps = [Step(Command(0.1)), Step(DriveWithPolicy(str(straight_policy), Point(1.0, 0.0)), at=5.0)]
    result = run_trial(replace(scenario(robot=RobotSource("kbot")), steps=steps))
    assert result.error.startswith("step 2, policy to 1, 0: the policy sees obstacles with a lidar")
    assert result.failed_at == 0.0


PYTHON = """from kbot.trials import DriveWithPolicy, Point, Scenario, Step
drive = Scenario("drive", 8.0, [Step(DriveWithPolicy("FILE", Point(0.6, -0.5)))])
"""


def test_a_python_scenario_names_a_file_beside_it(straight_policy: Path, tmp_path: Path) -> None:
    shutil.copy(straight_policy, tmp_path / "p.onnx")
    path = tmp_path / "drive.py"
    path.write_text(PYTHON.replace("FILE", "p.onnx"))
    (found,) = read_python_scenarios(str(path))
    assert found.steps[0].action == DriveWithPolicy(str(tmp_path / "p.onnx"), Point(0.6, -0.5))
    for file, message in (("none.onnx", "there is no file"), ("drive.py", "is not an ONNX file")):
        path.write_text(PYTHON.replace("FILE", file))
        with pytest.raises(KbotError, match=message):
            read_python_scenarios(str(path))


YAML = """robot: {{file: kbot, arguments: {{lidar: true}}}}
world: rooms
duration: 8
steps:
  - policy: {{file: {file}, goal: {goal}}}
expect:
  - goals_reached: {{min: 1}}
"""


def read(
    tmp_path: Path, file: str, goal: str = "{x: 0.6, y: -0.5}"
) -> tuple[list[Scenario], list[str], list[Diagnostic]]:
    path = tmp_path / "drive.yaml"
    path.write_text(YAML.format(file=file, goal=goal))
    return yaml_scenarios(str(path))


def test_a_scenario_names_a_file_beside_it(straight_policy: Path, tmp_path: Path) -> None:
    shutil.copy(straight_policy, tmp_path / "p.onnx")
    ((found,), _, _) = read(tmp_path, "p.onnx")
    assert found.steps[0].action == DriveWithPolicy(str(tmp_path / "p.onnx"), Point(0.6, -0.5))
    assert run_trial(found).passed


@pytest.mark.parametrize(
    ("file", "goal", "message"),
    [
        ("none.onnx", "{x: 1, y: 0}", "there is no file"),
        ("drive.yaml", "{x: 1, y: 0}", "is not an ONNX file"),
        ("p.onnx", "{x: 1}", "'y' is missing: position in m"),
        ("p.onnx", "[1, 0]", "'goal' must be a mapping with x, y"),
        ("p.onnx", "{x: 1, y: .nan}", "'y' must be a finite number"),
    ],
)
def test_an_unusable_policy_is_an_error_at_its_place(
    straight_policy: Path, tmp_path: Path, file: str, goal: str, message: str
) -> None:
    shutil.copy(straight_policy, tmp_path / "p.onnx")
    _, _, (found,) = read(tmp_path, file, goal)
    assert message in found.message
    assert found.origin.span.line == 5
