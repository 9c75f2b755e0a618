"""Rules that compare plugins, controllers and transmissions with the robot that they name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, reported, rule
from kbot.kinematics.drive.declared import DeclaredDrive
from kbot.kinematics.drive.programs import words_of
from kbot.model import JointType
from kbot.model.extensions import extensions, hardware_joints
from kbot.text import Element, Related, Severity
from kbot.text.suggest import Candidates, did_you_mean


def _gazebo_plugins(context: Context) -> Iterator[Element]:
    """All plugins within `<gazebo>`, also those of sensors."""
    for extension in extensions(context.robot, "gazebo"):
        yield from (e for e in extension.descendants() if e.tag == "plugin")


def _unknown_joints(context: Context, holder: Element, what: str) -> Found:
    joints = context.robot.joints
    for element in holder.elements("joint"):
        name = element.attributes.get("name", "")
        if name and name not in joints and "$" not in name:
            yield Finding(
                element.attribute_origin("name"),
                f"{what} '{holder.attributes.get('name', '')}': '{name}' is not a joint of this robot",
                did_you_mean(name, context.joint_names),
            )


@rule("D101", "plugin-joint-unknown", Severity.ERROR, "robot")
def plugin_joint_unknown(context: Context) -> Found:
    """A plugin or controller names a joint, or a track's link, that the robot does not have.

    Why: The plugin refuses to load ("Joint 'x' not found"), and the robot does not move. KBot drives the
    wheels that it finds, and the message names them.

    Example: `<left_joint>wheel_left_jiont</left_joint>`

    Fix: Name a joint of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    return reported(context.drive_findings, "D101")


@rule("W134", "drive-joint-unknown", Severity.WARNING, "robot")
def drive_joint_unknown(context: Context) -> Found:
    """A drive plugin or controller names a joint that does not turn a drive wheel, or no joint for one side.
    Or it names a track that no `TrackController` turns.

    Why: Outside KBot the robot does not follow its commands. A drive that names a caster's joint turns the
    caster. KBot drives the wheels that it finds, and the message names them.

    Example: `<leftJoint>caster_joint</leftJoint>`

    Fix: Name the joint that turns the wheel. Add a `TrackController` for each track.

    Autofix: none.
    """
    return reported(context.drive_findings, "W134")


@rule("W149", "setting-ignored", Severity.INFO, "robot")
def setting_ignored(context: Context) -> Found:
    """A plugin or controller has a setting that changes what it does, and that KBot ignores.

    Why: Outside KBot the robot behaves differently. A setting with its default value is not reported.

    Example: `<publish_distance>true</publish_distance>`

    Fix: None is needed. docs/reference/plugin-settings.md lists what KBot does with each setting.

    Autofix: none.
    """
    return reported(context.drive_findings, "W149")


@rule("D131", "joint-named-twice", Severity.ERROR, "robot")
def joint_named_twice(context: Context) -> Found:
    """A drive plugin or controller names a joint both as left and as right, or twice on one side.

    Why: If both sides name one joint, its wheel gets two commands, of which the last one wins. The other
    wheel gets none, and the robot runs in circles. `kbot sim` does not drive such a robot. If one side names
    a joint twice, ros2_control does not activate the controller, and gazebo_ros_diff_drive does not start.

    Example: `<leftJoint>left_wheel_joint</leftJoint> <rightJoint>left_wheel_joint</rightJoint>`

    Fix: Name the joint of each wheel once, on its own side.

    Autofix: none.
    """
    return reported(context.drive_findings, "D131")


@rule("D102", "control-joint-unknown", Severity.ERROR, "robot", is_ros_only=True)
def control_joint_unknown(context: Context) -> Found:
    """`<ros2_control>` names a joint that the robot does not have.

    Why: The resource manager throws an exception while it loads the description, and the controller manager
    exits.

    Example: `<ros2_control …> <joint name="left_whele_joint"> …`

    Fix: Name a joint of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    for extension in extensions(context.robot, "ros2_control"):
        yield from _unknown_joints(context, extension, "<ros2_control>")


@rule("D103", "gazebo-reference-unknown", Severity.WARNING, "robot")
def gazebo_reference_unknown(context: Context) -> Found:
    """`<gazebo reference>` names a link or joint that the robot does not have.

    Why: The converter to SDF silently drops everything in the element, for example friction, colour and
    sensors.

    Example: `<gazebo reference="left_whele">`

    Fix: Name a link or joint of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    robot = context.robot
    names = Candidates([*robot.links, *robot.joints])
    for extension in robot.extensions:
        name = extension.attributes.get("reference", "")
        if extension.tag != "gazebo" or not name or name in robot.links or name in robot.joints:
            continue
        what = ", ".join(sorted({f"<{e.tag}>" for e in extension.elements()})[:4]) or "its content"
        yield Finding(
            extension.attribute_origin("reference"),
            f"'{name}' is not a link or joint of this robot: Gazebo drops {what}",
            did_you_mean(name, names),
        )


@rule("D104", "transmission-joint-unknown", Severity.ERROR, "robot", is_ros_only=True)
def transmission_joint_unknown(context: Context) -> Found:
    """A transmission names a joint that the robot does not have.

    Why: ros_control refuses to load the transmission, and every controller of that joint.

    Example: `<transmission …> <joint name="left_whele_joint"> …`

    Fix: Name a joint of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    for extension in context.robot.extensions:
        holders: Iterable[Element] = ()
        if extension.tag == "transmission":
            holders = (extension,)
        elif extension.tag == "ros2_control":
            holders = extension.elements("transmission")
        for holder in holders:
            yield from _unknown_joints(context, holder, "transmission")


@rule("D121", "plugin-frame-unknown", Severity.WARNING, "robot")
def plugin_frame_unknown(context: Context) -> Found:
    """The base frame of a drive plugin or controller is not a link of the robot.

    Why: The plugin publishes a transform from odom to that frame. tf then has two trees, and rviz and
    navigation find no transform between odom and the robot.

    Example: `<robot_base_frame>base_footprnt</robot_base_frame>`

    Fix: Name the robot's root link.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    links = context.robot.links
    for controller in context.declared_drives:
        word = controller.base_frame
        if word is None or not word.text or word.text.lstrip("/") in links or "$" in word.text:
            continue
        if word.text.rsplit("/", 1)[-1] in links:
            continue  # with a tf prefix
        yield Finding(
            word.origin,
            f"{controller.name}: its base frame '{word.text}' is not a link of this robot",
            did_you_mean(word.text, links) or f"the root is '{context.robot.root}'",
        )


@rule("D122", "two-publishers", Severity.WARNING, "robot")
def two_publishers(context: Context) -> Found:
    """Two drives command the same joint, or a plugin publishes the wheels' transforms, as
    robot_state_publisher already does.

    Why: Both publish, and the last message wins. The wheels flicker between two angles, or the robot follows
    only some of the commands. robot_state_publisher publishes the transform of every joint whose state it
    receives. So the plugin's transforms are reported only if something publishes the wheels' states.

    Example: `<publishWheelTF>true</publishWheelTF>`

    Fix: Remove one of the two drives, or set `publishWheelTF` to false.

    Autofix: none.
    """
    owner: dict[str, DeclaredDrive] = {}
    for controller in context.declared_drives:
        for joint in (*controller.left, *controller.right):
            first = owner.setdefault(joint.text, controller)
            if first is not controller and not (first.plugin is None and controller.plugin is None):
                yield Finding(
                    joint.origin,
                    f"'{joint.text}' is driven by '{first.name}' and by '{controller.name}'",
                    "remove one of the two",
                    (Related(f"'{first.name}'", first.origin),),
                )
                break
    for controller in context.declared_drives:
        if controller.publishes_tf and _publishes_states(context):
            place = next((e for e in _plugin_tags(context, ("publishWheelTF", "publish_wheel_tf"))), None)
            tag = place.tag if place else "publishWheelTF"
            yield Finding(
                place.origin if place else controller.origin,
                f"{controller.name} publishes the wheels' transforms, as robot_state_publisher does",
                f"write <{tag}>false</{tag}>",
            )


def _publishes_states(context: Context) -> bool:
    """Whether a drive, a plugin of joint states or ros2_control publishes the states of wheels."""
    if any(controller.publishes_joints is not None for controller in context.declared_drives):
        return True
    words = [words_of(plugin) for plugin in _gazebo_plugins(context)]
    return any(word in text for text in words for word in ("jointstate", "roscontrol", "ros2control"))


def _plugin_tags(context: Context, tags: tuple[str, ...]) -> Iterator[Element]:
    for plugin in _gazebo_plugins(context):
        yield from (e for e in plugin.elements() if e.tag in tags)


@rule("D123", "no-velocity-interface", Severity.WARNING, "drive")
def no_velocity_interface(context: Context) -> Found:
    """A drive wheel in `<ros2_control>` has no velocity command interface.

    Why: diff_drive_controller claims `wheel_joint/velocity` and cannot be configured: "Unable to obtain left
    wheel joint command interface". The robot does not move.

    Example: `<joint name="left_wheel_joint"> <command_interface name="position"/> …`

    Fix: Add `<command_interface name="velocity"/>`.

    Autofix: none.
    """
    wheels = {w.joint.name for w in context.base.wheels if w.joint.type is JointType.CONTINUOUS}
    for joint in hardware_joints(context.robot):
        if joint.attributes.get("name") not in wheels:
            continue
        commands = [c.attributes.get("name", "") for c in joint.elements("command_interface")]
        if "velocity" not in commands:
            has = f"it has {', '.join(commands)}" if commands else "it has none"
            yield Finding(
                joint.attribute_origin("name"),
                f"{joint.attributes.get('name')}: a drive wheel needs a velocity command interface; {has}",
                'add <command_interface name="velocity"/>',
            )
