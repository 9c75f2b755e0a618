"""Finds the joint controllers of a robot: of ros_control, ros2_control and Gazebo's plugins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import isfinite

from kbot.kinematics.controller_files import (
    JOINT_STATE,
    Parameters,
    controller_parameters,
    unknown_type,
)
from kbot.kinematics.drive.declared import words_of
from kbot.kinematics.drive.findings import plugin_findings, unknown_joint
from kbot.model import RobotModel
from kbot.model.extensions import gazebo_plugins, hardware_joints, initial_values
from kbot.sim.joint_control.control import JointControl, JointController
from kbot.sim.joint_control.kinds import (
    KINDS,
    Input,
    Interface,
    Kind,
    is_done_elsewhere,
)
from kbot.sim.joint_control.plugins import commanded_by
from kbot.sim.joint_control.trajectory_goal import Constraints
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plugin_topics import PluginNames, is_of_gazebo_ros
from kbot.text import DiagnosticCollector, Element
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean

_INTERFACES = {f"{interface.capitalize()}JointInterface": interface for interface in Interface}


def joint_interfaces(robot: RobotModel, findings: DiagnosticCollector) -> Mapping[str, frozenset[Interface]]:
    """By joint, what a controller may command of it.

    Commands, states and limits are the joint's, on the far side of the gear, as in ROS: whatever
    `<mechanicalReduction>` a transmission has, the joint goes where it is told. One that is no number, or
    0, is none, and its joints cannot be commanded (transmission_interface::SimpleTransmission).
    """
    found: dict[str, frozenset[Interface]] = {}
    for transmission in robot.extensions:
        if transmission.tag != "transmission" or not _has_gear(transmission, findings):
            continue
        for joint in transmission.elements("joint"):
            name = joint.attributes.get("name", "")
            found[name] = found.get(name, frozenset()) | set(_interfaces(joint, transmission))
    return found


def _interfaces(joint: Element, transmission: Element) -> Iterator[Interface]:
    """Those of the joint; of its actuators in descriptions from before Indigo."""
    for holder in (joint, *transmission.elements("actuator")):
        written = [element.text.strip() for element in holder.elements("hardwareInterface")]
        known = [i for word in written if (i := _INTERFACES.get(word.rpartition("/")[2]))]
        if known:
            yield from known
            return


def _has_gear(transmission: Element, findings: DiagnosticCollector) -> bool:
    for element in transmission.descendants():
        if element.tag != "mechanicalReduction":
            continue
        try:
            reduction = to_float(element.text)
        except ValueError:
            reduction = 0.0
        if not isfinite(reduction) or reduction == 0.0:
            what = f"a reduction is a number other than 0, not '{element.text.strip()}'"
            findings.warning("W130", what, element.origin, "the transmission is left out")
            return False
    return True


def joint_starts(
    robot: RobotModel, free: set[str], findings: DiagnosticCollector
) -> Iterator[tuple[str, float]]:
    """Joints that are `free` to be commanded, and their first positions in rad or m; what is no number is
    said at its line."""
    for joint, element in _said(robot):
        if joint not in free:
            continue
        try:
            value = to_float(element.text)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            yield joint, value
        else:
            message = f"the joint '{joint}' starts at no number: '{element.text.strip()}'"
            findings.warning("W130", message, element.origin, "it starts at 0")


def _said(robot: RobotModel) -> Iterator[tuple[str, Element]]:
    """The names of joints, and what says where each starts."""
    yield from initial_values(robot)
    for plugin in gazebo_plugins(robot):
        first = plugin.find("initial_position")
        said = plugin.find("joint_name")
        if commanded_by(plugin) is not None and first is not None and said is not None:
            yield said.text.strip(), first


def joint_control(
    robot: RobotModel, driven: tuple[str, ...], findings: DiagnosticCollector, naming: Naming = ROOT_NAMING
) -> JointControl:
    """How the description has its joints commanded, those that are `driven` left out, of a robot that the
    simulation calls `naming`. What it names and the robot does not have is said at its line."""
    reader = _Reader(robot, driven, findings, naming)
    controllers = (*reader.of_parameters(), *reader.of_plugins())
    known = tuple(controller for controller in controllers if controller.joints)
    held = {j for c in known if c.is_active and c.interface is not Interface.EFFORT for j in c.joints}
    starts = dict(joint_starts(robot, reader.free, findings))
    return JointControl(known, frozenset(held | reader.hardware_holds()), starts, tuple(reader.state_topics))


def joints_of(kind: Kind, found: Parameters) -> list[str]:
    """The names of the joints that a controller commands, whether there are such or not."""
    said = found.values.get(kind.joints)
    return [said] if isinstance(said, str) and said else _words(said)


def spawned_for(robot: RobotModel, joints: Iterable[str]) -> str:
    """Why joints that would drive do not: a controller was spawned to command one of them; else empty."""
    for found in controller_parameters(robot, DiagnosticCollector()):
        kind = KINDS[found.ros].get(found.kind)
        if kind is not None and found.is_spawned and found.is_active:
            taken = set(joints_of(kind, found)).intersection(joints)
            if taken:
                return f"the controller {found.controller} was spawned to command '{min(taken)}'"
    return ""


class _Reader:
    def __init__(
        self, robot: RobotModel, driven: tuple[str, ...], findings: DiagnosticCollector, naming: Naming
    ) -> None:
        self.robot, self.findings, self._naming = robot, findings, naming
        self.free = {j.name for j in robot.movable_joints if j.name not in driven and j.mimic is None}
        """The joints that controllers may command."""
        self._offered = joint_interfaces(robot, findings)
        self._has_manager = any("gazeboroscontrol" in words_of(plugin) for plugin in gazebo_plugins(robot))
        """Whether gazebo_ros_control runs ROS 1's controller manager."""
        self.state_topics: list[str] = []

    def of_parameters(self) -> Iterator[JointController]:
        """Those of ros_control and ros2_control."""
        for found in controller_parameters(self.robot, self.findings):
            yield from self._of(found)

    def _of(self, found: Parameters) -> Iterator[JointController]:
        """What one controller commands of joints."""
        kind = KINDS[found.ros].get(found.kind)
        if found.ros == 1 and not self._has_manager:
            what = f"nothing loads the controller '{found.controller}': there is no controller manager"
            hint = "the description needs the plugin libgazebo_ros_control.so"
            self.findings.warning("W137", what, found.origin, hint)
        elif kind is not None:
            yield from self._of_kind(kind, found)
        elif found.ros == 2 and (meant := unknown_type(found.kind)) is not None:
            what = f"the controller '{found.controller}' is not loaded: there is no type '{found.kind}'"
            self.findings.error("W143", what, found.place(), meant)
        elif is_done_elsewhere(found.kind):
            self._of_others(found)
        else:
            said = f"the controller '{found.controller}' of type {found.kind} is not run"
            hint = did_you_mean(found.kind, KINDS[found.ros])
            self.findings.info("W135", said, found.place(), hint)

    def _of_others(self, found: Parameters) -> None:
        """Controllers that do not command single joints: of these, one publishes joint states."""
        if self._has(found) and found.kind == JOINT_STATE and found.is_active:
            self.state_topics.append(f"{found.controller.rpartition('/')[0]}/joint_states")

    def _of_kind(self, kind: Kind, found: Parameters) -> Iterator[JointController]:
        words = joints_of(kind, found)
        needed = {
            name.replace("JOINT", joint): None for name in kind.required for joint in words or ("JOINT",)
        }
        if not self._has(found, *needed, *([] if words else [kind.joints])):
            return
        interface = self._interface(kind, found)
        place = found.place(kind.joints)
        self.findings.diagnostics += (
            unknown_joint(self.robot, found.controller, word, place)
            for word in words
            if word not in self.robot.joints
        )
        joints = tuple(word for word in words if word in self.free)
        if interface is None or (found.is_spawned and not all(word in self.robot.joints for word in words)):
            return
        if found.ros == 1 and not self._is_offered(kind, found, joints):
            return
        for word in words if found.is_spawned else ():
            if word in self.robot.joints and word not in joints:
                mimic = self.robot.joints[word].mimic
                why = f"follows '{mimic.joint}'" if mimic else "drives the robot or cannot move"
                what = f"the controller '{found.controller}' does not command '{word}', which {why}"
                self.findings.info("W135", what, found.place(kind.joints))
        topic = f"{found.controller}/{kind.topic}"
        has_action = found.ros == 1 and kind.input is Input.TRAJECTORY
        yield JointController(
            found.controller,
            topic,
            kind.input,
            joints,
            interface,
            found.is_active,
            found.values.get("allow_partial_joints_goal") is True,
            Constraints.of(found.values, joints) if has_action else None,
        )

    def _has(self, found: Parameters, *needed: str) -> bool:
        """Whether a controller has what its namesake does not start without."""
        lacking = found.lacking(*needed)
        if lacking:
            what = f"the controller '{found.controller}' lacks {', '.join(lacking)}: it is not loaded"
            self.findings.warning("W137", what, found.place(), f"without that no {found.kind} starts")
        return not lacking

    def _is_offered(self, kind: Kind, found: Parameters, joints: tuple[str, ...]) -> bool:
        """Whether a transmission gives the controller what it commands of each of its joints."""
        wanted = kind.hardware
        for joint in joints if wanted is not None else ():
            offered = self._offered.get(joint)
            if offered is None or wanted not in offered:
                has = "no transmission" if offered is None else f"none but {', '.join(sorted(offered))}"
                what = f"the controller '{found.controller}' commands the {wanted} of '{joint}'"
                hint = f"<hardwareInterface>hardware_interface/{str(wanted).capitalize()}JointInterface"
                hint = f"write {hint}</hardwareInterface> in the joint's <transmission>"
                self.findings.warning(
                    "W138", f"{what}, which has {has}: it is not loaded", found.place(kind.joints), hint
                )
                return False
        return True

    def _interface(self, kind: Kind, found: Parameters) -> Interface | None:
        if kind.interface is not None:
            return kind.interface
        said: object = found.values.get("interface_name")
        if kind.input is Input.TRAJECTORY:
            said = (_words(found.values.get("command_interfaces")) or ["position"])[0]
        try:
            return Interface(str(said))
        except ValueError:
            what = f"the controller '{found.controller}' commands '{said}': it is left out"
            where = found.place("interface_name", "command_interfaces")
            self.findings.warning("W130", what, where, f"there are {', '.join(Interface)}")
            return None

    def of_plugins(self) -> Iterator[JointController]:
        self.findings.diagnostics += plugin_findings(self.robot)
        for plugin in gazebo_plugins(self.robot):
            kind = commanded_by(plugin)
            if is_of_gazebo_ros(plugin) and "jointstatepublisher" in words_of(plugin):
                self.state_topics.append(PluginNames(plugin, self._naming).topic("joint_states"))
            if kind is None:
                continue
            input_, interface, ending = kind
            names = [element.text.strip() for element in plugin.elements("joint_name")]
            joints = tuple(name for name in names if name in self.free)
            if input_ is Input.TRAJECTORY and not names:
                joints = tuple(j.name for j in self.robot.movable_joints if j.name in self.free)
            said = plugin.find("topic") or plugin.find("topicName")
            topic = said.text.strip() if said is not None else ""
            if input_ is Input.TRAJECTORY and is_of_gazebo_ros(plugin):
                topic = PluginNames(plugin, self._naming).topic(topic or ending)
            if input_ is Input.TRAJECTORY:
                name = plugin.attributes.get("name", "joint_trajectory")
                yield JointController(name, topic or ending, input_, joints, interface)
                continue
            for joint in joints:
                own = topic or f"/model/{self.robot.name}/joint/{joint}/{ending}"
                yield JointController(joint, own, input_, (joint,), interface)

    def hardware_holds(self) -> set[str]:
        """Joints that the hardware holds before any controller speaks, as gz_ros2_control (`hold_joints`) and
        gazebo_ros_control do: all whose position or speed can be commanded."""
        held = {
            joint.attributes.get("name", "")
            for joint in hardware_joints(self.robot)
            for command in joint.elements("command_interface")
            if command.attributes.get("name") in ("position", "velocity")
        }
        if self._has_manager:
            held |= {joint for joint, offered in self._offered.items() if offered - {Interface.EFFORT}}
        return held & self.free


def _words(value: object) -> list[str]:
    return [str(word) for word in value] if isinstance(value, list) else []
