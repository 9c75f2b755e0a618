"""Bases that also drive sideways move as their plugin or controller computes, within the laws of physics."""

from math import cos, hypot, inf, pi, radians, sin

import pytest

from kbot.checks import Config, check_text
from kbot.kinematics.angles import wrap
from kbot.kinematics.drive.drive import HolonomicDrive, NoDrive, find_drive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages import Odometry, Twist, TwistStamped, Vector3
from kbot.model.load import load_robot_text
from kbot.navigation.with_map.go_to import go_to
from kbot.record.replay import repeat_action
from kbot.sim import Simulation
from kbot.sim.injected_faults import BlockedJoint, Slip
from kbot.sim.recipe import SERVO_STIFFNESS
from kbot.text import Diagnostic, KbotError
from kbot.workbench.protocol import Drive
from kbot.workbench.serve import open_session
from kbot.world import load_world

RADIUS, AHEAD, ASIDE = 0.05, 0.2, 0.15
"""Wheel radius, and distance of the wheels from the middle along x and y, in m."""
LEVER = AHEAD + ASIDE
CORNERS = {"front_left": (1, 1), "front_right": (1, -1), "rear_left": (-1, 1), "rear_right": (-1, -1)}
GRAVITY = 9.81


def wheel(name: str, x: float, y: float, turn: float = 0.0, limit: str = "") -> str:
    """A wheel that rolls along x, turned by `turn` about z."""
    return (
        f'<link name="{name}"><inertial><mass value="0.5"/>'
        '<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
        f'<origin rpy="{pi / 2} 0 0"/><geometry><cylinder radius="{RADIUS}" length="0.03"/></geometry>'
        f'</collision></link><joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
        f'<child link="{name}"/><origin xyz="{x} {y} {RADIUS}" rpy="0 0 {turn}"/><axis xyz="0 1 0"/>{limit}'
        "</joint>"
    )


def body(wheels: str, extension: str) -> str:
    return (
        '<robot name="base"><link name="base_link"><inertial><origin xyz="0 0 0.1"/><mass value="10"/>'
        '<inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
        '<origin xyz="0 0 0.12"/><geometry><box size="0.5 0.2 0.1"/></geometry></collision></link>'
        f"{wheels}{extension}</robot>"
    )


FOUR = "".join(wheel(name, x * AHEAD, y * ASIDE) for name, (x, y) in CORNERS.items())


def plugin(filename: str, inner: str = "", name: str = "drive") -> str:
    return f'<gazebo><plugin filename="{filename}" name="{name}">{inner}</plugin></gazebo>'


def gz_mecanum(radius: float = RADIUS, along: float = 2 * AHEAD) -> str:
    joints = "".join(
        f"<{name.replace('rear', 'back')}_joint>{name}_joint</{name.replace('rear', 'back')}_joint>"
        for name in CORNERS
    )
    sizes = f"<wheel_separation>{2 * ASIDE}</wheel_separation><wheelbase>{along}</wheelbase>"
    inner = f"{joints}{sizes}<wheel_radius>{radius}</wheel_radius>"
    return plugin("gz-sim-mecanum-drive-system", inner, "gz::sim::systems::MecanumDrive")


PLANAR = plugin("libgazebo_ros_planar_move.so")
MOVERS = (
    PLANAR,
    plugin("libhector_gazebo_ros_force_based_move.so"),
    plugin("libridgeback_ros_force_based_move.so"),
    plugin("gz-sim-velocity-control-system", "", "gz::sim::systems::VelocityControl"),
)
"""The plugins that move the base itself."""
MECANUM = body(FOUR, gz_mecanum())
OMNI_ANGLES = [pi / 3, pi, 5 * pi / 3]
"""Where three omni wheels are: counterclockwise from the `wheel_offset` of 60 degrees."""
OMNI_ARM = 0.2


def with_controller(tmp_path, wheels: str, kind: str, parameters: str) -> str:
    """A robot with a controller of ros2_control that drives its wheels."""
    yaml = tmp_path / "controllers.yaml"
    yaml.write_text(
        f"controller_manager: {{ros__parameters: {{base: {{type: {kind}}}}}}}\n"
        f"base: {{ros__parameters: {{{parameters}}}}}\n"
    )
    return body(wheels, plugin("libgz_ros2_control-system.so", f"<parameters>{yaml}</parameters>", "control"))


def ros2_mecanum(tmp_path, more: str = "") -> str:
    names = ", ".join(f"{name}_wheel_command_joint_name: {name}_joint" for name in CORNERS)
    sizes = (
        f"kinematics: {{wheels_radius: {RADIUS}, sum_of_robot_center_projection_on_X_Y_axis: {LEVER:.3f}}}"
    )
    kind = "mecanum_drive_controller/MecanumDriveController"
    return with_controller(tmp_path, FOUR, kind, f"{names}, {sizes}{more}")


def ros2_omni(tmp_path) -> str:
    wheels = "".join(
        # a positive speed drives clockwise along the circle, as omni_wheel_drive_controller requires
        wheel(f"wheel_{i}", OMNI_ARM * cos(angle), OMNI_ARM * sin(angle), angle - pi / 2)
        for i, angle in enumerate(OMNI_ANGLES)
    )
    kind = "omni_wheel_drive_controller/OmniWheelDriveController"
    names = "[wheel_0_joint, wheel_1_joint, wheel_2_joint]"
    sizes = f"wheel_radius: {RADIUS}, robot_radius: {OMNI_ARM}, wheel_offset: {OMNI_ANGLES[0]}"
    return with_controller(tmp_path, wheels, kind, f"wheel_names: {names}, {sizes}")


@pytest.fixture(params=["planar_move", "gz MecanumDrive", "ROS 2 mecanum", "ROS 2 omni"])
def description(request, tmp_path) -> str:
    """A robot with each kind of drive."""
    if request.param == "planar_move":
        return body(FOUR, PLANAR)
    builders = {"ROS 2 mecanum": ros2_mecanum, "ROS 2 omni": ros2_omni}
    return builders[request.param](tmp_path) if request.param in builders else MECANUM


def simulate(text: str, **options) -> Simulation:
    return Simulation(load_robot_text(text, "base.urdf").require(), **options)


def after(x: float, y: float, yaw: float, seconds: float) -> PlanarPose:
    """The pose after a constant twist (Lynch and Park, Modern Robotics, 13.4: the exponential of se(2))."""
    turned = yaw * seconds
    if not turned:
        return PlanarPose(x * seconds, y * seconds)
    ahead, aside = sin(turned) / yaw, (1.0 - cos(turned)) / yaw
    return PlanarPose(x * ahead - y * aside, x * aside + y * ahead, turned)


def drive_as_commanded(sim: Simulation, twist: tuple[float, float, float]) -> None:
    """Drive for 6 s, and assert that the base moves along the commanded arc after the first second."""
    x, y, yaw = twist
    sim.cmd_vel(x, yaw, lateral=y)
    sim.run(1.0)
    start = sim.ground_truth.pose
    sim.run(5.0)
    moved, expected = start.inverse() @ sim.ground_truth.pose, after(x, y, yaw, 5.0)
    assert (moved.x, moved.y) == pytest.approx((expected.x, expected.y), abs=0.003)
    assert moved.yaw == pytest.approx(expected.yaw, abs=0.005)


@pytest.mark.parametrize(
    ("contacts", "twist"),
    [
        ("recipe", (0.3, 0.0, 0.0)),
        ("recipe", (0.0, 0.3, 0.0)),
        ("recipe", (0.0, 0.0, 0.5)),
        ("recipe", (0.2, -0.1, 0.5)),
        ("as-written", (0.2, -0.1, 0.5)),
    ],
)
def test_the_base_moves_as_commanded_in_every_direction(description, contacts, twist):
    sim = simulate(description, contacts=contacts)
    drive_as_commanded(sim, twist)
    truth, odometry = sim.ground_truth, sim.odometry
    assert hypot(truth.pose.x - odometry.pose.x, truth.pose.y - odometry.pose.y) < 0.003
    assert truth.pose.yaw == pytest.approx(odometry.pose.yaw, abs=0.005)
    given = (odometry.twist.x, odometry.twist.y, odometry.twist.yaw)
    assert given == pytest.approx(twist, abs=0.002)
    assert sim.findings == ()


def test_a_run_from_rest_covers_the_distance_of_the_ramp():
    """v (t - v / 2a), with the default limit of 1 m/s^2."""
    sim = simulate(body(FOUR, PLANAR))
    sim.cmd_vel(0.0, 0.0, lateral=0.4)
    sim.run(3.0)
    assert sim.ground_truth.pose.y == pytest.approx(0.4 * (3.0 - 0.2), abs=0.001)


def test_mecanum_wheels_turn_as_gz_and_ros2_control_compute(tmp_path):
    x, y, yaw = 0.2, 0.1, 0.5
    for text in (MECANUM, ros2_mecanum(tmp_path)):
        sim = simulate(text)
        sim.cmd_vel(x, yaw, lateral=y)
        sim.run(1.0)
        speeds = sim.robots.first.body.joint_velocities
        turn = LEVER * yaw
        expected = {
            "front_left_joint": (x - y - turn) / RADIUS,
            "front_right_joint": (x + y + turn) / RADIUS,
            "rear_left_joint": (x + y - turn) / RADIUS,
            "rear_right_joint": (x - y + turn) / RADIUS,
        }
        assert speeds == pytest.approx(expected, rel=1e-3)


def test_omni_wheels_turn_as_ros2_control_computes(tmp_path):
    x, y, yaw = 0.2, 0.1, 0.5
    sim = simulate(ros2_omni(tmp_path))
    sim.cmd_vel(x, yaw, lateral=y)
    sim.run(1.0)
    expected = [(sin(a) * x - cos(a) * y - OMNI_ARM * yaw) / RADIUS for a in OMNI_ANGLES]
    assert list(sim.robots.first.body.joint_velocities.values()) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("names", "sizes"),
    [
        ("{}_wheel_joint", "wheel_separation_x: 0.4, wheel_separation_y: 0.3, wheel_radius: 0.05"),
        ("{}_wheel_name", "wheel_separation_x: 0.4, wheel_separation_y: 0.3, wheel_radius: 0.05"),
        ("{}_joint_name", "wheel_base: 0.4, wheel_separation: 0.3, wheel_radius: 0.05"),
    ],
    ids=["ROS 1", "husarion", "yahboom"],
)
def test_copies_of_the_mecanum_controller_have_other_parameters(tmp_path, names, sizes):
    wheels = ", ".join(f"{names.format(name)}: {name}_joint" for name in CORNERS)
    kind = "my_mecanum_drive_controller/MecanumDriveController"
    sizes = sizes.replace("0.4", "0.5")  # a wrong one
    robot = simulate(with_controller(tmp_path, FOUR, kind, f"{wheels}, {sizes}")).robots.first
    assert robot.drives_sideways
    assert robot.settings is not None
    assert (robot.settings.radius, robot.settings.separation) == pytest.approx((RADIUS, 0.5 + 0.3))
    assert set(robot.settings.command_topics) == {"cmd_vel", "base/cmd_vel"}


@pytest.mark.parametrize("extension", MOVERS)
def test_wheels_of_a_base_that_its_plugin_moves_are_free(extension):
    drive = find_drive(load_robot_text(body(FOUR, extension), "base.urdf").require())
    assert isinstance(drive, HolonomicDrive)
    assert drive.joints == ()
    assert set(drive.casters) == set(CORNERS)


def test_the_base_circles_about_the_middle_of_the_wheels():
    """It turns by 0.5 rad/s, 0.2 m ahead of the middle, and so drives to the left at 0.1 m/s."""
    behind = "".join(wheel(name, x * AHEAD - 0.2, y * ASIDE) for name, (x, y) in CORNERS.items())
    sim = simulate(body(behind, gz_mecanum()))
    sim.cmd_vel(0.0, 0.5)
    sim.run(3.0)
    for motion in (sim.ground_truth, sim.odometry):
        twist, pose = motion.twist, motion.pose
        assert (twist.x, twist.y, twist.yaw) == pytest.approx((0.0, 0.1, 0.5), abs=2e-3)
        middle = pose.x - 0.2 * cos(pose.yaw), pose.y - 0.2 * sin(pose.yaw)
        assert middle == pytest.approx((-0.2, 0.0), abs=2e-3)


def test_a_sideways_command_far_above_the_limit_is_reported():
    limited = gz_mecanum().replace("</plugin>", "<max_velocity>0.5</max_velocity></plugin>")
    sim = simulate(body(FOUR, limited))
    sim.cmd_vel(0.0, 0.0, lateral=300.0)
    sim.run(2.0)
    assert sim.ground_truth.twist.y == pytest.approx(0.5, rel=0.01)
    [finding] = sim.findings
    assert finding.code == "W305"
    assert "300 m/s" in finding.message


def test_a_controller_with_a_wrong_radius_drives_too_far():
    """It turns the wheels for a radius of 0.06 m, and they have 0.05 m."""
    sim = simulate(body(FOUR, gz_mecanum(radius=0.06)))
    sim.cmd_vel(0.0, 0.0, lateral=0.3)
    sim.run(6.0)
    truth, odometry = sim.ground_truth, sim.odometry
    assert truth.twist.y == pytest.approx(0.3 * 0.05 / 0.06, rel=1e-3)
    assert odometry.twist.y == pytest.approx(0.3, rel=1e-3)
    assert truth.pose.y / odometry.pose.y == pytest.approx(0.05 / 0.06, rel=0.01)
    [finding] = sim.findings
    assert finding.code == "W301"
    assert "its wheel radius is 0.06 m, but the wheels have 0.05: distances are +20 % off" in finding.message


def test_a_controller_with_a_wrong_wheelbase_turns_wrongly():
    sim = simulate(body(FOUR, gz_mecanum(along=1.0)))
    sim.cmd_vel(0.0, 0.5)
    sim.run(2.0)
    assert sim.ground_truth.twist.yaw == pytest.approx(0.5 * (0.5 + ASIDE) / LEVER, rel=1e-3)
    assert sim.odometry.twist.yaw == pytest.approx(0.5, rel=1e-3)
    [finding] = sim.findings
    assert finding.code == "W301"
    given, true = 2.0 * (0.5 + ASIDE), 2.0 * LEVER
    assert f"along x and y add up to {true:.4g} m, not {given:.4g}: turns are +" in finding.message


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            (f"robot_radius: {OMNI_ARM}", "robot_radius: 0.3"),
            "the wheels are 0.2 m from their middle, not 0.3",
        ),
        ((f"Y_axis: {LEVER:.3f}", "Y_axis: 0.5"), f"add up to {2 * LEVER:.4g} m, not 1: turns are +"),
    ],
)
def test_a_controller_with_a_wrong_lever_is_reported(tmp_path, change, message):
    text = ros2_omni(tmp_path) if change[0].startswith("robot_radius") else ros2_mecanum(tmp_path)
    yaml = tmp_path / "controllers.yaml"
    assert not lever_findings(text)
    yaml.write_text(yaml.read_text().replace(*change))
    [finding] = lever_findings(text)
    assert finding.code == "D105"
    assert message in finding.message
    assert finding.origin.span.text == change[1].partition(": ")[2]


@pytest.mark.parametrize("tag", ["wheel_separation", "wheelbase"])
def test_the_distance_between_mecanum_wheels_that_is_wrong_is_underlined(tag):
    right = {"wheel_separation": 2 * ASIDE, "wheelbase": 2 * AHEAD}[tag]
    [finding] = lever_findings(body(FOUR, gz_mecanum().replace(f"<{tag}>{right}", f"<{tag}>0.9")))
    assert finding.code == "D105"
    assert finding.origin.span.text == "0.9"
    before = finding.origin.span.source.data[: finding.origin.span.start]
    assert before.endswith(f"<{tag}>".encode())


def lever_findings(text: str) -> tuple[Diagnostic, ...]:
    robot = load_robot_text(text, "base.urdf").require()
    return findings_of_drive(robot, find_drive(robot))


WALL = (
    '<sdf version="1.9"><world name="w"><model name="ground"><static>true</static><link name="l">'
    '<collision name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link>'
    '</model><model name="wall"><static>true</static><pose>0 1 0.5 0 0 0</pose><link name="l">'
    '<collision name="c">'
    "<geometry><box><size>4 0.2 1</size></box></geometry></collision></link></model></world></sdf>"
)


def test_a_wall_stops_the_base(description, tmp_path):
    world = tmp_path / "wall.sdf"
    world.write_text(WALL)
    sim = simulate(description, world=str(world))
    height = sim.link_pose("base_link").translation[2]
    sim.cmd_vel(0.0, 0.0, lateral=0.5)
    sim.run(6.0)
    pose = sim.link_pose("base_link")
    reach = 0.9 - sim.ground_truth.pose.y
    assert 0.1 < reach < 0.25  # half the robot's width
    assert pose.translation[2] == pytest.approx(height, abs=0.002)
    assert pose.rotation[2, 2] > 0.999
    assert sim.collided
    assert "W302" in [finding.code for finding in sim.findings]


def tilted(degrees: float) -> str:
    """A world on a slope that falls along -x, from the point of view of the slope."""
    x, z = -GRAVITY * sin(radians(degrees)), -GRAVITY * cos(radians(degrees))
    return (
        f'<sdf version="1.9"><world name="w"><gravity>{x} 0 {z}</gravity><model name="ground">'
        '<static>true</static><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal>'
        "</plane></geometry></collision></link></model></world></sdf>"
    )


def test_the_base_holds_on_a_slope_and_climbs_it(description, tmp_path):
    world = tmp_path / "slope.sdf"
    world.write_text(tilted(20.0))
    sim = simulate(description, world=str(world))
    sim.run(2.0)
    rest = sim.ground_truth.pose.x
    sim.run(5.0)
    assert sim.ground_truth.pose.x == pytest.approx(rest, abs=1e-4)
    sim.cmd_vel(0.3, 0.0)
    sim.run(2.0)
    assert sim.ground_truth.twist.x == pytest.approx(0.3, rel=0.02)


def test_the_base_slides_down_where_friction_does_not_hold_it(description, tmp_path):
    """With a friction of 1 it accelerates at g (sin a - cos a)."""
    world = tmp_path / "slope.sdf"
    world.write_text(tilted(60.0))
    sim = simulate(description, world=str(world))
    sim.run(1.0)
    before = sim.ground_truth.twist.x
    sim.run(1.0)
    expected = -GRAVITY * (sin(radians(60.0)) - cos(radians(60.0)))
    assert sim.ground_truth.twist.x - before == pytest.approx(expected, rel=0.02)


def test_nothing_moves_the_base_in_the_air(description):
    sim = simulate(description)
    sim.run(0.2)
    above = Transform.from_xyz_rpy((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    sim.models.set_model_state("base", above @ sim.link_pose("base_link"), (0.0,) * 3, (0.0,) * 3)
    sim.run(0.04)  # the load on the wheels is measured every 0.02 s
    sim.cmd_vel(0.5, 0.0, lateral=0.5)
    sim.run(0.3)
    # spinning up the wheels pitches the body slightly
    assert hypot(sim.ground_truth.twist.x, sim.ground_truth.twist.y) < 0.05


def test_weak_motors_limit_the_force():
    """Four motors of 0.05 N m on wheels of 5 cm push with 4 N. They also speed up the wheels themselves."""
    limit = '<limit effort="0.05" velocity="0"/>'
    weak = "".join(wheel(name, x * AHEAD, y * ASIDE, 0.0, limit) for name, (x, y) in CORNERS.items())
    sim = simulate(body(weak, gz_mecanum()))
    sim.cmd_vel(0.0, 0.0, lateral=2.0)
    sim.run(0.5)
    before = sim.ground_truth.twist.y
    sim.run(0.5)
    inert = 12.0 + 4 * 0.001 / RADIUS**2
    assert sim.ground_truth.twist.y - before == pytest.approx(4.0 / inert * 0.5, rel=0.02)


def test_wheels_without_friction_do_not_move_the_base():
    slippery = "".join(f'<gazebo reference="{name}"><mu1>0</mu1></gazebo>' for name in CORNERS)
    sim = simulate(body(FOUR, gz_mecanum() + slippery))
    sim.cmd_vel(0.3, 0.0)
    sim.run(3.0)
    assert sim.ground_truth.pose.x == pytest.approx(0.0, abs=0.01)
    [finding] = sim.findings
    assert finding.code == "W302"
    assert "the coefficient of friction of the wheels is only 0" in finding.message


def test_a_blocked_wheel_slows_the_base():
    """Its speed is missing in the mean of the four wheels."""
    sim = simulate(MECANUM)
    sim.disturbances.schedule(BlockedJoint("front_left_joint"), 0.0)
    sim.cmd_vel(0.3, 0.0)
    sim.run(2.0)
    assert sim.odometry.twist.x == pytest.approx(0.225, rel=0.01)
    assert sim.ground_truth.twist.x == pytest.approx(0.225, rel=0.02)


def test_a_wheel_that_carries_the_base_has_no_friction_to_change():
    sim = simulate(MECANUM)
    with pytest.raises(KbotError, match="slides freely"):
        sim.disturbances.schedule(Slip("front_left", 0.1), 0.0)


def test_the_true_pose_is_the_odometry_of_planar_move_after_a_push():
    start = PlanarPose(1.0, 2.0, pi / 2)
    sim = simulate(body(FOUR, PLANAR), start=start)
    sim.disturbances.apply_body_wrench("base_link", (200.0, 30.0, 0.0), 0.3, (0.0, 0.0, 20.0))
    sim.run(2.0)
    truth, odometry = sim.ground_truth.pose, start @ sim.odometry.pose
    assert hypot(truth.x - 1.0, truth.y - 2.0) > 0.05
    assert (odometry.x, odometry.y, odometry.yaw) == pytest.approx((truth.x, truth.y, truth.yaw), abs=1e-9)
    sim.reset()
    pose = sim.odometry.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_a_steep_ramp_is_not_an_error_of_true_odometry(tmp_path):
    sim = simulate(body(FOUR, PLANAR), world=load_world("ramp"))
    sim.cmd_vel(0.4, 0.0)
    sim.run(6.0)
    assert "W301" not in [finding.code for finding in sim.findings]


@pytest.mark.parametrize("stamped", [False, True])
def test_topics_carry_sideways_commands_and_odometry(tmp_path, stamped):
    sim = simulate(ros2_mecanum(tmp_path, "" if stamped else ", use_stamped_vel: false"))
    received: list[Odometry] = []
    sim.bus.subscribe("/base/odometry", Odometry, received.append)
    twist = Twist(Vector3(0.0, 0.2, 0.0))
    topic, message = (
        ("/base/reference", TwistStamped(twist=twist)) if stamped else ("/base/reference_unstamped", twist)
    )
    publisher = sim.bus.advertise(topic, type(message))
    for _ in range(20):
        publisher.publish(message)
        sim.run(0.1)
    last = received[-1]
    assert last.twist.twist.linear.y == pytest.approx(0.2, rel=1e-3)
    way = 0.2 * (2.0 - 0.1) - 0.2 / SERVO_STIFFNESS  # wheels run behind their servos
    assert last.pose.pose.position.y == pytest.approx(way, abs=0.002)


def test_limits_of_the_controller_apply_to_each_direction(tmp_path):
    more = ", linear: {y: {max_velocity: 0.1, max_acceleration: 0.5}}"
    sim = simulate(ros2_mecanum(tmp_path, more))
    sim.cmd_vel(0.3, 0.0, lateral=0.3)
    sim.run(1.0)
    assert (sim.ground_truth.twist.x, sim.ground_truth.twist.y) == pytest.approx((0.3, 0.1), rel=0.01)


def test_other_robots_do_not_drive_sideways(sim):
    with pytest.raises(KbotError, match="robot 'kbot' cannot drive sideways"):
        sim.cmd_vel(0.1, 0.0, lateral=0.1)


def test_a_sideways_command_on_a_topic_of_another_robot_is_reported_once(sim):
    reports: list[str] = []
    sim.journal.listeners.append(reports.append)
    publisher = sim.bus.advertise("/cmd_vel", Twist)
    for _ in range(3):
        publisher.publish(Twist(Vector3(0.1, 0.2, 0.0)))
    assert reports == ["/cmd_vel: robot 'kbot' cannot drive sideways: linear.y is ignored"]
    assert sim.robots.first.commanded_twist.x == 0.1


def test_a_copy_of_planar_move_may_ignore_sideways_commands():
    sim = simulate(body(FOUR, plugin("libgazebo_ros_planar_move.so", "<enableYAxis>false</enableYAxis>")))
    with pytest.raises(KbotError, match="cannot drive sideways"):
        sim.cmd_vel(0.1, 0.0, lateral=0.1)
    sim.cmd_vel(0.3, 0.0)
    sim.run(2.0)
    assert sim.ground_truth.twist.x == pytest.approx(0.3, rel=0.01)


@pytest.mark.parametrize("count", [1, 4])
def test_a_wheel_whose_shape_is_not_round_drives_too(count):
    """Rollers, for example. The radius is that of the other wheels, or else that of the plugin."""
    box = FOUR.replace(f'<cylinder radius="{RADIUS}" length="0.03"/>', '<box size="0.1 0.1 0.03"/>', count)
    sim = simulate(body(box, gz_mecanum()))
    sim.cmd_vel(0.0, 0.0, lateral=0.3)
    sim.run(2.0)
    assert sim.ground_truth.twist.y == pytest.approx(0.3, rel=0.01)


def test_a_base_without_wheels_drives_in_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr("kbot.workbench.driving.driving.BUSY_SECONDS", inf)
    (tmp_path / "base.urdf").write_text(body("", PLANAR))
    session = open_session(str(tmp_path / "base.urdf"), simulate=True)
    assert session.about().cannot_drive == ""
    for _ in range(20):
        session.handle(Drive(0.3, 0.0), 1)
        session.advance(0.1)
    assert session.state().odometry[0] == pytest.approx(0.55, abs=0.05)


@pytest.mark.parametrize(
    ("extension", "reason"),
    [
        (gz_mecanum().replace("<front_left_joint>front_left_joint</front_left_joint>", ""), "four mecanum"),
        (gz_mecanum().replace(">front_left_joint<", ">front_lef_joint<"), "'front_lef_joint'"),
        (gz_mecanum().replace(">front_left_joint<", ">front_right_joint<"), "for more than one wheel"),
    ],
)
def test_a_plugin_that_does_not_name_its_wheels_does_not_drive(extension, reason):
    drive = find_drive(load_robot_text(body(FOUR, extension), "base.urdf").require())
    assert isinstance(drive, NoDrive)
    assert reason in drive.reason


def test_a_saved_state_continues_bit_for_bit(description):
    sim = simulate(description)
    sim.cmd_vel(0.2, 0.3, lateral=0.1)
    sim.run(0.53)
    state = sim.state()
    sim.run(1.0)
    first, odometry = sim.state_sha256(), sim.odometry
    sim.cmd_vel(0.0, 0.0)
    sim.run(0.3)
    sim.restore(state)
    sim.run(1.0)
    assert (sim.state_sha256(), sim.odometry) == (first, odometry)


def test_a_sideways_command_is_in_the_journal():
    sim, again = simulate(MECANUM), simulate(MECANUM)
    notes: list[tuple[str, dict[str, object]]] = []
    sim.journal.write = lambda what, note: notes.append((what, note))
    sim.cmd_vel(0.1, 0.2, lateral=0.3)
    for what, note in notes:
        repeat_action(again, what, note)
    assert again.robots.first.commanded_twist == PlanarTwist(0.1, 0.3, 0.2)


def test_a_changed_robot_continues_odometry_and_command(description):
    sim = simulate(description)
    sim.cmd_vel(0.2, 0.0, lateral=0.1)
    sim.run(1.0)
    other = sim.with_robot(load_robot_text(description.replace('"10"', '"11"'), "base.urdf").require())
    assert other.odometry.pose.y == pytest.approx(sim.odometry.pose.y, abs=1e-9)
    other.run(1.0)
    assert other.ground_truth.twist.y == pytest.approx(0.1, rel=0.01)


def test_a_goal_is_reached(description):
    sim = simulate(description)
    assert go_to(sim, PlanarPose(1.0, 0.5, 0.0), timeout=30.0).reached


TRACKS_APART, EFFICIENCY = 0.4, 0.5


def tracked(inner: str = "", apart: float = TRACKS_APART, controller: str = "") -> str:
    """A base on two tracks, with gz's TrackedVehicle and a TrackController for each track."""
    links = names = plugins = ""
    for side, y in (("left", 0.5), ("right", -0.5)):
        link = f"{side}_track"
        links += (
            f'<link name="{link}"><inertial><mass value="1"/>'
            '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
            '<geometry><box size="0.5 0.1 0.1"/></geometry></collision></link>'
            f'<joint name="{link}_joint" type="fixed"><parent link="base_link"/><child link="{link}"/>'
            f'<origin xyz="0 {y * TRACKS_APART} 0.05"/></joint>'
        )
        names += f"<{side}_track><link>{link}</link></{side}_track>"
        inside = f"<link>{link}</link>{controller}"
        plugins += plugin("gz-sim-track-controller-system", inside, "gz::sim::systems::TrackController")
    inside = f"{names}<tracks_separation>{apart}</tracks_separation>{inner}"
    vehicle = plugin("gz-sim-tracked-vehicle-system", inside, "gz::sim::systems::TrackedVehicle")
    return body(links, vehicle + plugins)


@pytest.mark.parametrize("twist", [(0.3, 0.5), (0.0, 0.5), (-0.2, -0.3)])
def test_tracks_slip_in_turns_by_the_steering_efficiency(twist):
    """gz turns the tracks by v +- w s / 2 e, so the base turns by w, and odometry counts w / e."""
    x, yaw = twist
    sim = simulate(tracked())
    sim.cmd_vel(x, yaw)
    sim.run(1.0)
    start, odometry = sim.ground_truth.pose, sim.odometry.pose
    sim.run(4.0)
    for before, now, turn in (
        (start, sim.ground_truth, yaw),
        (odometry, sim.odometry, yaw / EFFICIENCY),
    ):
        moved, expected = before.inverse() @ now.pose, after(x, 0.0, turn, 4.0)
        assert (moved.x, moved.y, moved.yaw) == pytest.approx(
            (expected.x, expected.y, wrap(expected.yaw)), abs=3e-3
        )
        assert (now.twist.x, now.twist.y, now.twist.yaw) == pytest.approx((x, 0.0, turn), abs=2e-3)
    [finding] = sim.findings
    assert finding.code == "W301"
    assert "turns the tracks 2 times as fast as without slip (steering_efficiency 0.5)" in finding.message


def test_tracks_without_slip_have_right_odometry():
    sim = simulate(tracked("<steering_efficiency>1</steering_efficiency>"))
    sim.cmd_vel(0.3, 0.5)
    sim.run(4.0)
    truth, odometry = sim.ground_truth.pose, sim.odometry.pose
    assert (odometry.x, odometry.y, odometry.yaw) == pytest.approx((truth.x, truth.y, truth.yaw), abs=0.01)
    assert sim.findings == ()


def test_the_limit_of_the_track_controllers_bounds_the_speed_of_the_tracks():
    """0.2 m/s + 0.4 rad/s * 0.4 m / (2 * 0.5) = 0.36 m/s are half too many for 0.24 m/s."""
    sim = simulate(tracked(controller="<max_velocity>0.24</max_velocity>"))
    sim.cmd_vel(0.2, 0.4)
    sim.run(2.0)
    twist = sim.ground_truth.twist
    assert (twist.x, twist.yaw) == pytest.approx((0.2 / 1.5, 0.4 / 1.5), rel=0.01)


def test_limits_of_a_tracked_vehicle_are_inside_tags():
    limits = (
        "<linear_velocity><max_velocity>0.2</max_velocity></linear_velocity>"
        "<angular_velocity><max_velocity>0.1</max_velocity></angular_velocity>"
    )
    sim = simulate(tracked(limits))
    sim.cmd_vel(1.0, 1.0)
    sim.run(2.0)
    twist = sim.ground_truth.twist
    assert (twist.x, twist.yaw) == pytest.approx((0.2, 0.1), rel=0.01)


def test_tracks_climb_a_slope_that_their_friction_holds(tmp_path):
    world = tmp_path / "slope.sdf"
    for degrees, climbs in ((20.0, True), (30.0, False)):  # 26.6 degrees for a friction of 0.5
        world.write_text(tilted(degrees))
        slippery = "".join(
            f'<gazebo reference="{side}_track"><mu1>0.5</mu1></gazebo>' for side in ("left", "right")
        )
        sim = simulate(tracked().replace("</robot>", f"{slippery}</robot>"), world=str(world))
        sim.cmd_vel(0.3, 0.0)
        sim.run(2.0)
        assert (sim.ground_truth.pose.x > 0.4) is climbs


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("<link>left_track</link></left_track>", "</left_track>"), "does not name a left track"),
        (("<link>left_track</link></left_track>", "<link>lef_track</link></left_track>"), "'lef_track'"),
    ],
)
def test_a_vehicle_without_its_tracks_does_not_drive(change, reason):
    drive = find_drive(load_robot_text(tracked().replace(*change), "base.urdf").require())
    assert isinstance(drive, NoDrive)
    assert reason in drive.reason


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (
            tracked(apart=0.5),
            "D105",
            "the middles of the tracks are 0.4 m apart, not 0.5: turns are +25 % off",
        ),
        (
            tracked().replace(">left_track</link></left", ">leftrack</link></left"),
            "D101",
            "'leftrack' is not a link",
        ),
        (
            tracked().replace("<link>left_track</link></plugin>", "<link>base_link</link></plugin>"),
            "W134",
            "no TrackController turns the track 'left_track'",
        ),
    ],
)
def test_faults_of_tracks_are_reported(text, code, message):
    robot = load_robot_text(text, "base.urdf").require()
    [finding] = findings_of_drive(robot, find_drive(robot))
    assert finding.code == code
    assert message in finding.message


def test_a_plugin_turns_a_base_whose_inertia_is_far_too_large():
    """As gz and Gazebo Classic do, which set the velocity of such a base."""
    inertia = 'ixx="0.2" iyy="0.3" izz="0.4"'
    sim = simulate(body(FOUR, PLANAR).replace(inertia, 'ixx="300" iyy="300" izz="400"'))
    sim.cmd_vel(0.0, 0.5)
    sim.run(2.0)
    assert sim.ground_truth.twist.yaw == pytest.approx(0.5, rel=0.01)


def test_a_plugin_that_moves_the_base_ignores_tags_of_other_drives():
    sim = simulate(
        body(FOUR, plugin("libgazebo_ros_planar_move.so", "<wheelAcceleration>0.1</wheelAcceleration>"))
    )
    sim.cmd_vel(0.3, 0.0)
    sim.run(1.0)
    assert sim.ground_truth.twist.x == pytest.approx(0.3, rel=0.01)


def on_rollers(places: dict[str, tuple[float, float, float]], slopes: dict[str, float], extension="") -> str:
    """Wheels at x, y, turned by an angle about z. Those of their rollers that are on the ground are turned by
    `slopes` from the rim."""
    count, inner, roller = 8, 0.04, 0.01
    text = ""
    for name, (x, y, turn) in places.items():
        small = f'<cylinder radius="{inner}" length="0.02"/>'
        text += wheel(name, x, y, turn).replace(f'<cylinder radius="{RADIUS}" length="0.03"/>', small)
        for i in range(count):
            angle = 2 * pi * i / count
            text += (
                f'<link name="{name}_{i}"><inertial><mass value="0.01"/><inertia ixx="1e-6" iyy="1e-6" '
                'izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
                f'<geometry><sphere radius="{roller}"/></geometry></collision></link>'
                f'<joint name="{name}_{i}_joint" type="continuous"><parent link="{name}"/>'
                f'<child link="{name}_{i}"/><origin xyz="{-inner * sin(angle)} 0 {-inner * cos(angle)}" '
                f'rpy="0 {angle} 0"/><axis xyz="{cos(slopes[name])} {sin(slopes[name])} 0"/></joint>'
            )
    return body(text, extension)


MECANUM_PLACES = {name: (x * AHEAD, y * ASIDE, 0.0) for name, (x, y) in CORNERS.items()}
MECANUM_SLOPES = {name: -x * y * pi / 4 for name, (x, y) in CORNERS.items()}
"""Seen from above, the rollers on the ground form an O, and so those on top form an X."""
MECANUM_ROLLERS = on_rollers(MECANUM_PLACES, MECANUM_SLOPES)
OMNI_PLACES = {
    f"wheel_{i}": (OMNI_ARM * cos(angle), OMNI_ARM * sin(angle), angle - pi / 2)
    for i, angle in enumerate(OMNI_ANGLES)
}
OMNI_ROLLERS = on_rollers(OMNI_PLACES, dict.fromkeys(OMNI_PLACES, 0.0))


@pytest.mark.parametrize("text", [MECANUM_ROLLERS, OMNI_ROLLERS], ids=["mecanum", "omni"])
@pytest.mark.parametrize("twist", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.2, -0.1, 0.5)])
def test_a_base_on_rollers_drives_sideways_without_a_plugin(text, twist):
    sim = simulate(text)
    drive_as_commanded(sim, twist)
    assert sim.findings == ()


def test_wheels_with_rollers_turn_as_their_rollers_require():
    """Lynch and Park, Modern Robotics, 13.2: as gz's MecanumDrive and omni_wheel_drive_controller compute."""
    x, y, yaw = 0.2, 0.1, 0.5
    turn = LEVER * yaw
    mecanum = [x - y - turn, x + y + turn, x + y - turn, x - y + turn]
    omni = [sin(a) * x - cos(a) * y - OMNI_ARM * yaw for a in OMNI_ANGLES]
    for text, rims in ((MECANUM_ROLLERS, mecanum), (OMNI_ROLLERS, omni)):
        sim = simulate(text)
        sim.cmd_vel(x, yaw, lateral=y)
        sim.run(1.0)
        drive = sim.robots.first.drive
        assert isinstance(drive, HolonomicDrive)
        speeds = sim.robots.first.body.joint_velocities
        assert [speeds[joint] for joint in drive.joints] == pytest.approx([v / 0.05 for v in rims], rel=1e-3)


def test_rollers_below_their_hubs_are_not_casters():
    assert not check_text(MECANUM_ROLLERS, "base.urdf", config=Config(select=("D112", "D128")))


def test_rollers_drive_with_their_own_friction():
    """The hubs of the wheels do not touch the ground."""
    smooth = "".join(f'<gazebo reference="{name}"><mu1>0</mu1></gazebo>' for name in CORNERS)
    sim = simulate(on_rollers(MECANUM_PLACES, MECANUM_SLOPES, smooth))
    sim.cmd_vel(0.0, 0.0, lateral=0.3)
    sim.run(2.0)
    assert sim.ground_truth.twist.y == pytest.approx(0.3, rel=0.01)


def test_rollers_that_are_all_parallel_do_not_drive_sideways():
    drive = find_drive(
        load_robot_text(on_rollers(MECANUM_PLACES, dict.fromkeys(CORNERS, 0.0)), "base.urdf").require()
    )
    assert not isinstance(drive, HolonomicDrive)


def test_a_part_that_holds_a_base_without_motors_is_named():
    """Two flaps carry more of the weight than the wheels, so their friction is larger."""
    flaps = "".join(
        f'<link name="{name}"><inertial><origin xyz="0.7 0 0"/><mass value="30"/><inertia ixx="0.1" iyy="1" '
        'izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0.8 0 0"/><geometry>'
        f'<sphere radius="0.02"/></geometry></collision></link><joint name="{name}_hinge" type="continuous">'
        f'<parent link="base_link"/><child link="{name}"/><origin xyz="{x} 0 0.1" rpy="0 0 {yaw}"/>'
        '<axis xyz="0 1 0"/></joint>'
        for name, x, yaw in (("front_flap", 0.3, 0.0), ("rear_flap", -0.3, pi))
    )
    sim = simulate(body(FOUR + flaps, PLANAR))
    sim.cmd_vel(0.0, 0.0, lateral=0.3)
    sim.run(4.0)
    [finding] = sim.findings
    assert finding.code == "W302"
    assert "'front_flap' drags on the ground" in finding.message


@pytest.mark.parametrize(
    ("limit", "command", "reported"),
    [
        ("max_velocity>0.1", (0.0, 0.0, 0.3), "drives 33 % of the commanded distance"),
        ("max_velocity>0.1", (0.0, 0.0, -0.3), "drives 33 % of the commanded distance"),
        ("max_acceleration>0.1", (0.0, 0.0, 0.3), "drives 66 % of the commanded distance"),
        ("max_velocity>0.2", (0.0, 0.5, 0.0), "turns 40 % of the commanded angle"),
    ],
)
def test_a_limit_below_a_command_is_named_on_each_axis(limit, command, reported):
    """At the last sample, 4.48 s: 0.1 / 0.3, of 1.344 m 0.3^2 / 0.2 m = 0.45 m are missing, and 0.2 / 0.5."""
    name = limit.partition(">")[0]
    sim = simulate(body(FOUR, gz_mecanum().replace("</plugin>", f"\n<{limit}</{name}></plugin>")))
    sim.cmd_vel(*command)
    sim.run(5.0)
    [finding] = sim.findings
    assert finding.code == "W307"
    assert f"the robot {reported} in 4.5 s: gz::sim::systems::MecanumDrive limits it" in finding.message
    assert finding.origin.span.line == 2
