"""The YAML files of controllers of ros_control and ros2_control: their parameters and their errors."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from kbot.model import RobotModel
from kbot.model.extensions import gazebo_plugins
from kbot.model.spawned import Setting, SpawnedController, spawned_controllers
from kbot.text import (
    DescriptionError,
    Diagnostic,
    DiagnosticCollector,
    Element,
    Origin,
    Severity,
    read_source,
)
from kbot.text.numbers import to_float
from kbot.text.span import Call
from kbot.text.suggest import Suggestion, did_you_mean
from kbot.text.yaml import Keys, YamlDocument, YamlError, read_yaml

PARAMETERS = "ros__parameters"
MANAGER = "controller_manager"

DIFF_DRIVE = "diff_drive_controller/DiffDriveController"
MECANUM_DRIVE = "mecanum_drive_controller/MecanumDriveController"
OMNI_DRIVE = "omni_wheel_drive_controller/OmniWheelDriveController"
STEERING = (
    "ackermann_steering_controller",
    "bicycle_steering_controller",
    "tricycle_controller",
    "tricycle_steering_controller",
)
"""The packages of the controllers that steer a car or a tricycle."""
JOINT_STATE = "joint_state_controller/JointStateController"

OTHERS_NEED: Mapping[tuple[int, str], tuple[str, ...]] = {
    (1, DIFF_DRIVE): ("left_wheel", "right_wheel"),
    (2, DIFF_DRIVE): ("left_wheel_names", "right_wheel_names"),
    (1, JOINT_STATE): ("publish_rate",),
}
"""Parameters without which controllers that command no single joints do not start, by ROS 1 or 2 and type."""

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
    MECANUM_DRIVE,
    OMNI_DRIVE,
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
"""The types in the packages of ros2_controllers. Other packages have more."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a controller, or a tag of a plugin.

    value   the value in YAML, or the text of the tag
    origin  where the value was written
    key     the key or the tag; for a spawned controller's parameter the same as `origin`
    items   where the items of a list were written
    """

    name: str
    value: object
    origin: Origin
    key: Origin
    items: tuple[Origin, ...] = ()

    @property
    def text(self) -> str:
        """The value as text. A key without a value has none, so that its default counts."""
        return "" if self.value is None else str(self.value)

    @property
    def number(self) -> float | None:
        """The value as a finite number, else None."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float | str):
            return None
        try:
            number = to_float(self.value) if isinstance(self.value, str) else float(self.value)
        except (ValueError, OverflowError):
            return None
        return number if math.isfinite(number) else None

    @property
    def boolean(self) -> bool | None:
        """The value as a boolean, which SDF also writes as 0 or 1, else None."""
        return {"true": True, "1": True, "false": False, "0": False}.get(self.text.strip().lower())

    @property
    def is_nan(self) -> bool:
        """Whether the value is NaN, which ros2_control takes for "no limit". ROS 2 reads the text `NAN` as a
        number too, in any case."""
        return self.text.lower() in ("nan", ".nan", "+nan", "-nan")

    def names(self) -> tuple[Parameter, ...]:
        """The texts of a list, or the single text, each as a separate parameter."""
        if not isinstance(self.value, list):
            return (self,) if isinstance(self.value, str) else ()
        places = self.items or (self.origin,) * len(self.value)
        return tuple(
            Parameter(self.name, item, place, self.key)
            for item, place in zip(self.value, places, strict=True)
            if isinstance(item, str)
        )


@dataclass(frozen=True, slots=True)
class ControllerFile:
    """A file of controller parameters.

    document  its content, None if it cannot be read
    named     where the description names the file
    faults    what is wrong with it
    words     the keys that hold a node's parameters, with misspelt ones
    """

    document: YamlDocument | None
    named: Origin
    faults: tuple[Diagnostic, ...] = ()
    words: tuple[str, ...] = (PARAMETERS,)

    def nodes(self) -> Iterator[tuple[str, dict[str, Parameter]]]:
        """Each node's name without its namespace, or its wildcard, and its parameters by dotted name."""
        for keys, values in _sections(self.document.data, (), self.words) if self.document else ():
            name = "/".join(keys[:-1]).rpartition("/")[2]
            leaves = [(".".join(below[len(keys) :]), below, value) for below, value in _leaves(values, keys)]
            yield name, {dotted: self._parameter(dotted, below, value) for dotted, below, value in leaves}

    def parameters(self, node: str) -> dict[str, Parameter]:
        """The parameters of a node in any namespace, by dotted name; later ones replace earlier ones."""
        found: dict[str, Parameter] = {}
        for name, parameters in self.nodes():
            if matches(name, node):
                found.update(parameters)
        return found

    def _parameter(self, name: str, keys: Keys, value: object) -> Parameter:
        place = self.document.place(*keys) if self.document is not None else None
        if self.document is None or place is None or place.key is None:
            return Parameter(name, value, self.named, self.named)
        count = len(value) if isinstance(value, list) else 0
        items = [self.document.place(*keys, str(index)) or place for index in range(count)]
        places = tuple(Origin(item.value) for item in items)
        return Parameter(name, value, Origin(place.value), Origin(place.key), places)

    def types(self) -> dict[str, Parameter]:
        """The type of each controller that the controller manager lists."""
        return {
            name.removesuffix(".type"): parameter
            for name, parameter in self.parameters(MANAGER).items()
            if name.endswith(".type")
        }

    def unknown_types(self) -> Iterator[tuple[str, str, Origin, Suggestion]]:
        """Controllers whose type does not exist: name, type, its place, and a suggestion."""
        for name, kind in self.types().items():
            meant = unknown_type(kind.text)
            if meant is not None:
                yield name, kind.text, kind.key, meant


def controller_files(robot: RobotModel) -> Iterator[ControllerFile]:
    """The files in the `<parameters>` of Gazebo's plugins, also those that cannot be used."""
    for plugin in gazebo_plugins(robot):
        yield from (_read(e) for e in plugin.elements("parameters") if e.text.strip())


def node_parameters(
    document: YamlDocument, node: str | None, call: Call | None = None, words: Collection[str] = (PARAMETERS,)
) -> dict[str, Setting]:
    """A node's parameters in a parameter file of ROS 2. Nested names are joined by dots, and later parameters
    replace earlier ones.

    Args:
        document: the file.
        node: full name of the node, for example `/arm/follow`. A name without a slash matches in every
            namespace, and None matches every node.
        call: the include that loaded the file.
        words: the keys that hold the parameters of a node.
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
    """Whether a pattern of a parameter file matches a node's full name: `*` matches one part of the name, and
    `**` any number of parts."""
    names = [part for part in node.split("/") if part]
    reached = {0}
    """How many parts of the name the pattern so far can match."""
    for part in filter(None, pattern.split("/")):
        if part == "**":
            reached = set(range(min(reached, default=len(names) + 1), len(names) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(names) and part in ("*", names[at])}
    return len(names) in reached


# Any: what YAML holds
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
    """Suggestions for a type that does not exist; None for one that may exist in a package that KBot does not
    know.

    A type does not exist if it names no package, if its package is known and has no such controller, or if it
    is a typo of a known type."""
    package, slash, _ = kind.partition("/")
    if not slash and "::" not in kind:
        return did_you_mean(kind, [known for known in TYPES if known.endswith(f"/{kind}")] or TYPES)
    hint = did_you_mean(kind, TYPES)
    is_of_known = any(known.partition("/")[0] == package for known in TYPES)
    return hint if kind not in TYPES and (hint.sure or is_of_known) else None


def _read(element: Element) -> ControllerFile:
    path = element.text.strip()
    try:
        document = read_yaml(read_source(path))
    except DescriptionError as error:
        message = f"the controllers' {error.diagnostics[0].message}"
        # only a warning: the file may exist on the machine on which the robot runs
        fault = Diagnostic("W132", Severity.WARNING, message, element.origin)
        return ControllerFile(None, element.origin, (fault,))
    except YamlError as error:
        span = error.span
        tab = span.source.data[span.start : span.start + 1] == b"\t"
        what = "it is indented with a tab" if tab else error.problem
        message = f"the controllers' file is not valid YAML, and no controller is loaded: {what}"
        fault = _fault("W132", message, Origin(span), "indent with spaces" if tab else "")
        return ControllerFile(None, element.origin, (fault,))
    misspelt = list(_misspelt(document.data, ()))
    words = (PARAMETERS, *dict.fromkeys(keys[-1] for keys in misspelt))
    faults = tuple(_misspelling(keys[-1], Origin(document.span(*keys))) for keys in misspelt)
    return ControllerFile(document, element.origin, faults, words)


def _misspelt(data: object, keys: Keys) -> Iterator[Keys]:
    """The keys that lead to a misspelt `ros__parameters`."""
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
    message = f"the key '{word}' must be '{PARAMETERS}': the controller manager rejects the whole file"
    return _fault("W144", message, origin, did_you_mean(word, (PARAMETERS,)) or f"write '{PARAMETERS}'")


def _means_parameters(word: str) -> bool:
    return word.replace("_", "").lower() == "rosparameters" or bool(did_you_mean(word, (PARAMETERS,)).sure)


def _fault(code: str, message: str, origin: Origin, hint: str = "") -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, message, origin, hint)


@dataclass(frozen=True, slots=True)
class Parameters:
    """A controller's parameters by dotted name, including `type`. `origin` is where the description names the
    file, or where the launch names the controller."""

    kind: str
    controller: str
    given: Mapping[str, Parameter]
    origin: Origin
    ros: int = 2
    is_active: bool = True
    is_spawned: bool = False

    @property
    def values(self) -> Mapping[str, object]:
        return {name: parameter.value for name, parameter in self.given.items()}

    def place(self, *names: str) -> Origin:
        """Where the first given one of these parameters was written, else the place of the controller's
        type."""
        return next((self.given[n].key for n in (*names, "type") if n in self.given), self.origin)

    def lacking(self, *needed: str) -> list[str]:
        """The needed parameters that a spawned controller lacks, including those that its type always needs.

        A controller in the description is assumed to have all of them.
        """
        every = (*needed, *OTHERS_NEED.get((self.ros, self.kind), ()))
        return [name for name in every if name not in self.given] if self.is_spawned else []


def controller_parameters(robot: RobotModel, findings: DiagnosticCollector) -> Iterator[Parameters]:
    """The parameters of every controller that the controller manager lists, or only of those that a launch
    spawns. A spawned controller without a type is reported at the place that spawns it."""
    written = {found.controller: found for found in _of_description(robot, findings)}
    spawned = spawned_controllers(robot)
    if not spawned:
        yield from written.values()
    for controller in spawned:
        file = written.get(controller.name.rpartition("/")[2])
        given = dict(file.given) if file else {}
        for name, setting in controller.settings.items():
            given[name] = Parameter(name, setting.value, setting.origin, setting.origin)
        own = controller.settings.get("type")
        kind = str((own and own.value) or (file.kind if file else ""))
        if not kind:
            if controller.settings or not any(d.code == "W132" for d in findings.diagnostics):
                _report_unknown(controller, spawned, written, findings)
            continue
        ros, is_active = controller.ros, controller.is_active
        yield Parameters(kind, controller.name, given, controller.origin, ros, is_active, True)


def _report_unknown(
    controller: SpawnedController,
    spawned: Iterable[SpawnedController],
    written: Mapping[str, Parameters],
    findings: DiagnosticCollector,
) -> None:
    known = [*(other.name for other in spawned if "type" in other.settings), *written]
    if controller.settings:
        message = f"the controller {controller.name} has parameters but no type: it is not loaded"
        origin = next(iter(controller.settings.values())).origin
        hint = "set its type, for example effort_controllers/JointPositionController"
        findings.warning("W137", message, origin, hint)
        return
    message = f"the controller {controller.name} has no parameters: it is not loaded"
    findings.warning("W137", message, controller.origin, did_you_mean(controller.name, known))


def _of_description(robot: RobotModel, findings: DiagnosticCollector) -> Iterator[Parameters]:
    for file in controller_files(robot):
        findings.diagnostics += file.faults
        for controller, kind in file.types().items():
            given = {"type": replace(kind, name="type")} | file.parameters(controller)
            yield Parameters(kind.text, controller, given, file.named)
