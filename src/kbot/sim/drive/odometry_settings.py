"""What a drive publishes of its odometry: topics, frames, rate and variances."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import isfinite

from kbot.kinematics.controller_files import Parameter
from kbot.kinematics.drive.declared import DeclaredDrive, Holonomic
from kbot.kinematics.drive.programs import (
    BASE,
    COVARIANCES,
    ODOMETRY,
    OPEN_LOOP,
    POSE_COVARIANCE,
    PREFIX,
    PREFIX_ENABLE,
    PROGRAMS,
    RATE,
    SOURCE,
    TRANSFORM,
    TRANSFORM_TOPIC,
    TWIST_COVARIANCE,
    Diagonal,
    Program,
    Setting,
)
from kbot.model import RobotModel
from kbot.sim.naming import Naming
from kbot.sim.recipe import CONTROL_RATE
from kbot.text import DiagnosticCollector

OWN_VARIANCES = (0.001, 0.001, 0.001, 0.001, 0.001, 0.01)
"""Variances of x, y, z and the rotations for a robot without a plugin or controller. They are the values that
TurtleBot 3 and others write for diff_drive_controller's `pose_covariance_diagonal`."""


class Source(StrEnum):
    """What odometry is computed from: the wheels, the true pose, or the commands."""

    WHEELS = "wheels"
    TRUTH = "truth"
    COMMANDS = "commands"


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """What a drive publishes of its odometry.

    is_published, has_transform  whether it publishes Odometry, and the transform from odom to the robot
    rate                         Hz; infinite for every time step
    base_frame                   the robot's frame. Empty: the link that odometry describes
    prefix                       the prefix of both frames. None: that of all frames of the robot
    transform_topic              the topic of the transform
    pose, twist                  variances of x, y, z (m^2) and the rotations (rad^2), and of their speeds
    source                       what odometry is computed from
    """

    is_published: bool = True
    has_transform: bool = True
    rate: float = CONTROL_RATE
    base_frame: str = ""
    prefix: str | None = None
    transform_topic: str = "/tf"
    pose: Diagonal = OWN_VARIANCES
    twist: Diagonal = OWN_VARIANCES
    source: Source = Source.WHEELS


def odometry_settings(
    robot: RobotModel, controller: DeclaredDrive, naming: Naming, findings: DiagnosticCollector
) -> OdometrySettings:
    """Read them from a plugin or controller, with the defaults of its source. Invalid values are reported."""
    return _Reader(robot, controller, findings).read(naming)


class _Reader:
    """Reads settings by their role. For an unknown plugin every name of a known one counts."""

    def __init__(self, robot: RobotModel, controller: DeclaredDrive, findings: DiagnosticCollector) -> None:
        self._robot, self._given, self._findings = robot, controller.given, findings
        self._controller, self._program = controller, controller.program

    def read(self, naming: Naming) -> OdometrySettings:
        program = self._program
        rate = self._rate()
        is_published, has_transform = self._flag(ODOMETRY), self._flag(TRANSFORM)
        if rate <= 0.0:
            is_published = has_transform = program is None or not program.needs_rate
            rate = float("inf")
        settings = OdometrySettings(
            is_published,
            has_transform,
            rate,
            self._base_frame(),
            self._prefix(naming),
            self._transform_topic(naming),
            self._diagonal(POSE_COVARIANCE, OWN_VARIANCES if program is None else program.pose),
            self._diagonal(TWIST_COVARIANCE, OWN_VARIANCES if program is None else program.twist),
            self._source(),
        )
        self._note_default_off(settings)
        return settings

    def _settings(self, role: str) -> tuple[Setting, ...]:
        programs: tuple[Program, ...] = PROGRAMS if self._program is None else (self._program,)
        return tuple(setting for program in programs for setting in program.of_role(role))

    def _first(self, role: str) -> Parameter | None:
        return next((self._given[s.name] for s in self._settings(role) if s.name in self._given), None)

    def _word(self, role: str) -> str:
        given = self._first(role)
        if given is not None and isinstance(given.value, list):
            self._warn(given, f"must be a text, not '{given.text}'", "its default")
            return ""
        return given.text.strip() if given is not None else ""

    def _flag(self, role: str) -> bool:
        """Whether all switches of a role are on. Without a switch it is on."""
        if self._program is None:
            return all(self._boolean(self._given.get(s.name), True) for s in self._settings(role))
        return all(self._boolean(self._given.get(s.name), s.default == "true") for s in self._settings(role))

    def _boolean(self, given: Parameter | None, default: bool) -> bool:
        if given is None:
            return default
        if given.boolean is None:
            self._warn(given, f"must be true or false, not '{given.text}'", str(default).lower())
            return default
        return given.boolean

    def _rate(self) -> float:
        given = self._first(RATE)
        settings = self._settings(RATE)
        known = self._program is not None and settings
        default = float(settings[0].default) if known else CONTROL_RATE
        if given is None:
            return default
        if given.number is None:
            self._warn(given, f"must be a number, not '{given.text}'", f"{default:g}")
            return default
        return given.number

    def _diagonal(self, role: str, default: Diagonal) -> Diagonal:
        """Six variances: a list of them, or settings for x, y and the yaw alone."""
        given, known = self._first(role), self._settings(role) if self._program is not None else ()
        if known and known[0].default:
            default = tuple(float(word) for word in known[0].default.strip("[]").split(","))
        if given is not None:
            values = given.value if isinstance(given.value, list) else []
            if len(values) == 6 and all(_is_number(value) for value in values):
                return tuple(float(value) for value in values)
            self._warn(given, f"must be a list of 6 numbers, not '{given.text}'", "its default")
        # Gazebo Classic's drives use the same three for the twist, if they report its variances at all
        if self._program is not None and not any(default):
            return default
        replaced = zip((0, 1, 5), self._variances, strict=True)
        changed = {at: value for at, value in replaced if value is not None}
        return tuple(changed.get(at, value) for at, value in enumerate(default))

    @cached_property
    def _variances(self) -> tuple[float | None, ...]:
        """The settings for the variances of x, y and the yaw, None without one."""
        found: list[float | None] = []
        for axis in COVARIANCES:
            given = self._first(axis)
            if given is not None and given.number is None:
                self._warn(given, f"must be a number, not '{given.text}'", "its default")
            found.append(given.number if given is not None else None)
        return tuple(found)

    def _source(self) -> Source:
        open_loop, source = self._first(OPEN_LOOP), self._first(SOURCE)
        if open_loop is not None and self._boolean(open_loop, False):
            return Source.COMMANDS
        is_body = self._controller.holonomic is Holonomic.BODY
        if is_body or (source is not None and source.text.strip() in ("world", "1")):
            return Source.TRUTH
        return Source.WHEELS

    def _base_frame(self) -> str:
        """The given frame. Without one, the plugin's default if the robot has such a link."""
        given = self._word(BASE).lstrip("/")
        defaults = [s.default for s in self._settings(BASE)] if self._program is not None else []
        return given or next((name for name in defaults if name in self._robot.links), "")

    def _prefix(self, naming: Naming) -> str | None:
        """The prefix that controllers of ROS 2 start their frames with, None for that of all frames."""
        enable = self._first(PREFIX_ENABLE)
        if enable is not None and not self._boolean(enable, True):
            return ""
        prefix = self._word(PREFIX)
        if not prefix:
            return None
        # as controller_interface::resolve_tf_prefix
        return f"{prefix.replace('~', naming.namespace).strip('/')}/".lstrip("/")

    def _transform_topic(self, naming: Naming) -> str:
        """`/tf`, or the topic that a description names for gz. Without one, KBot is the bridge to `/tf`."""
        topic = self._word(TRANSFORM_TOPIC).strip("/")
        return "/tf" if topic in ("", "tf") else naming.topic(self._word(TRANSFORM_TOPIC))

    def _note_default_off(self, settings: OdometrySettings) -> None:
        """W150: odometry or its transform is not published, because its switch is off by default."""
        off: dict[str, list[str]] = {}
        for role, what, is_on in (
            (ODOMETRY, "its odometry", settings.is_published),
            (TRANSFORM, "the transform from odom to the robot", settings.has_transform),
        ):
            switches = self._settings(role) if self._program is not None else ()
            if not is_on and switches and not any(s.name in self._given for s in switches):
                off.setdefault(switches[0].name, []).append(what)
        if not off:
            return
        is_plugin = self._controller.plugin is not None
        given = [f"<{name}>true</{name}>" if is_plugin else f"{name}: true" for name in off]
        parts = [text for texts in off.values() for text in texts]
        what, other = " or ".join(parts), "it" if len(parts) == 1 else "them"
        verb = "is" if len(off) == 1 else "are"
        self._findings.info(
            "W150",
            f"{self._controller.name} does not publish {what}: {' and '.join(off)} {verb} false by default",
            self._controller.origin,
            f"write {' and '.join(given)}, unless another node publishes {other}",
        )

    def _warn(self, given: Parameter, what: str, instead: str) -> None:
        name = given.name if self._controller.plugin is None else f"<{given.name}>"
        self._findings.warning("W130", f"{name} {what}", given.origin, f"KBot uses {instead}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
