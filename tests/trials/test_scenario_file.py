"""Scenario files: what they mean, and all errors of a file with their places."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.injected_faults import Payload, Slip
from kbot.text import DescriptionError, KbotError
from kbot.trials import (
    AddObject,
    Bound,
    Command,
    Goal,
    InjectFault,
    JointCommand,
    MoveObject,
    NeverTouches,
    PassesThrough,
    Program,
    Push,
    Range,
    Reaches,
    RemoveObject,
    RobotSource,
    RunScript,
    Scenario,
    Settles,
    StaysUpright,
    Step,
    run_trial,
)
from kbot.trials.scenario_file import find_scenario_files, python_scenarios, read_scenarios, yaml_scenarios
from kbot.trials.schema import json_schema

PUBLISHED = Path(__file__).parents[2] / "docs" / "reference" / "scenario.schema.json"

EVERYTHING = """\
# all keys of a scenario
name: everything
robot:
  file: robots/robot.urdf
  arguments: {wheel_radius: 0.040, name: left, with_lidar: true}
  properties: {mass: 1e-3}
  packages: [robots]
world: maze:size=4,seed={seed}
start: {x: 1, y: 2, yaw: 0.5}
seeds: [3, 1]
duration: 20
until: {distance: {min: 2}, tilt: {max: 0.5}}
programs:
  - driver.py
  - {file: driver.py, arguments: [_speed:=0.2, 3], lockstep: false}
steps:
  - command: {linear: 0.2, angular: -1e-1}
  - at: 1
    goal: {x: 1, y: 2}
  - when: {distance: {min: 0.5}}
    at: 2
    script: driver.py
  - joint_command: {joints: {arm: 0.5}, interface: velocity}
  - push: {force: [1, 0, 0.5], duration: 0.1, link: base_link}
  - fault: {kind: Slip, link: left_wheel, friction: 0, duration: 2}
  - fault: {kind: Payload, link: base_link, mass: 2, at: [0, 0, 0.1]}
  - add_object: {name: wall, x: 2, y: 0, size: [0.1, 1, 1]}
  - move_object: {name: wall, x: 3, y: 0}
  - remove_object: {name: wall}
  - command:
expect:
  - never_touches
  - never_touches: {objects: [wall]}
  - stays_upright: {max_tilt: 0.2}
  - settles: {within: 1}
  - passes_through: {x: 1, y: 0, within: 0.1}
  - reaches: {x: 2, y: 0, within: 0.05, yaw: 0, before: 10}
  - final_x: {min: 1, max: 2}
  - support/left_wheel: {min: 5}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "robot.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    (tmp_path / "driver.py").write_text("def drive(sim): ...\n")
    return tmp_path


def write(text: str, name: str = "own.scenario.yaml") -> str:
    Path(name).write_text(text)
    return name


def errors(text: str) -> list[str]:
    """The errors of a file as `line:column code message`."""
    _, _, found = yaml_scenarios(write(text))
    return [
        f"{each.origin.span.line}:{each.origin.span.column} {each.code} {each.message}".split("\n")[0]
        + (f" ({each.hint})" if each.hint else "")
        for each in found
        if each.origin
    ]


@pytest.mark.usefixtures("folder")
def test_yaml_means_the_same_as_python() -> None:
    (scenario,) = read_scenarios(write(EVERYTHING))
    assert scenario == Scenario(
        "everything",
        20.0,
        (
            Step(Command(0.2, -0.1)),
            Step(Goal(1.0, 2.0), at=1.0),
            Step(RunScript("driver.py"), at=2.0, when={"distance": Range(min=0.5)}),
            Step(JointCommand({"arm": 0.5}, "velocity")),
            Step(Push((1.0, 0.0, 0.5), 0.1, "base_link")),
            Step(InjectFault(Slip("left_wheel", 0.0), 2.0)),
            Step(InjectFault(Payload("base_link", 2.0, (0.0, 0.0, 0.1)))),
            Step(AddObject("wall", 2.0, 0.0, size=(0.1, 1.0, 1.0))),
            Step(MoveObject("wall", 3.0, 0.0)),
            Step(RemoveObject("wall")),
            Step(Command()),
        ),
        (
            NeverTouches(),
            NeverTouches(("wall",)),
            StaysUpright(0.2),
            Settles(1.0),
            PassesThrough(1.0, 0.0, 0.1),
            Reaches(2.0, 0.0, 0.05, 0.0, before=10.0),
            Bound("final_x", 1.0, 2.0),
            Bound("support/left_wheel", 5.0),
        ),
        RobotSource(
            "robots/robot.urdf",
            {"wheel_radius": "0.040", "name": "left", "with_lidar": "true"},
            {"mass": "1e-3"},
            ("robots",),
        ),
        "maze:size=4,seed={seed}",
        PlanarPose(1.0, 2.0, 0.5),
        (3, 1),
        {"distance": Range(min=2.0), "tilt": Range(max=0.5)},
        (Program("driver.py"), Program("driver.py", ("_speed:=0.2", "3"), lockstep=False)),
    )


@pytest.mark.usefixtures("folder")
def test_an_error_of_a_step_in_the_run_has_its_place() -> None:
    (scenario,) = read_scenarios(write("robot: kbot\nduration: 1\nsteps:\n  - remove_object: {name: box}\n"))
    assert run_trial(scenario).error.startswith("own.scenario.yaml:4:5: step 1, remove box: ")


@pytest.mark.usefixtures("folder")
def test_documents_are_named_by_the_file_and_have_its_lines() -> None:
    text = "# 1\nrobot: kbot\nduration: 1\nseeds: 3\n--- # 2\n# a comment\nrobot: kbot\nduration: 0\n---\n"
    found, unusable, found_errors = yaml_scenarios(write(text, "turn.scenario.yml"))
    assert [(each.name, list(each.seeds)) for each in found] == [("turn-1", [0, 1, 2])]
    assert unusable == ["turn-2"]
    (error,) = found_errors
    assert str(error).startswith(
        "turn.scenario.yml:8:11: error: the duration in seconds must be a finite number"
    )


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("wrld: maze", "3:1 T102 unknown key 'wrld' (did you mean 'world'?)"),
        ("start: {x: 1, jaw: 2}", "3:15 T102 unknown key 'jaw' (choose from x, y, yaw)"),
        ("seeds: 0", "3:8 T104 'seeds' must be at least 1, not 0"),
        ("seeds: [1, -1]", "3:12 T104 'seeds' must be integers from 0 to 9223372036854775807, not -1"),
        (
            "seeds: [9223372036854775808]",
            "3:9 T104 'seeds' must be integers from 0 to 9223372036854775807, not 9223372036854775808",
        ),
        ("seeds: many", "3:8 T104 'seeds' must be a list of integers, or how many seeds, not 'many'"),
        ("start: 3", "3:8 T104 'start' must be a mapping with x, y, yaw, not 3"),
        ("start: {x: true}", "3:12 T104 'x' must be a number, not true"),
        ("start: {x: .nan}", "3:12 T104 'x' must be a finite number, not nan"),
        ("start: {x: 1, x: 2}", "3:15 T104 the key 'x' is given twice"),
        ("until: {distanze: {min: 1}}", "3:9 T105 unknown quantity 'distanze' (did you mean 'distance'?)"),
        ("until: {x: 3}", "3:12 T104 'x' must be a mapping with min, max, not 3"),
        ("steps: {}", "3:8 T104 'steps' must be a list, not a mapping"),
        ("steps: [{at: 1}]", "3:9 T103 a step needs one action, one of command, goal, joint_command, push, "
         "add_object, move_object, remove_object, policy, script, fault"),
        ("steps: [{command: {}, goal: {x: 1, y: 1}}]",
         "3:9 T104 a step needs one action, not 2: command, goal"),
        ("steps: [{comand: {}}]", "3:10 T102 unknown key 'comand' (did you mean 'command'?)"),
        ("steps: [{at: -1, command: {}}]", "3:9 T104 the time of a step must be from 0 to 1e+09 s, not -1.0"),
        ("steps: [{goal: {x: 1}}]", "3:10 T103 'y' is missing: position in m"),
        ("steps: [{script: drive.py}]", "3:18 T104 there is no file drive.py (did you mean 'driver.py'?)"),
        ("steps: [{fault: {kind: Slipp}}]", "3:24 T105 unknown fault 'Slipp' (did you mean 'Slip'?)"),
        ("steps: [{fault: {link: a}}]",
         "3:10 T103 'kind' is missing. Choose from BlockedJoint, Slip, Payload, "
         "LostCommands, SilentTopic, Kick"),
        ("steps: [{push: {force: [1, 2], duration: 1}}]",
         "3:24 T104 'force' must be a list of three numbers x, y, z, not a list of 2"),
        ("expect: [max_tlt]",
         "3:10 T105 unknown expectation or measure 'max_tlt' (did you mean 'max_tilt'?)"),
        ("expect: [max_tilt]", "3:10 T104 'max_tilt' needs a bound: min, max, or both"),
        ("expect: [max_tilt: {maxx: 1}]", "3:21 T102 unknown key 'maxx' (did you mean 'max'?)"),
        ("expect: [reaches: {x: 1, y: 1, within: 0}]", "3:40 T104 'within' must be above 0, not 0.0"),
        ("expect: [{final_x: {min: 1}, final_y: {min: 1}}]", "3:10 T104 an item of 'expect' needs one name, "
         "not 2: final_x, final_y (begin each expectation with '- ', and indent its settings further)"),
        ("expect: [{}]", "3:10 T104 'expect' must be the name of an expectation or measure, with its "
         "settings, not a mapping"),
        ("steps: [{command: , linear: 1}]", "3:21 T102 unknown key 'linear' (it is a key of 'command': "
         "indent it further)"),
        ("until:\n\t- time", "4:1 T101 while scanning for the next token, found character '\\t' that cannot "
         "start any token (indent with spaces: YAML does not accept tabs)"),
        ("seeds:\n  - 1\n - 2", "5:2 T101 while parsing a block mapping, expected <block end>, but found "
         "'<block sequence start>' (check the indentation"),
        ("robot: {file: kbot, package: [a]}", "3:21 T102 unknown key 'package' (did you mean 'packages'?)"),
        ("robot: robots/robt.urdf",
         "3:8 T104 there is no file robots/robt.urdf (did you mean 'robot.urdf'?)"),
        ("robot: package://gone_description/r.urdf", "3:8 T104 "),
        ("world: gone.sdf", "3:8 T104 there is no file gone.sdf"),
        ("world: maz", "3:8 T104 unknown world 'maz': did you mean 'maze'?"),
        ("world: maze:sise=3", "3:8 T104 world 'maze' has no parameter 'sise': did you mean 'size'?"),
        ("programs: [gone.py]", "3:12 T104 there is no file gone.py"),
        ("steps: [command: {linear: 1", "5:1 T101 "),
        ("until: {x: {min: 5, max: 1}}", "3:18 T104 the condition can never hold: min 5 is above max 1"),
        ("start: {x: 1.0e+300}", "3:8 T104 start must be three finite numbers from -1e+06 to 1e+06"),
        ("steps: [{script: robots}]", "3:18 T104 robots is not a file"),
        ("programs: [robots]", "3:12 T104 robots is not a file"),
        ("robot: " + 3000 * "x", "3:8 T104 there is no file xxx"),
    ],
)  # fmt: skip
def test_an_error_has_its_place(line: str, error: str) -> None:
    (found,) = errors(f"name: own\nduration: 5\n{line}\n\n")
    assert found.startswith(error)


@pytest.mark.usefixtures("folder")
def test_all_errors_of_a_file_are_reported_in_order() -> None:
    found = errors("robt: kbot\nseeds: x\n---\nexpect: [gone]\nduration: -1\n")
    assert [each.split(" ")[:2] for each in found] == [
        ["1:1", "T102"], ["1:1", "T103"], ["2:8", "T104"], ["4:10", "T105"],
    ]  # fmt: skip
    with pytest.raises(DescriptionError) as refused:
        read_scenarios("own.scenario.yaml")
    assert len(refused.value.diagnostics) == 4


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "1:1 T101 the file contains no scenario"),
        ("# nothing\n---\n", "1:1 T101 the file contains no scenario"),
        ("- 3\n", "1:1 T104 the scenario must be a mapping with name, duration"),
        ("3", "1:1 T104 the scenario must be a mapping with name, duration"),
        ("a: &a [*a]\nb: " + "[" * 200, "2:"),
    ],
)
def test_a_file_that_is_not_a_scenario_is_one_error(text: str, error: str) -> None:
    (found,) = errors(text)
    assert found.startswith(error)


def test_a_file_that_cannot_be_read_counts_as_a_scenario(tmp_path: Path) -> None:
    (tmp_path / "own.scenario.yaml").write_bytes(b"robot: \xff")
    found, unusable, (error,) = yaml_scenarios(str(tmp_path / "own.scenario.yaml"))
    assert (found, unusable) == ([], ["own"])
    assert "is not UTF-8 text" in error.message


def test_a_trial_lasts_at_most_a_day() -> None:
    with pytest.raises(KbotError, match="at most 86400"):
        Scenario("long", 86401.0)


def test_a_folder_is_searched_for_scenario_files(folder: Path) -> None:
    for name in (
        "b.scenario.yaml",
        "a.scenario.py",
        "sub/c.scenario.yml",
        ".hidden/d.scenario.yaml",
        "e.yaml",
    ):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("")
    assert find_scenario_files(".") == [
        "a.scenario.py",
        "b.scenario.yaml",
        str(Path("sub", "c.scenario.yml")),
    ]
    with pytest.raises(
        KbotError, match=r"robots contains no scenario file: their names end in \*\.scenario\.yaml"
    ):
        find_scenario_files("robots")


@pytest.mark.usefixtures("folder")
def test_a_python_file_gives_its_scenarios_in_order() -> None:
    text = (
        "from kbot.trials import *\nfrom parts import way\n"
        "_hidden = Scenario('hidden', 1.0)\n"
        "several = [Scenario(f'part{n}', 1.0, [Step(RunScript('driver.py'))]) for n in (1, 2)]\n"
        "last = Scenario('last', way, robot=RobotSource('robots/robot.urdf'))\nagain = last\n"
    )
    write("way = 2.0\n", "parts.py")
    found = read_scenarios(write(text, "own.scenario.py"))
    assert [each.name for each in found] == ["part1", "part2", "last"]
    assert found[0].steps == (Step(RunScript("driver.py")),)
    assert found[2].robot == RobotSource("robots/robot.urdf")
    write("way = 3.0\n", "parts.py")
    assert [each.scenario.duration for each in python_scenarios("own.scenario.py")] == [1.0, 1.0, 3.0]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a = 3\n", "own.scenario.py defines no Scenario"),
        ("a = (\n", "own.scenario.py:1: not valid Python"),
        ("\n1 / 0\n", "own.scenario.py:2: ZeroDivisionError: division by zero"),
        (
            "from kbot.trials import *\na = Scenario('a', -1)\n",
            "own.scenario.py:2: the duration in seconds must",
        ),
        ("import sys\nsys.exit(3)\n", "own.scenario.py:2: SystemExit: 3"),
    ],
)
def test_an_error_of_a_python_file_names_its_line(text: str, error: str) -> None:
    with pytest.raises(KbotError, match=error.replace("(", r"\(")):
        read_scenarios(write(text, "own.scenario.py"))


def test_the_published_schema_is_that_of_the_dataclasses() -> None:
    """If this fails: kbot try --schema > docs/reference/scenario.schema.json."""
    assert json.loads(PUBLISHED.read_text("utf-8")) == json_schema()


@pytest.mark.parametrize(
    ("line", "is_valid"),
    [
        ("", True),
        ("wrld: maze", False),
        ("seeds: 0", False),
        ("seeds: [1]", True),
        ("start: {x: a}", False),
        ("until: {distanze: {min: 1}}", False),
        ("until: {distance: {min: 1}}", True),
        ("steps: [{command: {}, goal: {x: 1, y: 1}}]", False),
        ("steps: [{at: 1}]", False),
        ("steps: [{fault: {kind: Slip, link: a}}]", False),
        ("expect: [max_tlt: {max: 1}]", False),
        ("expect: [max_tilt: {max: 1}, settles: {within: 1}, support/a: {min: 1}, never_touches]", True),
        ("expect: [settles]", False),
    ],
)
def test_the_schema_accepts_what_kbot_accepts(folder: Path, line: str, is_valid: bool) -> None:
    validator = jsonschema.Draft7Validator(json_schema())
    jsonschema.Draft7Validator.check_schema(json_schema())
    text = f"duration: 5\n{line}\n"
    data: Any = yaml.safe_load(text)
    assert validator.is_valid(data) is is_valid
    assert (errors(text) == []) is is_valid


def test_the_schema_accepts_every_key() -> None:
    data = yaml.safe_load(EVERYTHING.replace("-1e-1", "-0.1"))
    assert list(jsonschema.Draft7Validator(json_schema()).iter_errors(data)) == []
