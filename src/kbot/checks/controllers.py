"""Rules that hold plugins, controllers and transmissions against the robot they speak of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from kbot.checks.context import Context
from kbot.checks.drivers import Driver, Word
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rig import Pair
from kbot.model import JointType
from kbot.text import Element, Origin, Related, Severity
from kbot.text.suggest import did_you_mean

_SEPARATION = re.compile(r"(wheels?_?(separation|track|distance|spacing)|track_?width)", re.IGNORECASE)
_RADIUS = re.compile(r"(drive_?)?wheel_?(radius|diameter)", re.IGNORECASE)
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)


def _gazebo_plugins(context: Context) -> Iterator[Element]:
    for extension in context.robot.extensions:
        if extension.tag == "gazebo":
            yield from (e for e in extension.descendants() if e.tag == "plugin")


@rule("D101", "plugin-joint-unknown", Severity.ERROR, "robot")
def plugin_joint_unknown(context: Context) -> Found:
    """A drive plugin or controller that names a joint the robot lacks.

    Why: the plugin refuses to load ("Joint 'x' not found"), and the robot does not move.

    Example: `<left_joint>wheel_left_jiont</left_joint>`

    Mend: name a joint of this robot.

    Fix: none.
    """
    joints = context.robot.joints
    for driver in context.drivers:
        for side, words in driver.sides.items():
            for word in words:
                if word.text and word.text not in joints:
                    yield Finding(
                        word.origin,
                        f"{driver.name}: its {side} joint '{word.text}' is no joint of this robot: the "
                        "robot does not "
                        "move",
                        did_you_mean(word.text, joints),
                    )
    for plugin in _gazebo_plugins(context):
        for element in plugin.elements():
            if element.tag in ("joint_name", "jointName", "joint") and not element.attributes:
                name = element.text.strip()
                if name and " " not in name and "," not in name and name not in joints:
                    yield Finding(
                        element.origin,
                        f"{plugin.attributes.get('name', 'plugin')}: '{name}' is no joint of this robot",
                        did_you_mean(name, joints),
                    )


@rule("D102", "control-joint-unknown", Severity.ERROR, "robot")
def control_joint_unknown(context: Context) -> Found:
    """A joint within `<ros2_control>` that the robot lacks.

    Why: the resource manager throws while it loads the description, and takes the controller manager with it.

    Example: `<ros2_control …> <joint name="left_whele_joint"> …`

    Mend: name a joint of this robot.

    Fix: none.
    """
    joints = context.robot.joints
    for extension in context.robot.extensions:
        if extension.tag != "ros2_control":
            continue
        for element in extension.elements("joint"):
            name = element.attributes.get("name", "")
            if name and name not in joints and "$" not in name:
                yield Finding(
                    element.attribute_origin("name"),
                    f"<ros2_control> '{extension.attributes.get('name', '')}': '{name}' is no joint of "
                    "this robot",
                    did_you_mean(name, joints),
                )


@rule("D103", "gazebo-reference-unknown", Severity.WARNING, "robot")
def gazebo_reference_unknown(context: Context) -> Found:
    """`<gazebo reference>` of a link or joint that the robot lacks.

    Why: the converter to SDF drops what is in it: friction, colour, sensors and all, without a word.

    Example: `<gazebo reference="left_whele">`

    Mend: name a link or joint of this robot.

    Fix: none.
    """
    robot = context.robot
    for extension in robot.extensions:
        name = extension.attributes.get("reference", "")
        if extension.tag != "gazebo" or not name or name in robot.links or name in robot.joints:
            continue
        what = ", ".join(sorted({f"<{e.tag}>" for e in extension.elements()})[:4]) or "what is in it"
        yield Finding(
            extension.attribute_origin("reference"),
            f"'{name}' is no link or joint of this robot: {what} is dropped",
            did_you_mean(name, [*robot.links, *robot.joints]),
        )


@rule("D104", "transmission-joint-unknown", Severity.ERROR, "robot")
def transmission_joint_unknown(context: Context) -> Found:
    """A transmission of a joint that the robot lacks.

    Why: ros_control refuses to load the transmission, and with it every controller of that joint.

    Example: `<transmission …> <joint name="left_whele_joint"> …`

    Mend: name a joint of this robot.

    Fix: none.
    """
    joints = context.robot.joints
    for extension in context.robot.extensions:
        holders: Iterable[Element] = ()
        if extension.tag == "transmission":
            holders = (extension,)
        elif extension.tag == "ros2_control":
            holders = extension.elements("transmission")
        for holder in holders:
            for element in holder.elements("joint"):
                name = element.attributes.get("name", "")
                if name and name not in joints and "$" not in name:
                    yield Finding(
                        element.attribute_origin("name"),
                        f"transmission '{holder.attributes.get('name', '')}': '{name}' is no joint of "
                        "this robot",
                        did_you_mean(name, joints),
                    )


def _level_pairs(context: Context) -> list[Pair]:
    return [p for p in context.wheels.pairs if p.separation > abs(p.left.center[0] - p.right.center[0])]


def _conventions(pair: Pair) -> list[float]:
    """Distances that are called the wheels' separation: between middles, inner faces, outer faces."""
    width = max(pair.left.width or 0.0, pair.right.width or 0.0)
    return [pair.separation, pair.separation - width, pair.separation + width]


@rule("D105", "separation-differs", Severity.WARNING, "drive")
def separation_differs(context: Context) -> Found:
    """A wheel separation, told to a plugin or controller or kept as a property, that is not the robot's own.

    Why: yaw is reckoned as (right - left) / separation. With 0.15 m for a robot of 0.174 m every turn is
    reported 16 % too large: after one turn odometry is 58 degrees off.

    Example: `<wheelSeparation>0.15</wheelSeparation>` on wheels 0.174 m apart.

    Mend: compute it once, and use it for the joints and the plugin: `${base_width + 2*base_wheel_gap}`.

    Fix: none.
    """
    pairs = _level_pairs(context)
    if not pairs or context.unsure & {w.link for w in context.wheels.wheels}:
        return
    true = pairs[0].separation
    related = _joint_places(pairs[0])
    for driver in context.drivers:
        told, word = driver.separation, driver.separation_word
        if told is None or word is None or told <= 0.0:
            continue
        if len(pairs) > 1 and true <= told <= 2.5 * true:
            continue  # a skid-steer robot is given the track it turns with, which is wider
        if abs(told - true) > max(0.01 * true, 5e-4):
            yield Finding(
                word.origin, f"{driver.name}: " + _apart(told, true), "compute it from the joints", related
            )
    for name, value, origin in _properties(context, _SEPARATION):
        if (
            all(abs(value - d) > 0.01 * true for d in _conventions(pairs[0]))
            and abs(value - true / 2) > 0.01 * true
        ):
            if any(_conventions(p)[0] and abs(value - p.separation) < 0.01 * value for p in pairs):
                continue
            yield Finding(
                origin,
                f"property '{name}': " + _apart(value, true),
                "compute it from what places the joints",
                related,
            )


def _apart(told: float, true: float) -> str:
    return (
        f"the wheels are {true:.4g} m apart from middle to middle, not {told:.4g}: yaw reckoned with it is "
        f"{(true / told - 1.0) * 100.0:+.0f} % off"
    )


def _joint_places(pair: Pair) -> tuple[Related, ...]:
    return tuple(
        Related(f"'{w.joint.name}' at y = {w.center[1]:.4g} m", w.joint.pose.origin or w.joint.origin)
        for w in (pair.left, pair.right)
    )


def _properties(context: Context, name: re.Pattern[str]) -> Iterator[tuple[str, float, Origin]]:
    """Properties of a name whose value is a plain number, set whatever the arguments are."""
    for file in context.sources:
        for element in file.root.elements():
            if element.tag != "xacro:property":
                continue
            own, value = element.attributes.get("name", ""), element.attributes.get("value", "")
            if name.fullmatch(own) and _NUMBER.fullmatch(value) and float(value) > 0.0:
                yield own, float(value), element.origin


@rule("D106", "radius-differs", Severity.WARNING, "drive")
def radius_differs(context: Context) -> Found:
    """A wheel radius or diameter told to a plugin or controller that is not the wheels' own.

    Why: every distance is off by the ratio: with 0.04 for 0.035 m the robot says 1.14 m when it has gone 1 m.

    Example: `<wheelDiameter>0.08</wheelDiameter>` on wheels of radius 0.035 m.

    Mend: use the property that makes the wheels: `${2*wheel_radius}`.

    Fix: none.
    """
    wheels = [w for w in context.wheels.wheels if w.radius]
    if not wheels or context.unsure & {w.link for w in wheels}:
        return
    radii = [w.radius for w in wheels if w.radius]
    related = tuple(Related(f"the shape of '{w.link}'", w.part.origin) for w in wheels[:1] if w.part)
    for driver in context.drivers:
        told, word = driver.radius, driver.radius_word
        if told is None or word is None or told <= 0.0:
            continue
        if all(abs(told - r) > max(0.01 * r, 2e-4) for r in radii):
            true = radii[0]
            yield Finding(
                word.origin,
                f"{driver.name}: it reckons with a wheel radius of {told:.4g} m, the wheels have "
                f"{true:.4g}: distances "
                f"are {(told / true - 1.0) * 100.0:+.0f} % off",
                "use the property that makes the wheels",
                related,
            )
    for name, value, origin in _properties(context, _RADIUS):
        told = value / 2.0 if "diameter" in name.lower() else value
        if all(abs(told - r) > 0.01 * r for r in radii):
            yield Finding(
                origin,
                f"property '{name}': the wheels have a radius of {radii[0]:.4g} m, not {told:.4g}",
                "make the wheels from it",
                related,
            )


@rule("D121", "plugin-frame-unknown", Severity.WARNING, "robot")
def plugin_frame_unknown(context: Context) -> Found:
    """The base frame of a drive plugin or controller is no link of the robot.

    Why: it publishes odom -> that frame beside the robot's own tree: tf has two trees, and rviz and
    navigation find no transform between odom and the robot.

    Example: `<robot_base_frame>base_footprnt</robot_base_frame>`

    Mend: name the robot's root link.

    Fix: none.
    """
    links = context.robot.links
    for driver in context.drivers:
        word = driver.base_frame
        if word is None or not word.text or word.text.lstrip("/") in links or "$" in word.text:
            continue
        if word.text.rsplit("/", 1)[-1] in links:
            continue  # a prefix of tf
        yield Finding(
            word.origin,
            f"{driver.name}: its base frame '{word.text}' is no link of this robot",
            did_you_mean(word.text, links) or f"the root is '{context.robot.root}'",
        )


@rule("D122", "two-publishers", Severity.WARNING, "robot")
def two_publishers(context: Context) -> Found:
    """Two that publish or drive the same: a second drive plugin for the same joints, or wheel transforms
    from a plugin.

    Why: both send, and the last wins: the wheels flicker between two angles, commands are obeyed by half.
    robot_state_publisher publishes every joint's transform already.

    Example: `<publishWheelTF>true</publishWheelTF>`

    Mend: let one of them do it.

    Fix: none.
    """
    owner: dict[str, Driver] = {}
    for driver in context.drivers:
        words: list[Word] = [w for names in driver.sides.values() for w in names]
        for word in words:
            first = owner.setdefault(word.text, driver)
            if first is not driver and {first.kind, driver.kind} != {"ros2_control"}:
                yield Finding(
                    word.origin,
                    f"'{word.text}' is driven by '{first.name}' and by '{driver.name}'",
                    "let one of them drive it",
                    (Related(f"'{first.name}'", first.origin),),
                )
                break
    for driver in context.drivers:
        if driver.publishes_tf:
            place = next((e for e in _plugin_tags(context, ("publishWheelTF", "publish_wheel_tf"))), None)
            yield Finding(
                place.origin if place else driver.origin,
                f"{driver.name} publishes the wheels' transforms, and so does robot_state_publisher",
                "publishWheelTF false",
            )


def _plugin_tags(context: Context, tags: tuple[str, ...]) -> Iterator[Element]:
    for plugin in _gazebo_plugins(context):
        yield from (e for e in plugin.elements() if e.tag in tags)


@rule("D123", "no-velocity-interface", Severity.WARNING, "drive")
def no_velocity_interface(context: Context) -> Found:
    """A drive wheel within `<ros2_control>` that has no velocity command interface.

    Why: diff_drive_controller claims `wheel_joint/velocity` and cannot be configured: "Unable to obtain
    left wheel joint command interface". The robot does not move.

    Example: `<joint name="left_wheel_joint"> <command_interface name="position"/> …`

    Mend: `<command_interface name="velocity"/>`.

    Fix: none.
    """
    wheels = {w.joint.name for w in context.wheels.wheels if w.joint.type is JointType.CONTINUOUS}
    for extension in context.robot.extensions:
        if extension.tag != "ros2_control":
            continue
        for joint in extension.elements("joint"):
            if joint.attributes.get("name") not in wheels:
                continue
            commands = [c.attributes.get("name", "") for c in joint.elements("command_interface")]
            if "velocity" not in commands:
                has = f"it has {', '.join(commands)}" if commands else "it has none"
                yield Finding(
                    joint.attribute_origin("name"),
                    f"{joint.attributes.get('name')}: a drive wheel needs a velocity command "
                    f"interface; {has}",
                    'add <command_interface name="velocity"/>',
                )
