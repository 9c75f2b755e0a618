"""The drive of published and of small test robots, compared with values read from their descriptions by
hand."""

import math
from pathlib import Path

import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from kbot.kinematics import DifferentialDrive, NoDrive, PlanarPose, find_drive
from kbot.model import RobotModel, read_robot
from kbot.text import Source, parse_xml, read_source

SAM_BOT = (
    "ros-navigation+navigation2_tutorials/sam_bot_description/src/description/sam_bot_description.urdf.urdf"
)
UR5E = "UniversalRobots+Universal_Robots_ROS2_Description/urdf/ur.urdf.xacro.ur5e.urdf"

# corpus file: radius, separation, base, the axle's x in the base, left joints, casters
REAL = {
    "ROBOTIS-GIT+turtlebot3/turtlebot3_description/urdf/turtlebot3_burger.urdf.urdf": (
        0.033, 0.16, "base_footprint", 0.0, ("wheel_left_joint",), ("caster_back_link",)
    ),
    "ROBOTIS-GIT+turtlebot3/turtlebot3_description/urdf/turtlebot3_waffle.urdf.urdf": (
        0.033, 0.288, "base_footprint", 0.0, ("wheel_left_joint",),
        ("caster_back_right_link", "caster_back_left_link"),
    ),
    "Ekumen-OS+andino/andino_description/urdf/andino.urdf.xacro.urdf": (
        0.0331, 0.135, "base_footprint", 0.0185, ("left_wheel_joint",), ("caster_wheel_link",)
    ),
    "yujinrobot+kobuki/kobuki_description/urdf/kobuki_standalone.urdf.xacro.urdf": (
        0.035, 0.23, "base_footprint", 0.0, ("wheel_left_joint",), ("caster_front_link", "caster_back_link")
    ),
    "husarion+rosbot_ros/rosbot_description/urdf/rosbot.urdf.xacro.urdf": (
        0.0425, 0.192, "base_link", 0.0, ("fl_wheel_joint", "rl_wheel_joint"), ()
    ),
    "DFKI-NI+mir_robot/mir_description/urdf/mir.urdf.xacro.mir250.urdf": (
        0.1, 0.403, "base_footprint", 0.0, ("left_wheel_joint",),
        ("fl_caster_wheel_link", "fr_caster_wheel_link", "bl_caster_wheel_link", "br_caster_wheel_link"),
    ),
    SAM_BOT: (
        0.1, 0.36, "base_footprint", -0.12, ("drivewhl_l_joint",), ("front_caster",)
    ),
    # wheels on a rocker
    "warthog-cpr+warthog/warthog_description/urdf/warthog.urdf.xacro.urdf": (
        0.3, 1.13642, "base_link", 0.0, ("front_left_wheel_joint", "rear_left_wheel_joint"), ()
    ),
    # its joint left_wheel_joint is on the right
    "ros-controls+ros2_control_demos/example_2/description/urdf/diffbot.urdf.xacro.urdf": (
        0.015, 0.1, "base_link", 0.0, ("right_wheel_joint",), ("caster_frontal_wheel", "caster_rear_wheel")
    ),
}  # fmt: skip

DRIVELESS = {
    UR5E: "the robot has no continuous joint",
    "luxonis+depthai-ros/depthai_descriptions/urdf/depthai_descr.urdf.xacro.urdf": "no movable joint",
    "ros-controls+ros2_control_demos/example_1/description/urdf/rrbot.urdf.xacro.urdf": "shape is not round",
    "Kinovarobotics+ros2_kortex/kortex_description/robots/gen3.xacro.7.urdf": "its axis is not horizontal",
}


def read(text: str, packages: object = None) -> RobotModel:
    return read_robot(parse_xml(Source("robot.urdf", text)), packages).require()


@pytest.mark.parametrize("file", REAL)
def test_the_drive_of_published_robots_is_found(shared, file):
    robot = read_robot(parse_xml(read_source(shared / "corpus/expected" / file))).require()
    radius, separation, base, ahead, left, casters = REAL[file]
    drive = find_drive(robot)
    assert isinstance(drive, DifferentialDrive), drive
    assert drive.radius == pytest.approx(radius)
    assert drive.separation == pytest.approx(separation)
    assert (drive.base, drive.left, drive.casters) == (base, left, casters)
    assert drive.axle_in_base.translation[0] == pytest.approx(ahead)
    assert drive.axle_in_base.translation[1] == pytest.approx(0.0, abs=1e-12)
    assert drive.axle_in_base.yaw == pytest.approx(0.0)


@pytest.mark.parametrize("file", DRIVELESS)
def test_robots_without_a_drive_have_a_reason(shared, file):
    robot = read_robot(parse_xml(read_source(shared / "corpus/expected" / file))).require()
    drive = find_drive(robot)
    assert isinstance(drive, NoDrive)
    assert DRIVELESS[file] in drive.reason


def test_the_drive_of_the_robot_in_the_chapter(shared):
    robot = read_robot(parse_xml(read_source(shared / "chapter/corrected/kbot.urdf"))).require()
    drive = find_drive(robot)
    assert isinstance(drive, DifferentialDrive)
    assert (drive.radius, drive.left, drive.right) == (0.035, ("left_wheel_joint",), ("right_wheel_joint",))
    assert drive.separation == pytest.approx(0.174)
    assert drive.axle_in_base_planar.x == pytest.approx(0.02)
    assert drive.casters == ("caster_wheel",)


def wheel(
    name: str, y: float, shape: str, axis: str = "0 1 0", rpy: str = "1.5707963267948966 0 0", x: float = 0.0
) -> str:
    part = f"<origin rpy='{rpy}'/><geometry>{shape}</geometry>"
    return (
        f"<link name='{name}'><collision>{part}</collision></link>"
        f"<joint name='{name}_joint' type='continuous'><parent link='base_link'/><child link='{name}'/>"
        f"<origin xyz='{x} {y} 0'/><axis xyz='{axis}'/></joint>"
    )


def robot(*parts: str) -> RobotModel:
    return read("<robot name='r'><link name='base_link'/>" + "".join(parts) + "</robot>")


CYLINDER = "<cylinder radius='0.1' length='0.02'/>"


def test_axes_of_opposite_sign_still_drive_forwards():
    drive = find_drive(robot(wheel("l", 0.2, CYLINDER), wheel("r", -0.2, CYLINDER, "0 -1 0")))
    assert isinstance(drive, DifferentialDrive)
    assert drive.joint_velocities(0.1, 0.0) == pytest.approx({"l_joint": 1.0, "r_joint": -1.0})


def test_largest_wheels_drive_and_small_pairs_are_casters():
    small = "<cylinder radius='0.04' length='0.02'/>"
    drive = find_drive(
        robot(
            wheel("a", 0.1, small, x=-0.3),
            wheel("b", -0.1, small, x=-0.3),
            wheel("l", 0.2, CYLINDER),
            wheel("r", -0.2, CYLINDER),
        )
    )
    assert isinstance(drive, DifferentialDrive)
    assert (drive.left, drive.right, drive.casters) == (("l_joint",), ("r_joint",), ())


def test_a_plugin_decides_which_wheels_drive():
    plugin = (
        "<gazebo><plugin name='d' filename='libgazebo_ros_diff_drive.so'>"
        "<leftJoint>c_joint</leftJoint><rightJoint>d_joint</rightJoint></plugin></gazebo>"
    )
    four = [
        wheel(n, y, CYLINDER, x=x)
        for n, y, x in (("a", 0.2, 0.3), ("b", -0.2, 0.3), ("c", 0.2, 0), ("d", -0.2, 0))
    ]
    both, named = find_drive(robot(*four)), find_drive(robot(*four, plugin))
    assert isinstance(both, DifferentialDrive)
    assert both.left == ("a_joint", "c_joint")
    assert isinstance(named, DifferentialDrive)
    assert (named.left, named.right) == (("c_joint",), ("d_joint",))
    assert named.casters == ("a", "b")


def test_mesh_wheels_are_measured(tmp_path: Path):
    disc = trimesh.creation.cylinder(radius=0.05, height=0.02, sections=64)
    disc.apply_translation((0.0, 0.0, 0.01))
    path = tmp_path / "wheel.stl"
    disc.export(str(path))

    class Found:
        def resolve(self, uri: str) -> str | None:
            return str(path) if uri == "package://x/wheel.stl" else None

    mesh = "<mesh filename='package://x/wheel.stl'/>"
    text = (
        "<robot name='r'><link name='base_link'/>"
        + wheel("l", 0.2, mesh)
        + wheel("r", -0.2, mesh)
        + "</robot>"
    )
    drive = find_drive(read(text, Found()))
    assert isinstance(drive, DifferentialDrive)
    assert drive.radius == pytest.approx(0.05, rel=1e-6)
    # both meshes extend to -y of the origins of their axles
    assert drive.separation == pytest.approx(0.4)
    assert drive.axle_in_base.translation[1] == pytest.approx(-0.01)
    assert drive.wheels["l_joint"].width == pytest.approx(0.02)
    lost = find_drive(read(text))
    assert isinstance(lost, NoDrive)
    assert "its mesh is not found: package://x/wheel.stl" in lost.reason


def test_a_mesh_wheel_whose_axis_is_written_as_zero_is_not_round_about_it(tmp_path: Path):
    path = tmp_path / "wheel.stl"
    trimesh.creation.cylinder(radius=0.05, height=0.02, sections=64).export(str(path))

    class Found:
        def resolve(self, _uri: str) -> str | None:
            return str(path)

    mesh = "<mesh filename='wheel.stl'/>"
    wheels = wheel("l", 0.2, mesh, axis="0 0 0") + wheel("r", -0.2, mesh, axis="0 0 0")
    text = f"<robot name='r'><link name='base_link'/>{wheels}</robot>"
    drive = find_drive(read(text, Found()))
    assert isinstance(drive, NoDrive)
    assert "'l_joint': its mesh is not round" in drive.reason


def test_a_single_wheel_is_not_a_drive():
    drive = find_drive(robot(wheel("l", 0.2, CYLINDER)))
    assert isinstance(drive, NoDrive)
    assert "'l_joint' has no wheel of equal size" in drive.reason


def test_a_cylinder_across_its_axis_is_not_a_wheel():
    drive = find_drive(robot(wheel("l", 0.2, CYLINDER, rpy="0 0 0"), wheel("r", -0.2, CYLINDER, rpy="0 0 0")))
    assert isinstance(drive, NoDrive)
    assert "does not lie along its axis (robot.urdf:" in drive.reason


def test_a_wheel_without_an_axis_turns_about_x():
    sides = (wheel(n, y, CYLINDER).replace("<axis xyz='0 1 0'/>", "") for n, y in (("l", 0.2), ("r", -0.2)))
    drive = find_drive(robot(*sides))
    assert isinstance(drive, NoDrive)
    assert (
        "'l_joint': its cylinder does not lie along its axis, which is x because it has no <axis>"
        in drive.reason
    )


def test_wheels_with_camber_are_a_pair():
    """Both wheels lean by 0.15 rad to the middle, so that their axes differ by 0.3 rad."""
    left = wheel("l", 0.2, CYLINDER, "0 0.98877 0.14944", rpy="1.720796 0 0")
    right = wheel("r", -0.2, CYLINDER, "0 0.98877 -0.14944", rpy="1.420796 0 0")
    drive = find_drive(robot(left, right))
    assert isinstance(drive, DifferentialDrive)
    assert (drive.left, drive.right) == (("l_joint",), ("r_joint",))
    assert drive.separation == pytest.approx(0.4)


def test_a_plugin_that_names_fixed_joints_is_the_reason():
    joints = wheel("l", 0.2, CYLINDER) + wheel("r", -0.2, CYLINDER)
    swivel = wheel("swivel", 0.0, "<box size='0.1 0.1 0.1'/>")
    plugin = (
        "<gazebo><plugin name='diff' filename='libgazebo_ros_diff_drive.so'><leftJoint>l_joint</leftJoint>"
        "<rightJoint>r_joint</rightJoint></plugin></gazebo>"
    )
    drive = find_drive(robot(joints.replace("continuous", "fixed"), swivel, plugin))
    assert isinstance(drive, NoDrive)
    assert drive.reason.startswith("its drive names 'l_joint', which is fixed and does not turn (robot.urdf:")


@given(st.floats(-2, 2), st.floats(-5, 5))
def test_twist_and_wheel_speeds_are_inverse(linear, angular):
    drive = find_drive(robot(wheel("l", 0.2, CYLINDER), wheel("r", -0.2, CYLINDER)))
    assert isinstance(drive, DifferentialDrive)
    assert drive.twist(*drive.wheel_speeds(linear, angular)) == pytest.approx((linear, angular), abs=1e-12)


def test_wheel_speeds_by_hand():
    drive = find_drive(robot(wheel("l", 0.2, CYLINDER), wheel("r", -0.2, CYLINDER)))
    assert isinstance(drive, DifferentialDrive)
    assert drive.wheel_speeds(0.5, 1.0) == pytest.approx((3.0, 7.0))
    quarter = math.pi / 2 * 0.2 / 0.1
    pose = drive.integrate(PlanarPose(), -quarter, quarter)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0, 0, math.pi / 2), abs=1e-12)
