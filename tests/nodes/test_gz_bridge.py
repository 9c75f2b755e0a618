"""ros_gz_bridge: the simulation's topics under the names of a bridge."""

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


def test_topics_of_a_model_by_their_gz_names(sim: Simulation) -> None:
    rules = [
        rule("/model/r/cmd_vel", "/drive", Twist, Direction.TO_GZ),
        rule("/model/r/odometry", "/where", Odometry, Direction.TO_ROS),
    ]
    assert GzBridge(sim, rules).notes == []
    received: list[Odometry] = []
    sim.bus.subscribe("/where", Odometry, received.append)
    sim.bus.publish("/drive", Twist(Vector3(0.2), Vector3()))
    sim.run(0.4)
    assert received[-1].twist.twist.linear.x == pytest.approx(0.2, abs=0.02)
    assert sim.odometry.twist.x == pytest.approx(0.2, abs=0.02)


def test_gz_topics_select_a_robot_by_its_model_name(sim: Simulation) -> None:
    sim.models.spawn_model("kbot", "b", x=2.0)
    assert GzBridge(sim, [rule("/model/b/cmd_vel", "/drive_b", Twist)]).notes == []
    sim.bus.publish("/drive_b", Twist(Vector3(0.2), Vector3()))
    sim.run(0.4)
    assert sim.robots["b"].odometry.twist.x > 0.1
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=1e-3)


def test_a_sensor_is_bridged_only_while_there_are_subscribers() -> None:
    sim = Simulation(kbot.load("kbot", lidar="true"))
    sensors, _ = mount_declared(sim)
    (label,) = (name for name, sensor in sensors.items() if sensor.message_type is LaserScan)
    GzBridge(sim, [rule(sensors[label].topic, "/front/scan", LaserScan, Direction.TO_ROS)])
    sim.run(0.5)
    assert not sensors[label].has_subscribers
    received: list[LaserScan] = []
    subscription = sim.bus.subscribe("/front/scan", LaserScan, received.append)
    sim.run(1.0)
    assert len(received) >= 5
    subscription.close()
    sim.run(0.2)
    assert not sensors[label].has_subscribers


@pytest.mark.parametrize(
    ("bridged", "message"),
    [
        (rule("/model/r/cmd_vell", "/a", Twist), "the simulation has no gz topic /model/r/cmd_vell"),
        (
            rule("/odom", "/a", Odometry, Direction.TO_GZ),
            "the simulation publishes /odom, so its direction must be GZ_TO_ROS",
        ),
        (
            rule("/cmd_vel", "/a", Twist, Direction.TO_ROS),
            "the simulation subscribes to /cmd_vel, so its direction must be ROS_TO_GZ",
        ),
        (rule("/odom", "/a", Twist), "/odom has the type nav_msgs/msg/Odometry, not geometry_msgs/msg/Twist"),
        (rule("/odom", "/joint_states", Odometry), "topic /joint_states carries JointState"),
    ],
)
def test_errors_are_reported_at_the_line_of_the_topic(
    sim: Simulation, bridged: Bridged, message: str
) -> None:
    (note,) = GzBridge(sim, [bridged]).notes
    assert message in note.message
    assert note.origin is ORIGIN
