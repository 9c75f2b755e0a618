"""The simulation's topics under the names of a bridge."""

import pytest

import kbot
from kbot.messages import Odometry, Twist, Vector3
from kbot.messages.sensing import LaserScan
from kbot.ros.nodes.gz_bridge import Bridged, Direction, GzBridge
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import Origin, Source

ORIGIN = Origin(Source("bridge.yaml", "- a").whole())


def rule(gz: str, ros: str, kind: type, direction: Direction = Direction.BOTH) -> Bridged:
    package = {Twist: "geometry_msgs", Odometry: "nav_msgs", LaserScan: "sensor_msgs"}[kind]
    return Bridged(gz, ros, f"{package}/msg/{kind.__name__}", direction, ORIGIN)


@pytest.fixture
def sim() -> Simulation:
    return Simulation("kbot", naming=Naming("r"))


def test_gz_s_own_names_of_a_model_s_topics(sim: Simulation) -> None:
    rules = [
        rule("/model/r/cmd_vel", "/drive", Twist, Direction.TO_GZ),
        rule("/model/r/odometry", "/where", Odometry, Direction.TO_ROS),
    ]
    assert GzBridge(sim, rules).notes == []
    heard: list[Odometry] = []
    sim.bus.subscribe("/where", Odometry, heard.append)
    sim.bus.publish("/drive", Twist(Vector3(0.2), Vector3()))
    sim.run(0.4)
    assert heard[-1].twist.twist.linear.x == pytest.approx(0.2, abs=0.02)
    assert sim.odometry.twist.x == pytest.approx(0.2, abs=0.02)


def test_one_of_several_is_meant_by_its_model_s_name(sim: Simulation) -> None:
    sim.models.spawn_model("kbot", "b", x=2.0)
    assert GzBridge(sim, [rule("/model/b/cmd_vel", "/drive_b", Twist)]).notes == []
    sim.bus.publish("/drive_b", Twist(Vector3(0.2), Vector3()))
    sim.run(0.4)
    assert sim.robots["b"].odometry.twist.x > 0.1
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=1e-3)


def test_a_sensor_by_its_path_and_only_while_somebody_listens() -> None:
    sim = Simulation(kbot.load("kbot", lidar="true"))
    sensors, _ = mount_declared(sim)
    (label,) = (name for name, sensor in sensors.items() if sensor.message_type is LaserScan)
    GzBridge(sim, [rule(sensors[label].topic, "/front/scan", LaserScan, Direction.TO_ROS)])
    sim.run(0.5)
    assert not sensors[label].has_subscribers
    heard: list[LaserScan] = []
    listening = sim.bus.subscribe("/front/scan", LaserScan, heard.append)
    sim.run(1.0)
    assert len(heard) >= 5
    listening.close()
    sim.run(0.2)
    assert not sensors[label].has_subscribers


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (rule("/model/r/cmd_vell", "/a", Twist), "nothing here says or hears /model/r/cmd_vell of gz"),
        (rule("/odom", "/a", Odometry, Direction.TO_GZ), "is said by the simulation"),
        (rule("/cmd_vel", "/a", Twist, Direction.TO_ROS), "is heard by the simulation"),
        (rule("/odom", "/a", Twist), "is carried as nav_msgs/msg/Odometry, not as geometry_msgs/msg/Twist"),
        (rule("/odom", "/joint_states", Odometry), "topic /joint_states carries JointState"),
    ],
)
def test_what_cannot_be_carried_is_said_at_its_line(sim: Simulation, asked: Bridged, said: str) -> None:
    (note,) = GzBridge(sim, [asked]).notes
    assert said in note.message
    assert note.origin is ORIGIN
