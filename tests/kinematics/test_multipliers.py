"""A wrong multiplier is reported at its own line, and a right size beside it is not blamed.

Which multipliers exist: diff_drive_controller.cpp and ackermann_steering_controller.cpp of ros_controllers,
and diff_drive_controller_parameter.yaml of ros2_controllers. KBot's wheels have a radius of 0.035 m and are
0.174 m apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from kbot.kinematics.drive.declared import declared_drives
from kbot.kinematics.drive.drive import find_drive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.model import RobotModel
from kbot.model.load import load_robot, load_robot_text
from kbot.model.spawned import Setting, SpawnedController, with_controllers
from kbot.text import Diagnostic, Origin, Source, Span
from kbot.text.edits import apply_edits

NAMES = {"left": "left_wheel_joint", "right": "right_wheel_joint"}


@pytest.fixture(scope="module")
def plain() -> RobotModel:
    return load_robot("kbot", {"control": "none"}).require()


def with_controller(robot: RobotModel, ros: int, values: Mapping[str, float]) -> tuple[RobotModel, Source]:
    """The robot with a diff_drive_controller whose parameters are written in a file, one per line."""
    names = {f"{side}_wheel" + "_names" * (ros == 2): f"[{joint}]" for side, joint in NAMES.items()}
    given = {**names, **{name: str(value) for name, value in values.items()}}
    text = "".join(f"{name}: {value}\n" for name, value in given.items())
    source, at = Source("c.yaml", text), 0
    settings = {"type": Setting("diff_drive_controller/DiffDriveController", robot.origin)}
    for name, value in given.items():
        start = at + len(name) + 2
        origin = Origin(Span(source, start, start + len(value)))
        settings[name] = Setting([value[1:-1]] if value[0] == "[" else values[name], origin)
        at = start + len(value) + 1
    return with_controllers(robot, [SpawnedController("/base", settings, True, ros, robot.origin)]), source


def found_in(robot: RobotModel) -> list[Diagnostic]:
    return [d for d in findings_of_drive(robot, find_drive(robot)) if d.code in ("D105", "D106")]


SIZES = {"wheel_separation": 0.174, "wheel_radius": 0.035}
LEFT, RIGHT = "left_wheel_radius_multiplier", "right_wheel_radius_multiplier"
BOTH, SEPARATION = "wheel_radius_multiplier", "wheel_separation_multiplier"


@pytest.mark.parametrize(
    ("ros", "values", "expected"),
    [
        (2, {SEPARATION: 2.0}, [("D105", SEPARATION, "write 1,")]),
        (2, {SEPARATION: 1.0}, []),
        (2, {LEFT: 1.5}, [("D106", LEFT, "write 1,")]),
        (2, {RIGHT: 0.5}, [("D106", RIGHT, "write 1,")]),
        # each side is wrong, though their mean is right
        (2, {LEFT: 1.5, RIGHT: 0.5}, [("D106", LEFT, "write 1,"), ("D106", RIGHT, "write 1,")]),
        (2, {LEFT: 1.004, RIGHT: 0.996}, []),
        (2, {BOTH: 1.5}, []),  # ROS 2's controller does not have it
        (1, {BOTH: 1.5}, [("D106", BOTH, "write 1,")]),
        (1, {BOTH: 1.5, LEFT: 3.0}, [("D106", BOTH, "write 1,")]),  # ROS 1 then ignores those of the sides
        (1, {BOTH: 1.0, LEFT: 3.0}, []),
        (1, {LEFT: 1.5}, [("D106", LEFT, "write 1,")]),
        (1, {SEPARATION: 0.5}, [("D105", SEPARATION, "write 1,")]),
        # the product is right
        (2, {"wheel_separation": 0.087, SEPARATION: 2.0}, []),
        (2, {"wheel_radius": 0.07, LEFT: 0.5, RIGHT: 0.5}, []),
        # the size itself is wrong
        (2, {"wheel_separation": 0.3}, [("D105", "wheel_separation", "write 0.174,")]),
        (
            2,
            {"wheel_separation": 0.3, SEPARATION: 2.0},
            [("D105", "wheel_separation", f"write 0.174 and 1 for {SEPARATION}")],
        ),
        (2, {"wheel_radius": 0.05, LEFT: 1.5}, [("D106", "wheel_radius", f"and write 1 for {LEFT}")]),
    ],
    ids=str,
)  # fmt: skip
def test_the_parameter_that_is_wrong_is_reported(plain, ros, values, expected) -> None:
    robot, source = with_controller(plain, ros, {**SIZES, **values})
    found = found_in(robot)
    places = [(d.code, source.line(d.origin.span.line).partition(":")[0]) for d in found if d.origin]
    assert places == [(code, name) for code, name, _ in expected]
    for diagnostic, (_, name, hint) in zip(found, expected, strict=True):
        assert hint in diagnostic.hint
        assert "multiplier" not in name or name in diagnostic.message


@pytest.mark.parametrize("values", [{SEPARATION: 2.0}, {"wheel_separation": 0.3, SEPARATION: 2.0}], ids=str)
def test_fix_makes_the_separation_right(plain, values) -> None:
    robot, source = with_controller(plain, 2, {**SIZES, **values})
    (found,) = found_in(robot)
    assert found.fix is not None
    text = apply_edits(source.text, found.fix.edits)
    written = dict(line.split(": ") for line in text.splitlines())
    assert float(written["wheel_separation"]) * float(written[SEPARATION]) == pytest.approx(0.174)


@pytest.mark.parametrize(("left", "codes"), [(0.98, []), (1.0, ["D106"])])
def test_multipliers_may_match_unequal_wheels(left: float, codes: list[str]) -> None:
    """A left wheel of 0.98 times the radius, as `kbot identify --fix` writes it for worn wheels."""
    text = load_robot("kbot", {"control": "none"}).expansion.text
    start = text.index('<link name="left_wheel"')
    end = text.index("</link>", start)
    worn = text[start:end].replace('radius="0.035"', 'radius="0.0343"')
    assert worn != text[start:end]
    unequal = load_robot_text(text[:start] + worn + text[end:], "kbot.urdf").require()
    robot, _ = with_controller(unequal, 2, {**SIZES, LEFT: left})
    assert [d.code for d in found_in(robot)] == codes


def test_size_that_is_used_is_the_product(plain) -> None:
    robot, _ = with_controller(plain, 1, {**SIZES, SEPARATION: 1.2, BOTH: 1.1})
    (drive,) = declared_drives(robot)
    assert drive.separation is not None
    assert drive.radius is not None
    assert (drive.separation.value, drive.radius.value) == pytest.approx((0.174 * 1.2, 0.035 * 1.1))
