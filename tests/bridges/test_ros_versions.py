"""Topics that only one version of ROS has are offered only there."""

import pytest

import kbot
from kbot.navigation.goals.topics import NavigationTopics
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.ros_versions import version_of
from kbot.ros.gazebo.states import GazeboTopics
from kbot.ros.peers import RosPeers
from kbot.sim import Simulation

ONLY_ROS1 = {
    "/gazebo/link_states",
    "/gazebo/model_states",
    "/gazebo/set_model_state",
    "/move_base/NavfnROS/plan",
    "/move_base/cancel",
    "/move_base/current_goal",
    "/move_base/feedback",
    "/move_base/goal",
    "/move_base/result",
    "/move_base/status",
    "/move_base_simple/goal",
}
ONLY_ROS2 = {"/goal_pose", "/plan"}


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    simulation = Simulation(kbot.load("kbot"))
    GazeboTopics(simulation)
    NavigationTopics(simulation)
    return simulation


def feed_of(simulation: Simulation) -> Feed:
    return Feed(simulation.bus, lambda: simulation.clock.nanoseconds)


def test_a_simulation_offers_each_ros_version_its_own_topics(simulation: Simulation) -> None:
    peers = RosPeers(print)
    peers.join(simulation, feed_of(simulation), "", "empty")
    try:
        link = peers._link
        every = link.topics.keys()  # those of Foxglove, rosbridge and `kbot topic`
        assert every >= ONLY_ROS1 | ONLY_ROS2 | {"/odom", "/cmd_vel", "/map", "/initialpose"}
        assert every - link.topics_of(2).keys() == ONLY_ROS1
        assert every - link.topics_of(1).keys() == ONLY_ROS2
    finally:
        peers.close()


def test_a_users_node_and_a_recording_offer_all_topics(simulation: Simulation) -> None:
    link = PeerLink(print)
    link.attach(simulation, feed_of(simulation))
    try:
        assert link.topics_of(1) == link.topics_of(2) == link.topics
    finally:
        link.end()


@pytest.mark.parametrize(
    ("topic", "type_name", "expected"),
    [
        ("/arm/follow_joint_trajectory/goal", "control_msgs/msg/FollowJointTrajectoryActionGoal", 1),
        ("/arm/follow_joint_trajectory/status", "actionlib_msgs/msg/GoalStatusArray", 1),
        ("/arm/follow_joint_trajectory/cancel", "actionlib_msgs/msg/GoalID", 1),
        ("/move_base/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", 1),
        ("/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", 2),
        ("/gazebo_camera/image_raw", "sensor_msgs/msg/Image", None),
        ("/robot/plan", "nav_msgs/msg/Path", None),
    ],
)
def test_versions_of_topics(topic: str, type_name: str, expected: int | None) -> None:
    assert version_of(topic, type_name) is expected
