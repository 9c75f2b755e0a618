"""Joints with controllers move as theory and ROS's controllers predict."""

from math import exp

import pytest

from kbot.messages.control import Duration, Float64, Float64MultiArray, JointTrajectory, JointTrajectoryPoint
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import KbotError

MASS, LENGTH, MOMENT = 2.0, 0.5, 0.01
INERTIA = MOMENT + MASS * LENGTH**2
"""The moment of inertia about the joint in kg m^2."""

MANAGER = """
controller_manager:
  ros__parameters:
    joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    group: {type: velocity_controllers/JointGroupVelocityController}
    push: {type: forward_command_controller/ForwardCommandController}
    odd: {type: some_controllers/Odd}
"""


def arm(
    extensions: str = "", limit: str = 'lower="-3" upper="3" effort="100" velocity="0"', more: str = ""
) -> str:
    """A bar on the world with a horizontal joint along y and its mass at the end. At 0 it points ahead."""
    return (
        '<robot name="arm"><link name="world"/><link name="bar">'
        f'<inertial><origin xyz="{LENGTH} 0 0"/><mass value="{MASS}"/>'
        f'<inertia ixx="{MOMENT}" iyy="{MOMENT}" izz="{MOMENT}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="shoulder" type="revolute"><parent link="world"/><child link="bar"/>'
        f'<origin xyz="0 0 2"/><axis xyz="0 1 0"/><limit {limit}/>{more}</joint>'
        f"{extensions}</robot>"
    )


def hardware(interface: str = "position", initial: str = "") -> str:
    start = f'<param name="initial_value">{initial}</param>' if initial else ""
    return (
        '<ros2_control name="c" type="system"><joint name="shoulder">'
        f'<command_interface name="{interface}"/><state_interface name="position">{start}</state_interface>'
        "</joint></ros2_control>"
    )


def gz(kind: str, inner: str) -> str:
    named = f'filename="gz-sim-{kind}-system" name="gz::sim::systems::X"'
    return f"<gazebo><plugin {named}>{inner}</plugin></gazebo>"


@pytest.fixture
def controlled(urdf, tmp_path):
    """The arm with controllers of ros2_control from a YAML file."""

    def build(yaml: str, interface: str = "position") -> Simulation:
        (tmp_path / "controllers.yaml").write_text(MANAGER + yaml)
        plugin = (
            '<gazebo><plugin filename="gz_ros2_control-system" name="c">\n'
            f"<parameters>{tmp_path}/controllers.yaml</parameters></plugin></gazebo>"
        )
        return Simulation(urdf(arm(hardware(interface) + plugin)))

    return build


TRAJECTORY = "arm: {ros__parameters: {joints: [shoulder]}}"


def to(seconds: float, position: float, *velocity: float) -> JointTrajectoryPoint:
    return JointTrajectoryPoint((position,), velocity, time_from_start=Duration.from_seconds(seconds))


def test_joint_of_ros2_control_is_held_against_its_weight(urdf):
    """A plain spring would sag by m g l / k."""
    held, free = Simulation(urdf(arm(hardware()))), Simulation(urdf(arm()))
    held.run(3.0)
    free.run(0.5)
    assert held.joint_positions["shoulder"] == pytest.approx(0.0, abs=1e-4)
    assert held.joint_states.effort[0] == pytest.approx(-MASS * 9.81 * LENGTH, rel=1e-3)
    assert free.joint_positions["shoulder"] > 0.5


@pytest.mark.parametrize(("damping", "friction"), [(0.0, 5.0), (5.0, 0.0), (5.0, 5.0)])
def test_damping_and_friction_do_not_keep_a_joint_from_its_command(urdf, damping, friction):
    resisting = f'<dynamics damping="{damping}" friction="{friction}"/>'
    sim = Simulation(urdf(arm(more=resisting)))
    robot = sim.robots.first
    robot.set_joint("shoulder", -0.5)
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.5, abs=1e-4)
    robot.command_joints({"shoulder": 0.3}, "velocity")
    sim.run(1.0)
    assert sim.joint_states.velocity[0] == pytest.approx(0.3, rel=1e-3)
    robot.follow_trajectory(["shoulder"], [(1.0, [0.5]), (2.0, [-0.5])])
    sim.run(2.5)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.5, abs=1e-4)


POST = (
    '<robot name="post"><link name="world"/>'
    '<link name="turret"><inertial><mass value="1"/>'
    '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/>'
    '</inertial></link><link name="bar"><inertial><origin xyz="0 0 0.5"/><mass value="2"/>'
    '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="pan" type="revolute"><parent link="world"/><child link="turret"/>'
    '<origin xyz="0 0 2"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="0" velocity="0"/>'
    '</joint><joint name="lift" type="revolute"><parent link="turret"/><child link="bar"/>'
    '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="0" velocity="0"/></joint></robot>'
)
"""A bar on a turret. Upright, the inertia about the turret is a hundredth of that of the horizontal bar."""


def test_servo_is_as_stiff_with_a_stretched_as_with_a_folded_arm(urdf):
    """The step response is critically damped at 50 rad/s: 1 - (1 + 50 t) exp(-50 t).

    The inertia about the post is 0.5 kg m^2 with a horizontal bar, and a hundredth of that with an upright
    one.
    """
    sim = Simulation(urdf(POST))
    for lift in (0.0, 1.5708):
        sim.robots.first.command_joints({"pan": 0.0, "lift": lift})
        sim.run(1.0)
        sim.robots.first.command_joints({"pan": 0.1})
        for t in (1.0, 2.0, 3.0):
            sim.run(1.0 / 50.0)
            assert sim.joint_positions["pan"] == pytest.approx(0.1 * (1.0 - (1.0 + t) * exp(-t)), abs=3e-3)


def test_run_of_an_arm_repeats_after_a_reset_and_a_restore(urdf):
    """The servos depend on the inertia in the current pose, which a reset or restore must reproduce."""
    sim = Simulation(urdf(POST))
    digests = []
    for _ in range(2):
        sim.robots.first.follow_trajectory(["pan", "lift"], [(1.0, [0.8, 1.2])])
        sim.step(203)
        state = sim.state()
        sim.step(400)
        digests.append(sim.state_sha256())
        for other in (sim, Simulation(urdf(POST))):
            other.restore(state)
            other.step(400)
            digests.append(other.state_sha256())
        sim.reset()
    assert len(set(digests)) == 1


def test_joint_starts_at_the_initial_value_of_its_hardware(urdf):
    sim = Simulation(urdf(arm(hardware(initial="-0.7"))))
    assert sim.joint_positions["shoulder"] == -0.7
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.7, abs=1e-4)
    sim.reset()
    assert sim.joint_positions["shoulder"] == -0.7


def test_trajectory_with_velocities_follows_cubics(controlled):
    """From rest to rest in T: after T/4, 3/16 - 2/64 = 5/32 of the distance are done, after T/2 a half."""
    sim = controlled(TRAJECTORY)
    sim.run(0.5)
    sim.bus.publish(
        "arm/joint_trajectory", JointTrajectory(joint_names=("shoulder",), points=(to(2.0, -1.0, 0.0),))
    )
    for seconds, share in ((0.5, 5 / 32), (0.5, 0.5), (0.5, 27 / 32), (0.5, 1.0), (1.0, 1.0)):
        sim.run(seconds)
        assert sim.joint_positions["shoulder"] == pytest.approx(-share, abs=2e-3)
    assert sim.joint_positions["shoulder"] == pytest.approx(-1.0, abs=2e-4)


def test_command_beyond_a_limit_stops_at_the_limit_and_is_reported_once(controlled):
    sim = controlled(TRAJECTORY)
    reports: list[str] = []
    sim.journal.listeners.append(reports.append)
    for position in (3.0005, 9.0, 8.0):
        sim.bus.publish(
            "arm/joint_trajectory", JointTrajectory(joint_names=("shoulder",), points=(to(1.0, position),))
        )
    sim.run(2.0)
    assert reports == ["joint 'shoulder': 9 is beyond its limit. It moves to 3"]
    assert sim.joint_positions["shoulder"] == pytest.approx(3.0, abs=1e-3)


def test_trajectory_without_velocities_is_linear(controlled):
    sim = controlled(TRAJECTORY)
    sim.robots.first.follow_trajectory(["shoulder"], [(1.0, [-0.5]), (3.0, [0.5])])
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.0, abs=2e-3)
    sim.run(0.5)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.25, abs=2e-3)


def test_new_trajectory_replaces_the_old_one(controlled):
    sim = controlled(TRAJECTORY)
    sim.robots.first.follow_trajectory(["shoulder"], [(2.0, [1.0])])
    sim.run(1.0)
    sim.robots.first.follow_trajectory(["shoulder"], [(1.0, [0.5])])
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.5, abs=1e-3)


def test_velocity_group_turns_its_joints_at_the_commanded_speeds(controlled):
    sim = controlled("group: {ros__parameters: {joints: [shoulder]}}", "velocity")
    sim.run(0.5)
    sim.bus.publish("group/commands", Float64MultiArray(data=(-0.4,)))
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.8, abs=0.01)
    with pytest.raises(KbotError, match="1 numbers, one per joint, but received 2"):
        sim.bus.publish("group/commands", Float64MultiArray(data=(1.0, 2.0)))


def test_effort_command_is_exerted(controlled):
    """The effort that balances the weight holds the joint. 1 N m more accelerates it by M / I."""
    sim = controlled("push: {ros__parameters: {joints: [shoulder], interface_name: effort}}", "effort")
    sim.bus.publish("push/commands", Float64MultiArray(data=(-MASS * 9.81 * LENGTH - 1.0,)))
    sim.run(0.2)
    assert sim.robots.first.body.joint_velocities["shoulder"] == pytest.approx(-0.2 / INERTIA, rel=0.02)


def test_effort_and_speed_limits_apply(urdf):
    weak = Simulation(urdf(arm(hardware(), 'lower="-3" upper="3" effort="5" velocity="0"')))
    weak.run(1.0)
    assert weak.joint_positions["shoulder"] > 0.5, "5 N m do not bear 9.81 N m"
    slow = Simulation(urdf(arm(hardware(), 'lower="-3" upper="3" effort="100" velocity="0.25"')))
    slow.robots.first.set_joint("shoulder", -1.0)
    slow.run(2.0)
    assert slow.joint_positions["shoulder"] == pytest.approx(-0.5, abs=0.01)
    slow.run(4.0)
    assert slow.joint_positions["shoulder"] == pytest.approx(-1.0, abs=1e-3)


def test_safety_controller_keeps_a_joint_from_its_limit(urdf):
    """A position command stops at the soft limit.

    The velocity towards it is k_position times the remaining distance, which shrinks as exp(-k_position t).
    """
    safety = '<safety_controller soft_lower_limit="-1" soft_upper_limit="1" k_position="2" k_velocity="20"/>'
    sim = Simulation(urdf(arm(hardware(), more=safety)))
    sim.robots.first.set_joint("shoulder", -2.5)
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-1.0, abs=1e-3)
    sim.reset()
    sim.robots.first.command_joints({"shoulder": -2.0}, "velocity")
    for seconds in (0.25, 0.5):
        sim.run(seconds)
        assert sim.joint_positions["shoulder"] == pytest.approx(-1.0 + exp(-2.0 * sim.time), abs=0.03)


def test_safety_controller_limits_efforts_by_speed(urdf):
    """Beyond the soft limit the allowed outward effort falls to 0, so that -50 N m does not move it on."""
    safety = '<safety_controller soft_lower_limit="-1" soft_upper_limit="1" k_position="5" k_velocity="20"/>'
    sim = Simulation(urdf(arm(hardware("effort"), more=safety)))
    sim.robots.first.command_joints({"shoulder": -50.0}, "effort")
    sim.run(3.0)
    assert -1.1 < sim.joint_positions["shoulder"] < -0.8


def test_plugins_of_gz_command_their_joints(urdf):
    position = gz("joint-position-controller", "<joint_name>shoulder</joint_name><topic>lift</topic>")
    sim = Simulation(urdf(arm(position)))
    sim.bus.publish("lift", Float64(-0.3))
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.3, abs=1e-3)
    speed = Simulation(urdf(arm(gz("joint-controller", "<joint_name>shoulder</joint_name>"))))
    speed.bus.publish("/model/arm/joint/shoulder/cmd_vel", Float64(-0.3))
    speed.run(1.0)
    assert speed.joint_positions["shoulder"] == pytest.approx(-0.3, abs=0.02)
    way = Simulation(urdf(arm(gz("joint-trajectory-controller", "<topic>way</topic>"))))
    way.bus.publish("way", JointTrajectory(joint_names=("shoulder",), points=(to(1.0, -0.3),)))
    way.run(2.0)
    assert way.joint_positions["shoulder"] == pytest.approx(-0.3, abs=1e-3)


def test_plugin_of_classic_follows_trajectories(urdf):
    plugin = '<gazebo><plugin name="p" filename="libgazebo_ros_joint_pose_trajectory.so"/></gazebo>'
    sim = Simulation(urdf(arm(plugin)))
    sim.bus.publish(
        "set_joint_trajectory", JointTrajectory(joint_names=("shoulder",), points=(to(1.0, 0.4),))
    )
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.4, abs=1e-3)


def test_plugins_of_gazebo_ros_use_their_namespace(urdf):
    """The robot's namespace `fleet` applies only to plugins without a namespace of their own."""
    plugins = """<gazebo>
      <plugin name="p" filename="libgazebo_ros_joint_pose_trajectory.so">
        <robotNamespace>/bot</robotNamespace><topicName>move</topicName></plugin>
      <plugin name="j" filename="libgazebo_ros_joint_state_publisher.so">
        <ros><remapping>joint_states:=states</remapping></ros></plugin></gazebo>"""
    sim = Simulation(urdf(arm(plugins)), naming=Naming("arm", "fleet"))
    assert sim.bus.topics["/bot/move"] is JointTrajectory
    assert sim.bus.topics["/fleet/states"] is sim.bus.topics["/fleet/joint_states"]


def test_unknown_joints_and_unsupported_controllers_are_reported(controlled, urdf):
    sim = controlled("arm: {ros__parameters: {joints: [shoulder, sholder]}}")
    found = {d.code: d for d in sim.diagnostics}
    assert "'sholder' is not a joint of this robot" in found["D101"].message
    at = found["D101"].origin.span
    assert at.file.endswith("controllers.yaml")
    assert at.text == "joints"
    assert "'shoulder'" in found["D101"].hint
    assert "KBot does not run the controller" in found["W135"].message
    plugin = gz("joint-position-controller", "\n<joint_name>elbow</joint_name>")
    (reported,) = Simulation(urdf(arm(plugin))).diagnostics
    assert (reported.code, reported.origin.span.line) == ("D101", 2)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(1.0, [0.1]), (1.0, [0.2])], "times of a trajectory must increase"),
        ([(1.0, [0.1, 0.2])], "1 numbers, one per joint, not 2"),
        ([(-1.0, [0.1])], "at least 0 seconds"),
        ([(1.0, [float("nan")])], "finite"),
        ([(1.0,)], "a point must be"),
        ([(1.0, ["0.1"])], "finite"),
        ([(1.0, "a")], "lists of numbers, not 'a'"),
        ([(1.0, [float("inf")])], "finite"),
        (
            [(0.01 * n, [0.1]) for n in range(100_001)],
            "at most 100,000 points, not 100,001: split",
        ),
    ],
)
def test_invalid_trajectory_is_rejected_without_effect(controlled, points, message):
    sim = controlled(TRAJECTORY)
    before = sim.state_sha256()
    with pytest.raises(KbotError, match=message):
        sim.robots.first.follow_trajectory(["shoulder"], points)
    assert sim.state_sha256() == before


def test_run_with_a_trajectory_does_not_depend_on_chunks_and_restores(controlled):
    runs = []
    for cuts in ((1.5,), (0.3, 0.004, 0.196, 1.0)):
        sim = controlled(TRAJECTORY)
        sim.robots.first.follow_trajectory(["shoulder"], [(1.0, [-1.0], [0.0]), (1.4, [-0.5], [0.0])])
        for seconds in cuts:
            sim.run(seconds)
        runs.append(sim.state_sha256())
    sim = controlled(TRAJECTORY)
    sim.robots.first.follow_trajectory(["shoulder"], [(1.0, [-1.0], [0.0]), (1.4, [-0.5], [0.0])])
    sim.run(0.5)
    saved = sim.state()
    sim.run(0.7)
    sim.restore(saved)
    sim.run(1.0)
    assert {*runs, sim.state_sha256()} == {runs[0]}


@pytest.mark.parametrize("value", [True, False])
def test_boolean_joint_command_is_rejected(urdf, value):
    sim = Simulation(urdf(arm(hardware())))
    with pytest.raises(KbotError, match=f"the command of joint 'shoulder' must be a number, not {value}"):
        sim.robots.first.command_joints({"shoulder": value})
