"""A driving robot moves as kinematics predict, and odometry agrees with ground truth."""

from math import cos, degrees, hypot, pi, sin

import pytest

from kbot.messages import Odometry
from kbot.sim import DriveLimits, Simulation
from kbot.text import KbotError

MILLIMETRE = 1e-3


def stop(sim: Simulation) -> None:
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)


def odometry_error(sim: Simulation) -> tuple[float, float]:
    """The error of odometry against ground truth in mm and degrees."""
    odometry, truth = sim.odometry, sim.ground_truth
    distance = hypot(odometry.pose.x - truth.pose.x, odometry.pose.y - truth.pose.y)
    return distance / MILLIMETRE, degrees(odometry.unwrapped_yaw - truth.unwrapped_yaw)


def test_straight_drive_covers_speed_times_time(sim):
    """The distances lost and gained by equal acceleration and deceleration cancel: 0.2 m/s x 10 s."""
    sim.cmd_vel(0.2, 0.0)
    sim.run(10.0)
    stop(sim)
    truth = sim.ground_truth.pose
    assert truth.x == pytest.approx(2.0, abs=5e-6)
    assert abs(truth.y) < 1e-6
    millimetres, turned = odometry_error(sim)
    assert millimetres < 0.01
    assert abs(turned) < 0.001


def test_ten_turns_on_the_spot_are_accurate(sim):
    sim.cmd_vel(0.0, 1.0)
    sim.run(20 * pi)
    stop(sim)
    truth = sim.ground_truth.pose
    assert sim.ground_truth.unwrapped_yaw / (2 * pi) == pytest.approx(10.0, abs=1e-3)
    assert hypot(truth.x, truth.y) < 1e-5
    _, turned = odometry_error(sim)
    assert abs(turned) < 0.01


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_square_of_one_metre_is_accurate(sim, side):
    for _ in range(4):
        sim.cmd_vel(0.2, 0.0)
        sim.run(5.0)
        stop(sim)
        sim.cmd_vel(0.0, side)
        sim.run(pi / 2)
        stop(sim)
    truth = sim.ground_truth.pose
    assert sim.ground_truth.unwrapped_yaw == pytest.approx(side * 2 * pi, abs=0.01)
    assert hypot(truth.x, truth.y) < 0.005
    millimetres, _ = odometry_error(sim)
    assert millimetres < 0.01


def test_standing_robot_does_not_creep(sim):
    sim.run(1.0)
    before = sim.ground_truth.pose
    sim.run(60.0)
    after = sim.ground_truth.pose
    assert hypot(after.x - before.x, after.y - before.y) < 1e-6
    assert abs(after.yaw - before.yaw) < 1e-6


def test_robot_holds_its_position_on_a_slope(kbot_robot):
    """Less than 0.1 mm per minute at 10 degrees."""
    sim = Simulation(kbot_robot, world="ramp:angle=10")
    sim.cmd_vel(0.2, 0.0)
    sim.run(5.0)
    stop(sim)
    before = sim.link_pose("base_footprint").translation
    assert before[2] > 0.05
    sim.run(20.0)
    after = sim.link_pose("base_footprint").translation
    assert hypot(*(after - before)) < 0.1 * MILLIMETRE / 3


@pytest.mark.parametrize(("linear", "angular"), [(0.2, 0.5), (0.3, -1.0)])
def test_arc_has_the_commanded_radius(sim, linear, angular):
    """After a full circle the robot is back at its start. Half way round it is one diameter to the side."""
    sim.cmd_vel(linear, angular)
    sim.run(1.0)
    start, before = sim.ground_truth.pose, sim.ground_truth.unwrapped_yaw
    sim.run(pi / abs(angular))
    half, after = sim.ground_truth.pose, sim.ground_truth.unwrapped_yaw
    across = hypot(half.x - start.x, half.y - start.y)
    assert across == pytest.approx(2 * linear / abs(angular), rel=2e-3)
    assert after - before == pytest.approx(pi if angular > 0 else -pi, abs=0.01)


@pytest.mark.parametrize("linear", [0.4, 0.7, 0.95])
def test_fast_drive_is_as_accurate_as_a_slow_one(sim, linear):
    """The speed servo must not chatter against its torque limit."""
    sim.cmd_vel(linear, 0.0)
    sim.run(5.0)
    sim.run(1.0)
    assert odometry_error(sim)[0] < 0.01
    assert sim.ground_truth.twist.x == pytest.approx(linear, rel=1e-4)


def test_speed_follows_the_acceleration_limit(kbot_robot):
    """At 1 m/s^2 the command is 0.1 m/s after 0.1 s, and the wheels' setpoint has moved a t^2 / 2 = 5 mm."""
    sim = Simulation(kbot_robot)
    sim.cmd_vel(0.5, 0.0)
    sim.run(0.1)
    assert sim.robots.first.twist.x == pytest.approx(0.1)
    sim.run(2.0)
    stop(sim)
    assert sim.ground_truth.pose.x == pytest.approx(0.5 * 2.1, abs=1e-5)


def test_given_limits_apply(kbot_robot):
    limits = DriveLimits(linear_velocity=0.1, angular_velocity=0.5)
    sim = Simulation(kbot_robot, limits=limits)
    sim.cmd_vel(3.0, -3.0)
    sim.run(2.0)
    assert (sim.robots.first.twist.x, sim.robots.first.twist.yaw) == (0.1, -0.5)


def test_limit_of_zero_is_rejected():
    with pytest.raises(KbotError, match="linear_acceleration must be above 0"):
        DriveLimits(linear_acceleration=0.0)


def test_command_beyond_the_wheel_speed_keeps_its_curve(sim, kbot_robot):
    """KBot's joints allow 1 m/s at the rim."""
    sim.cmd_vel(2.0, 2.0)
    sim.run(3.0)
    twist = sim.robots.first.twist
    assert twist.x == pytest.approx(twist.yaw)
    fastest = max(sim.robots.first.drive.wheel_speeds(twist.x, twist.yaw))
    assert fastest == pytest.approx(1.0 / 0.035)


def test_wall_stops_the_robot_on_the_ground(kbot_robot):
    """The robot does not climb, and its servos do not wind up.

    Commanded back at 0.2 m/s, it has reversed after 0.4 s. After 1 s it is 2 cm + 8 cm away, minus the
    servos' lag.
    """
    sim = Simulation(kbot_robot, world="corridor:length=1.5")
    sim.cmd_vel(0.4, 0.0)
    sim.run(6.0)
    blocked = sim.ground_truth.pose.x
    assert 0.8 < blocked < 1.0
    assert sim.link_pose("base_link").translation[2] == pytest.approx(0.04, abs=1e-3)
    sim.cmd_vel(-0.2, 0.0)
    sim.run(1.0)
    assert sim.ground_truth.pose.x == pytest.approx(blocked - 0.1, abs=0.015)


def test_base_that_is_not_on_the_axle_moves_on_a_circle(shared):
    """The chapter's base_footprint is 20 mm behind the axle: a turn on the spot moves it on a circle."""
    from kbot.model.load import load_robot

    path = shared / "chapter" / "corrected" / "kbot_description" / "urdf" / "kbot.xacro"
    sim = Simulation(load_robot(path).require())
    sim.cmd_vel(0.0, 1.0)
    sim.run(pi)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    yaw = sim.ground_truth.unwrapped_yaw
    odometry = sim.odometry.pose
    assert yaw == pytest.approx(pi, abs=0.02)
    assert (odometry.x, odometry.y) == pytest.approx((0.02 - 0.02 * cos(yaw), -0.02 * sin(yaw)), abs=1e-4)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_yaw_of_a_pose_is_wrapped_and_the_unwrapped_yaw_counts_turns(sim, sense):
    """At 1 rad/s for 14 s the robot turns by 14 rad, which is 2.23 turns; its accelerations cancel."""
    received = []
    sim.bus.subscribe("odom", Odometry, received.append)
    sim.cmd_vel(0.0, sense)
    for second in range(14):
        sim.run(1.0)
        for motion in (sim.ground_truth, sim.odometry):
            assert -pi < motion.pose.yaw <= pi
            assert abs(motion.unwrapped_yaw - sense * (second + 1)) < 0.1
        assert received[-1].pose.pose.orientation.yaw == pytest.approx(sim.odometry.pose.yaw, abs=1e-3)
    stop(sim)
    for motion in (sim.ground_truth, sim.odometry):
        assert motion.unwrapped_yaw == pytest.approx(sense * 14.0, abs=2e-3)
        assert motion.pose.yaw == pytest.approx(sense * (14.0 - 4.0 * pi), abs=2e-3)
    changed = sim.with_robot(sim.robot)
    assert changed.odometry.unwrapped_yaw == pytest.approx(sense * 14.0, abs=2e-3)


@pytest.mark.parametrize("yaw", [pi, -pi, 3.0, 3.5, -3.5, 10.0])
def test_a_robot_is_placed_at_any_yaw(sim, yaw):
    sim.models.set_pose(0.0, 0.0, yaw)
    truth = sim.ground_truth
    assert -pi < truth.pose.yaw <= pi
    assert cos(truth.pose.yaw - yaw) == pytest.approx(1.0)
    assert truth.unwrapped_yaw == pytest.approx(yaw)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_invalid_command_is_rejected_without_effect(sim, bad):
    sim.cmd_vel(0.1, 0.0)
    sim.run(0.5)
    before = sim.state_sha256()
    for command in ((bad, 0.0), (0.0, bad)):
        with pytest.raises(KbotError, match="finite"):
            sim.cmd_vel(*command)
    assert sim.state_sha256() == before
    assert sim.robots.first.twist.x == pytest.approx(0.1)


def test_huge_command_is_limited_to_the_wheel_speed(sim):
    sim.cmd_vel(1e308, -1e308)
    sim.run(2.0)
    assert sim.robots.first.twist.x == pytest.approx(-sim.robots.first.twist.yaw)
    assert sim.robots.first.twist.x + 0.087 * sim.robots.first.twist.x == pytest.approx(1.0)


def test_robot_without_wheels_reports_why_it_cannot_drive(ball):
    sim = Simulation(ball)
    with pytest.raises(KbotError, match="robot 'ball' cannot drive: the robot has no movable joint"):
        sim.cmd_vel(0.1, 0.0)
    sim.run(0.1)


def test_hinged_caster_scrubs_with_contacts_as_written(shared):
    """The chapter's caster rolls about one axis and resists every turn, as its finding warns."""
    from kbot.model.load import load_robot

    robot = load_robot(shared / "chapter" / "corrected" / "kbot.urdf").require()
    errors = []
    for contacts in ("recipe", "as-written"):
        sim = Simulation(robot, contacts=contacts)
        sim.cmd_vel(0.0, 1.0)
        sim.run(4 * pi)
        errors.append(abs(odometry_error(sim)[1]))
    assert errors[0] < 0.01
    assert errors[1] > 1.0
