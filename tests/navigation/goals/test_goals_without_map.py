"""Goals of a running simulation without a map: topics, path, costs, cancelling, a robot that is placed."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose
from kbot.messages import Header, String, Twist, Vector3
from kbot.messages.navigation import OccupancyGrid, Path, PoseStamped
from kbot.messages.types import Quaternion, TFMessage, Transform, TransformStamped
from kbot.model.load import load_robot
from kbot.navigation import Goals, GoalState, NavigationTopics, WithoutMap, to_pose_stamped
from kbot.navigation.goals.goal_options import GoalOptions
from kbot.navigation.space.cost_to_go import costs
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.builders import box, floor, wall
from kbot.world.occupancy import OccupancyGrid as Grid
from kbot.world.world import World


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot", {"lidar": "true"}).require()


@pytest.fixture
def simulation(robot):
    walls = wall("back", (1.2, -0.5), (1.2, 0.5)), wall("left", (0.5, 0.5), (1.2, 0.5))
    return Simulation(robot, World("corner", (floor(), *walls)))


def _goals(simulation, **options):
    return Goals(simulation, WithoutMap(simulation, **{"arrive": 0.1, **options}))


def _subscribe(simulation, topic, kind):
    received = []
    simulation.bus.subscribe(topic, kind, received.append)
    return received


def _goal(x, y, yaw=0.0, frame="map") -> PoseStamped:
    return to_pose_stamped(PlanarPose(x, y, yaw), Header(frame_id=frame))


def _run(simulation, goals, seconds=40.0):
    for _ in range(round(seconds / 0.1)):
        simulation.run(0.1)
        if goals.status.state.is_end:
            return


def test_a_goal_on_a_topic_is_reached_with_path_and_costs(simulation):
    goals = _goals(simulation)
    NavigationTopics(simulation, goals)
    states, plans = _subscribe(simulation, "navigation_status", String), _subscribe(simulation, "plan", Path)
    costmaps = _subscribe(simulation, "move_base/local_costmap/costmap", OccupancyGrid)
    assert "/map" not in simulation.bus.topics
    simulation.bus.publish("move_base_simple/goal", _goal(2.0, 0.0))
    _run(simulation, goals)
    assert [state.data for state in states] == ["accepted", "driving", "reached"]
    true = simulation.ground_truth.pose
    assert math.hypot(true.x - 2.0, true.y) < 0.1
    assert not simulation.collided
    assert len(plans) > 5
    end = plans[-1].poses[-1].pose.position
    assert (end.x, end.y) == pytest.approx((2.0, 0.0), abs=0.05)
    grid = Grid.from_message(costmaps[-1])
    odom_from_world = simulation.odometry.pose @ goals.pose.inverse()
    back = odom_from_world @ PlanarPose(1.2, -0.3)
    nearby = [grid.value(back.x + off, back.y) for off in (-0.04, -0.02, 0.0, 0.02, 0.04)]
    assert 100 in nearby
    assert grid.value(back.x, back.y - 1.5) == 0
    assert costmaps[-1].header.frame_id == "odom"


def test_the_path_leads_around_obstacles_that_are_known(simulation):
    goals = _goals(simulation)
    goals.go(PlanarPose(2.0, 0.0))
    simulation.run(1.0)
    points = goals.path.points
    crossing = points[np.argmin(np.abs(points[:, 0] - 1.2))]
    assert abs(crossing[1]) > 0.55  # beside the wall, whose ends are at 0.5
    assert math.hypot(*(points[0] - [goals.pose.x, goals.pose.y])) < 0.1
    assert np.hypot(*np.diff(points[:-1], axis=0).T).max() < 0.15
    # by (1.2, -0.9): 1.5 + 1.2 m, because a way near obstacles costs more
    assert goals.path.length == pytest.approx(2.7, abs=0.3)


def test_a_second_goal_continues_the_estimate(simulation):
    goals = _goals(simulation)
    goals.go(PlanarPose(0.4, -0.4), any_heading=True)
    _run(simulation, goals)
    assert goals.status == "reached"
    simulation.run(1.0)
    assert abs(simulation.ground_truth.twist.x) < 1e-3
    goals.go(PlanarPose(0.0, 0.0), any_heading=True)
    _run(simulation, goals)
    assert goals.status == "reached"
    true = simulation.ground_truth.pose
    assert math.hypot(true.x, true.y) < 0.1
    assert math.hypot(true.x - goals.pose.x, true.y - goals.pose.y) < 0.02


def test_the_estimate_follows_a_robot_that_is_driven_by_hand(simulation):
    goals = _goals(simulation)
    navigation = NavigationTopics(simulation, goals)
    simulation.bus.publish("goal_pose", _goal(2.0, 0.0))
    simulation.run(1.0)
    for _ in range(20):
        simulation.bus.publish("cmd_vel", Twist(Vector3(-0.2), Vector3(0.0, 0.0, 0.5)))
        simulation.run(0.1)
    assert str(goals.status) == "cancelled: another command drives the robot"
    true = simulation.ground_truth.pose
    assert simulation.ground_truth.twist.yaw == pytest.approx(0.5, abs=0.05)
    assert math.hypot(true.x - goals.pose.x, true.y - goals.pose.y) < 0.03
    navigation.close()


@pytest.mark.parametrize("how", ["cancel", "reset", "place", "moved"])
def test_what_ends_a_goal_stops_the_robot(simulation, how):
    goals = _goals(simulation)
    goals.go(PlanarPose(2.0, -1.0))
    simulation.run(1.5)
    assert goals.status == "driving"
    reasons = {
        "cancel": "enough",
        "reset": "the simulation was reset",
        "place": "the robot was placed elsewhere",
        "moved": "enough",
    }
    if how == "cancel":
        goals.cancel("enough")
    elif how == "reset":
        simulation.reset()
    elif how == "place":
        goals.place(PlanarPose(-1.0, 0.5, 1.0))
    else:
        goals.cancel("enough")
        simulation.models.set_pose(-1.0, 0.5, 1.0)
    simulation.run(0.3)
    assert str(goals.status) == f"cancelled: {reasons[how]}"
    assert not goals.is_driving
    simulation.run(1.0)
    assert abs(simulation.ground_truth.twist.x) < 1e-3
    # the robot knows its new place, and then its wheels slip by some cm until they stand still
    true = simulation.ground_truth.pose
    assert (goals.pose.x, goals.pose.y) == pytest.approx((true.x, true.y), abs=0.04)
    goals.go(PlanarPose(-0.6, 0.3), any_heading=True)
    _run(simulation, goals)
    assert goals.status == "reached"


def test_a_goal_in_a_frame_of_the_robot_is_where_the_robot_believes(robot):
    simulation = Simulation(robot, start=PlanarPose(1.0, 2.0, math.pi / 2))
    goals = _goals(simulation)
    NavigationTopics(simulation, goals)
    simulation.bus.publish("goal_pose", _goal(0.5, 0.0, 0.0, "base_footprint"))
    goal = goals.status.goal
    assert (goal.x, goal.y, goal.yaw) == pytest.approx((1.0, 2.5, math.pi / 2), abs=1e-6)


def test_a_goal_in_a_frame_that_is_connected_on_tf(robot):
    """A script publishes the parent of the frame of odometry, as a localisation does."""
    simulation = Simulation(robot, start=PlanarPose(1.0, 2.0, math.pi / 2))
    goals = _goals(simulation)
    NavigationTopics(simulation, goals)
    # the frame is turned by 90 degrees against odometry, as one with the axes of the world
    turned = Transform(Vector3(0.0, 0.0, 0.0), Quaternion.about_z(math.pi / 2))
    message = TFMessage((TransformStamped(Header(frame_id="fused"), "odom", turned),))
    simulation.bus.publish("/tf", message)
    simulation.bus.publish("goal_pose", _goal(0.0, 3.0, 0.0, "fused"))
    goal = goals.status.goal
    assert (goal.x, goal.y) == pytest.approx((1.0, 5.0), abs=1e-6)
    assert math.remainder(goal.yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_a_robot_without_a_lidar_refuses_goals_with_the_reason():
    simulation = Simulation(load_robot("kbot").require())
    NavigationTopics(simulation, _goals(simulation))
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", _goal(1.0, 0.0))
    assert "declares no level lidar" in states[-1].data
    with pytest.raises(KbotError, match="declares no level lidar"):
        _goals(simulation).go(PlanarPose(1.0, 0.0))


def test_the_same_goals_give_the_same_run(robot):
    ends = []
    for _ in range(2):
        simulation = Simulation(robot, World("w", (floor(), box("box", (0.2, 0.4, 0.3), 0.6, 0.1))))
        _goals(simulation).go(PlanarPose(1.2, 0.0), any_heading=True)
        simulation.run(4.0)
        ends.append(simulation.state_sha256())
    assert ends[0] == ends[1]


def test_options_set_radius_and_speed(simulation):
    goals = GoalOptions(no_map=True, arrive=0.3, max_speed=(0.2, 1.0)).goals(simulation)
    assert not goals.has_map
    goals.go(PlanarPose(0.5, -0.5), any_heading=True)
    speeds = []
    simulation.clock.every(50.0, lambda: speeds.append(simulation.robots.first.commanded_twist.x))
    _run(simulation, goals)
    assert goals.status.state is GoalState.REACHED
    assert 0.15 < max(speeds) <= 0.2
    true = simulation.ground_truth.pose
    assert 0.03 < math.hypot(true.x - 0.5, true.y + 0.5) < 0.3


def test_the_costs_fall_from_100_to_0_with_the_distance():
    occupied = np.zeros((3, 40), dtype=bool)
    occupied[:, 0] = True
    row = costs(occupied, 0.02, 0.1, 0.4)[1].tolist()
    assert row[0] == 100
    assert row[1:5] == [99] * 4  # nearer than the robot's radius of 0.1 m
    assert row[5] == 98
    assert row == sorted(row, reverse=True)
    assert row[25:] == [0] * 15  # 0.4 m beyond it
