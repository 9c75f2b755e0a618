"""The YAML files of parameters that a description names for Gazebo's ros2_control, and what in them the
controller manager refuses."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from kbot.model import Robot
from kbot.model.spawned import Setting
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, read_source
from kbot.text.span import Call
from kbot.text.suggest import Suggestion, did_you_mean
from kbot.text.yaml import Document, Keys, YamlError, read_yaml

PARAMETERS = "ros__parameters"
MANAGER = "controller_manager"

TYPES = (
    "ackermann_steering_controller/AckermannSteeringController",
    "admittance_controller/AdmittanceController",
    "bicycle_steering_controller/BicycleSteeringController",
    "chained_filter_controller/ChainedFilter",
    "diff_drive_controller/DiffDriveController",
    "effort_controllers/GripperActionController",
    "effort_controllers/JointGroupEffortController",
    "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster",
    "forward_command_controller/ForwardCommandController",
    "forward_command_controller/MultiInterfaceForwardCommandController",
    "gpio_controllers/GpioCommandController",
    "gps_sensor_broadcaster/GPSSensorBroadcaster",
    "imu_sensor_broadcaster/IMUSensorBroadcaster",
    "joint_state_broadcaster/JointStateBroadcaster",
    "joint_trajectory_controller/JointTrajectoryController",
    "mecanum_drive_controller/MecanumDriveController",
    "omni_wheel_drive_controller/OmniWheelDriveController",
    "parallel_gripper_action_controller/GripperActionController",
    "pid_controller/PidController",
    "pose_broadcaster/PoseBroadcaster",
    "position_controllers/GripperActionController",
    "position_controllers/JointGroupPositionController",
    "range_sensor_broadcaster/RangeSensorBroadcaster",
    "tricycle_controller/TricycleController",
    "tricycle_steering_controller/TricycleSteeringController",
    "velocity_controllers/JointGroupVelocityController",
)
"""Those of ros2_controllers; other packages have more."""


@dataclass(frozen=True, slots=True)
class ControllerFile:
    """What a file holds; None if it cannot be read. `named` is where the description names it, `faults` what
    is wrong with it, and `words` are the keys that hold a node's parameters, misspelt ones too."""

    document: Document | None
    named: Origin
    faults: tuple[Diagnostic, ...] = ()
    words: tuple[str, ...] = (PARAMETERS,)

    def parameters(self, node: str) -> dict[str, Setting]:
        """A node's parameters as `node_parameters` returns them."""
        return node_parameters(self.document, node, words=self.words) if self.document else {}

    def types(self) -> dict[str, tuple[str, Origin]]:
        """The type of each controller that the controller manager is told of."""
        return {
            name.removesuffix(".type"): (str(setting.value), setting.origin)
            for name, setting in self.parameters(MANAGER).items()
            if name.endswith(".type")
        }

    def unknown_types(self) -> Iterator[tuple[str, str, Origin, Suggestion]]:
        """Controllers whose type is none, as `unknown_type` has it: name, type, its place, what was meant."""
        for name, (kind, origin) in self.types().items():
            meant = unknown_type(kind)
            if meant is not None:
                yield name, kind, origin, meant


def controller_files(robot: Robot) -> Iterator[ControllerFile]:
    """Those of the `<parameters>` of Gazebo's plugins, also those that cannot be used."""
    for extension in robot.extensions:
        if extension.tag == "gazebo":
            for plugin in extension.elements("plugin"):
                yield from (_read(e) for e in plugin.elements("parameters") if e.text.strip())


def node_parameters(
    document: Document, node: str | None, call: Call | None = None, words: Collection[str] = (PARAMETERS,)
) -> dict[str, Setting]:
    """A node's parameters in a parameter file of ROS 2: nested names are joined by dots, later ones replace
    earlier ones.

    node    its full name, as `/arm/follow`; a name without a slash is one in any namespace, None every node
    call    the include that brought the file
    words   the keys that hold the parameters of a node
    """
    found: dict[str, Setting] = {}
    for keys, values in _sections(document.data, (), words):
        pattern = "/".join(keys[:-1])
        if node is not None and "/" not in node:
            pattern = pattern.rpartition("/")[2]
        if node is None or matches(pattern, node):
            for below, value in _leaves(values, keys):
                name = ".".join(below[len(keys) :])
                found[name] = Setting(value, Origin(document.span(*below), call))
    return found


def matches(pattern: str, node: str) -> bool:
    """Whether a parameter file means a node by its full name: `*` stands for one part of it, `**` for any
    number of them."""
    names = [part for part in node.split("/") if part]
    reached = {0}
    """How many of the names the parts of the pattern so far may stand for."""
    for part in filter(None, pattern.split("/")):
        if part == "**":
            reached = set(range(min(reached, default=len(names) + 1), len(names) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(names) and part in ("*", names[at])}
    return len(names) in reached


def _sections(data: object, keys: Keys, words: Collection[str]) -> Iterator[tuple[Keys, Mapping[Any, Any]]]:
    """The parameters of each node, and the keys that lead to them."""
    for key, value in data.items() if isinstance(data, dict) else ():
        below = (*keys, str(key))
        if key not in words:
            yield from _sections(value, below, words)
        elif isinstance(value, dict):
            yield below, value


def _leaves(values: Mapping[Any, Any], keys: Keys) -> Iterator[tuple[Keys, object]]:
    for key, value in values.items():
        below = (*keys, str(key))
        if isinstance(value, dict):
            yield from _leaves(value, below)
        else:
            yield below, value


def unknown_type(kind: str) -> Suggestion | None:
    """The types that were perhaps meant by one that surely is none: it names no package, its package has no
    such controller, or it is a slip away from one there is. None for a type that may be of somebody's own."""
    package, slash, _ = kind.partition("/")
    if not slash and "::" not in kind:
        return did_you_mean(kind, [one for one in TYPES if one.endswith(f"/{kind}")] or TYPES)
    hint = did_you_mean(kind, TYPES)
    is_of_known = any(one.partition("/")[0] == package for one in TYPES)
    return hint if kind not in TYPES and (hint.sure or is_of_known) else None


def _read(element: Element) -> ControllerFile:
    path = element.text.strip()
    try:
        document = read_yaml(read_source(path))
    except DescriptionError as error:
        message = f"the controllers' {error.diagnostics[0].message}"
        # it may be there where the robot runs: a description is also looked at alone
        fault = Diagnostic("W132", Severity.WARNING, message, element.origin)
        return ControllerFile(None, element.origin, (fault,))
    except YamlError as error:
        span = error.span
        tab = span.source.data[span.start : span.start + 1] == b"\t"
        what = "a tab stands where YAML wants blanks" if tab else error.problem
        message = f"the controllers' file is no YAML, and none of them is loaded: {what}"
        fault = _fault("W132", message, Origin(span), "indent with blanks" if tab else "")
        return ControllerFile(None, element.origin, (fault,))
    misspelt = list(_misspelt(document.data, ()))
    words = (PARAMETERS, *dict.fromkeys(keys[-1] for keys in misspelt))
    faults = tuple(_misspelling(keys[-1], Origin(document.span(*keys))) for keys in misspelt)
    return ControllerFile(document, element.origin, faults, words)


def _misspelt(data: object, keys: Keys) -> Iterator[Keys]:
    """The keys that lead to a word in the place of `ros__parameters` that can mean nothing else."""
    if not isinstance(data, dict):
        return
    for key, value in data.items():
        word = str(key)
        if not isinstance(value, dict) or word == PARAMETERS:
            continue
        if PARAMETERS not in data and _means_parameters(word):
            yield (*keys, word)
        else:
            yield from _misspelt(value, (*keys, word))


def _misspelling(word: str, origin: Origin) -> Diagnostic:
    message = f"'{word}' is no '{PARAMETERS}': the controller manager refuses the whole file"
    return _fault("W144", message, origin, did_you_mean(word, (PARAMETERS,)) or f"write '{PARAMETERS}'")


def _means_parameters(word: str) -> bool:
    return word.replace("_", "").lower() == "rosparameters" or bool(did_you_mean(word, (PARAMETERS,)).sure)


def _fault(code: str, message: str, origin: Origin, hint: str = "") -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, message, origin, hint)
