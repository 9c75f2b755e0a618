"""Faults of plugins and controllers that drive a robot, as `kbot check` and `kbot sim` report them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import degrees
from typing import NamedTuple

import numpy as np

from kbot.kinematics.controller_files import Parameter
from kbot.kinematics.drive.declared import (
    DIAMETER,
    SIDE_MULTIPLIERS,
    DeclaredDrive,
    Holonomic,
    Size,
    declared_drives,
    track_controllers,
)
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.kinematics.drive.part_names import side_of
from kbot.kinematics.drive.wheels import Array, Pair, Wheel
from kbot.kinematics.frames import FrameTree
from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.text import Diagnostic, Edit, Element, Fix, Origin, Related, Severity
from kbot.text.numbers import NUMBER
from kbot.text.suggest import did_you_mean

UNEQUAL = 0.002
"""Share by which the radii of wheels may differ (D106, D111). With this difference a robot with a track of 17
cm drives a circle of 85 m radius."""
_AHEAD = 0.9
"""Least component along x of the direction in which a robot drives, 25 degrees off (D132)."""
EXCHANGE_PLACES = "y points left: swap the signs of the wheels' y coordinates"
_JOINT_TAGS = ("joint_name", "jointName", "joint")
"""Tags with which plugins name a joint."""


def wheel_pairs(tree: FrameTree, drive: DifferentialDrive) -> tuple[Pair, ...]:
    """Pairs of a drive's wheels, left and right by their position, front to rear. They are in the root's
    frame, rotated so that the robot drives along x."""
    root_from_base, base_from_axle = tree.pose(drive.base), drive.axle_in_base
    root_from_axle = root_from_base.rotation @ base_from_axle.rotation
    sides: tuple[list[Wheel], list[Wheel]] = [], []
    for name in (*drive.left, *drive.right):
        wheel = drive.wheels[name]
        is_left = base_from_axle.inverse().apply(wheel.center)[1] > 0.0
        center = root_from_axle.T @ root_from_base.apply(wheel.center)
        axis = base_from_axle.rotation.T @ wheel.axis
        sides[0 if is_left else 1].append(replace(wheel, center=center, axis=axis))
    for side in sides:
        side.sort(key=lambda wheel: -wheel.center[0])
    return tuple(Pair(left, right) for left, right in zip(*sides, strict=False))


def findings_of_drive(robot: RobotModel, drive: DifferentialDrive | NoDrive) -> tuple[Diagnostic, ...]:
    """Faults of the plugins and controllers of a robot, given the drive that `find_drive` found."""
    pairs = wheel_pairs(FrameTree(robot), drive) if isinstance(drive, DifferentialDrive) else ()
    return tuple(drive_findings(robot, declared_drives(robot), drive, pairs))


def drive_findings(
    robot: RobotModel,
    controllers: Sequence[DeclaredDrive],
    drive: DifferentialDrive | NoDrive | None,
    pairs: Sequence[Pair],
) -> Iterator[Diagnostic]:
    """Faults of plugins and controllers, compared with the driving wheels.

    `drive` is what KBot drives, or None if that is unknown.
    """
    for controller in controllers:
        yield from _unknown_wheels(robot, controller)
        if controller.holonomic is Holonomic.TRACKS:
            yield from _tracks(robot, controller)
    sided = [controller for controller in controllers if controller.has_sides]
    yield from _named_joints(robot, sided, drive)
    if isinstance(drive, DifferentialDrive) and not isinstance(drive, HolonomicDrive):
        yield from _sideways(drive)
    for controller in sided:
        yield from _named_twice(controller)
        yield from _exchanged(controller, pairs)
    named = {joint.text for c in sided for joint in (*c.left, *c.right)}
    yield from axis_faults([p for p in pairs if {p.left.joint.name, p.right.joint.name} & named])
    wheels = [wheel for pair in pairs for wheel in pair.wheels]
    if isinstance(drive, HolonomicDrive):
        wheels = list(drive.wheels.values())
    if isinstance(drive, SteeredDrive):
        wheels = [drive.wheels[name] for name in drive.joints]
    for controller in controllers:
        yield from _separation(controller, pairs)
        if isinstance(drive, SteeredDrive):
            yield from _distance(controller, controller.wheelbase, drive.wheelbase, "the axles")
        if isinstance(drive, HolonomicDrive) and drive.kind is controller.holonomic is Holonomic.TRACKS:
            middles = "the middles of the tracks"
            yield from _distance(controller, controller.separation, drive.separation, middles)
        elif isinstance(drive, HolonomicDrive) and drive.kind is controller.holonomic:
            yield from _span(controller, drive)
        yield from _radius(controller, [wheel for wheel in wheels if wheel.radius])


def plugin_findings(robot: RobotModel) -> Iterator[Diagnostic]:
    """D101 of the joints that other plugins name, including those of sensors."""
    for extension in extensions(robot, "gazebo"):
        for plugin in extension.descendants():
            if plugin.tag == "plugin":
                yield from _joints_of_plugin(robot, plugin)


def unknown_joint(robot: RobotModel, name: str, joint: str, origin: Origin) -> Diagnostic:
    """D101 of a plugin or controller that is not a drive."""
    message = f"{name}: '{joint}' is not a joint of this robot"
    return Diagnostic("D101", Severity.ERROR, message, origin, did_you_mean(joint, robot.joints))


def _joints_of_plugin(robot: RobotModel, plugin: Element) -> Iterator[Diagnostic]:
    for element in plugin.elements():
        if element.tag not in _JOINT_TAGS:
            continue
        name = element.text.strip()
        is_name = not element.attributes and name and not {" ", ","} & {*name}
        if is_name and name not in robot.joints:
            yield unknown_joint(robot, plugin.attributes.get("name", "plugin"), name, element.origin)


def _unknown_wheels(robot: RobotModel, controller: DeclaredDrive) -> Iterator[Diagnostic]:
    """D101 of the wheels of a holonomic drive."""
    for wheel in controller.wheels:
        if wheel.text not in robot.joints:
            yield unknown_joint(robot, controller.name, wheel.text, wheel.origin)


def _tracks(robot: RobotModel, controller: DeclaredDrive) -> Iterator[Diagnostic]:
    """D101 and W134: tracks that are not links, and those whose belt no plugin turns."""
    turning = track_controllers(robot)
    for track in (*controller.left, *controller.right):
        if track.text not in robot.links:
            message = f"{controller.name}: '{track.text}' is not a link of this robot"
            hint = did_you_mean(track.text, robot.links)
            yield Diagnostic("D101", Severity.ERROR, message, track.origin, hint)
        elif track.text not in turning:
            message = f"no TrackController turns the track '{track.text}': outside KBot it does not drive"
            add = "add the plugin gz::sim::systems::TrackController for this link"
            yield Diagnostic("W134", Severity.WARNING, f"{controller.name}: {message}", track.origin, add)


def _named_joints(
    robot: RobotModel, controllers: Sequence[DeclaredDrive], drive: DifferentialDrive | NoDrive | None
) -> Iterator[Diagnostic]:
    """D101 and W134: joints that the robot does not have or that do not turn a driving wheel, and sides
    without a joint."""
    driving, sides = (drive.joints, drive.sides) if isinstance(drive, DifferentialDrive) else ((), {})
    named = {joint.text for c in controllers for joint in (*c.left, *c.right)}
    free = [joint for joint in driving if joint not in named]
    for controller, side, name, origin in _every_name(robot, controllers):
        own = [joint for joint in free if joint in sides.get(side, ())]
        instead = " and ".join(f"'{joint}'" for joint in own or free)
        hint = f"name the joint that turns the {side} wheel: {instead}" if instead else ""
        if name and name not in robot.joints:
            message = f"{controller.name}: its {side} joint '{name}' is not a joint of this robot"
            message += ": outside KBot the robot does not drive"
            message += f"; KBot drives {instead} instead" if instead else ""
            hint = did_you_mean(name, robot.joints) or hint
            yield Diagnostic("D101", Severity.ERROR, message, origin, hint)
        elif drive is not None and (not name or (driving and name not in driving)):
            message = (
                f"the drive names the joint '{name}', which is not a driving wheel's joint"
                if name
                else f"the drive does not name a {side} joint"
            )
            if instead:
                message += f": outside KBot the robot does not drive like this; KBot drives {instead} instead"
            elif name:
                message += ": KBot does not drive it"
            yield Diagnostic("W134", Severity.WARNING, message, origin, hint)


def _every_name(
    robot: RobotModel, controllers: Iterable[DeclaredDrive]
) -> Iterator[tuple[DeclaredDrive, str, str, Origin]]:
    """Each joint that a controller names, with its side and place.

    The name is empty for an empty tag, and for a side without a tag or parameter.
    """
    for controller in controllers:
        for side, joints in controller.sides.items():
            yield from ((controller, side, joint.text, joint.origin) for joint in joints)
            # gazebo_ros_diff_drive and gazebo_ros_skid_steer_drive have these names as defaults
            defaults = {f"{side}_joint", f"{side}_front_joint"} if controller.plugin is not None else set()
            if not joints and controller.is_running and defaults.isdisjoint(robot.joints):
                yield controller, side, "", controller.place(side)


def _named_twice(controller: DeclaredDrive) -> Iterator[Diagnostic]:
    """D131 of a joint that a controller names twice."""
    first: dict[str, tuple[str, Parameter]] = {}
    for side, joints in controller.sides.items():
        for joint in joints:
            before, place = first.setdefault(joint.text, (side, joint))
            if joint.text and place is not joint:
                twice = f"twice as {side}" if side == before else "both as left and as right"
                yield Diagnostic(
                    "D131",
                    Severity.ERROR,
                    f"{controller.name}: it names the joint '{joint.text}' {twice}: the robot does not drive",
                    joint.origin,
                    "name the joint of each wheel once, on its own side",
                    (Related("named here first", place.origin),),
                )


def _exchanged(controller: DeclaredDrive, pairs: Iterable[Pair]) -> Iterator[Diagnostic]:
    """D107 of a joint that is named left and whose wheel is on the right."""
    wheels = {wheel.joint.name: wheel for pair in pairs for wheel in pair.wheels}
    for left_name, right_name in zip(controller.left, controller.right, strict=False):
        left, right = wheels.get(left_name.text), wheels.get(right_name.text)
        if left is None or right is None or not left.center[1] < right.center[1]:
            continue
        # exchanged names would hide that the wheels themselves are on the wrong sides
        are_misplaced = side_of(left_name.text) == "left" and side_of(right_name.text) == "right"
        names = (left_name, right_name)
        tags = [f"<{p.name}>" if controller.plugin is not None else p.name for p in names]
        yield Diagnostic(
            "D107",
            Severity.WARNING,
            f"{controller.name}: its left joint '{left_name.text}' turns the wheel at y = "
            f"{left.center[1] * 1e3:.4g} mm, on the right: turns are reversed",
            left_name.origin,
            EXCHANGE_PLACES if are_misplaced else f"swap the names in {tags[0]} and {tags[1]}",
            (Related(f"'{left_name.text}'", left.joint.pose.origin or left.joint.origin),),
        )


def _sideways(drive: DifferentialDrive) -> Iterator[Diagnostic]:
    """D132."""
    ahead = drive.axle_in_base.rotation[:, 0]
    if ahead[0] > _AHEAD:
        return
    wheel = next(iter(drive.wheels.values()))
    angle = f"{-degrees(drive.axle_in_base.yaw):.0f} degrees about z"
    yield Diagnostic(
        "D132",
        Severity.WARNING,
        f"the wheels roll along {_direction(ahead)} of '{drive.base}': the robot drives there, but commands "
        "and odometry mean +x",
        wheel.joint.pose.origin or wheel.joint.origin,
        f"turn the wheels by {angle}, or the whole robot below a new base link",
    )


def axis_faults(pairs: Iterable[Pair]) -> Iterator[Diagnostic]:
    """D108 of two axes in opposite directions, D109 of two that point to the right."""
    for pair in pairs:
        left, right = pair.left, pair.right
        if left.axis @ right.axis < -0.5:
            wrong, other = (left, right) if left.axis[1] < 0.0 else (right, left)
            yield Diagnostic(
                "D108",
                Severity.WARNING,
                f"{wrong.joint.name}: its axis points along {_direction(wrong.axis)} of the base, the axis "
                f"of '{other.joint.name}' along {_direction(other.axis)}: equal speeds turn the robot on the "
                "spot",
                _axis_origin(wrong),
                "let both axes point along +y",
                (Related(f"the axis of '{other.joint.name}'", _axis_origin(other)),),
            )
        elif left.axis[1] < -0.5 and right.axis[1] < -0.5:
            # also at the right wheel if one macro made both, which shows that the fault is the macro's
            is_shared = _axis_origin(left).span == _axis_origin(right).span
            for wheel in (left, right) if is_shared else (left,):
                yield Diagnostic(
                    "D109",
                    Severity.WARNING,
                    f"{wheel.joint.name}: the axes of both wheels point along -y of the base: a positive "
                    "speed drives backwards",
                    _axis_origin(wheel),
                    "let both axes point along +y",
                )


def _axis_origin(wheel: Wheel) -> Origin:
    return wheel.joint.axis_origin or wheel.joint.origin


def _direction(axis: Array) -> str:
    """The direction of a unit vector (3,): the name of a coordinate axis if it is near one, else its
    components."""
    for i, name in enumerate("xyz"):
        if abs(axis[i]) > 0.98:
            return ("-" if axis[i] < 0.0 else "+") + name
    return "(" + ", ".join(f"{v:.2g}" for v in axis) + ")"


def _separation(controller: DeclaredDrive, pairs: Sequence[Pair]) -> Iterator[Diagnostic]:
    """D105."""
    size = controller.separation
    if size is None or size.value <= 0.0 or not pairs:
        return
    given, true = size.value, pairs[0].separation
    is_skid_steer = len(pairs) > 1
    if is_skid_steer and true <= given <= 2.5 * true:
        return  # a skid-steer robot needs the wider separation with which it turns
    if _differs(given, true):
        cause = _cause(size, true, "compute it from the joints")
        off = separation_is_off(given, true)
        if is_skid_steer:
            hint = f"a robot that turns by skidding needs at least {true:.4g}: measure a turn"
            cause = cause._replace(hint=hint, fix=None)
        message = f"{controller.name}: {cause.what}{off}"
        yield Diagnostic(
            "D105", Severity.WARNING, message, cause.place, cause.hint, joint_places(pairs[0]), cause.fix
        )


class _Cause(NamedTuple):
    """The parameter that makes a size wrong: where it is, words for the message, the hint and a fix."""

    place: Origin
    what: str
    hint: str
    fix: Fix | None


def _cause(size: Size, true: float, otherwise: str = "") -> _Cause:
    """Which parameter makes a size wrong that must be `true` m: its multiplier, or the size itself.

    `otherwise` is what can be done instead of writing the size."""
    factor = next((factor for factor in size.factors if factor.number != 1.0), None)
    if factor is not None and not _differs(size.given.number or 0.0, true):
        hint = f"write 1, unless it was measured on the real robot: {size.given.name} is right"
        return _Cause(factor.origin, f"{factor.name} is {factor.text}: ", hint, _written((factor, "1.0")))
    values = [(size.given, f"{true:.6g}"), *([(factor, "1.0")] if factor is not None else [])]
    fix = _written(*values)
    right = f"write {true:.6g}" + (f" and 1 for {factor.name}" if factor is not None else "")
    hint = ", or ".join([right, otherwise] if otherwise and fix is not None else [otherwise or right])
    return _Cause(size.given.origin, "", hint, fix)


def _written(*values: tuple[Parameter, str]) -> Fix | None:
    """The fix that writes these values. None if one of the parameters is not written as a plain number."""
    spans = [given.origin.span for given, _ in values]
    if not all(NUMBER.fullmatch(span.text) for span in spans):
        return None
    edits = tuple(Edit(span, text) for span, (_, text) in zip(spans, values, strict=True))
    return Fix("write " + " and ".join(text for _, text in values), edits, safe=False)


def _distance(controller: DeclaredDrive, size: Size | None, true: float, what: str) -> Iterator[Diagnostic]:
    """D105 of tracks, and of the axles of a car or tricycle, from which its steering angles are computed."""
    if size is None or size.value <= 0.0 or not _differs(size.value, true):
        return
    cause = _cause(size, true)
    message = (
        f"{controller.name}: {cause.what}{what} are {true:.4g} m apart, not {size.value:.4g}: turns are "
        f"{(size.value / true - 1.0) * 100.0:+.0f} % off"
    )
    yield Diagnostic("D105", Severity.WARNING, message, cause.place, cause.hint)


def _span(controller: DeclaredDrive, drive: HolonomicDrive) -> Iterator[Diagnostic]:
    """D105 of mecanum and omni wheels."""
    size, true = controller.span, drive.separation
    if size is None or size.value <= 0.0 or not _differs(size.value, true):
        return
    is_omni = controller.holonomic is Holonomic.OMNI
    what = (
        "the wheels are {} m from their middle"
        if is_omni
        else "the wheels' distances along x and y add up to {} m"
    )
    share = 0.5 if is_omni else 1.0
    message = (
        f"{controller.name}: {what.format(f'{true * share:.4g}')}, not {size.value * share:.4g}: turns are "
        f"{(size.value / true - 1.0) * 100.0:+.0f} % off"
    )
    hint = "compute the sizes from the positions of the wheels' joints"
    spans, given = controller.spans, size.given
    if spans is not None and size.given is spans[0].given:
        wrong, distance = _most_wrong(spans, drive)
        given = wrong.given
        factors = [factor for factor in wrong.factors if factor.number != 1.0]
        if factors and not _differs(given.number or 0.0, distance):
            given, hint = factors[0], f"write 1: {given.name} is right"
    yield Diagnostic("D105", Severity.WARNING, message, given.origin, hint)


def _most_wrong(spans: tuple[Size, Size], drive: HolonomicDrive) -> tuple[Size, float]:
    """That of the distances between mecanum wheels along x and along y which differs most, and the right one
    in m."""
    centers = np.array([wheel.center[:2] for wheel in drive.wheels.values()])
    true = 2.0 * np.abs(centers - centers.mean(axis=0)).mean(axis=0)
    off = [abs(size.value - distance) for size, distance in zip(spans, true, strict=True)]
    index = int(np.argmax(off))
    return spans[index], float(true[index])


def _differs(given: float, true: float) -> bool:
    """Whether a distance in m is wrong, and not only rounded: by 1 %, and by half a millimetre."""
    return abs(given - true) > max(0.01 * true, 5e-4)


def separation_is_off(given: float, true: float) -> str:
    """The message for a wheel separation in m that differs from the robot's."""
    return (
        f"the wheel centres are {true:.4g} m apart, not {given:.4g}: yaw computed with {given:.4g} is "
        f"{(true / given - 1.0) * 100.0:+.0f} % off"
    )


def joint_places(pair: Pair) -> tuple[Related, ...]:
    """Where the positions of the joints of two wheels are written."""
    return tuple(
        Related(f"'{w.joint.name}' at y = {w.center[1]:.4g} m", w.joint.pose.origin or w.joint.origin)
        for w in pair.wheels
    )


def _radius(controller: DeclaredDrive, wheels: Sequence[Wheel]) -> Iterator[Diagnostic]:
    """D106. If the wheels differ, the message names both radii, because no wheel has their mean."""
    size = controller.radius
    if size is None or size.value <= 0.0 or not wheels:
        return
    if any(factor.number != 1.0 for factor in size.factors):
        wrong = list(_wrong_multipliers(controller, size, wheels))
        yield from (finding for finding in wrong if finding is not None)
        if None not in wrong:
            return
    given, true = size.value, wheels[0].radius
    least, most = (of(wheels, key=lambda wheel: wheel.radius) for of in (min, max))
    small, large = least.radius, most.radius
    message = f"{controller.name}: its wheel radius is {given:.4g} m, but the wheels have "
    if large - small > UNEQUAL * large:
        message += f"{small:.4g} on '{least.joint.name}' and {large:.4g} on '{most.joint.name}': "
        message += "a single radius cannot match both"
        hint = "create the wheels with one macro and one radius"
    elif _radius_differs(given, true):
        message += f"{true:.4g}: distances are {(given / true - 1.0) * 100.0:+.0f} % off"
        is_diameter = size.given.name in DIAMETER
        hint = f"use {'twice ' if is_diameter else ''}the radius of the wheels: "
        hint += f"{2.0 * true if is_diameter else true:.4g}"
        named = [factor.name for factor in size.factors if factor.number != 1.0]
        hint += f", and write 1 for {' and '.join(named)}" if named else ""
    else:
        return
    shape = wheels[0].shape
    link = wheels[0].joint.child
    related = (Related(f"the shape of '{link}'", shape.origin),) if shape is not None else ()
    yield Diagnostic("D106", Severity.WARNING, message, size.given.origin, hint, related)


def _wrong_multipliers(
    controller: DeclaredDrive, size: Size, wheels: Sequence[Wheel]
) -> Iterator[Diagnostic | None]:
    """D106 of the multipliers that make a right radius wrong. None for a wheel whose radius is wrong without
    its multiplier. Nothing if the multipliers make the radius right."""
    radius, reported = size.given.number or 0.0, set[str]()
    for wheel in wheels:
        factor = _multiplier_of(controller, size, wheel)
        number = 1.0 if factor is None or factor.number is None else factor.number
        if not _radius_differs(radius * number, wheel.radius):
            continue
        if factor is None or _radius_differs(radius, wheel.radius):
            yield None
        elif factor.name not in reported:
            reported.add(factor.name)
            distances = "its distance is" if factor.name in SIDE_MULTIPLIERS else "distances are"
            message = (
                f"{controller.name}: {factor.name} is {factor.text}: with it, the wheel radius is "
                f"{radius * number:.4g} m, but '{wheel.joint.name}' has {wheel.radius:.4g}: {distances} "
                f"{(number - 1.0) * 100.0:+.0f} % off"
            )
            hint = f"write 1, unless it was measured on the real robot: {size.given.name} is right"
            shape = wheel.shape
            related = (Related(f"the shape of '{wheel.joint.child}'", shape.origin),) if shape else ()
            yield Diagnostic("D106", Severity.WARNING, message, factor.origin, hint, related)


def _multiplier_of(controller: DeclaredDrive, size: Size, wheel: Wheel) -> Parameter | None:
    """The multiplier of the radius of a wheel: that of its side, or the one of all wheels."""
    for name, side in zip(SIDE_MULTIPLIERS, controller.sides.values(), strict=True):
        if wheel.joint.name in {joint.text for joint in side}:
            return next((f for f in size.factors if f.name in (name, "wheel_radius_multiplier")), None)
    return next((f for f in size.factors if f.name not in SIDE_MULTIPLIERS), None)


def _radius_differs(given: float, true: float) -> bool:
    """Whether a radius in m is wrong, and not only rounded: by 1 %, and by a fifth of a millimetre."""
    return abs(given - true) > max(0.01 * true, 2e-4)
