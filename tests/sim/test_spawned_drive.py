"""Drives that a launch file spawns: their topics and the commands that they reject."""

import pytest

from kbot.messages import types as msg
from kbot.messages.control import Float64
from kbot.sim import Simulation
from kbot.text import KbotError

from .test_spawned import MANAGER, findings, transmission

ROVER = (
    '<robot name="rover"><link name="base"><inertial><mass value="2"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
    '<origin xyz="-0.15 0 -0.05"/><geometry><sphere radius="0.05"/></geometry></collision></link>{}</robot>'
)
WHEEL = (
    '<link name="{0}"><inertial><mass value="0.2"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0"'
    ' iyz="0"/></inertial><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1"'
    ' length="0.03"/></geometry></collision></link><joint name="{0}_joint" type="continuous"><parent'
    ' link="base"/><child link="{0}"/><origin xyz="0 {1} 0"/><axis xyz="0 1 0"/></joint>'
)
DRIVE = """base:
  type: diff_drive_controller/DiffDriveController
  left_wheel: left_joint
  right_wheel: right_joint
  linear: {x: {max_velocity: 0.01}}
"""


def test_spawned_drive_has_topics_under_its_name(launched):
    rover = ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + MANAGER)
    sim = Simulation(launched(rover, DRIVE, "base", ns="/"))
    received: list[msg.Odometry] = []
    sim.bus.subscribe("/base/odom", msg.Odometry, received.append)
    for _ in range(10):
        sim.bus.publish("/base/cmd_vel", msg.Twist(msg.Vector3(0.1, 0.0, 0.0), msg.Vector3(0.0, 0.0, 0.0)))
        sim.run(0.2)
    # 0.1 m/s for 2 s minus the ramp of 1 m/s^2; in ROS 1 a limit needs has_velocity_limits
    assert sim.odometry.pose.x == pytest.approx(0.195, abs=5e-3)
    assert received[-1].pose.pose.position.x == pytest.approx(0.195, abs=7e-3)


@pytest.mark.parametrize(
    ("parameter", "topic", "kind"),
    [
        ("", "/base/cmd_vel", msg.TwistStamped),
        ("use_stamped_vel: true", "/base/cmd_vel", msg.TwistStamped),
        ("use_stamped_vel: false", "/base/cmd_vel_unstamped", msg.Twist),
    ],
)
def test_ros2_drive_has_the_command_topic_and_type_of_its_version(urdf, tmp_path, parameter, topic, kind):
    """The topic is the stamped `~/cmd_vel`, with Humble's `use_stamped_vel: false` `~/cmd_vel_unstamped`."""
    (tmp_path / "c.yaml").write_text(
        "controller_manager:\n  ros__parameters:\n    base:\n"
        "      type: diff_drive_controller/DiffDriveController\n"
        "base:\n  ros__parameters:\n    left_wheel_names: [left_joint]\n"
        f"    right_wheel_names: [right_joint]\n    {parameter}\n"
    )
    plugin = (
        f'<gazebo><plugin name="r" filename="x"><parameters>{tmp_path}/c.yaml</parameters></plugin></gazebo>'
    )
    sim = Simulation(urdf(ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + plugin)))
    inputs = {name: sim.bus.topics[name] for name in sim.bus.inputs}
    assert inputs == {"/cmd_vel": msg.Twist, topic: kind}
    assert sim.bus.topics["/base/odom"] is msg.Odometry
    twist = msg.Twist(msg.Vector3(0.1, 0.0, 0.0))
    sim.run(2.0)
    for _ in range(10):
        sim.bus.publish(topic, twist if kind is msg.Twist else msg.TwistStamped(twist=twist))
        sim.run(0.2)
    # 0.1 m/s for 2 s minus the ramp of 1 m/s^2
    assert sim.odometry.pose.x == pytest.approx(0.195, abs=5e-3)


def test_stamped_command_older_than_the_timeout_is_rejected(urdf, tmp_path):
    """As in DiffDriveController, commands without a stamp or with a wall-clock stamp count as new."""
    (tmp_path / "c.yaml").write_text(
        "controller_manager: {ros__parameters: {base: {type: diff_drive_controller/DiffDriveController}}}\n"
        "base: {ros__parameters: {cmd_vel_timeout: 0.3}}\n"
    )
    plugin = (
        f'<gazebo><plugin name="r" filename="x"><parameters>{tmp_path}/c.yaml</parameters></plugin></gazebo>'
    )
    sim = Simulation(urdf(ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + plugin)))
    sim.run(2.0)

    def drive(seconds: float) -> None:
        header = msg.Header(msg.Time.from_nanoseconds(round(seconds * 1e9)))
        sim.bus.publish("/base/cmd_vel", msg.TwistStamped(header, msg.Twist(msg.Vector3(0.1, 0.0, 0.0))))

    with pytest.raises(KbotError, match=r"0\.350 s old, more than the cmd_vel_timeout of 0\.3 s"):
        drive(1.65)
    assert sim.robots.first.commanded_twist.x == 0.0
    for stamp in (1.75, 0.0, 1.8e9):
        drive(stamp)
        assert sim.robots.first.commanded_twist.x == 0.1
        sim.run(0.4)
        assert sim.robots.first.commanded_twist.x == 0.0


def test_wheels_with_their_own_controllers_are_not_driven_by_the_drive(launched):
    gears = transmission("left_joint", "Velocity") + transmission("right_joint", "Velocity")
    rover = ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + MANAGER + gears)
    kind = "velocity_controllers/JointVelocityController"
    yaml = "".join(f"{side}:\n  type: {kind}\n  joint: {side}_joint\n" for side in ("left", "right"))
    sim = Simulation(launched(rover, yaml, "left right", ns="/"))
    for side in ("left", "right"):
        sim.bus.publish(f"/{side}/command", Float64(1.0))
    sim.run(2.0)
    before = sim.ground_truth.pose.x
    sim.run(1.0)
    # 1 rad/s with wheels of 0.1 m
    assert sim.ground_truth.pose.x - before == pytest.approx(0.1, abs=5e-3)
    with pytest.raises(KbotError, match="/left, which was spawned, commands 'left_joint'"):
        sim.cmd_vel(0.1, 0.0)


def test_drive_without_wheel_names_is_reported(launched):
    rover = ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + MANAGER)
    sim = Simulation(launched(rover, DRIVE.replace("  left_wheel: left_joint\n", ""), "base", ns="/"))
    assert findings(sim) == [("W137", "controllers.yaml", 2)]
    assert sim.robots.first.settings.command_topics == {"cmd_vel": msg.Twist}
