"""Tricycles and cars drive as their geometry predicts, and skid steer slips."""

from math import inf, pi, tan

import pytest

from kbot.kinematics.drive.drive import SteeredDrive, find_drive
from kbot.messages import Twist, Vector3
from kbot.sim import Simulation
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
BASES = {"tricycle": TRICYCLE, "front driven": FRONT_DRIVEN, "car": CAR}


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
    assert tuple(wheel.joint for wheel in drive.steering) == steering
    assert [wheel.x for wheel in drive.steering] == pytest.approx([BASE] * len(steering))
    assert drive.casters == ()


@pytest.mark.parametrize("name", list(BASES))
def test_steered_base_drives_straight(urdf, name):
    sim = Simulation(urdf(BASES[name]))
    sim.cmd_vel(0.5, 0.0)
    sim.run(4.5)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    truth, reckoned = sim.ground_truth.pose, sim.odometry.pose
    assert truth.x == pytest.approx(0.5 * 4.5, abs=0.01)
    assert (truth.y, truth.yaw) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert reckoned.x == pytest.approx(truth.x, abs=1e-3)


@pytest.mark.parametrize("name", list(BASES))
@pytest.mark.parametrize("turn", [0.3, -0.3])
def test_wheels_of_a_steered_base_roll_about_one_point(urdf, name, turn):
    """The base moves at v and turns at w. The steering angles are those of Ackermann, tan a = L / (R - y)."""
    sim = Simulation(urdf(BASES[name]))
    sim.cmd_vel(0.5, turn)
    sim.run(2.0)
    before = sim.ground_truth.pose.yaw
    sim.run(4.0)
    assert sim.ground_truth.pose.yaw - before == pytest.approx(4.0 * turn, rel=0.01)
    assert sim.ground_truth.twist.x == pytest.approx(0.5, rel=0.01)
    for wheel in sim.robots.first.drive.steering:
        angle = sim.joint_positions[wheel.joint]
        assert tan(angle) == pytest.approx(BASE / (0.5 / turn - wheel.y), rel=0.02)
    truth, reckoned = sim.ground_truth.pose, sim.odometry.pose
    assert (reckoned.x, reckoned.y) == pytest.approx((truth.x, truth.y), abs=0.01)
    assert reckoned.yaw == pytest.approx(truth.yaw, abs=0.01)


def test_topic_and_limits_of_a_cars_plugin_are_used(urdf):
    settings = (
        "<topic>/car/cmd</topic><max_velocity>0.2</max_velocity><wheel_separation>0.4</wheel_separation>"
    )
    sim = Simulation(urdf(CAR.replace("<left_joint>", f"{settings}<left_joint>")))
    sim.bus.publish("/car/cmd", Twist(Vector3(1.0)))
    sim.run(0.4)
    assert sim.ground_truth.twist.x == pytest.approx(0.2, rel=0.02)
    assert sim.diagnostics == ()


def test_steering_limit_bounds_the_curvature(urdf):
    """At a limit of 1.2 rad a tricycle turns at v tan(1.2) / L, for any larger command."""
    sim = Simulation(urdf(TRICYCLE))
    sim.cmd_vel(0.1, 3.0)
    sim.run(3.0)
    before = sim.ground_truth.pose.yaw
    sim.run(2.0)
    rate = (sim.ground_truth.pose.yaw - before) / 2.0
    assert sim.joint_positions["front_steering"] == pytest.approx(1.2, abs=0.02)
    assert rate == pytest.approx(0.1 * tan(1.2) / BASE, rel=0.02)


@pytest.mark.parametrize("name", ["tricycle", "front driven"])
@pytest.mark.parametrize("end", ["1.57", "1.8"])
def test_tricycle_with_a_wheel_at_90_degrees_turns_on_the_spot(urdf, name, end):
    """4 s at 0.5 rad/s, minus the time to accelerate at 8 rad/s^2 and to steer the wheel."""
    sim = Simulation(urdf(BASES[name].replace('lower="-1.2" upper="1.2"', f'lower="-{end}" upper="{end}"')))
    sim.cmd_vel(0.0, 0.5)
    sim.run(4.0)
    truth, reckoned = sim.ground_truth.pose, sim.odometry.pose
    assert truth.yaw == pytest.approx(2.0, abs=0.06)
    assert (truth.x, truth.y) == pytest.approx((0.0, 0.0), abs=0.01)
    assert (reckoned.x, reckoned.y, reckoned.yaw) == pytest.approx((truth.x, truth.y, truth.yaw), abs=0.01)


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
    turned = sim.ground_truth.pose.yaw - pose.yaw
    assert 0.2 < turned / (sim.odometry.pose.yaw - pose.yaw) < 0.98


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
