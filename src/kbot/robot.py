"""`kbot.load` reads a description and returns a Robot with its frames and drive."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING

from kbot import model
from kbot.extensions import NotebookView, notebook
from kbot.kinematics import DifferentialDrive, FrameTree, NoDrive, Transform, find_drive
from kbot.model.load import Loaded, load_robot, resolve_robot_path
from kbot.model.writer import to_urdf
from kbot.text import Diagnostic, KbotError
from kbot.xacro import Packages
from kbot.xacro.assignments import require_overridden, resolve_names

if TYPE_CHECKING:
    from kbot.sim.mujoco_export import MujocoModel
    from kbot.world import World

Value = str | bool | int | float


class DescriptionWarning(UserWarning):
    """A part of a description that may not do what its author means."""


@dataclass(frozen=True, repr=False)
class Robot(model.RobotModel):
    """A robot description with its frames and its drive: the result of `kbot.load`, and `robot` of a
    simulation."""

    loaded: Loaded | None = field(default=None, compare=False, repr=False)
    """The expanded description, with its source map. None for a model that was not read from a file."""

    @classmethod
    def of(cls, description: Loaded | model.RobotModel) -> Robot:
        """The robot of a loaded description or of a model. Raises DescriptionError if it has errors."""
        if isinstance(description, Robot):
            return description
        loaded = description if isinstance(description, Loaded) else None
        robot = description.require() if isinstance(description, Loaded) else description
        return cls(**{f.name: getattr(robot, f.name) for f in fields(robot)}, loaded=loaded)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes about the description. It has no errors."""
        return self.loaded.diagnostics if self.loaded is not None else ()

    @cached_property
    def frames(self) -> FrameTree:
        """The frames of the links, which compute their poses, also for many joint positions at once."""
        return FrameTree(self)

    @cached_property
    def drive(self) -> DifferentialDrive | NoDrive:
        """The drive that was found in the model, or the reason why there is none.

        A `SteeredDrive` or a `HolonomicDrive` of `kbot.kinematics` is also a `DifferentialDrive`.
        """
        return find_drive(self, self.frames)

    def pose(
        self, link: str, in_frame: str | None = None, joints: Mapping[str, float] | None = None
    ) -> Transform:
        """The pose `in_frame_from_link` of a link in another link's frame (by default the root's).

        `joints`: positions in rad or m by name. All others are 0.

        Raises:
            KbotError: a link or joint is unknown, or a position is not finite.
        """
        return self.frames.pose(link, in_frame, joints)

    def to_urdf(self) -> str:
        """The robot as URDF text."""
        return to_urdf(self)

    def to_mujoco(
        self, world: str | World = "empty", *, timestep: float | None = None, contacts: str = "recipe"
    ) -> MujocoModel:
        """The robot in a world as a model of MuJoCo, to simulate and train in other programs.

        The result has the `model` (MjModel), its MJCF text (`xml`), and the `controls` that drive it. The
        model has KBot's contacts and servos. `timestep` (s) and `contacts` are as in `kbot.Simulation`.

        Raises:
            DescriptionError: the robot cannot be simulated. It carries every reason with its line.
            KbotError: the world does not exist, or another argument is not valid.
        """
        from kbot.sim.mujoco_export import export  # needed only here: start-up time
        from kbot.sim.recipe import TIMESTEP
        from kbot.sim.simulation import Simulation

        step = TIMESTEP if timestep is None else timestep
        return export(Simulation(self, world, timestep=step, contacts=contacts))

    def show(self, joints: Mapping[str, float] | None = None, *, height: int = 480) -> NotebookView:
        """Show the robot in a notebook, with sliders for its joints. `height` is in pixels.

        `joints`: initial positions in rad or m by name, within their limits.

        Raises:
            KbotError: a joint does not exist, or follows another joint.
        """
        view: NotebookView = notebook().show_robot(self, joints, height)
        return view


def load(
    path: str | os.PathLike[str],
    /,
    *,
    properties: Mapping[str, Value] | None = None,
    packages: Packages | str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | None = None,
    arguments: Mapping[str, Value] | None = None,
    **more_arguments: Value,
) -> Robot:
    """Load a robot from a xacro or URDF file. `"kbot"` is the robot that ships with KBot.

    Keywords set xacro arguments, as in `load("robot.xacro", wheel_radius=0.04)`. Names that Python does not
    allow as keywords go into `arguments`. If the description declares no such argument, the keyword overrides
    the top-level property of that name, and a `DescriptionWarning` reports it. `properties` override
    top-level properties without a warning. `packages`: folders in which packages are searched first.

    Warnings about the description are issued as `DescriptionWarning`. This includes wheel sizes of a plugin
    or controller that differ from those of the wheels.

    Raises:
        DescriptionError: the description has errors, or a keyword is neither an argument nor a top-level
            property. The exception has all errors.
        KbotError: a value is not a text, a number or a truth value, or a property is given twice.
    """
    from kbot.checks.first_look import SIZES, first_look  # needed only here: start-up time

    values = _texts("argument", {**(arguments or {}), **more_arguments})
    overrides = _texts("property", properties or {})
    places = _packages(packages)
    given = resolve_names(resolve_robot_path(path), values, places, overrides).require()
    for name in given.properties.keys() & overrides.keys():
        raise KbotError(f"the property '{name}' is given twice: as a keyword, and in properties")
    for text in given.notes:
        warnings.warn(text, DescriptionWarning, stacklevel=2)
    loaded = load_robot(path, given.arguments, {**given.properties, **overrides}, places)
    robot = Robot.of(loaded)
    require_overridden(overrides, loaded.expansion)
    for diagnostic in (*loaded.diagnostics, *first_look(loaded, SIZES)):
        warnings.warn(str(diagnostic), DescriptionWarning, stacklevel=2)
    return robot


def _packages(
    packages: Packages | str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | None,
) -> Packages | None:
    if packages is None or isinstance(packages, Packages):
        return packages
    paths = [packages] if isinstance(packages, str | os.PathLike) else list(packages)
    return Packages(paths)


def _texts(kind: str, values: Mapping[str, Value]) -> dict[str, str]:
    return {name: _text(kind, name, value) for name, value in values.items()}


def _text(kind: str, name: str, value: object) -> str:
    """A Python value, as it is written in a xacro file."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    try:
        number = float(value)  # type: ignore[arg-type]  # also numpy's numbers
    except (TypeError, ValueError):
        kind_of = type(value).__name__
        raise KbotError(f"the {kind} '{name}' is a {kind_of}, not a string, number or boolean") from None
    if not math.isfinite(number):
        raise KbotError(f"the {kind} '{name}' is not finite: {value}")
    return str(value) if isinstance(value, int) else repr(number)
