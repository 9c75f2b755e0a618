"""The controllers of joints that a description has: those of ros2_control, and Gazebo's own plugins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import isfinite

from kbot.model import Robot
from kbot.sim.controllers_yaml import Parameters, controller_parameters
from kbot.text import Element, Origin
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings


class Interface(StrEnum):
    """What of a joint is commanded: rad or m, rad/s or m/s, N m or N."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"


class Input(StrEnum):
    """The message that a controller hears."""

    NUMBER = "Float64"
    ARRAY = "Float64MultiArray"
    TRAJECTORY = "JointTrajectory"


@dataclass(frozen=True, slots=True)
class JointController:
    """`joints` in the order in which an array has their numbers."""

    name: str
    topic: str
    input: Input
    joints: tuple[str, ...]
    interface: Interface


@dataclass(frozen=True, slots=True)
class JointControl:
    """The controllers, the joints that they or their hardware hold from the start on, and where joints start
    that are not to start at 0 (rad or m)."""

    controllers: tuple[JointController, ...] = ()
    holds: frozenset[str] = frozenset()
    starts: Mapping[str, float] = field(default_factory=dict)


_GROUPS = {
    "position_controllers/JointGroupPositionController": Interface.POSITION,
    "velocity_controllers/JointGroupVelocityController": Interface.VELOCITY,
    "effort_controllers/JointGroupEffortController": Interface.EFFORT,
}
_FORWARD = "forward_command_controller/ForwardCommandController"
_TRAJECTORY = "joint_trajectory_controller/JointTrajectoryController"
_OTHERS = (
    "diff_drive_controller",
    "tricycle_controller",
    "tricycle_steering_controller",
    "ackermann_steering_controller",
    "bicycle_steering_controller",
)
"""Packages of what the simulation does by itself, or reads elsewhere; broadcasters are too."""


def joint_control(robot: Robot, driven: tuple[str, ...], findings: Findings) -> JointControl:
    """How the description has its joints commanded, those that are `driven` left out. What it names and the
    robot does not have is said at its line."""
    reader = _Reader(robot, driven, findings)
    controllers = (*reader.of_ros2_control(), *reader.of_plugins())
    known = tuple(controller for controller in controllers if controller.joints)
    held = {j for c in known if c.interface is not Interface.EFFORT for j in c.joints}
    starts = dict(reader.starts())
    return JointControl(known, frozenset(held | reader.hardware_holds()), starts)


class _Reader:
    def __init__(self, robot: Robot, driven: tuple[str, ...], findings: Findings) -> None:
        self.robot, self.findings = robot, findings
        self._free = {j.name for j in robot.movable_joints if j.name not in driven and j.mimic is None}

    def of_ros2_control(self) -> Iterator[JointController]:
        for found in controller_parameters(self.robot, self.findings):
            kind, name, values = found.kind, found.controller, found.values
            joints = self._joints(found)
            if kind == _TRAJECTORY:
                interfaces = _words(values.get("command_interfaces")) or ["position"]
                interface = self._interface(interfaces[0], found)
                if interface is not None:
                    topic = f"{name}/joint_trajectory"
                    yield JointController(name, topic, Input.TRAJECTORY, joints, interface)
            elif kind in _GROUPS or kind == _FORWARD:
                group = _GROUPS.get(kind) or self._interface(values.get("interface_name"), found)
                if group is not None:
                    yield JointController(name, f"{name}/commands", Input.ARRAY, joints, group)
            elif not kind.partition("/")[0].endswith(("_broadcaster", *_OTHERS)):
                self.findings.info("W135", f"the controller '{name}' of type {kind} is not run", found.origin)

    def _interface(self, said: object, found: Parameters) -> Interface | None:
        try:
            return Interface(str(said))
        except ValueError:
            what = f"the controller '{found.controller}' commands '{said}': it is left out"
            self.findings.warning("W130", what, found.origin, f"there are {', '.join(Interface)}")
            return None

    def _joints(self, found: Parameters) -> tuple[str, ...]:
        words = _words(found.values.get("joints"))
        return self._known(words, f"the controller '{found.controller}'", found.origin)

    def _known(self, names: list[str], who: str, origin: Origin) -> tuple[str, ...]:
        for name in names:
            if name not in self.robot.joints:
                self.findings.warning(
                    "W134", f"{who} names the joint '{name}', which the robot does not have", origin,
                    did_you_mean(name, self.robot.joints),
                )  # fmt: skip
        return tuple(name for name in names if name in self._free)

    def of_plugins(self) -> Iterator[JointController]:
        for plugin in _plugins(self.robot):
            kind = _kind(plugin)
            if kind is None:
                continue
            input_, interface, ending = kind
            elements = list(plugin.elements("joint_name"))
            joints: tuple[str, ...] = ()
            for element in elements:
                joints += self._known([element.text.strip()], "the plugin", element.origin)
            if input_ is Input.TRAJECTORY and not elements:
                joints = tuple(j.name for j in self.robot.movable_joints if j.name in self._free)
            said = plugin.find("topic")
            topic = said.text.strip() if said is not None else ""
            if input_ is Input.TRAJECTORY:
                name = plugin.attributes.get("name", "joint_trajectory")
                yield JointController(name, topic or ending, input_, joints, interface)
                continue
            for joint in joints:
                own = topic or f"/model/{self.robot.name}/joint/{joint}/{ending}"
                yield JointController(joint, own, input_, (joint,), interface)

    def hardware_holds(self) -> set[str]:
        """Joints that ros2_control's hardware holds before any controller speaks (`hold_joints` of
        gz_ros2_control)."""
        held = {
            joint.attributes.get("name", "")
            for joint in _hardware_joints(self.robot)
            for command in joint.elements("command_interface")
            if command.attributes.get("name") in ("position", "velocity")
        }
        return held & self._free

    def starts(self) -> Iterator[tuple[str, float]]:
        for joint in _hardware_joints(self.robot):
            for state in joint.elements("state_interface"):
                for parameter in state.elements("param"):
                    named = state.attributes.get("name"), parameter.attributes.get("name")
                    if named == ("position", "initial_value"):
                        yield from self._start(joint.attributes.get("name", ""), parameter)
        for plugin in _plugins(self.robot):
            first = plugin.find("initial_position")
            said = plugin.find("joint_name")
            if _kind(plugin) is not None and first is not None and said is not None:
                yield from self._start(said.text.strip(), first)

    def _start(self, joint: str, element: Element) -> Iterator[tuple[str, float]]:
        if joint not in self._free:
            return
        try:
            value = to_float(element.text)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            yield joint, value
        else:
            message = f"the joint '{joint}' starts at no number: '{element.text.strip()}'"
            self.findings.warning("W130", message, element.origin, "it starts at 0")


def _hardware_joints(robot: Robot) -> Iterator[Element]:
    for extension in robot.extensions:
        if extension.tag == "ros2_control":
            yield from extension.elements("joint")


def _plugins(robot: Robot) -> Iterator[Element]:
    for extension in robot.extensions:
        if extension.tag == "gazebo":
            yield from extension.elements("plugin")


def _kind(plugin: Element) -> tuple[Input, Interface, str] | None:
    """What a plugin hears and commands, and the end of its topic where none is given."""
    words = (plugin.attributes.get("filename", "") + plugin.attributes.get("name", "")).lower()
    words = words.replace("_", "").replace("-", "")
    if "jointposetrajectory" in words:
        return Input.TRAJECTORY, Interface.POSITION, "set_joint_trajectory"
    if "jointtrajectorycontroller" in words:
        return Input.TRAJECTORY, Interface.POSITION, "joint_trajectory"
    if "jointpositioncontroller" in words:
        return Input.NUMBER, Interface.POSITION, "0/cmd_pos"
    if "jointcontroller" in words:
        return Input.NUMBER, Interface.VELOCITY, "cmd_vel"
    return None


def _words(value: object) -> list[str]:
    return [str(word) for word in value] if isinstance(value, list) else []
