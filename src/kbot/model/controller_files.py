"""The YAML files of parameters that a description names for Gazebo's ros2_control, and what in them the
controller manager refuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from kbot.model import Robot
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, Span, read_source
from kbot.text.placed_yaml import BadYaml, Keys, load_placed_yaml
from kbot.text.suggest import Suggestion, did_you_mean

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
    """What a file holds, its misspelt `ros__parameters` put right; `faults` is what is wrong with it, `named`
    where the description names it."""

    data: Mapping[str, Any]
    places: Mapping[Keys, Span]
    named: Origin
    faults: tuple[Diagnostic, ...] = ()

    def parameters(self, node: str) -> dict[str, tuple[object, Origin]]:
        """A node's parameters with nested names joined by dots, and where each was written; `/**` counts for
        every node."""
        found: dict[str, tuple[object, Origin]] = {}
        for keys, values in self._sections(self.data, ()):
            if "/".join(keys).rpartition("/")[2] in ("**", node):
                found.update(self._flat(values, "", (*keys, PARAMETERS)))
        return found

    def _sections(self, data: Mapping[str, Any], keys: Keys) -> Iterator[tuple[Keys, Mapping[Any, Any]]]:
        """The nodes, by the keys that lead to them."""
        for key, value in data.items():
            if isinstance(value, dict) and key == PARAMETERS:
                yield keys, value
            elif isinstance(value, dict):
                yield from self._sections(value, (*keys, key))

    def _flat(
        self, values: Mapping[Any, Any], prefix: str, keys: Keys
    ) -> Iterator[tuple[str, tuple[object, Origin]]]:
        for key, value in values.items():
            below = (*keys, str(key))
            if isinstance(value, dict):
                yield from self._flat(value, f"{prefix}{key}.", below)
            else:
                span = self.places.get(below)
                yield f"{prefix}{key}", (value, Origin(span) if span else self.named)

    def types(self) -> dict[str, tuple[str, Origin]]:
        """The type of each controller that the controller manager is told of."""
        return {
            name.removesuffix(".type"): (str(kind), origin)
            for name, (kind, origin) in self.parameters(MANAGER).items()
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
        data, places = load_placed_yaml(read_source(path))
    except DescriptionError as error:
        message = f"the controllers' {error.diagnostics[0].message}"
        # it may be there where the robot runs: a description is also looked at alone
        fault = Diagnostic("W132", Severity.WARNING, message, element.origin)
        return ControllerFile({}, {}, element.origin, (fault,))
    except BadYaml as error:
        tab = "'\\t'" in error.problem
        what = "a tab stands where YAML wants blanks" if tab else error.problem
        message = f"the controllers' file is no YAML, and none of them is loaded: {what}"
        fault = _fault("W132", message, Origin(error.span), "indent with blanks" if tab else "")
        return ControllerFile({}, {}, element.origin, (fault,))
    if not isinstance(data, dict):
        return ControllerFile({}, places, element.origin)
    faults: list[Diagnostic] = []
    right: dict[Keys, Span] = dict(places)
    data = _put_right(data, (), right, faults)
    return ControllerFile(data, right, element.origin, tuple(faults))


def _put_right(
    data: Mapping[Any, Any], keys: Keys, places: dict[Keys, Span], faults: list[Diagnostic]
) -> dict[str, Any]:
    """Nodes and namespaces beneath `keys`, with `ros__parameters` where another word stands that can mean
    nothing else."""
    found: dict[str, Any] = {}
    for key, value in data.items():
        word = str(key)
        here, name = (*keys, word), word
        if (
            isinstance(value, dict)
            and word != PARAMETERS
            and PARAMETERS not in data
            and _means_parameters(word)
        ):
            name = PARAMETERS
            message = f"'{word}' is no '{PARAMETERS}': the controller manager refuses the whole file"
            hint = did_you_mean(word, (PARAMETERS,)) or f"write '{PARAMETERS}'"
            faults.append(_fault("W144", message, Origin(places[here]), hint))
            for old in [old for old in places if old[: len(here)] == here]:
                places[(*keys, name, *old[len(here) :])] = places[old]
        nested = isinstance(value, dict) and name != PARAMETERS
        found[name] = _put_right(value, here, places, faults) if nested else value
    return found


def _means_parameters(word: str) -> bool:
    return word.replace("_", "").lower() == "rosparameters" or bool(did_you_mean(word, (PARAMETERS,)).sure)


def _fault(code: str, message: str, origin: Origin, hint: str = "") -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, message, origin, hint)
