"""The pytest plugin, in projects of its own: fixtures, the marker, and the reports of failed tests."""

import re
import shutil
import tomllib
from pathlib import Path

import pytest

import kbot
from kbot.record.reader import Recording
from kbot.templates import Sizes, make_package

pytest_plugins = "pytester"

Result = pytest.RunResult


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A robot package, in which pytest loads no plugins but KBot's and xdist."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p kbot.pytest_plugin -p xdist -W error")
    make_package(pytester.path, "my_robot", Sizes())
    shutil.rmtree(pytester.path / "test")
    return pytester


def run(project: pytest.Pytester, test: str, *words: str) -> Result:
    project.makepyfile(test_it="import pytest\nimport kbot\nfrom kbot.trials import *\n" + test)
    return project.runpytest_subprocess(*words)


STRAIGHT = """
def test_straight(sim):
    sim.cmd_vel(0.1, 0.0)
    sim.run(10.0)
    assert sim.ground_truth.pose.x == pytest.approx(DISTANCE, abs=0.01)
"""


def test_the_robot_of_the_package_drives_and_a_passed_test_leaves_no_files(project: pytest.Pytester) -> None:
    # 0.1 m/s for 10 s, less half the way of the time in which it accelerates, about 0.15 s
    result = run(project, STRAIGHT.replace("DISTANCE", "1.0"), "--kbot-film", "films")
    result.assert_outcomes(passed=1)
    assert not list(project.path.glob("films/*"))


def test_a_failure_shows_the_last_seconds_and_a_picture(project: pytest.Pytester) -> None:
    result = run(project, STRAIGHT.replace("DISTANCE", "1.6"))
    result.assert_outcomes(failed=1)
    out = result.stdout.str()
    # at a constant 0.1 m/s, 3 s are 0.3 m
    first, *_, last = map(float, re.findall(r"[\d.]+", out.partition("\nx [m] ")[2].partition("\n")[0]))
    assert last - first == pytest.approx(0.3, abs=0.001)
    result.stdout.re_match_lines([r"command_linear \[m/s\] +( +0\.1000){6}$"])
    picture = Path(out.partition("picture of the path: ")[2].partition("\n")[0])
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_failure_shows_the_source_line_of_the_cause(project: pytest.Pytester) -> None:
    drive = project.path / "urdf" / "drive.xacro"
    text = drive.read_text("utf-8")
    drive.write_text(text.replace("<wheelSeparation>${separation}<", "<wheelSeparation>${1.1*separation}<"))
    line = text[: text.index("<wheelSeparation>")].count("\n") + 1
    test = """
def test_turn(sim):
    sim.cmd_vel(0.0, 0.5)
    sim.run(6.0)
    assert sim.ground_truth.pose.yaw == pytest.approx(3.0, abs=0.05)
"""
    result = run(project, test, "-W", "default")
    result.assert_outcomes(failed=1, warnings=1)
    _, findings = result.stdout.str().split("KBot: findings about the run")
    assert re.search(rf"drive\.xacro:{line}:\d+", findings)
    assert "^^^" in findings


def test_films_are_recordings_and_pictures_of_failed_tests_also_with_xdist(project: pytest.Pytester) -> None:
    test = (
        STRAIGHT.replace("DISTANCE", "1.6")
        + """
@pytest.mark.kbot(robot="kbot", seeds=[1, 2])
def test_trial(trial):
    trial(steps=[Step(Command(0.2))], expect=[Reaches(0, 0, 0.1), StaysUpright(), NeverTouches()], duration=2)
"""
    )
    result = run(project, test, "--kbot-film", "films", "-n", "2")
    result.assert_outcomes(failed=3)
    names = ["straight", "trial-seed1", "trial-seed2"]
    found = sorted(file.name for file in (project.path / "films").iterdir())
    assert found == [f"test_it.py-test_{name}.{kind}" for name in names for kind in ("mcap", "png", "webp")]
    result.stdout.fnmatch_lines(["E   *Failed: distance_to_target is 0.3* m, above 0.1 m (it ends at *)"])
    for file in (project.path / "films").glob("*.mcap"):
        assert "/odom" in Recording(str(file)).summary().topics


@pytest.mark.parametrize("words", [(), ("-n", "2")])
def test_a_run_does_not_depend_on_order_or_workers(project: pytest.Pytester, words: tuple[str, ...]) -> None:
    expected = kbot.Simulation(str(project.path / "urdf" / "my_robot.xacro"), "boxes:seed=2")
    expected.cmd_vel(0.2, 0.4)
    expected.run(2.0)
    test = f"""
@pytest.mark.parametrize("again", [1, 2])
@pytest.mark.kbot(world="boxes:seed={{seed}}", seeds=[1, 2])
def test_equal(sim, seed, again):
    assert sim.world.bodies == kbot.load_world(f"boxes:seed={{seed}}").bodies
    sim.cmd_vel(0.2, 0.4)
    sim.run(2.0)
    assert sim.state_sha256() == "{expected.state_sha256()}"
"""
    run(project, test, *words).assert_outcomes(passed=4)


def test_markers_of_function_class_and_module_merge_and_fixtures_override(project: pytest.Pytester) -> None:
    project.mkdir("maps")
    test = """
pytestmark = pytest.mark.kbot(robot="urdf/my_robot.xacro", world="rooms", properties={"wheel_radius": 0.04})

@pytest.mark.kbot(world="corridor:length=3", arguments={"wheel_width": 0.03})
class TestClass:
    @pytest.mark.kbot(start=(0.5, 0.1, 0.2), seeds=(7,))
    def test_function(self, sim, robot, world, seed, properties, arguments):
        assert (world, seed) == ("corridor:length=3", 7)
        assert (properties, arguments) == ({"wheel_radius": 0.04}, {"wheel_width": 0.03})
        assert robot.drive.radius == pytest.approx(0.04)
        assert sim.robot is robot
        pose = sim.ground_truth.pose
        assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.5, 0.1, 0.2))

class TestOwn:
    @pytest.fixture
    def world(self):
        return kbot.load_world("maze")

    @pytest.fixture
    def robot(self):
        return "kbot"

    def test_function(self, sim):
        assert (sim.robot.name, sim.world.name) == ("kbot", "maze")
"""
    run(project, test).assert_outcomes(passed=2)


def test_a_robot_is_found_in_the_package_or_by_ini_option(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p kbot.pytest_plugin --import-mode=importlib")
    for name in ("first", "second"):
        make_package(pytester.path / name, name, Sizes())
        (pytester.path / name / "test" / "drive.scenario.yaml").unlink()
        test = f"def test_name(robot): assert robot.name == '{name}'"
        (pytester.path / name / "test" / f"test_{name}.py").write_text(test)
    pytester.runpytest_subprocess().assert_outcomes(passed=2)
    pytester.runpytest_subprocess("--rootdir=second/test", "second/test").assert_outcomes(passed=1)
    pytester.makeini("[pytest]\nkbot_robot = second/urdf/second.xacro")
    pytester.runpytest_subprocess().assert_outcomes(passed=1, failed=1)


def test_a_robot_that_does_not_load_is_shown_with_its_line_and_without_a_traceback(
    project: pytest.Pytester,
) -> None:
    robot = project.path / "urdf" / "my_robot.xacro"
    robot.write_text(robot.read_text("utf-8").replace("${0.2*length}", "${0.2*lenght}"))
    line = robot.read_text("utf-8").partition("lenght")[0].count("\n") + 1
    result = run(project, STRAIGHT.replace("DISTANCE", "1"))
    result.assert_outcomes(errors=1)
    result.stdout.re_match_lines(
        [rf".*my_robot\.xacro:{line}:\d+: error: .*'lenght'.*", rf"{line} \| .*lenght", r" +\| +\^+"]
    )
    assert "site-packages" not in result.stdout.str()
    assert "pytest_plugin.py" not in result.stdout.str()


@pytest.mark.parametrize(
    ("marker", "message"),
    [
        ("sed=1", "unknown argument 'sed' of the marker kbot: "),
        ("robot=3", "robot of the marker kbot must be the name of a file, not 3"),
        ("start=(1, 2)", "start of the marker kbot must be x, y and yaw in m and rad, not (1, 2)"),
        ('"robot.xacro"', "the marker kbot takes only keywords"),
        ("seeds=[1.5]", "seeds of the marker kbot must be whole numbers of at least 0, not (1.5,)"),
        ("seeds=[]", "seeds of the marker kbot must be whole numbers of at least 0, not ()"),
        ('world="romms"', "unknown world 'romms': did you mean 'rooms'?"),
        ('robot="no.xacro"', "no.xacro"),
        ("start=(1, 2, float('nan'))", "start must be three finite numbers"),
    ],
)
def test_an_invalid_marker_is_one_clear_error(project: pytest.Pytester, marker: str, message: str) -> None:
    result = run(project, f"@pytest.mark.kbot({marker})\ndef test_it(sim): pass")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"*{message.replace('[', '[[]')}*"])
    assert "Traceback" not in result.stdout.str()
    assert "INTERNALERROR" not in result.stdout.str() + result.stderr.str()


def test_without_a_robot_the_error_says_where_one_is_named(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    result = run(pytester, "def test_it(sim): pass", "-p", "kbot.pytest_plugin")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(
        [
            "* contains no robot (.xacro or .urdf). "
            'Name a robot with @pytest.mark.kbot(robot="FILE"), or with kbot_robot in *'
        ]
    )


SCENARIO = """\
duration: 3
seeds: [3, 4]
steps:
  - command: {linear: 0.1}
expect:
  - final_forward: {min: 0.28, max: 0.3}
  - never_touches
---
name: fast
robot: kbot
duration: 3
steps:
  - command: {linear: 0.2}
expect:
  - max_speed: {max: 0.15}
"""


def test_scenario_files_are_tests(project: pytest.Pytester) -> None:
    (project.path / "test").mkdir()
    (project.path / "test" / "drive.scenario.yaml").write_text(SCENARIO)
    (project.path / "test" / "drive.scenario.py").write_text(
        "from kbot.trials import *\n"
        "SCENARIO = Scenario('python', 2.0, [Step(Command(0.1))], [StaysUpright()], RobotSource('kbot'))\n"
    )
    result = project.runpytest_subprocess("-v", "--kbot-film", "films")
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines_random(
        [
            "test/drive.scenario.py::python PASSED*",
            "test/drive.scenario.yaml::drive-1[[]seed3[]] PASSED*",
            "test/drive.scenario.yaml::drive-1[[]seed4[]] PASSED*",
            "test/drive.scenario.yaml::fast FAILED*",
            "max_speed is 0.2* m/s, above 0.15 m/s",
            "*KBot: the last seconds of the run*",
            "recording: kbot view */films/test-drive.scenario.yaml-fast.mcap --at 0.0",
        ]
    )


def test_an_error_in_a_scenario_file_is_shown_with_its_line(project: pytest.Pytester) -> None:
    (project.path / "drive.scenario.yaml").write_text(SCENARIO.replace("max_speed", "max_sped"))
    result = run(project, "def test_other(): pass", "--continue-on-collection-errors")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.re_match_lines(
        [r".*drive\.scenario\.yaml:15:\d+: error: .*'max_sped'.*", r"15 \| .*max_sped", r" +\| +\^+"]
    )


@pytest.mark.parametrize("words", [(), ("-n", "2")])
def test_an_html_report_has_all_runs_of_all_workers(project: pytest.Pytester, words: tuple[str, ...]) -> None:
    test = (
        STRAIGHT.replace("DISTANCE", "1.6")
        + """
@pytest.mark.parametrize("speed", [0.1, 0.2])
def test_trial(trial, speed):
    trial(steps=[Step(Command(speed))], expect=[Bound("max_speed", max=0.15)], duration=2)

@pytest.mark.kbot(world="romms")
def test_without_a_world(sim):
    pass

def test_of_something_else():
    pass
"""
    )
    result = run(project, test, "--kbot-html", "report.html", *words)
    result.assert_outcomes(passed=2, failed=2, errors=1)
    result.stdout.fnmatch_lines([f"*KBot: report with 4 runs in {project.path / 'report.html'}*"])
    page = (project.path / "report.html").read_text("utf-8")
    for text in (
        "test_it.py::test_straight",
        "test_it.py::test_trial[0.1]",
        "1.6 ± 0.01",
        "3 of 4",
        "unknown world",
    ):
        assert text in page
    assert page.count("data:image/webp") >= 2


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--kbot-html=no/report.html", "* the folder */no does not exist"),
        ("--kbot-html=test_it.py", "*test_it.py exists and is not a report *"),
        ("--kbot-film=file", "cannot make */file: *"),
    ],
)
def test_a_place_that_cannot_be_written_is_reported_before_the_tests(
    project: pytest.Pytester, option: str, message: str
) -> None:
    (project.path / "file").write_text("")
    result = run(project, "def test_it(): pass", option)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: {option.partition('=')[0]}: {message}"])


def test_a_trial_fails_with_all_reasons_and_gives_its_trace(project: pytest.Pytester) -> None:
    test = """
def test_passes(trial):
    result = trial(steps=[Step(Command(0.1))], expect=[Bound("final_forward", 0.35, 0.41)], duration=4.0)
    assert result.trace["time"][-1] == pytest.approx(4.0)

def test_fails(trial):
    trial(steps=[Step(Command(0.1))], expect=[Reaches(2, 0, 0.1), Bound("max_speed", max=0.05)], duration=4.0)

def test_cannot_run(trial):
    trial(steps=[Step(JointCommand({"nose_joint": 1.0}))])

def test_has_no_such_step(trial):
    trial(steps=[Step(Command(0.1), at=20.0)])

def test_fails_later(trial):
    assert trial(steps=[Step(Command(0.1))], duration=2.0).trace["x"][-1] > 1.0
"""
    result = run(project, test)
    result.assert_outcomes(passed=1, failed=4)
    result.stdout.re_match_lines_random(
        [
            r"E +Failed: distance_to_target is 1\.[56]\d+ m, above 0\.1 m",
            r"E +max_speed is 0\.1\d* m/s, above 0\.05 m/s",
            r"E +Failed: .*nose_joint.*",
            r".*one of the steps is at 20 s, after the scenario ends at 10 s",
            r"0\.00 s: command 0\.1 m/s, 0 rad/s",
        ]
    )
    assert result.stdout.str().count("KBot: the last seconds of the run") == 3


def test_errors_of_kbot_in_a_test_show_the_line_of_the_test_only(project: pytest.Pytester) -> None:
    result = run(project, "def test_it(sim):\n    sim.cmd_vel(float('nan'), 0.0)\n")
    result.assert_outcomes(failed=1)
    result.stdout.re_match_lines(
        [r"> +sim\.cmd_vel\(float\('nan'\), 0\.0\)", r"E +kbot\..*KbotError: .*finite.*"]
    )
    assert "twist" not in result.stdout.str().lower().partition("KbotError")[0]


def test_the_plugin_imports_nothing_of_kbot_until_a_fixture_is_used(project: pytest.Pytester) -> None:
    test = """
import sys

def test_nothing_heavy():
    assert not {"numpy", "mujoco", "kbot.sim", "kbot.text"} & {*sys.modules}
"""
    project.makepyfile(test_it=test)
    project.runpytest_subprocess().assert_outcomes(passed=1)


def test_the_distribution_declares_the_plugin() -> None:
    declared = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    assert declared["project"]["entry-points"]["pytest11"] == {"kbot": "kbot.pytest_plugin"}


def test_the_examples_of_the_reference_pass(project: pytest.Pytester) -> None:
    page = (Path(__file__).parents[1] / "docs" / "reference" / "trials.md").read_text("utf-8")
    _, section = page.split("\n## pytest\n")
    blocks = re.findall(r"^```python\n(.*?)^```", section.partition("\n## ")[0], re.DOTALL | re.MULTILINE)
    project.makepyfile(**{f"test_{number}": block for number, block in enumerate(blocks)})
    project.runpytest_subprocess().assert_outcomes(passed=5)
