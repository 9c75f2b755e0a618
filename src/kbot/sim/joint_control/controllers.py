"""Finds the joint controllers of a robot in ros_control, ros2_control and Gazebo's plugins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import inf, isfinite

from kbot.kinematics.controller_files import (
    JOINT_STATE,
    Parameter,
    Parameters,
    controller_parameters,
    unknown_type,
)
from kbot.kinematics.drive.findings import plugin_findings, unknown_joint
from kbot.kinematics.drive.programs import (
    RATE,
    Program,
    program_of_controller,
    program_of_plugin,
    tags_of,
    words_of,
)
from kbot.model import RobotModel
from kbot.model.extensions import gazebo_plugins, hardware_joints, initial_values
from kbot.sim.joint_control.control import JointControl, JointController
from kbot.sim.joint_control.kinds import (
    KINDS,
    Input,
    Interface,
    Kind,
    is_handled_elsewhere,
)
from kbot.sim.joint_control.plugins import commanded_by
from kbot.sim.joint_control.trajectory_goal import Constraints
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plugin_topics import PluginNames, is_of_gazebo_ros
from kbot.sim.recipe import CONTROL_RATE
from kbot.text import DiagnosticCollector, Element
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean

_INTERFACES = {f"{interface.capitalize()}JointInterface": interface for interface in Interface}


def joint_interfaces(robot: RobotModel, findings: DiagnosticCollector) -> Mapping[str, frozenset[Interface]]:
    """The command interfaces of each joint, from its transmissions.

    As in ROS, commands, states and limits are those of the joint, not of the motor: `<mechanicalReduction>`
    does not change where a joint moves. A reduction that is 0 or not a number is an error, and its joints
    cannot be commanded (transmission_interface::SimpleTransmission).
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
    """The interfaces of the joint. In descriptions from before ROS Indigo its actuators have them."""
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
            what = f"<mechanicalReduction> must be a number other than 0, not '{element.text.strip()}'"
            findings.warning("W130", what, element.origin, "KBot ignores the transmission")
            return False
    return True


def joint_starts(
    robot: RobotModel, free: set[str], findings: DiagnosticCollector
) -> Iterator[tuple[str, float]]:
    """The start positions (rad or m) of the joints in `free`. Invalid values are reported at their line."""
    for joint, element in _start_elements(robot):
        if joint not in free:
            continue
        try:
            value = to_float(element.text)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            yield joint, value
        else:
            message = f"the start position of joint '{joint}' must be a number, not '{element.text.strip()}'"
            findings.warning("W130", message, element.origin, "the joint starts at 0")


def _start_elements(robot: RobotModel) -> Iterator[tuple[str, Element]]:
    """The names of joints, each with the element that gives its start position."""
    yield from initial_values(robot)
    for plugin in gazebo_plugins(robot):
        first = plugin.find("initial_position")
        joint_name = plugin.find("joint_name")
        if commanded_by(plugin) is not None and first is not None and joint_name is not None:
            yield joint_name.text.strip(), first


def joint_control(
    robot: RobotModel, driven: tuple[str, ...], findings: DiagnosticCollector, naming: Naming = ROOT_NAMING
) -> JointControl:
    """Find the joint controllers of a description.

    Joints in `driven` belong to the drive and are not commanded. `naming` has the robot's names in the
    simulation. Names that the robot does not have are reported at their line.
    """
    reader = _Reader(robot, driven, findings, naming)
    controllers = (*reader.of_parameters(), *reader.of_plugins())
    known = tuple(controller for controller in controllers if controller.joints)
    held = {j for c in known if c.is_active and c.interface is not Interface.EFFORT for j in c.joints}
    starts = dict(joint_starts(robot, reader.free, findings))
    return JointControl(known, frozenset(held | reader.hardware_holds()), starts, reader.state_topics)


def joints_of(kind: Kind, found: Parameters) -> list[str]:
    """The names of the joints that a controller commands. The joints need not exist."""
    value = found.values.get(kind.joints)
    return [value] if isinstance(value, str) and value else _words(value)


def spawned_for(robot: RobotModel, joints: Iterable[str]) -> str:
    """The reason why the joints do not drive: a controller was spawned to command one of them. Else empty."""
    for found in controller_parameters(robot, DiagnosticCollector()):
        kind = KINDS[found.ros].get(found.kind)
        if kind is not None and found.is_spawned and found.is_active:
            taken = set(joints_of(kind, found)).intersection(joints)
            if taken:
                return f"the controller {found.controller}, which was spawned, commands '{min(taken)}'"
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
        """Whether the description loads gazebo_ros_control, which runs ROS 1's controller manager."""
        self.state_topics: dict[str, float] = {}
        """The topics of joint states, each with its rate in Hz."""

    def of_parameters(self) -> Iterator[JointController]:
        """The controllers of ros_control and ros2_control."""
        for found in controller_parameters(self.robot, self.findings):
            yield from self._of(found)

    def _of(self, found: Parameters) -> Iterator[JointController]:
        """The joint controller for the parameters of one controller, if KBot runs it."""
        kind = KINDS[found.ros].get(found.kind)
        if found.ros == 1 and not self._has_manager:
            what = f"the controller '{found.controller}' is not loaded: there is no controller manager"
            hint = "add the plugin libgazebo_ros_control.so to the description"
            self.findings.warning("W137", what, found.origin, hint)
        elif kind is not None:
            yield from self._of_kind(kind, found)
        elif found.ros == 2 and (meant := unknown_type(found.kind)) is not None:
            what = (
                f"the controller '{found.controller}' is not loaded: its type '{found.kind}' does not exist"
            )
            self.findings.error("W143", what, found.place(), meant)
        elif is_handled_elsewhere(found.kind):
            self._of_others(found)
        else:
            what = f"KBot does not run the controller '{found.controller}' of type {found.kind}"
            hint = did_you_mean(found.kind, KINDS[found.ros])
            self.findings.info("W135", what, found.place(), hint)

    def _of_others(self, found: Parameters) -> None:
        """Check a controller that does not command single joints. A JointStateController adds a topic."""
        if self._has(found) and found.kind == JOINT_STATE and found.is_active:
            topic = f"{found.controller.rpartition('/')[0]}/joint_states"
            self.state_topics[topic] = self._rate(program_of_controller(found.kind, found.ros), found.given)

    def _of_kind(self, kind: Kind, found: Parameters) -> Iterator[JointController]:
        words = joints_of(kind, found)
        required = {
            name.replace("JOINT", joint): None for name in kind.required for joint in words or ("JOINT",)
        }
        if not self._has(found, *required, *([] if words else [kind.joints])):
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
                why = f"mimics '{mimic.joint}'" if mimic else "drives the robot or cannot move"
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

    def _has(self, found: Parameters, *required: str) -> bool:
        """Whether a controller has the parameters without which ROS's controller does not start."""
        lacking = found.lacking(*required)
        if lacking:
            what = f"the controller '{found.controller}' is not loaded: it lacks {', '.join(lacking)}"
            self.findings.warning("W137", what, found.place(), f"{found.kind} does not start without it")
        return not lacking

    def _is_offered(self, kind: Kind, found: Parameters, joints: tuple[str, ...]) -> bool:
        """Whether transmissions offer the interface that the controller needs for each of its joints."""
        wanted = kind.hardware
        for joint in joints if wanted is not None else ():
            offered = self._offered.get(joint)
            if offered is None or wanted not in offered:
                only = f"only {', '.join(sorted(offered))}" if offered else "no known interface"
                has = "has no transmission" if offered is None else f"has a transmission for {only}"
                what = f"the controller '{found.controller}' is not loaded: it commands the {wanted} of"
                hint = f"<hardwareInterface>hardware_interface/{str(wanted).capitalize()}JointInterface"
                hint = f"write {hint}</hardwareInterface> in the joint's <transmission>"
                self.findings.warning(
                    "W138", f"{what} '{joint}', which {has}", found.place(kind.joints), hint
                )
                return False
        return True

    def _interface(self, kind: Kind, found: Parameters) -> Interface | None:
        if kind.interface is not None:
            return kind.interface
        name: object = found.values.get("interface_name")
        if kind.input is Input.TRAJECTORY:
            name = (_words(found.values.get("command_interfaces")) or ["position"])[0]
        try:
            return Interface(str(name))
        except ValueError:
            what = f"KBot does not run the controller '{found.controller}': unknown interface '{name}'"
            where = found.place("interface_name", "command_interfaces")
            self.findings.warning("W130", what, where, f"choose from {', '.join(Interface)}")
            return None

    def of_plugins(self) -> Iterator[JointController]:
        """The controllers that are plugins of Gazebo."""
        self.findings.diagnostics += plugin_findings(self.robot)
        for plugin in gazebo_plugins(self.robot):
            kind = commanded_by(plugin)
            if "jointstatepublisher" in words_of(plugin):
                tags = tags_of(plugin)
                rate = self._rate(program_of_plugin(words_of(plugin), tags), tags)
                if is_of_gazebo_ros(plugin):
                    topic = PluginNames(plugin, self._naming).topic("joint_states")
                else:
                    topic = tags["topic"].text if "topic" in tags else "joint_states"
                self.state_topics[topic] = rate
            if kind is None:
                continue
            input_, interface, ending = kind
            names = [element.text.strip() for element in plugin.elements("joint_name")]
            joints = tuple(name for name in names if name in self.free)
            if input_ is Input.TRAJECTORY and not names:
                joints = tuple(j.name for j in self.robot.movable_joints if j.name in self.free)
            element = plugin.find("topic") or plugin.find("topicName")
            topic = element.text.strip() if element is not None else ""
            if input_ is Input.TRAJECTORY and is_of_gazebo_ros(plugin):
                topic = PluginNames(plugin, self._naming).topic(topic or ending)
            if input_ is Input.TRAJECTORY:
                name = plugin.attributes.get("name", "joint_trajectory")
                yield JointController(name, topic or ending, input_, joints, interface)
                continue
            for joint in joints:
                own = topic or f"/model/{self.robot.name}/joint/{joint}/{ending}"
                yield JointController(joint, own, input_, (joint,), interface)

    def _rate(self, program: Program | None, given: Mapping[str, Parameter]) -> float:
        """The rate of joint states in Hz, with the default of the plugin or controller if it has one."""
        settings = program.of_role(RATE) if program is not None else ()
        default = float(settings[0].default) if settings and settings[0].default else CONTROL_RATE
        found = next((given[setting.name] for setting in settings if setting.name in given), None)
        if found is None:
            return default
        if found.number is None:
            what = f"{found.name} must be a number, not '{found.text}'"
            self.findings.warning("W130", what, found.origin, f"KBot uses {default:g}")
            return default
        return found.number if found.number > 0.0 else inf

    def hardware_holds(self) -> set[str]:
        """Joints that the hardware holds until a controller commands them.

        gz_ros2_control (`hold_joints`) and gazebo_ros_control hold all joints whose position or velocity can
        be commanded.
        """
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
