"""Show a robot or a simulation in a notebook: the page that `kbot export` saves, in a frame."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from kbot.checks import check_loaded
from kbot.model import RobotModel
from kbot.model.load import Loaded
from kbot.sim import Simulation
from kbot.sim import Snapshot as Moment
from kbot.text import KbotError
from kbot.text.files import write_text
from kbot.text.xml_text import escaped
from kbot.workbench.driving.mover import Moment as MoverState
from kbot.workbench.driving.mover import flat
from kbot.workbench.driving.sliders import Sliders
from kbot.workbench.protocol import SetJoint, State
from kbot.workbench.saved_page import saved_page
from kbot.workbench.scene.scene import Control
from kbot.workbench.session.session import Session
from kbot.workbench.source.description import DescriptionReading, findings_of_sensors
from kbot.workbench.source.description_file import Checked
from kbot.workbench.source.overrides import Overrides


@dataclass(frozen=True, slots=True)
class NotebookPage:
    """The result of `show()`. Notebooks display it, and `save` writes it to a file. `page` is its HTML."""

    page: str = field(repr=False)  # about a megabyte, which notebooks would also store as text
    height: int

    def _repr_html_(self) -> str:
        """Return the page in an iframe, so that page and notebook do not affect each other."""
        return (
            f'<iframe srcdoc="{escaped(self.page)}" style="width: 100%; height: {self.height}px; border: 0"'
            ' title="KBot" allow="fullscreen"></iframe>'
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page as one HTML file.

        Raises:
            KbotError: the folder is missing or not writable.
        """
        write_text(path, self.page)


def show_robot(robot: RobotModel, joints: Mapping[str, float] | None, height: int) -> NotebookPage:
    """Return a robot with sliders for its joints, which start at `joints` (rad, m).

    Raises:
        KbotError: an unknown joint.
    """
    session = Session(LoadedReader(reading_of(robot)), "view", Sliders)
    for name, position in (joints or {}).items():
        session.handle(SetJoint(name, float(position)), 0)
    return NotebookPage(saved_page(session, robot), height)


def show_simulation(simulation: Simulation, moments: Sequence[Moment], height: int) -> NotebookPage:
    """Return a simulation in its current state, or with `moments` a slider over them.

    Raises:
        KbotError: a moment is of another simulation.
    """
    if isinstance(moments, str) or not isinstance(moments, Sequence):
        raise KbotError(
            f"snapshots must be a list of values that state() returned, not {reprlib.repr(moments)}"
        )
    session = _display_session(simulation)
    states = list(_states(session, simulation, moments)) if moments else []
    return NotebookPage(saved_page(session, simulation.robot, states), height)


def _display_session(simulation: Simulation) -> Session:
    reading = reading_of(simulation.robot)
    return Session(
        LoadedReader(reading),
        "sim",
        lambda robot: _StillView(robot, simulation=simulation),
        simulation.world,
    )


def _states(session: Session, simulation: Simulation, moments: Sequence[Moment]) -> Iterator[State]:
    # a copy, so that restoring moments does not change the simulation or its recording
    twin = Simulation(
        simulation.robot,
        simulation.world,
        simulation.seed,
        simulation.timestep,
        simulation.contacts,
        start=simulation.start,
    )
    display = _display_session(twin)
    for moment in moments:
        twin.restore(moment)
        yield replace(display.state(), revision=session.scene.revision)


@dataclass
class _StillView(Sliders):
    """A simulation that is only displayed."""

    simulation: Simulation | None = None

    @property
    def controls(self) -> Mapping[str, Control]:
        return {} if self.simulation is not None else super().controls

    def moment(self) -> MoverState:
        if self.simulation is None:
            return super().moment()
        simulation = self.simulation
        odometry = simulation.odometry
        return replace(
            super().moment(),
            time=simulation.time,
            positions=simulation.joint_positions,
            poses=simulation.link_poses(),
            bodies=flat(simulation.models.body_poses().values()),
            twist=(odometry.twist.x, odometry.twist.yaw),
            odometry=(odometry.pose.x, odometry.pose.y, odometry.pose.yaw),
        )


@dataclass
class LoadedReader:
    """A description that is already read."""

    reading: DescriptionReading
    overrides: Overrides = field(default_factory=lambda: Overrides(None))
    package_path: tuple[str, ...] = ()
    read_only_reason: str = "the program loaded this robot. Start the program again to use a changed file"

    def read(self) -> DescriptionReading:
        return self.reading

    def read_again(self) -> DescriptionReading:
        return self.reading

    def check(self, texts: Mapping[str, str], allowed: Iterable[str]) -> Checked:
        raise KbotError(self.read_only_reason)

    def allow_only(self, files: Iterable[str]) -> None:
        """No page changes it."""


def reading_of(robot: RobotModel) -> DescriptionReading:
    """Return what a robot was read from, if it is known."""
    loaded: Loaded | None = getattr(robot, "loaded", None)
    if loaded is None:
        return DescriptionReading(robot, True, None, (), (robot.name,))
    expansion = loaded.expansion
    findings = (*check_loaded(loaded), *findings_of_sensors(robot))
    document = expansion.document
    files = (*((document.source.path,) if document else ()), *expansion.dependencies)
    return DescriptionReading(robot, True, expansion, findings, tuple(dict.fromkeys(files)) or (robot.name,))
