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

from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from kbot.pytest_plugin import runs
from kbot.pytest_plugin.html import HtmlReport, attach
from kbot.pytest_plugin.runs import Trial
from kbot.pytest_plugin.scenario_files import ENDINGS, ScenarioFile, ScenarioItem
from kbot.pytest_plugin.settings import (
    MARKER,
    robot_file,
    settings_of,
    start_of,
    without_traceback,
    world_of,
)

if TYPE_CHECKING:
    import os

    from kbot.model import RobotModel
    from kbot.robot import Robot, Value
    from kbot.sim import Simulation
    from kbot.world import World

    RobotLike = RobotModel | str | os.PathLike[str]
    WorldLike = str | World

__all__ = ["Trial"]


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("kbot", "KBot (robots in simulation)")
    group.addoption(
        "--kbot-film",
        metavar="DIR",
        help="Folder for a picture, a film and a recording of each failed run.",
    )
    group.addoption(
        "--kbot-html",
        metavar="FILE",
        help="Write all runs to one HTML file, with paths, plots, and films of those that failed.",
    )
    parser.addini(
        "kbot_robot",
        "Robot of tests without @pytest.mark.kbot(robot=…): a file relative to rootdir, or kbot.",
        type="string",
        default="",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", MARKER)
    option, here = config.option, config.invocation_params.dir
    # the workers of xdist get the absolute paths
    option.kbot_film = str(here / option.kbot_film) if option.kbot_film else ""
    option.kbot_html = str(here / option.kbot_html) if option.kbot_html else ""
    if option.kbot_film:
        try:
            Path(option.kbot_film).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise pytest.UsageError(
                f"--kbot-film: cannot make {option.kbot_film}: {error.strerror}"
            ) from None
    if option.kbot_html and not hasattr(config, "workerinput"):
        from kbot.text import KbotError
        from kbot.text.outputs import require_report_place
        from kbot.trials.reports.html import MARK

        try:
            require_report_place(option.kbot_html, MARK)
        except KbotError as error:
            raise pytest.UsageError(f"--kbot-html: {error}") from None
        config.pluginmanager.register(HtmlReport(option.kbot_html), "kbot-html")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    return ScenarioFile.from_parent(parent, path=file_path) if file_path.name.endswith(ENDINGS) else None


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.definition.get_closest_marker("kbot") is None:
        return
    seeds = settings_of(metafunc.definition).seeds
    if len(seeds) > 1 and "seed" in metafunc.fixturenames:
        metafunc.parametrize("seed", seeds, ids=[f"seed{seed}" for seed in seeds])


# the fixtures


@pytest.fixture
def properties(request: pytest.FixtureRequest) -> Mapping[str, Value]:
    """Values of the robot's top-level xacro properties, by name."""
    return settings_of(request.node).properties


@pytest.fixture
def arguments(request: pytest.FixtureRequest) -> Mapping[str, Value]:
    """Values of the robot's xacro arguments, by name."""
    return settings_of(request.node).arguments


@pytest.fixture
def robot(
    request: pytest.FixtureRequest, arguments: Mapping[str, Value], properties: Mapping[str, Value]
) -> Robot:
    """The robot of the marker, of the ini option `kbot_robot`, or of the package around the test file."""
    from kbot.robot import DescriptionWarning, load
    from kbot.text import KbotError

    with without_traceback():
        try:
            return load(robot_file(request.node), properties=properties, arguments=arguments)
        except DescriptionWarning as warning:  # the filters for warnings make it an error
            raise KbotError(str(warning)) from None


@pytest.fixture
def seed(request: pytest.FixtureRequest) -> int:
    """The seed of the marker, by default 0. Several seeds parametrize the test."""
    return settings_of(request.node).seeds[0]


@pytest.fixture
def world(request: pytest.FixtureRequest, seed: int) -> WorldLike:
    """The world of the marker, by default `empty`. `{seed}` in its name is replaced by the seed."""
    with without_traceback():
        return world_of(request.node, seed)


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
    with without_traceback():
        simulation = Simulation(robot, world, seed, start=start_of(item))
    mount_declared(simulation, strict=False)
    name = world if isinstance(world, str) else world.name
    recording = runs.recording_of(item)
    run = WatchedRun(simulation, item.name, name, record=recording, film=runs.is_filmed(item))
    item.stash[runs.RUN] = lambda failed: (run.result(film=failed), simulation.world)
    yield simulation
    run.close()
    if recording and runs.FAILED not in item.stash:
        Path(recording).unlink()


@pytest.fixture
def trial(request: pytest.FixtureRequest, robot: RobotLike, world: WorldLike, seed: int) -> Trial:
    """Runs a scenario: `trial(steps=[Step(Command(0.2))], expect=[Bound("max_tilt", max=0.1)])`."""
    return Trial(request.node, robot, world, seed)


# the reports


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    if runs.RUN not in item.stash:
        report = yield
        if (
            report.failed
            and item.config.option.kbot_html
            and runs.FAILED not in item.stash
            and _runs_kbot(item)
        ):
            item.stash[runs.FAILED] = True
            attach(report, item, runs.without_run(item, report))
        return report
    lines = runs.cut_traceback(call)
    report = yield
    if report.failed:
        item.stash[runs.FAILED] = True
    if lines:
        report.sections.append(("KBot: the error", lines))
    is_shown = item.config.option.kbot_html and call.when == "call"
    if report.failed or is_shown:
        result = runs.describe(item, report)
        if item.config.option.kbot_html:
            attach(report, item, result)
    if report.failed or call.when == "teardown":
        del item.stash[runs.RUN]  # an item lives as long as the session
    return report


def _runs_kbot(item: pytest.Item) -> bool:
    return isinstance(item, ScenarioItem) or not {"sim", "trial"}.isdisjoint(
        getattr(item, "fixturenames", ())
    )
