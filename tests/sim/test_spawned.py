"""Controllers that a launch file spawns are active, idle or not loaded, as in ROS 1's controller manager."""

from math import pi
from pathlib import Path

import pytest

from kbot.messages import types as msg
from kbot.messages.control import Duration, Float64, Float64MultiArray, JointTrajectory, JointTrajectoryPoint
from kbot.model.load import load_robot_text
from kbot.model.spawned import SpawnedController, spawned_controllers, with_controllers
from kbot.model.writer import to_urdf
from kbot.sim import Simulation
from kbot.text import KbotError

NEAR = 5e-3
"""rad by which the other, swinging bar may move a held joint."""

MANAGER = '<gazebo><plugin name="gazebo_ros_control" filename="libgazebo_ros_control.so"/></gazebo>'


def transmission(joint: str, interface: str, reduction: str = "1") -> str:
    tag = f"<hardwareInterface>hardware_interface/{interface}JointInterface</hardwareInterface>"
    return (
        f'<transmission name="t_{joint}"><type>transmission_interface/SimpleTransmission</type>'
        f'<joint name="{joint}">{tag}</joint><actuator name="m_{joint}">{tag}'
        f"<mechanicalReduction>{reduction}</mechanicalReduction></actuator></transmission>"
    )


def arm(extensions: str) -> str:
    """Two bars on the world with horizontal joints along y. At 0 they point ahead."""
    bar = (
        '<link name="{}"><inertial><origin xyz="0.25 0 0"/><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    joint = (
        '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>'
        '<origin xyz="{}"/><axis xyz="0 1 0"/></joint>'
    )
    return (
        f'<robot name="arm"><link name="world"/>{bar.format("upper")}{bar.format("lower")}'
        f"{joint.format('shoulder', 'world', 'upper', '0 0 2')}"
        f"{joint.format('elbow', 'upper', 'lower', '0.5 0 0')}{extensions}</robot>"
    )


EFFORT = MANAGER + transmission("shoulder", "Effort") + transmission("elbow", "Effort")
POSITION = """arm:
  shoulder_controller:
    type: effort_controllers/JointPositionController
    joint: shoulder
    pid: {p: 100.0, i: 0.01, d: 10.0}
"""


def findings(simulation: Simulation) -> list[tuple[str, str, int]]:
    found = [(d.code, d.origin) for d in simulation.diagnostics if d.code in ("D101", "W130", "W137", "W138")]
    return [(code, Path(o.span.file).name, o.span.line) for code, o in found]


def test_position_controller_moves_its_joint_to_the_command(launched):
    sim = Simulation(launched(arm(EFFORT), POSITION, "shoulder_controller"))
    assert findings(sim) == []
    sim.bus.publish("/arm/shoulder_controller/command", Float64(-pi / 4))
    sim.run(3.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-pi / 4, abs=NEAR)


def test_position_controller_holds_its_start_and_other_effort_joints_hang(launched):
    sim = Simulation(launched(arm(EFFORT), POSITION, "shoulder_controller"))
    sim.run(0.3)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.0, abs=NEAR)
    assert sim.joint_positions["elbow"] > 0.1


@pytest.mark.parametrize("reduction", ["50", "-50", "0.5"])
def test_command_does_not_depend_on_the_gear(launched, reduction):
    extensions = MANAGER + transmission("shoulder", "Effort", reduction)
    sim = Simulation(launched(arm(extensions), POSITION, "shoulder_controller"))
    sim.bus.publish("/arm/shoulder_controller/command", Float64(0.7))
    sim.run(3.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.7, abs=NEAR)


@pytest.mark.parametrize("reduction", ["0", "much", "nan"])
def test_invalid_reduction_is_reported_and_its_joint_not_commanded(launched, reduction):
    extensions = MANAGER + transmission("shoulder", "Effort", reduction)
    sim = Simulation(launched(arm(extensions), POSITION, "shoulder_controller"))
    assert [found[:2] for found in findings(sim)] == [("W130", "robot.urdf"), ("W138", "controllers.yaml")]
    assert not sim.robots.first.joints.control.controllers


def test_controller_that_is_only_loaded_rejects_commands(launched):
    sim = Simulation(launched(arm(EFFORT), POSITION, "--stopped shoulder_controller"))
    with pytest.raises(KbotError, match="not started"):
        sim.bus.publish("/arm/shoulder_controller/command", Float64(0.5))
    sim.run(0.3)
    assert sim.joint_positions["shoulder"] > 0.1


def test_spawned_ros2_controller_without_parameters_is_reported(urdf):
    robot = urdf(arm(EFFORT))
    sim = Simulation(with_controllers(robot, [SpawnedController("/c", {}, True, 2, robot.origin)]))
    assert findings(sim) == [("W137", "robot.urdf", 1)]


@pytest.mark.parametrize(
    ("change", "code", "line"),
    [
        (("    pid: {p: 100.0, i: 0.01, d: 10.0}\n", ""), "W137", 3),
        (("    joint: shoulder\n", ""), "W137", 3),
        (("    type: effort_controllers/JointPositionController\n", ""), "W137", 3),
        (("joint: shoulder", "joint: shulder"), "D101", 4),
        (("effort_controllers", "velocity_controllers"), "W138", 4),
    ],
)
def test_controller_that_would_not_load_is_reported_at_its_yaml_line(launched, change, code, line):
    sim = Simulation(launched(arm(EFFORT), POSITION.replace(*change), "shoulder_controller"))
    assert (code, "controllers.yaml", line) in findings(sim)
    assert not sim.robots.first.joints.control.controllers


def test_controllers_are_not_loaded_without_a_controller_manager(launched):
    sim = Simulation(launched(arm(transmission("shoulder", "Effort")), POSITION, "shoulder_controller"))
    assert findings(sim) == [("W137", "a.launch", 3)]


@pytest.mark.parametrize("interface", ["Position", "Velocity"])
def test_joints_with_a_position_or_velocity_interface_are_held(urdf, interface):
    sim = Simulation(urdf(arm(MANAGER + transmission("shoulder", interface))))
    sim.run(0.3)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.0, abs=NEAR)


def controller(type_: str, *lines: str) -> str:
    return "arm:\n  c:\n" + "".join(f"    {line}\n" for line in (f"type: {type_}", *lines))


def test_velocity_controller_turns_at_the_commanded_speed(launched):
    extensions = MANAGER + transmission("shoulder", "Velocity") + transmission("elbow", "Position")
    yaml = controller("velocity_controllers/JointVelocityController", "joint: shoulder")
    sim = Simulation(launched(arm(extensions), yaml, "c"))
    sim.bus.publish("/arm/c/command", Float64(0.5))
    sim.run(1.0)
    before = sim.joint_positions["shoulder"]
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] - before == pytest.approx(0.5, abs=5e-3)


def test_group_command_is_in_the_order_of_its_joints(launched):
    extensions = MANAGER + transmission("shoulder", "Position") + transmission("elbow", "Position")
    yaml = controller("position_controllers/JointGroupPositionController", "joints: [elbow, shoulder]")
    sim = Simulation(launched(arm(extensions), yaml, "c"))
    sim.bus.publish("/arm/c/command", Float64MultiArray(data=(0.3, -0.2)))
    sim.run(3.0)
    assert sim.joint_positions["elbow"] == pytest.approx(0.3, abs=1e-3)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.2, abs=1e-3)


def test_trajectory_is_followed_to_its_last_point(launched):
    gains = "gains: {shoulder: {p: 100}, elbow: {p: 100}}"
    yaml = controller("effort_controllers/JointTrajectoryController", "joints: [shoulder, elbow]", gains)
    sim = Simulation(launched(arm(EFFORT), yaml, "c"))
    point = JointTrajectoryPoint((0.4, -0.3), time_from_start=Duration.from_seconds(1.0))
    sim.bus.publish("/arm/c/command", JointTrajectory(joint_names=("shoulder", "elbow"), points=(point,)))
    sim.run(2.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.4, abs=2e-3)
    assert sim.joint_positions["elbow"] == pytest.approx(-0.3, abs=2e-3)


def test_gains_of_every_joint_are_required(launched):
    yaml = controller("effort_controllers/JointTrajectoryController", "joints: [shoulder, elbow]",
               "gains: {shoulder: {p: 100}}")  # fmt: skip
    sim = Simulation(launched(arm(EFFORT), yaml, "c"))
    assert "gains.elbow.p" in next(d.message for d in sim.diagnostics if d.code == "W137")


def test_joint_states_are_published_in_the_controllers_namespace(launched):
    yaml = controller("joint_state_controller/JointStateController", "publish_rate: 50")
    sim = Simulation(launched(arm(EFFORT), yaml, "c"))
    received: list[msg.JointState] = []
    sim.bus.subscribe("/arm/joint_states", msg.JointState, received.append)
    sim.run(0.1)
    assert set(received[-1].name) == {"shoulder", "elbow"}


def test_description_from_a_recording_runs_the_same(launched):
    robot = launched(arm(EFFORT), POSITION, "shoulder_controller")
    again = load_robot_text(to_urdf(robot), "again.urdf").require()
    kept = spawned_controllers(again)
    assert [(c.name, c.is_active, c.ros, {n: s.value for n, s in c.settings.items()}) for c in kept] == [
        (c.name, c.is_active, c.ros, {n: s.value for n, s in c.settings.items()})
        for c in spawned_controllers(robot)
    ]
    states = []
    for simulation in (Simulation(robot), Simulation(again)):
        simulation.bus.publish("/arm/shoulder_controller/command", Float64(0.5))
        simulation.run(0.5)
        states.append(simulation.state_sha256())
    assert states[0] == states[1]


def test_controller_of_a_mimic_joint_is_reported(launched):
    mimic = arm(EFFORT).replace('<axis xyz="0 1 0"/></joint>', '<axis xyz="0 1 0"/>MIMIC</joint>')
    first, second, rest = mimic.split("MIMIC")
    robot = f'{first}{second}<mimic joint="shoulder"/>{rest}'
    yaml = controller("effort_controllers/JointEffortController", "joint: elbow")
    sim = Simulation(launched(robot, yaml, "c"))
    (found,) = [d for d in sim.diagnostics if d.code == "W135"]
    assert "mimics 'shoulder'" in found.message
    assert not sim.robots.first.joints.control.controllers
