"""Goals on topics, as rviz and Foxglove publish them."""

import math

import pytest

from kbot.kinematics import PlanarPose
from kbot.messages import Header, String
from kbot.messages.navigation import OccupancyGrid, Path, PoseStamped
from kbot.model.load import load_robot
from kbot.navigation import NavigationTopics, to_pose_stamped
from kbot.sim import Simulation


@pytest.fixture
def simulation():
    return Simulation(load_robot("kbot").require(), "maze:size=3,seed=3")


def _subscribe(simulation, topic, kind):
    received = []
    simulation.bus.subscribe(topic, kind, received.append)
    return received


def _goal(x, y, yaw=0.0, frame="map"):
    return to_pose_stamped(PlanarPose(x, y, yaw), Header(frame_id=frame))


@pytest.mark.parametrize("topic", ["goal_pose", "move_base_simple/goal"])
def test_a_goal_on_a_topic_is_reached_and_its_states_are_published(simulation, topic):
    navigation = NavigationTopics(simulation)
    states, plans = _subscribe(simulation, "navigation_status", String), _subscribe(simulation, "plan", Path)
    simulation.bus.publish(topic, _goal(0.6, 0.6, 1.0))
    simulation.run(30.0)
    assert [m.data for m in states] == ["accepted", "driving", "reached"]
    (goal,) = _subscribe(simulation, "move_base/current_goal", PoseStamped)  # latched
    assert goal.header.frame_id == "odom"
    assert (goal.pose.position.x, goal.pose.position.y) == pytest.approx((0.6, 0.6))
    assert goal.pose.orientation.yaw == pytest.approx(1.0)
    end = plans[0].poses[-1].pose.position
    assert (end.x, end.y) == pytest.approx((0.6, 0.6))
    pose = simulation.ground_truth.pose
    assert math.hypot(pose.x - 0.6, pose.y - 0.6) < 0.015
    assert not navigation.goals.is_driving
    # the robot can be driven by hand again
    simulation.cmd_vel(0.0, 1.0)
    simulation.run(1.0)
    assert simulation.ground_truth.twist.yaw == pytest.approx(1.0, abs=0.01)


def test_the_map_is_latched_for_late_subscribers(simulation):
    NavigationTopics(simulation)
    (grid,) = _subscribe(simulation, "/map", OccupancyGrid)
    assert grid.header.frame_id == "odom"
    assert grid.data.size == grid.info.width * grid.info.height
    assert (grid.data == 100).any()


def test_a_new_goal_replaces_the_old_one(simulation):
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    simulation.run(1.0)
    simulation.bus.publish("goal_pose", _goal(0.0, 0.0))
    simulation.run(20.0)
    assert [m.data for m in states] == ["accepted", "driving", "accepted", "driving", "reached"]


def test_cancelling_stops_the_robot_by_topic(simulation):
    navigation = NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    simulation.run(2.0)
    navigation.goals.cancel("enough")
    simulation.run(1.0)
    assert states[-1].data == "cancelled: enough"
    assert abs(simulation.ground_truth.twist.x) < 1e-3
    navigation.close()
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    assert states[-1].data == "cancelled: enough"


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (_goal(0.3, 0.0), "refused: the goal is inside an obstacle"),
        (_goal(0.5, 0.0, frame="camera_lnk"), "refused: the goal is in the frame 'camera_lnk'"),
        (_goal(math.nan, 0.0), "refused: a goal needs a finite"),
    ],
)
def test_an_impossible_goal_is_refused_with_its_reason(simulation, goal, words):
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", goal)
    simulation.run(0.1)
    assert states[-1].data.startswith(words)
    assert isinstance(goal, PoseStamped)
