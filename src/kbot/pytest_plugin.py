"""pytest plugin: fixtures for a robot in a simulation, and reports about the runs of failed tests.

    @pytest.mark.kbot(robot="../urdf/robot.xacro", world="rooms", seeds=[0, 1, 2])
    def test_drives_straight(sim: kbot.Simulation) -> None:
        sim.cmd_vel(0.2, 0.0)
        sim.run(10.0)
        assert sim.ground_truth.pose.y == pytest.approx(0.0, abs=0.01)

pytest loads this module in every project of the environment. Therefore it imports only pytest, and a fixture
imports KBot when a test uses it.
"""

from __future__ import annotations

import os
import re
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.model import RobotModel
    from kbot.robot import Robot, Value
    from kbot.sim import Simulation
    from kbot.trials.expectations import Expectation
    from kbot.trials.results import TrialResult
    from kbot.trials.scenario import Condition, Program, Scenario, Step
    from kbot.world import World

    RobotLike = RobotModel | str | os.PathLike[str]
    WorldLike = str | World

MARKER = (
    "kbot(robot, world, seeds, properties, arguments, start): the robot and the world for KBot's fixtures. "
    "A relative path starts at the folder of the test file. Several seeds run the test once with each."
)
_KBOT = Path(__file__).parent
_LONGEST_NAME = 120
"""Characters of a file name that is made from a test's name."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The marker of a test. A marker of the function precedes that of its class, and that of its module."""

    robot: str | os.PathLike[str] | None = None
    world: WorldLike = "empty"
    seeds: Sequence[int] = (0,)
    properties: Mapping[str, Value] = field(default_factory=dict)
    arguments: Mapping[str, Value] = field(default_factory=dict)
    start: PlanarPose | Sequence[float] | None = None


_RUN: pytest.StashKey[Callable[[], tuple[TrialResult, World]]] = pytest.StashKey()
"""Describes the last run of a test. It is called if the test fails."""
_FAILED: pytest.StashKey[bool] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("kbot", "KBot (robots in simulation)")
    group.addoption(
        "--kbot-film",
        metavar="DIR",
        help="Folder for a picture, a film and a recording of each failed run.",
    )
    parser.addini(
        "kbot_robot",
        "Robot of tests without @pytest.mark.kbot(robot=…): a file relative to rootdir, or kbot.",
        type="string",
        default="",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", MARKER)
    if config.option.kbot_film:  # the workers of xdist get the absolute path
        config.option.kbot_film = str(config.invocation_params.dir / config.option.kbot_film)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.definition.get_closest_marker("kbot") is None:
        return
    seeds = _settings(metafunc.definition).seeds
    if len(seeds) > 1 and "seed" in metafunc.fixturenames:
        metafunc.parametrize("seed", seeds, ids=[f"seed{seed}" for seed in seeds])


# the fixtures


@pytest.fixture
def properties(request: pytest.FixtureRequest) -> Mapping[str, Value]:
    """Values of the robot's top-level xacro properties, by name."""
    return _settings(request.node).properties


@pytest.fixture
def arguments(request: pytest.FixtureRequest) -> Mapping[str, Value]:
    """Values of the robot's xacro arguments, by name."""
    return _settings(request.node).arguments


@pytest.fixture
def robot(
    request: pytest.FixtureRequest, arguments: Mapping[str, Value], properties: Mapping[str, Value]
) -> Robot:
    """The robot of the marker, of the ini option `kbot_robot`, or of the package around the test file."""
    from kbot.robot import DescriptionWarning, load
    from kbot.text import KbotError

    with _without_traceback():
        try:
            return load(_robot_file(request.node), properties=properties, arguments=arguments)
        except DescriptionWarning as warning:  # the filters for warnings make it an error
            raise KbotError(str(warning)) from None


@pytest.fixture
def seed(request: pytest.FixtureRequest) -> int:
    """The seed of the marker, by default 0. Several seeds parametrize the test."""
    return _settings(request.node).seeds[0]


@pytest.fixture
def world(request: pytest.FixtureRequest, seed: int) -> WorldLike:
    """The world of the marker, by default `empty`. `{seed}` in its name is replaced by the seed."""
    given = _settings(request.node).world
    if not isinstance(given, str):
        return given
    file = request.path.parent / given
    return str(file) if file.is_file() else given.replace("{seed}", str(seed))


@pytest.fixture
def sim(
    request: pytest.FixtureRequest, robot: RobotLike, world: WorldLike, seed: int
) -> Iterator[Simulation]:
    """A simulation of the robot in the world, with the sensors that the robot declares.

    If the test fails, its report shows the last seconds of the run, its findings and a picture.
    """
    from kbot.sensors.declared import mount_declared
    from kbot.sim import Simulation
    from kbot.trials.watched_run import WatchedRun

    item = request.node
    with _without_traceback():
        simulation = Simulation(robot, world, seed, start=_start(item))
    mount_declared(simulation, strict=False)
    name = world if isinstance(world, str) else world.name
    recording = _recording(item)
    run = WatchedRun(simulation, item.name, name, record=recording, film=bool(recording))
    item.stash[_RUN] = lambda: (run.result(), simulation.world)
    yield simulation
    run.close()
    if recording and not item.stash.get(_FAILED, False):
        Path(recording).unlink()


class Trial:
    """The type of the fixture `trial`."""

    def __init__(self, item: pytest.Item, robot: RobotLike, world: WorldLike, seed: int) -> None:
        self._item, self._robot, self._world, self._seed = item, robot, world, seed

    def __call__(
        self,
        steps: Sequence[Step] = (),
        expect: Sequence[Expectation] = (),
        duration: float = 10.0,
        *,
        until: Condition | None = None,
        programs: Sequence[Program] = (),
    ) -> TrialResult:
        """Run a scenario with the test's robot, world, seed and start. Returns the result with its trace.

        The arguments are those of `kbot.trials.Scenario`. The test fails if the run does not keep an
        expectation or cannot be completed. The failure has all reasons.
        """
        __tracebackhide__ = True
        from kbot.sim.preparation import read_robot
        from kbot.trials.scenario import Scenario

        with _without_traceback():
            if not isinstance(self._world, str):
                pytest.fail("the fixture trial needs the name or the file of a world, not a World", False)
            scenario = Scenario(
                self._item.name,
                duration,
                steps,
                expect,
                world=self._world,
                start=_start(self._item),
                seeds=(self._seed,),
                until=until or {},
                programs=programs,
            )
            robot = read_robot(self._robot)
        result = _run(self._item, scenario, self._seed, robot)
        if not result.passed:
            pytest.fail(_reasons(result))
        return result


@pytest.fixture
def trial(request: pytest.FixtureRequest, robot: RobotLike, world: WorldLike, seed: int) -> Trial:
    """Runs a scenario: `trial(steps=[Step(Command(0.2))], expect=[Bound("max_tilt", max=0.1)])`."""
    return Trial(request.node, robot, world, seed)


# the reports


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    describe = item.stash.get(_RUN, None)
    errors = _errors_of_kbot(call) if describe is not None else []
    report = yield
    if describe is not None:
        if report.failed:
            report.sections += errors
            item.stash[_FAILED] = True
            _add_sections(report, item, *describe())
        if call.when == "teardown" or report.failed:
            del item.stash[_RUN]  # an item lives as long as the session
    return report


def _errors_of_kbot(call: pytest.CallInfo[None]) -> list[tuple[str, str]]:
    """Cut KBot's own calls off the traceback of an error that KBot raised. Returns its source lines."""
    from kbot.text import DescriptionError, KbotError
    from kbot.text.render import render_text

    if call.excinfo is None or not isinstance(call.excinfo.value, KbotError):
        return []
    callers = [
        frame
        for frame, _ in traceback.walk_tb(call.excinfo.tb)
        if not Path(frame.f_code.co_filename).is_relative_to(_KBOT)
    ]
    entry = call.excinfo.tb
    while entry.tb_next is not None and entry.tb_frame is not callers[-1]:
        entry = entry.tb_next
    entry.tb_next = None
    error = call.excinfo.value
    return (
        [("KBot: the error", render_text(error.diagnostics))] if isinstance(error, DescriptionError) else []
    )


def _add_sections(report: pytest.TestReport, item: pytest.Item, result: TrialResult, world: World) -> None:
    from kbot.trials.failure_report import path_picture, sections

    picture = _file(item, ".png")
    picture.write_bytes(path_picture(result, world))
    files = [f"picture of the path: {picture}"]
    if result.film:
        film = picture.with_suffix(".webp")
        film.write_bytes(result.film)
        files.append(f"film of the end: {film}")
    elif result.film_problem:
        files.append(f"no film: {result.film_problem}")
    if result.recording:
        files.append(f"recording: kbot view {result.recording}")
    report.sections += [*sections(result), ("KBot: files of the run", "\n".join(files))]


def _run(item: pytest.Item, scenario: Scenario, seed: int, robot: RobotModel | None) -> TrialResult:
    """Run a scenario for a test. A run that fails is repeated for a film and a recording."""
    from kbot.trials.films import run_filmed
    from kbot.trials.trial import run_trial
    from kbot.world import load_world

    result = run_trial(scenario, seed, robot, with_trace=True)
    if result.trace is not None:
        recording = "" if result.passed else _recording(item)
        if recording:
            result = run_filmed(scenario, seed, robot, record=recording)
        world = load_world(scenario.world.replace("{seed}", str(seed)))
        item.stash[_RUN] = lambda: (result, world)
    return result


def _reasons(result: TrialResult) -> str:
    failures = [measure.failure for measure in result.measures if not measure.passed]
    return "\n".join([result.error, *failures] if result.error else failures)


def _recording(item: pytest.Item) -> str:
    """The file of a recording with `--kbot-film`, or else an empty text."""
    return str(_file(item, ".mcap")) if item.config.option.kbot_film else ""


def _file(item: pytest.Item, suffix: str) -> Path:
    """A new file in the folder of `--kbot-film`, or in pytest's folder for temporary files."""
    if item.config.option.kbot_film:
        folder = Path(item.config.option.kbot_film)
        folder.mkdir(parents=True, exist_ok=True)
    else:
        # the factory of the fixture tmp_path_factory: items of scenario files have no fixtures
        factory: pytest.TempPathFactory = item.config._tmp_path_factory  # type: ignore[attr-defined]
        folder = factory.mktemp("kbot")
    name = re.sub(r"[^\w.-]+", "-", item.nodeid).strip("-")[-_LONGEST_NAME:]
    file = folder / f"{name}{suffix}"
    file.unlink(missing_ok=True)
    return file


# the settings of a test


def _settings(node: pytest.Item) -> Settings:
    """Merge the markers of a test. Ends the test, or the collection of its file, if they are not valid."""
    given: dict[str, object] = {}
    for mark in node.iter_markers("kbot"):  # the closest first
        if mark.args:
            pytest.fail('the marker kbot takes only keywords, such as robot="robot.xacro"', False)
        given = {**mark.kwargs, **given}
    known = [entry.name for entry in fields(Settings)]
    for name in given:
        if name not in known:
            from kbot.text.suggest import suggest_or_list

            pytest.fail(
                f"unknown argument '{name}' of the marker kbot: {suggest_or_list(name, known)}", False
            )
    seeds = given.get("seeds", (0,))
    given["seeds"] = seeds = tuple(seeds) if isinstance(seeds, Iterable) else (seeds,)
    if not seeds or not all(type(seed) is int and seed >= 0 for seed in seeds):
        pytest.fail(f"seeds of the marker kbot must be whole numbers of at least 0, not {seeds}", False)
    return Settings(**given)  # type: ignore[arg-type]


def _robot_file(node: pytest.Item) -> str:
    """The file of the test's robot, or `kbot`."""
    from kbot.model.load import SHIPPED_NAME
    from kbot.templates.package import find_robot, package_name

    config, folder = node.config, node.path.parent
    for given, base in ((_settings(node).robot, folder), (config.getini("kbot_robot"), config.rootpath)):
        if given:
            return SHIPPED_NAME if given == SHIPPED_NAME else os.path.normpath(base / given)
    around = (parent for parent in node.path.parents if (parent / "package.xml").is_file())
    for package in (*around, config.rootpath):
        found = find_robot(package, package_name(package) or package.name)
        if found is not None:
            return str(package / found)
    return pytest.fail(
        'no robot: name one with @pytest.mark.kbot(robot="FILE"), or with kbot_robot in the configuration of'
        " pytest, or put one into the folder urdf of the package around the test file",
        False,
    )


def _start(node: pytest.Item) -> PlanarPose | None:
    from kbot.kinematics import PlanarPose

    start = _settings(node).start
    return start if start is None or isinstance(start, PlanarPose) else PlanarPose(*start)


@contextmanager
def _without_traceback() -> Iterator[None]:
    """Fail with the text of KBot's errors, and with the source lines of errors in a description."""
    from kbot.text import DescriptionError, KbotError
    from kbot.text.render import render_text

    try:
        yield
        return
    except DescriptionError as error:
        text = render_text(found for found in error.diagnostics if found.is_error) or str(error)
    except KbotError as error:
        text = str(error)
    raise pytest.fail.Exception(text, False) from None
