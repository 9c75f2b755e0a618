"""`kbot check` and a simulation report an error of a drive with the same code, severity and text."""

import pytest

from kbot.checks import check_text
from kbot.checks.config import Config
from kbot.model.load import load_robot, load_robot_text
from kbot.sim import Simulation

LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"
AXIS, BACKWARDS = '<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>'
STOCK, OWN = 'name="d" filename="libgazebo_ros_diff_drive.so"', 'name="d" filename="libmy_diff_drive.so"'
MANAGER = (
    "controller_manager:\n  ros__parameters:\n    base: {type: diff_drive_controller/DiffDriveController}\n"
)
IN_NAMESPACE = f"/**:\n  {MANAGER}".replace("\n  ros", "\n    ros").replace("\n    base", "\n      base")
FAULTS = ("D101", "D105", "D106", "D107", "D108", "D109", "D131", "W134")


@pytest.fixture(scope="module")
def plain() -> str:
    """KBot as URDF without a drive."""
    return load_robot("kbot", {"control": "none"}).expansion.text


def plugin(attributes: str, inner: str = "") -> str:
    return f"<gazebo><plugin {attributes}>{inner}</plugin></gazebo>"


def classic(left: str, right: str) -> str:
    return f"<leftJoint>{left}</leftJoint><rightJoint>{right}</rightJoint>"


def gz(left: str, right: str) -> str:
    return f"<left_joint>{left}</left_joint><right_joint>{right}</right_joint>"


def names(left: str, right: str, more: str = "", indent: str = "  ") -> str:
    lines = (
        "base:",
        "  ros__parameters:",
        f"    left_wheel_names: [{left}]",
        f"    right_wheel_names: [{right}]",
    )
    return "".join(f"{indent[2:]}{line}\n" for line in (*lines, *([f"    {more}"] if more else [])))


def with_one_axis_flipped(text: str) -> str:
    return text.replace(AXIS, BACKWARDS, 1)


def with_both_axes_flipped(text: str) -> str:
    return text.replace(AXIS, BACKWARDS)


ROWS = {
    "own plugin, right joint missing": (plugin(OWN, classic(LEFT, "right_whel_joint")), ["D101"]),
    "stock plugin, right joint missing": (plugin(STOCK, classic(LEFT, "right_whel_joint")), ["D101"]),
    "plugin known by its name, right joint missing": (
        plugin('name="gz::sim::systems::DiffDrive" filename="x"', gz(LEFT, "right_whel_joint")),
        ["D101"],
    ),
    "own plugin, one joint on both sides": (plugin(OWN, classic(LEFT, LEFT)), ["D131"]),
    "stock plugin, one joint on both sides": (plugin(STOCK, classic(LEFT, LEFT)), ["D131"]),
    "own plugin, sides exchanged": (plugin(OWN, classic(RIGHT, LEFT)), ["D107"]),
    "stock plugin, sides exchanged": (plugin(STOCK, classic(RIGHT, LEFT)), ["D107"]),
    "both axes to the right": (plugin(STOCK, classic(LEFT, RIGHT)), ["D109"], with_both_axes_flipped),
    "one axis to the right": (plugin(STOCK, classic(LEFT, RIGHT)), ["D108"], with_one_axis_flipped),
    "hyphens in the file's name": (
        plugin('name="d" filename="libignition-gazebo-diff-drive-system.so"', gz(LEFT, "nope")),
        ["D101"],
    ),
    "skid steer known by its name": (
        plugin('name="skid_steer" filename="libSkidSteerDrivePlugin.so"', gz(LEFT, "nope")),
        ["D101"],
    ),
    "no joints named": (plugin(STOCK, "<wheelSeparation>0.174</wheelSeparation>"), ["W134", "W134"]),
    "a joint that is not a wheel's": (plugin(STOCK, classic(LEFT, "caster_wheel_joint")), ["W134"]),
    "wrong separation": (
        plugin(STOCK, f"{classic(LEFT, RIGHT)}<wheelSeparation>0.15</wheelSeparation>"),
        ["D105"],
    ),
    "a radius counts before a diameter": (
        plugin(
            STOCK,
            f"{classic(LEFT, RIGHT)}<wheelDiameter>0.07</wheelDiameter><wheel_radius>0.05</wheel_radius>",
        ),
        ["D106"],
    ),
    "controller that no manager lists": (
        names(LEFT, "right_whel", "wheel_separation: 0.15"),
        ["D101", "D105"],
    ),
    "controller in a namespace": (IN_NAMESPACE + names(LEFT, "right_whel", indent="    "), ["D101"]),
    "controller, sides exchanged": (MANAGER + names(RIGHT, LEFT), ["D107"]),
    "controller, one joint on both sides": (MANAGER + names(LEFT, LEFT), ["D131"]),
    "multiplier of the radius": (
        MANAGER + names(LEFT, RIGHT, "wheel_radius: 0.035\n    left_wheel_radius_multiplier: 1.1"),
        ["D106"],
    ),
    "a plugin of another kind": (plugin('name="diff_drive_control" filename="libgazebo_ros_control.so"'), []),
    "plugin that holds a joint": (
        plugin(
            'name="hold" filename="gz-sim-joint-position-controller-system"', "<joint_name>elbow</joint_name>"
        ),
        ["D101"],
    ),
}


@pytest.mark.parametrize("row", ROWS)
def test_check_and_simulation_report_the_same_findings(row, plain, tmp_path):
    extension, codes, *change = ROWS[row]
    if not extension.startswith("<"):
        (tmp_path / "c.yaml").write_text(extension)
        extension = plugin('name="r" filename="x"', f"<parameters>{tmp_path}/c.yaml</parameters>")
    text = plain.replace("</robot>", f"{extension}</robot>")
    for changed in change:
        text = changed(text)
    file = str(tmp_path / "kbot.urdf")
    simulated = Simulation(load_robot_text(text, file).require()).diagnostics
    of_run, of_check = (
        sorted((d.code, d.severity, d.message, d.hint, str(d.origin)) for d in found if d.code in FAULTS)
        for found in (simulated, check_text(text, file, config=Config()))
    )
    assert of_run == of_check
    assert [code for code, *_ in of_check] == codes
