"""Finds the edits that write estimates into a robot's xacro files, at the lines that define the values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from kbot.checks.edits import insert_child, set_attribute
from kbot.identify.nominal import Nominal
from kbot.identify.result import (
    LEFT_RADIUS,
    RIGHT_RADIUS,
    SENSOR_POSE,
    WHEEL_SEPARATION,
    Estimate,
    Identification,
)
from kbot.kinematics.drive.declared import (
    RADII,
    SEPARATION,
    SIDE_MULTIPLIERS,
    DeclaredDrive,
    declared_drives,
    drive_controller,
)
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Joint, JointType
from kbot.text import Edit, Element, KbotError
from kbot.text.edits import edited_texts
from kbot.xacro.written_values import WantedValue, attribute_edits, number_text

_ROUND_SHAPES = ("cylinder", "sphere", "capsule")
_EXACT = 1e-5
"""Difference in m or rad that is not written: no robot is built more exactly."""
_STRAIGHT = 1e-6
"""Largest entry of a rotation matrix that counts as 0."""


@dataclass
class RobotFix:
    """Edits of a robot's files, and in words what they write and what is not written."""

    edits: tuple[Edit, ...] = ()
    written: list[str] = field(default_factory=list)
    not_written: list[str] = field(default_factory=list)

    def texts(self) -> Mapping[str, tuple[str, str]]:
        """The texts of the files before and after, by path."""
        return edited_texts(self.edits)


def robot_fix(nominal: Nominal, found: Identification) -> RobotFix:
    """Write each estimate whose interval does not contain the value of the description.

    Values that depend on each other are written together or not at all. If the wheels of both sides have one
    radius in the files, their mean is written, and the ratio into the multipliers of a controller that has
    them.
    """
    return _Search(nominal, found).search()


class _Search:
    """Finds the wanted values one after the other, and keeps those that edits can give together."""

    def __init__(self, nominal: Nominal, found: Identification) -> None:
        self._nominal, self._found = nominal, found
        self._robot = nominal.loaded.require()
        document = nominal.loaded.expansion.document
        if document is None:
            raise KbotError("the description is empty")
        self._elements = {
            (element.tag, element.attributes.get("name", "")): element for element in document.elements()
        }
        self._tree = FrameTree(self._robot)
        self._controller = drive_controller(declared_drives(self._robot))
        self._wanted: list[WantedValue] = []
        self._other: list[Edit] = []
        """Edits of YAML files, and of attributes that are missing."""
        self._fix = RobotFix()

    def search(self) -> RobotFix:
        changed = self._changed()
        if LEFT_RADIUS in changed or RIGHT_RADIUS in changed:
            self._write_radii()
        if WHEEL_SEPARATION in changed:
            self._write_separation()
        if any(name in changed for name in SENSOR_POSE):
            self._write_sensor([name for name in SENSOR_POSE if name in changed])
        if self._wanted:
            self._fix.edits = attribute_edits(self._nominal.loaded.expansion, self._wanted).edits
        self._fix.edits = (*self._fix.edits, *self._other)
        return self._fix

    def _changed(self) -> list[str]:
        """The estimates that differ from the description."""
        names = []
        for name, estimate in self._found.parameters.items():
            nominal = estimate.nominal
            if name not in (LEFT_RADIUS, RIGHT_RADIUS, WHEEL_SEPARATION, *SENSOR_POSE):
                self._fix.not_written.append(f"{name}: a description has no place for it")
            elif nominal is None:
                self._fix.not_written.append(f"{name}: the description does not have the sensor's link")
            elif estimate.low - _EXACT <= nominal <= estimate.high + _EXACT:
                self._fix.not_written.append(f"{name}: the value in the file is in the interval")
            else:
                names.append(name)
        return names

    def _accept(self, name: str, wanted: Sequence[WantedValue], text: str) -> bool:
        """Add wanted values, if edits can give them together with those before."""
        try:
            attribute_edits(self._nominal.loaded.expansion, [*self._wanted, *wanted])
        except KbotError as error:
            self._fix.not_written.append(f"{name}: {error}")
            return False
        self._wanted += wanted
        self._fix.written.append(text)
        return True

    # --- wheels ---

    def _write_radii(self) -> None:
        values = [
            _rounded(self._found.parameters[name]) if name in self._found.parameters else nominal
            for name, nominal in ((LEFT_RADIUS, self._nominal.left), (RIGHT_RADIUS, self._nominal.right))
        ]
        estimates = [
            self._found.parameters[name]
            for name in (LEFT_RADIUS, RIGHT_RADIUS)
            if name in self._found.parameters
        ]
        mean = round(sum(values) / 2.0, estimates[0].decimals)
        if all(estimate.low <= mean <= estimate.high for estimate in estimates):
            values = [mean, mean]
        sides = (self._nominal.drive.left, self._nominal.drive.right)
        before = len(self._fix.not_written)
        each = [want for side, value in zip(sides, values, strict=True) for want in self._shapes(side, value)]
        if not each:
            self._fix.not_written.append("the wheel radii: no shape of the wheels has a radius")
        elif values[0] != values[1] and self._accept(
            "the wheel radii", each, f"{LEFT_RADIUS} {values[0]:g} m, {RIGHT_RADIUS} {values[1]:g} m"
        ):
            self._write_declared_radius(mean, is_multiplied=not self._write_multipliers(values, mean))
            return
        if each:
            del self._fix.not_written[before:]
            both = [want for side in sides for want in self._shapes(side, mean)]
            if not self._accept("the wheel radii", both, f"radius of both wheels {mean:g} m"):
                return
        is_written = values[0] != values[1] and self._write_multipliers(values, mean)
        self._write_declared_radius(mean, is_multiplied=not is_written)
        if values[0] != values[1] and not is_written:
            left, right = (value / mean for value in values)
            self._fix.not_written.append(
                f"the difference between the wheels ({left:.5f} and {right:.5f} of the mean): both have one "
                "radius in the file. Define two, or give the multipliers left_wheel_radius_multiplier and "
                "right_wheel_radius_multiplier of diff_drive_controller"
            )

    def _shapes(self, side: Sequence[str], value: float) -> Iterator[WantedValue]:
        """The radii of the round shapes of wheels that are as large as the wheel."""
        for name in side:
            wheel = self._nominal.drive.wheels[name]
            for link in rigid_links(self._robot, wheel.link):
                for shape in self._elements[("link", link)].descendants():
                    text = shape.attributes.get("radius", "")
                    if shape.tag in _ROUND_SHAPES and _is_close(text, wheel.radius):
                        yield WantedValue(shape, "radius", value)

    def _write_declared_radius(self, mean: float, *, is_multiplied: bool) -> None:
        """The radius or diameter with which the drive computes, unless it follows from the wheels' radius.

        `is_multiplied`: the controller's multipliers keep their values."""
        controller = self._controller
        size = controller.radius if controller is not None else None
        if controller is None or size is None or not size.given.number:
            return
        share = 1.0 if size.given.name in RADII else 2.0
        factor = share * size.value / size.given.number if is_multiplied else 1.0
        self._write_declared("the radius of", controller, size.given.name, share * mean / factor)

    def _write_multipliers(self, values: Sequence[float], mean: float) -> bool:
        """The multipliers of diff_drive_controller for the radii of both sides in m, if it has them."""
        controller = self._controller
        if controller is None or controller.radius_multipliers != SIDE_MULTIPLIERS:
            return False
        if not all(name in controller.given for name in SIDE_MULTIPLIERS):
            return False
        for name, value in zip(SIDE_MULTIPLIERS, values, strict=True):
            self._write_declared(name, controller, name, round(value / mean, 6))
        return True

    def _write_separation(self) -> None:
        estimate = self._found.parameters[WHEEL_SEPARATION]
        drive = self._nominal.drive
        value = _rounded(estimate)
        apart = (value - drive.separation) / 2.0
        wanted = []
        for side, sign in ((drive.left, 1.0), (drive.right, -1.0)):
            for name in side:
                joint = self._robot.joints[name]
                leftward = drive.axle_in_base.rotation[:, 1]
                axis = self._tree.pose(joint.parent, in_frame=drive.base).rotation.T @ leftward
                index = int(np.abs(axis).argmax())
                if abs(abs(axis[index]) - 1.0) > _STRAIGHT:
                    self._fix.not_written.append(
                        f"{WHEEL_SEPARATION}: the frame of '{name}' is not parallel to the axle"
                    )
                    return
                moved = self._origin(joint).translation[index] + sign * apart * axis[index]
                origin = self._origin_element(joint)
                if origin is None or "xyz" not in origin.attributes:
                    self._fix.not_written.append(f"{WHEEL_SEPARATION}: joint '{name}' has no <origin xyz>")
                    return
                wanted.append(WantedValue(origin, "xyz", round(float(moved), 9), index))
        if self._accept(WHEEL_SEPARATION, wanted, f"{WHEEL_SEPARATION} {value:g} m"):
            controller = self._controller
            given = None if controller is None else controller.first(*SEPARATION)
            if controller is not None and given is not None:
                size = controller.separation
                factor = size.value / given.number if size is not None and given.number else 1.0
                self._write_declared("the separation of", controller, given.name, value / factor)

    def _write_declared(self, what: str, controller: DeclaredDrive, name: str, value: float) -> None:
        """Write a size with which a plugin or controller computes."""
        given = controller.given[name]
        if controller.plugin is None:
            span = given.origin.span
            if not _is_close(span.text, given.number):
                self._fix.not_written.append(f"{what} {controller.name}: {span} is not a number")
            elif not math.isclose(float(span.text), value, rel_tol=1e-9):
                self._other.append(Edit(span, number_text(round(value, 9), span.text)))
                self._fix.written.append(f"{name} of {controller.name} {value:g}")
            return
        tag = next(element for element in controller.plugin.elements(name.rpartition(".")[2]))
        want = WantedValue(tag, "", value)
        try:  # it usually follows from the wheels' own value
            attribute_edits(self._nominal.loaded.expansion, [*self._wanted, want])
        except KbotError as error:
            self._fix.not_written.append(f"{what} {controller.name}: {error}")
            return
        self._wanted.append(want)

    # --- sensor ---

    def _write_sensor(self, names: Sequence[str]) -> None:
        nominal, link = self._nominal, self._nominal.sensor_link
        joint = self._robot.parent_joint.get(link or "")
        pose = nominal.axle_from_sensor
        if joint is None or pose is None or link == nominal.drive.base or joint.type is not JointType.FIXED:
            self._fix.not_written.append(
                f"{', '.join(names)}: a fixed joint must connect '{link}' to the base"
            )
            return
        base_from_parent = self._tree.pose(joint.parent, in_frame=nominal.drive.base)
        axle_from_parent = nominal.drive.axle_in_base.inverse() @ base_from_parent
        new = {
            name: _rounded(self._found.parameters[name]) if name in names else nominal.values[name]
            for name in SENSOR_POSE
        }
        before = axle_from_parent @ self._origin(joint)
        x, y, yaw = (float(new[name] or 0.0) for name in SENSOR_POSE)
        turn = Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw - pose.yaw))
        turned = turn.rotation @ before.rotation
        moved = Transform.from_rotation_translation(turned, (x, y, float(before.translation[2])))
        origin = axle_from_parent.inverse() @ moved
        old = self._origin(joint)
        values = {"xyz": origin.translation.tolist(), "rpy": list(origin.rpy)}
        was = {"xyz": old.translation.tolist(), "rpy": list(old.rpy)}
        wanted, missing = list[WantedValue](), dict[str, str]()
        element = self._origin_element(joint)
        for attribute, numbers in values.items():
            changed = [i for i in range(3) if abs(numbers[i] - was[attribute][i]) > 1e-9]
            if element is not None and attribute in element.attributes:
                wanted += [WantedValue(element, attribute, round(numbers[i], 9), i) for i in changed]
            elif changed:
                missing[attribute] = " ".join(number_text(round(number, 9) + 0.0) for number in numbers)
        text = ", ".join(f"{name} {new[name]:g}" for name in names)
        self._keep_wheels()
        before_notes = len(self._fix.not_written)
        self._insert(joint, missing)
        if self._accept(", ".join(names), wanted, f"{text} of '{link}'"):
            return
        if len(wanted) > 1:  # perhaps some of the numbers can be written
            del self._fix.not_written[before_notes:]
            for want in wanted:
                name = (
                    f"{want.attribute} {'xyz'[want.index] if want.attribute == 'xyz' else 'rpy'[want.index]}"
                )
                self._accept(f"{name} of '{link}'", [want], f"{name} of '{link}' {want.value:g}")
        self._fix.written += [f"{name} of '{link}' {text}" for name, text in missing.items()]

    def _keep_wheels(self) -> None:
        """The wheels stay where they are, also if their positions are computed from the same property."""
        known = {(id(want.element), want.index) for want in self._wanted}
        for name in self._nominal.drive.joints:
            joint = self._robot.joints[name]
            origin = self._origin_element(joint)
            if origin is None or "xyz" not in origin.attributes:
                continue
            for index in range(2):
                value = float(self._origin(joint).translation[index])
                if (id(origin), index) not in known:
                    self._wanted.append(WantedValue(origin, "xyz", round(value, 9), index))

    def _insert(self, joint: Joint, missing: Mapping[str, str]) -> None:
        """Add attributes to the `<origin>` of a joint, or the `<origin>` itself."""
        origin = self._origin_element(joint)
        if origin is not None:
            for name, text in missing.items():
                self._other += set_attribute(origin, name, text)
        elif missing:
            written = " ".join(f'{name}="{text}"' for name, text in missing.items())
            added = insert_child(
                self._elements[("joint", joint.name)], f"<origin {written}/>", "", safe=False
            )
            self._other += added.edits if added is not None else ()

    def _origin(self, joint: Joint) -> Transform:
        return Transform.of(joint.pose)

    def _origin_element(self, joint: Joint) -> Element | None:
        return self._elements[("joint", joint.name)].find("origin")


def _is_close(text: str, value: float | None) -> bool:
    try:
        return value is not None and math.isclose(float(text), value, rel_tol=1e-6)
    except ValueError:
        return False


def _rounded(estimate: Estimate) -> float:
    return round(estimate.value, estimate.decimals) + 0.0  # without the sign of a zero
