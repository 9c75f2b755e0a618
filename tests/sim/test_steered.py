"""Tricycles and cars drive as their geometry predicts, and skid steer slips."""

import re
from math import atan2, hypot, inf, pi, sin, tan

import pytest

from kbot.kinematics.drive.drive import NoDrive, SteeredDrive, find_drive
from kbot.kinematics.robot_info import describe
from kbot.messages import Header, Twist, TwistStamped, Vector3
from kbot.model.load import load_robot
from kbot.sim import Simulation
from kbot.text import Severity
from kbot.workbench.protocol import Drive
from kbot.workbench.serve import open_session

BASE, TRACK, RADIUS = 0.5, 0.4, 0.1
"""Wheelbase, track and wheel radius in m."""


def wheel(name: str, parent: str, x: float, y: float, steered: bool = False) -> str:
    inertia = '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/>'
    link = (
        f'<link name="{name}"><inertial><mass value="0.5"/>{inertia}</inertial><collision>'
        f'<origin rpy="{pi / 2} 0 0"/><geometry><cylinder radius="{RADIUS}" length="0.04"/></geometry>'
        "</collision></link>"
    )
    if not steered:
        return link + (
            f'<joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
        )
    fork = f'<link name="{name}_fork"><inertial><mass value="0.2"/>{inertia}</inertial></link>'
    return (
        fork
        + (
            f'<joint name="{name}_steering" type="revolute">'
            f'<parent link="{parent}"/><child link="{name}_fork"/><origin xyz="{x} {y} 0"/>'
            '<axis xyz="0 0 1"/>'
            '<limit lower="-1.2" upper="1.2" effort="50" velocity="0"/></joint>'
        )
        + wheel(name, f"{name}_fork", 0.0, 0.0)
    )


def body(inner: str, extensions: str = "", x: float = 0.2) -> str:
    return (
        '<robot name="base"><link name="base_link"><inertial>'
        f'<origin xyz="{x} 0 0.1"/><mass value="10"/>'
        '<inertia ixx="0.3" iyy="0.5" izz="0.6" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f"{inner}{extensions}</robot>"
    )


REAR = wheel("left", "base_link", 0.0, TRACK / 2) + wheel("right", "base_link", 0.0, -TRACK / 2)
TRICYCLE = body(REAR + wheel("front", "base_link", BASE, 0.0, steered=True))
FRONT_DRIVEN = body(
    REAR + wheel("front", "base_link", BASE, 0.0, steered=True),
    '<ros2_control name="c" type="system">'
    '<joint name="front_joint"><command_interface name="velocity"/></joint>'
    '<joint name="front_steering"><command_interface name="position"/></joint></ros2_control>',
)
CAR = body(
    REAR
    + wheel("front_left", "base_link", BASE, TRACK / 2, steered=True)
    + wheel("front_right", "base_link", BASE, -TRACK / 2, steered=True),
    '<gazebo><plugin filename="gz-sim-ackermann-steering-system" name="gz::sim::systems::AckermannSteering">'
    "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>"
    "<left_steering_joint>front_left_steering</left_steering_joint>"
    "<right_steering_joint>front_right_steering</right_steering_joint></plugin></gazebo>",
)
ALL_DRIVEN = CAR.replace(
    "<left_joint>",
    "<left_joint>front_left_joint</left_joint><right_joint>front_right_joint</right_joint><left_joint>",
)
"""As in gz's example world, whose plugin names the joints of all four wheels."""
BASES = {"tricycle": TRICYCLE, "front driven": FRONT_DRIVEN, "car": CAR, "all driven": ALL_DRIVEN}


@pytest.mark.parametrize(
    ("text", "traction", "steering"),
    [
        (TRICYCLE, ("left_joint", "right_joint"), ("front_steering",)),
        (FRONT_DRIVEN, ("front_joint",), ("front_steering",)),
        (CAR, ("left_joint", "right_joint"), ("front_left_steering", "front_right_steering")),
    ],
)
def test_driven_and_steered_wheels_are_found(urdf, text, traction, steering):
    drive = find_drive(urdf(text))
    assert isinstance(drive, SteeredDrive)
    assert drive.joints == traction
    assert drive.steering == steering
    steered = [module for module in drive.modules if module.steering is not None]
    assert [module.x for module in steered] == pytest.approx([BASE] * len(steering))
    assert drive.casters == ()


def assert_odometry_is_true(sim: Simulation, within: float = 0.015) -> None:
    truth, odometry = sim.ground_truth.pose, sim.odometry.pose
    assert (odometry.x, odometry.y, odometry.yaw) == pytest.approx((truth.x, truth.y, truth.yaw), abs=within)


def drive_a_curve(sim: Simulation, speed: float, turn: float) -> None:
    """Drive for 6 s, and assert that the base moves as commanded after the first 2 s."""
    sim.cmd_vel(speed, turn)
    sim.run(2.0)
    before = sim.ground_truth.unwrapped_yaw
    sim.run(4.0)
    assert sim.ground_truth.unwrapped_yaw - before == pytest.approx(4.0 * turn, rel=0.01)
    assert sim.ground_truth.twist.x == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("name", list(BASES))
def test_steered_base_drives_straight(urdf, name):
    sim = Simulation(urdf(BASES[name]))
    sim.cmd_vel(0.5, 0.0)
    sim.run(4.5)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    truth, odometry = sim.ground_truth.pose, sim.odometry.pose
    assert truth.x == pytest.approx(0.5 * 4.5, abs=0.01)
    assert (truth.y, truth.yaw) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert odometry.x == pytest.approx(truth.x, abs=1e-3)


@pytest.mark.parametrize("name", list(BASES))
@pytest.mark.parametrize(("speed", "turn"), [(0.5, 0.3), (0.5, -0.3), (-0.5, 0.3)])
def test_wheels_of_a_steered_base_roll_about_one_point(urdf, name, speed, turn):
    """The base moves at v and turns at w. The steering angles are those of Ackermann, tan a = L / (R - y)."""
    sim = Simulation(urdf(BASES[name]))
    drive_a_curve(sim, speed, turn)
    for module in sim.robots.first.drive.modules:
        if module.steering is not None:
            angle = sim.joint_positions[module.steering]
            assert tan(angle) == pytest.approx(BASE / (speed / turn - module.y), rel=0.02)
    assert_odometry_is_true(sim, within=0.01)


FOUR = "".join(
    wheel(f"{end}_{side}", "base_link", x, y, steered=True)
    for end, x in (("front", BASE / 2), ("rear", -BASE / 2))
    for side, y in (("left", TRACK / 2), ("right", -TRACK / 2))
)
ROVER = body(FOUR.replace("1.2", "0.6"), x=0.0)
SWERVE = body(FOUR.replace("1.2", "1.57"), x=0.0)
JOINT = '<parent link="front_left_fork"/><child link="front_left"/><origin xyz='
TRAILING = SWERVE.replace(f'{JOINT}"0.0 0.0 0"/>', f'{JOINT}"-0.03 0.02 0"/>')


def test_front_wheels_with_a_velocity_interface_roll_freely(urdf):
    """gazebo_ros_control holds joints that nothing commands. A wheel that rolls on the ground is driven."""
    names = ("left_joint", "right_joint", "front_left_joint", "front_right_joint")
    gears = "".join(
        f'<transmission name="{name}"><type>transmission_interface/SimpleTransmission</type>'
        f'<joint name="{name}"><hardwareInterface>VelocityJointInterface</hardwareInterface></joint>'
        f'<actuator name="{name}_motor"/></transmission>'
        for name in names
    )
    manager = '<gazebo><plugin filename="libgazebo_ros_control.so" name="control"/></gazebo>'
    text = CAR[: CAR.index("<gazebo>")] + gears + manager + "</robot>"
    sim = Simulation(urdf(text))
    sim.cmd_vel(0.5, 0.0)
    sim.run(4.5)
    assert sim.ground_truth.pose.x == pytest.approx(0.5 * 4.5 - 0.5**2 / 2.0, abs=0.02)
    rolled = sim.joint_positions["front_left_joint"] * RADIUS
    assert rolled == pytest.approx(sim.ground_truth.pose.x, abs=0.01)


def test_steering_joints_overcome_their_friction_and_have_no_limit_below_zero(urdf):
    """Gazebo does not enforce a negative limit. The angles are those of Ackermann, tan a = L / (R - y)."""
    limit = '<limit lower="-1.2" upper="1.2" effort="50" velocity="0"/>'
    assert limit in CAR
    dry = '<limit lower="-1.2" upper="1.2" effort="-1" velocity="-1"/><dynamics damping="1" friction="2"/>'
    sim = Simulation(urdf(CAR.replace(limit, dry)))
    sim.cmd_vel(0.3, 0.05)
    sim.run(2.0)
    for module in sim.robots.first.drive.modules:
        if module.steering is not None:
            angle = sim.joint_positions[module.steering]
            assert tan(angle) == pytest.approx(BASE / (0.3 / 0.05 - module.y), rel=0.02)


def test_description_for_display_does_not_drive(urdf):
    drive = find_drive(
        urdf(
            '<robot name="r"><link name="a"/><link name="b"><visual><geometry>'
            '<cylinder radius="0.05" length="0.04"/></geometry></visual></link>'
            '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
        )
    )
    assert isinstance(drive, NoDrive)
    assert drive.reason == "no link has a mass or a collision shape: the description is only for display"


def test_a_steered_drive_is_described(urdf):
    data = describe(urdf(ALL_DRIVEN))
    assert data["no_drive"] is None
    drive = data["drive"]
    assert (drive["kind"], drive["sideways"]) == ("steered", False)
    assert drive["steering"] == ["front_left_steering", "front_right_steering"]
    assert len(drive["joints"]) == 4
    assert (drive["wheelbase"], drive["separation"], drive["radius"]) == pytest.approx((BASE, TRACK, RADIUS))


def test_a_steered_wheel_off_its_axis_is_named(urdf):
    """The rear wheels and one front wheel of four that steer are off their axes by 10 % of their radius."""
    off = FOUR.replace(f'<origin rpy="{pi / 2} 0 0"/>', f'<origin xyz="0 0 0.01" rpy="{pi / 2} 0 0"/>')
    centred = wheel("front_left", "base_link", BASE / 2, TRACK / 2, steered=True)
    alone = wheel("rear", "base_link", 0.0, 0.0)
    drive = find_drive(urdf(body(centred + alone + off.replace("front_left", "other"), x=0.0)))
    assert isinstance(drive, NoDrive)
    assert drive.reason.endswith("but 'other_joint': its shape is not centred on its axis")
    drive = find_drive(urdf(body(centred + off.replace("front_left", "other"), x=0.0)))
    assert isinstance(drive, NoDrive)
    assert drive.reason.endswith("but 'other_joint': its shape is not centred on its axis")


def test_four_steered_wheels_without_a_fixed_axle_are_found(urdf):
    for text, sideways in ((ROVER, False), (SWERVE, True)):
        drive = find_drive(urdf(text))
        assert isinstance(drive, SteeredDrive)
        assert len(drive.joints) == len(drive.steering) == 4
        assert drive.axle_in_base.translation == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
        assert (drive.sideways, drive.turns_in_place) == (sideways, sideways)


@pytest.mark.parametrize("speed", [0.4, -0.4])
@pytest.mark.parametrize("turn", [0.3, -0.3])
def test_front_and_rear_wheels_steer_opposite_for_an_arc(urdf, speed, turn):
    """All axes meet at the middle of the curve, at R = v / w to the left: tan a = x / (R - y)."""
    sim = Simulation(urdf(ROVER))
    drive_a_curve(sim, speed, turn)
    for module in sim.robots.first.drive.modules:
        angle = sim.joint_positions[module.steering]
        assert tan(angle) == pytest.approx(module.x / (speed / turn - module.y), rel=0.02)
    assert_odometry_is_true(sim)


def test_steering_limit_bounds_the_curvature_of_a_rover(urdf):
    """The inner wheels at 0.6 rad give R = track / 2 + wheelbase / 2 / tan(0.6)."""
    sim = Simulation(urdf(ROVER))
    sim.cmd_vel(0.2, 3.0)
    sim.run(3.0)
    radius = TRACK / 2 + BASE / 2 / tan(0.6)
    assert sim.ground_truth.twist.yaw == pytest.approx(0.2 / radius, rel=0.02)
    sim.cmd_vel(0.0, 1.0)
    sim.run(2.0)
    before = sim.ground_truth.pose
    sim.run(1.0)
    assert sim.ground_truth.pose.yaw == pytest.approx(before.yaw, abs=1e-3)


@pytest.mark.parametrize("text", [SWERVE, TRAILING])
@pytest.mark.parametrize("command", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.8), (-0.2, 0.1, 0.4)])
def test_wheels_that_all_steer_drive_every_twist(urdf, text, command):
    """A wheel at x, y rolls along (v - w y, u + w x). A trail of 3 cm turns it by asin(w t / s)."""
    sim = Simulation(urdf(text))
    x, y, yaw = command
    sim.cmd_vel(x, yaw, y)
    sim.run(2.0)
    before = sim.ground_truth.unwrapped_yaw
    sim.run(3.0)
    twist = sim.ground_truth.twist
    assert (twist.x, twist.y, twist.yaw) == pytest.approx(command, abs=0.006)
    assert sim.ground_truth.unwrapped_yaw - before == pytest.approx(3.0 * yaw, abs=0.02)
    for module in sim.robots.first.drive.modules:
        ahead, left = x - yaw * module.y, y + yaw * module.x
        angle = atan2(left, ahead) - sim.joint_positions[module.steering]
        slip = hypot(ahead, left) * sin(angle) + yaw * module.trail
        assert slip == pytest.approx(0.0, abs=0.005)
    # The contact of a wheel with a trail slides by up to trail x angle while it steers: 0.019 rad in a turn
    # of 3.9 rad.
    assert_odometry_is_true(sim, within=0.015 if text is SWERVE else 0.02)


CORNERS = ("front_left", "front_right", "rear_left", "rear_right")
CASTERS = (
    SWERVE.replace('"revolute"', '"continuous"')
    .replace('lower="-1.57" upper="1.57" effort="50"', 'effort="2"')
    .replace("_steering", "_caster_rotation")
    .replace("_joint", "_caster_wheel")
)
MOTORS = "".join(
    f'<transmission name="{corner}_{joint}"><joint name="{corner}_caster_{joint}"/></transmission>'
    for corner in CORNERS
    for joint in ("rotation", "wheel")
)


def test_base_whose_wheels_steer_everywhere_drives_along_its_own_axes(urdf):
    """Its wheels point to the left at position 0 of their steering joints."""
    text = re.sub(
        r'(_fork"/><origin xyz="[^"]*0")/><axis xyz="0 0 1"',
        r'\1 rpy="0 0 1.5708"/><axis xyz="0 0 1"',
        SWERVE,
    )
    assert text.count('rpy="0 0 1.5708"') == 4
    sim = Simulation(urdf(text))
    sim.cmd_vel(0.3, 0.0)
    sim.run(3.0)
    assert sim.ground_truth.twist.x == pytest.approx(0.3, abs=0.01)
    assert "D132" not in {finding.code for finding in sim.diagnostics}


def test_casters_with_motors_steer(urdf):
    """As those of PR2 and Care-O-bot. Casters swivel freely if they have none."""
    drive = find_drive(urdf(CASTERS.replace("</robot>", f"{MOTORS}</robot>")))
    assert isinstance(drive, SteeredDrive)
    assert drive.sideways
    assert not isinstance(find_drive(urdf(CASTERS)), SteeredDrive)


def test_casters_beside_a_fixed_axle_swivel_although_all_joints_have_a_transmission(urdf):
    """As those of AgileX's Tracer."""
    axle = wheel("left", "base_link", 0.0, 0.25) + wheel("right", "base_link", 0.0, -0.25)
    motors = MOTORS + "".join(
        f'<transmission name="{side}"><joint name="{side}_joint"/></transmission>'
        for side in ("left", "right")
    )
    drive = find_drive(urdf(CASTERS.replace("</robot>", f"{axle}{motors}</robot>")))
    assert not isinstance(drive, SteeredDrive)
    assert drive.joints == ("left_joint", "right_joint")


def test_weak_steering_motors_do_not_overshoot(urdf):
    sim = Simulation(urdf(CASTERS.replace("</robot>", f"{MOTORS}</robot>")))
    sim.cmd_vel(0.0, 0.0, 0.3)
    angles = list[float]()
    for _ in range(100):
        sim.run(0.02)
        angles.append(sim.joint_positions["front_left_caster_rotation"])
    assert max(angles) < pi / 2 + 0.05
    assert angles[-1] == pytest.approx(pi / 2, abs=0.01)
    assert sim.ground_truth.twist.y == pytest.approx(0.3, rel=0.02)


def test_a_base_that_steers_its_wheels_first_is_explained(urdf):
    slow = CASTERS.replace('effort="2" velocity="0"', 'effort="2" velocity="3"')
    sim = Simulation(urdf(slow.replace("</robot>", f"{MOTORS}</robot>")))
    sim.cmd_vel(0.0, 0.0, 0.3)
    sim.run(5.0)
    [finding] = sim.findings
    assert (finding.code, finding.severity) == ("W307", Severity.INFO)
    assert "its wheels first steer into this direction" in finding.message


def twin_casters() -> str:
    """Casters with a wheel on each side of their steering axis, as those of PR2."""
    twins = ""
    for corner in CORNERS:
        twin = wheel(f"{corner}_twin", f"{corner}_fork", 0.0, 0.0).replace("_joint", "_caster_wheel")
        motor = f'<transmission name="{corner}_t"><joint name="{corner}_twin_caster_wheel"/></transmission>'
        twins += twin.replace('"0.0 0.0 0"', '"0 -0.04 0"') + motor
    return CASTERS.replace('"0.0 0.0 0"', '"0 0.04 0"').replace("</robot>", f"{MOTORS}{twins}</robot>")


def test_two_wheels_beside_one_steering_axis_roll_around_it(urdf):
    """They steer with it, and do not hold it by their friction."""
    sim = Simulation(urdf(twin_casters()))
    sim.cmd_vel(0.0, 0.0, 0.3)
    sim.run(1.5)
    assert sim.joint_positions["front_left_caster_rotation"] == pytest.approx(pi / 2, abs=0.02)
    assert sim.ground_truth.twist.y == pytest.approx(0.3, rel=0.02)


def test_wheels_help_a_weak_steering_motor_until_the_caster_has_turned(urdf):
    """A heavy base goes over from turning on the spot to a curve to the other side. A caster that is held up
    on the way steers on when it can, and its wheels roll around its axis until then."""
    heavy = twin_casters().replace('<mass value="10"/>', '<mass value="150"/>')
    sim = Simulation(urdf(heavy))
    sim.cmd_vel(0.0, 2.0)
    sim.run(1.5)
    sim.cmd_vel(0.3, -1.0)
    sim.run(2.0)
    assert sim.ground_truth.twist.yaw == pytest.approx(-1.0, rel=0.02)


def test_wheels_that_all_swivel_on_one_joint_do_not_drive(urdf):
    """As those of HSR, whose base turns against its wheels by this joint."""
    fork = wheel("caster", "base_link", 0.0, 0.0, steered=True).replace('"revolute"', '"continuous"')
    inner = fork + wheel("twin", "caster_fork", -0.1, 0.1)
    motors = "".join(
        f'<transmission name="{name}"><joint name="{name}"/></transmission>'
        for name in ("caster_steering", "caster_joint", "twin_joint")
    )
    drive = find_drive(urdf(body(inner, motors)))
    assert isinstance(drive, NoDrive)
    assert "its wheels swivel together on 'caster_steering' (" in drive.reason


def test_swerving_base_changes_its_direction_without_sliding(urdf):
    """Forwards, then to the left: the wheels steer by a quarter turn, and odometry stays true."""
    sim = Simulation(urdf(SWERVE))
    for x, y, yaw in ((0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.5), (-0.3, 0.0, 0.0)):
        sim.cmd_vel(x, yaw, y)
        sim.run(2.0)
    assert_odometry_is_true(sim)


def test_topic_and_limits_of_a_cars_plugin_are_used(urdf):
    settings = (
        "<topic>/car/cmd</topic><max_velocity>0.2</max_velocity><wheel_separation>0.4</wheel_separation>"
    )
    sim = Simulation(urdf(CAR.replace("<left_joint>", f"{settings}<left_joint>")))
    sim.bus.publish("/car/cmd", Twist(Vector3(1.0)))
    sim.run(0.4)
    assert sim.ground_truth.twist.x == pytest.approx(0.2, rel=0.02)
    assert sim.diagnostics == ()


ACKERMANN = """
controller_manager:
  ros__parameters:
    car:
      type: ackermann_steering_controller/AckermannSteeringController
car:
  ros__parameters:
    wheelbase: 0.5
    traction_track_width: 0.4
    traction_wheels_radius: 0.1
    traction_joints_names: [left_joint, right_joint]
    steering_joints_names: [front_left_steering, front_right_steering]
    reference_timeout: 2.0
"""


def ackermann(urdf, tmp_path, parameters: str) -> Simulation:
    """The car whose front joints have no limits, with a controller of ros2_control."""
    text = CAR[: CAR.index("<gazebo>")].replace('type="revolute"', 'type="continuous"')
    return Simulation(urdf(text + controlled(tmp_path, parameters)))


def controlled(tmp_path, parameters: str) -> str:
    """The end of a description whose controllers have these parameters."""
    (tmp_path / "car.yaml").write_text(parameters)
    file = f"<parameters>{tmp_path}/car.yaml</parameters>"
    return f'<gazebo><plugin filename="x" name="gz_ros2_control::P">{file}</plugin></gazebo></robot>'


def test_controller_of_ros2_control_steers(urdf, tmp_path):
    """It subscribes to TwistStamped on `reference`, and steers the continuous joints that it names."""
    sim = ackermann(urdf, tmp_path, ACKERMANN)
    assert sim.diagnostics == ()
    twist = TwistStamped(Header(), Twist(Vector3(0.5), Vector3(0.0, 0.0, 0.3)))
    sim.bus.publish("/car/reference", twist)
    sim.run(1.9)
    assert sim.ground_truth.twist.yaw == pytest.approx(0.3, rel=0.02)
    sim.run(1.5)
    assert sim.ground_truth.twist.x == pytest.approx(0.0, abs=0.01)
    assert "/car/odometry" in sim.bus.topics


@pytest.mark.parametrize(("sizes", "turn"), [((0.5, 0.5), 0.3), ((0.5, 0.6), 0.36)])
def test_wrong_wheelbase_turns_the_robot_too_far(urdf, tmp_path, sizes, turn):
    """The controller steers tan a = L w / v. With an L that is 20 % too large the robot turns at 1.2 w."""
    true, given = sizes
    sim = ackermann(urdf, tmp_path, ACKERMANN.replace(f"wheelbase: {true}", f"wheelbase: {given}"))
    sim.cmd_vel(0.5, 0.3)
    sim.run(2.0)
    assert sim.ground_truth.twist.yaw == pytest.approx(turn, rel=0.03)
    assert sim.odometry.twist.yaw == pytest.approx(0.3, rel=0.03)
    assert [d.code for d in sim.diagnostics] == ["D105"] * (given != true)


def test_gz_steering_limit_bounds_the_curvature(urdf):
    """gz's smallest radius is the wheelbase over the sine of the limit, in reverse too."""
    settings = "<steering_limit>0.4</steering_limit><wheel_base>0.5</wheel_base>"
    sim = Simulation(urdf(CAR.replace("<left_joint>", f"{settings}<left_joint>", 1)))
    for speed in (0.3, -0.3):
        sim.cmd_vel(speed, 2.0)
        sim.run(3.0)
        assert sim.ground_truth.twist.yaw == pytest.approx(0.3 * sin(0.4) / 0.5, rel=0.02)


def test_tricycle_controller_steers_at_its_rate(urdf, tmp_path):
    """The type beside the parameters is the one that a spawner reads."""
    parameters = """
trike:
  ros__parameters:
    {type: tricycle_controller/TricycleController, traction_joint_name: front_joint,
     steering_joint_name: front_steering,
     wheel_radius: 0.1, wheelbase: 0.5, steering: {max_velocity: 0.2}}
"""
    sim = Simulation(urdf(TRICYCLE.replace("</robot>", controlled(tmp_path, parameters))))
    assert sim.robots.first.drive.joints == ("front_joint",)
    sim.cmd_vel(0.3, 0.5)
    sim.run(2.0)
    assert sim.joint_positions["front_steering"] == pytest.approx(0.2 * 2.0, abs=0.03)
    sim.bus.publish("/trike/cmd_vel", TwistStamped(Header(), Twist(Vector3(0.2))))
    sim.run(0.4)
    assert sim.robots.first.commanded_twist.x == 0.2


def test_published_car_without_joints_to_roll_on_is_driven(shared):
    """Its joints named right are on the left, and all mimic virtual joints."""
    file = "ros-controls+ros2_control_demos/example_11/description/urdf/carlikebot.urdf.xacro.urdf"
    drive = find_drive(load_robot(shared / "corpus/expected" / file).require())
    assert isinstance(drive, SteeredDrive)
    assert drive.joints == ("rear_right_wheel_joint", "rear_left_wheel_joint")
    assert drive.steering == ("front_right_wheel_joint", "front_left_wheel_joint")


def test_front_wheels_without_a_joint_to_roll_on_are_driven_as_if_they_rolled(urdf):
    """Cylinders that are fixed to the steering joints, which mimic a virtual joint, as the rear wheels do."""

    def front(side: str, y: float) -> str:
        fixed = wheel(f"front_{side}", "base_link", BASE, y).replace("continuous", "revolute")
        limit = '<axis xyz="0 0 1"/><limit lower="-0.6" upper="0.6" effort="50" velocity="5"/>'
        return fixed.replace('<axis xyz="0 1 0"/>', limit + '<mimic joint="steer"/>')

    rear = REAR.replace("</joint>", '<mimic joint="roll"/></joint>')
    virtual = "".join(
        f'<link name="{name}_link"/><joint name="{name}" type="{kind}"><parent link="base_link"/>'
        f'<child link="{name}_link"/><limit lower="-0.6" upper="0.6" effort="5" velocity="5"/>'
        f'<axis xyz="{axis}"/></joint>'
        for name, kind, axis in (("roll", "continuous", "0 1 0"), ("steer", "revolute", "0 0 1"))
    )
    sim = Simulation(urdf(body(rear + front("left", TRACK / 2) + front("right", -TRACK / 2) + virtual)))
    drive = sim.robots.first.drive
    assert (drive.joints, len(drive.steering)) == (("left_joint", "right_joint"), 2)
    for turn in (0.2, -0.2):
        sim.cmd_vel(0.4, turn)
        sim.run(2.0)
        assert (sim.ground_truth.twist.x, sim.ground_truth.twist.yaw) == pytest.approx((0.4, turn), rel=0.03)
    assert_odometry_is_true(sim)


def test_suspension_that_nothing_holds_is_named(urdf):
    """Swing arms of 0.3 m without springs drop the body, which moves while the wheels do not roll."""

    def swinging(side: str, y: float) -> str:
        inertia = '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/>'
        return (
            f'<link name="{side}_arm"><inertial><mass value="0.5"/>{inertia}</inertial></link>'
            f'<joint name="{side}_swing" type="revolute"><parent link="base_link"/><child link="{side}_arm"/>'
            f'<origin xyz="0.3 {y} 0.1"/><axis xyz="0 1 0"/>'
            '<limit lower="-0.6" upper="0.6" effort="0" velocity="0"/></joint>'
        ) + wheel(side, f"{side}_arm", -0.3, 0.0).replace('xyz="-0.3 0.0 0"', 'xyz="-0.3 0 -0.1"')

    sides = swinging("left", TRACK / 2) + swinging("right", -TRACK / 2)
    sim = Simulation(urdf(body(sides + wheel("front", "base_link", BASE, 0.0, steered=True))))
    sim.cmd_vel(0.3, 0.0)
    sim.run(5.0)
    (found,) = [finding for finding in sim.findings if finding.code in ("W301", "W307")]
    assert "_swing' gives way by " in found.message


def test_geared_front_wheels_drive_too(urdf):
    """Nothing names the driving joints. Front wheels with a dry friction of 15 N m do not roll freely."""
    text = CAR[: CAR.index("<gazebo>")]
    for side in ("left", "right"):
        head, joint, tail = text.partition(f'<joint name="front_{side}_joint"')
        text = head + joint + tail.replace("</joint>", '<dynamics friction="15"/></joint>', 1)
    sim = Simulation(urdf(text + "</robot>"))
    assert len(sim.robots.first.drive.joints) == 4
    sim.cmd_vel(0.5, 0.2)
    sim.run(2.0)
    assert (sim.ground_truth.twist.x, sim.ground_truth.twist.yaw) == pytest.approx((0.5, 0.2), rel=0.02)


def test_steering_limit_bounds_the_curvature(urdf):
    """At a limit of 1.2 rad a tricycle turns at v tan(1.2) / L, for any larger command."""
    sim = Simulation(urdf(TRICYCLE))
    sim.cmd_vel(0.1, 3.0)
    sim.run(3.0)
    before = sim.ground_truth.unwrapped_yaw
    sim.run(2.0)
    rate = (sim.ground_truth.unwrapped_yaw - before) / 2.0
    assert sim.joint_positions["front_steering"] == pytest.approx(1.2, abs=0.02)
    assert rate == pytest.approx(0.1 * tan(1.2) / BASE, rel=0.02)


@pytest.mark.parametrize("linear", [0.0, 0.05])
def test_a_curve_that_the_steering_limits_do_not_allow_is_reported(urdf, linear):
    sim = Simulation(urdf(TRICYCLE))
    sim.cmd_vel(linear, 0.5)
    sim.run(5.0)
    [finding] = sim.findings
    assert finding.code == "W307"
    radius = BASE / tan(1.2)
    assert f"its steering limits allow no curve with a radius below {radius:.3g} m" in finding.message
    assert 'lower="-1.2"' in finding.origin.span.text


def test_a_steering_limit_is_reported_beside_an_error_of_odometry(urdf, tmp_path):
    """The controller computes with a wheelbase that is 20 % too large."""
    parameters = ACKERMANN.replace("wheelbase: 0.5", "wheelbase: 0.6")
    sim = Simulation(urdf(CAR[: CAR.index("<gazebo>")] + controlled(tmp_path, parameters)))
    sim.cmd_vel(0.3, 3.0)
    sim.run(5.0)
    off, missed = sorted(sim.findings, key=lambda finding: finding.code)
    assert (off.code, missed.code) == ("W301", "W307")
    assert "commanded" not in off.message
    assert "its steering limits allow no curve with a radius below" in missed.message


@pytest.mark.parametrize("name", ["tricycle", "front driven"])
@pytest.mark.parametrize("end", ["1.57", "1.8"])
def test_tricycle_with_a_wheel_at_90_degrees_turns_on_the_spot(urdf, name, end):
    """4 s at 0.5 rad/s, minus the time to accelerate at 8 rad/s^2 and to steer the wheel."""
    sim = Simulation(urdf(BASES[name].replace('lower="-1.2" upper="1.2"', f'lower="-{end}" upper="{end}"')))
    sim.cmd_vel(0.0, 0.5)
    sim.run(4.0)
    truth = sim.ground_truth.pose
    assert truth.yaw == pytest.approx(2.0, abs=0.06)
    assert (truth.x, truth.y) == pytest.approx((0.0, 0.0), abs=0.01)
    assert_odometry_is_true(sim, within=0.01)


def test_steered_run_repeats_after_a_restore_and_a_reset(urdf):
    sim = Simulation(urdf(CAR))
    sim.cmd_vel(0.4, 0.3)
    sim.run(1.0)
    saved = sim.state()
    sim.run(1.0)
    once, pose = sim.state_sha256(), sim.odometry.pose
    sim.restore(saved)
    sim.run(1.0)
    assert (sim.state_sha256(), sim.odometry.pose) == (once, pose)
    sim.reset()
    assert (sim.odometry.pose.x, sim.odometry.pose.yaw) == (0.0, 0.0)
    sim.cmd_vel(0.4, 0.3)
    sim.run(2.0)
    assert sim.state_sha256() == once


@pytest.mark.parametrize("axles", [(0.2, -0.2), (0.25, 0.0, -0.25)])
def test_skid_steer_drives_straight_and_turns_slower_than_its_wheels_indicate(urdf, axles):
    """A skid steer turns on the spot, but less than its track predicts, because its wheels slip sideways.

    Mandow et al. 2007: its effective track is wider than the real one.
    """
    wheels = "".join(
        wheel(f"{side}_{i}", "base_link", x, y) for i, x in enumerate(axles)
        for side, y in (("left", 0.25), ("right", -0.25))
    )  # fmt: skip
    robot = urdf(body(wheels, x=0.0))
    sim = Simulation(robot)
    assert len(sim.robots.first.drive.joints) == 2 * len(axles)
    sim.cmd_vel(0.4, 0.0)
    sim.run(4.0)
    pose = sim.ground_truth.pose
    assert pose.x == pytest.approx(0.4 * 4.0 - 0.4**2 / 2, abs=0.02)
    assert (pose.y, pose.yaw) == pytest.approx((0.0, 0.0), abs=2e-3)
    sim.cmd_vel(0.0, 1.0)
    sim.run(4.0)
    turned = sim.ground_truth.unwrapped_yaw - pose.yaw
    assert 0.2 < turned / (sim.odometry.unwrapped_yaw - pose.yaw) < 0.98


def skid_steer(length, width):
    """Four wheels at +-length and +-width, in m, and their joints as a drive plugin names them."""
    wheels = "".join(
        wheel(f"{side}_{i}", "base_link", x, y) for i, x in enumerate((length, -length))
        for side, y in (("left", width), ("right", -width))
    )  # fmt: skip
    names = "".join(
        f"<{side}_joint>{side}_{i}_joint</{side}_joint>" for side in ("left", "right") for i in (0, 1)
    )
    return wheels, names


@pytest.mark.parametrize("source", ["0", "1"])
def test_slip_is_the_cause_also_if_odometry_is_the_true_pose(urdf, source):
    """True odometry does not show that the wheels turn as commanded, and that the base turns half as far."""
    wheels, names = skid_steer(0.2, 0.2)
    settings = f"{names}<num_wheel_pairs>2</num_wheel_pairs><odometry_source>{source}</odometry_source>"
    plugin = f'<plugin filename="libgazebo_ros_diff_drive.so" name="diff">{settings}</plugin>'
    sim = Simulation(urdf(body(wheels, f"<gazebo>{plugin}</gazebo>", x=0.0)))
    sim.cmd_vel(0.0, 0.5)
    sim.run(5.0)
    [finding] = sim.findings
    assert "a turn drags the wheels of 2 axles across the ground" in finding.message


@pytest.mark.parametrize("separation", [0.8, 1.2])
def test_a_wheel_separation_that_assumes_too_much_slip_is_the_cause(urdf, separation):
    """The wheels, 0.5 m apart, turn for 0.8 / 0.5 or 1.2 / 0.5 of the command, and the robot turns less than
    they roll, but more than commanded. With 0.8 m the slip is most of the error, and with 1.2 m the size."""
    wheels, names = skid_steer(0.1, 0.25)
    sizes = f"<wheel_separation>{separation}</wheel_separation><wheel_radius>0.1</wheel_radius>"
    plugin = f'<plugin filename="gz-sim-diff-drive-system" name="diff">{names}{sizes}</plugin>'
    sim = Simulation(urdf(body(wheels, f"<gazebo>{plugin}</gazebo>", x=0.0)))
    sim.cmd_vel(0.0, 0.5)
    sim.run(5.0)
    [finding] = sim.findings
    assert finding.code == "W301"
    assert f"because they slip less than its wheel separation of {separation} m assumes" in finding.message


@pytest.mark.parametrize("base", BASES)
def test_page_drives_a_steered_base(base, tmp_path, monkeypatch):
    """0.3 m/s for 2 s, minus the ramp of 1 m/s^2 and the servos' lag, gives about 0.55 m."""
    monkeypatch.setattr("kbot.workbench.driving.driving.BUSY_SECONDS", inf)
    (tmp_path / "base.urdf").write_text(BASES[base])
    session = open_session(str(tmp_path / "base.urdf"), simulate=True)
    about = session.about()
    assert about.cannot_drive == ""
    assert min(about.linear_limit, about.angular_limit) > 0.0
    for _ in range(20):
        session.handle(Drive(0.3, 0.0), 1)
        session.advance(0.1)
    assert session.state().odometry[0] == pytest.approx(0.55, abs=0.05)
