"""Goals of a running simulation: prepared on first use, journalled, and cancelled by other commands."""

import logging
import math
import time

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages import Header, String, Twist, Vector3
from kbot.messages.navigation import GoalID, OccupancyGrid, Path, PoseWithCovarianceStamped
from kbot.messages.types import PoseWithCovariance
from kbot.model.load import load_robot, load_robot_text
from kbot.navigation import Goals, GoalState, NavigationTopics, WithMap, to_pose_stamped
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.record.replay import replay
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.world.builders import box, floor
from kbot.world.occupancy import OccupancyGrid as Grid
from kbot.world.occupancy_of_world import world_grid
from kbot.world.world import World

MAZE = "maze:size=3,seed=3"


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot").require()


@pytest.fixture
def simulation(robot):
    return Simulation(robot, MAZE)


def _goal(x, y, yaw=0.0, frame="map"):
    return to_pose_stamped(PlanarPose(x, y, yaw), Header(frame_id=frame))


def _estimate(x, y, yaw=0.0, frame="map"):
    stamped = _goal(x, y, yaw, frame)
    return PoseWithCovarianceStamped(stamped.header, PoseWithCovariance(stamped.pose))


def _subscribe(simulation, topic, kind):
    received = []
    simulation.bus.subscribe(topic, kind, received.append)
    return received


def test_the_map_is_made_for_the_first_subscriber(simulation):
    due = simulation.clock.next_due
    navigation = NavigationTopics(simulation)
    simulation.run(1.0)
    assert navigation.goals.grid is None
    assert simulation.clock.next_due == due
    assert {"/goal_pose", "/move_base_simple/goal", "/initialpose"} <= simulation.bus.inputs
    _subscribe(simulation, "map", OccupancyGrid)
    assert navigation.goals.grid is not None


def test_the_robot_waits_for_a_map_that_is_made_in_the_background(simulation):
    navigation = NavigationTopics(simulation, Goals(simulation, WithMap(simulation, in_background=True)))
    maps, states = (
        _subscribe(simulation, "map", OccupancyGrid),
        _subscribe(simulation, "navigation_status", String),
    )
    simulation.bus.publish("goal_pose", _goal(0.6, 0.6))
    for _ in range(400):
        simulation.run(0.1)
        if navigation.goals.status.state.is_end:
            break
        time.sleep(0.005)
    assert [m.data for m in states] == ["accepted", "driving", "reached"]
    assert len(maps) == 1


def test_a_goal_beyond_the_map_enlarges_the_map(robot):
    simulation = Simulation(robot)
    goals = Goals(simulation)
    goals.go(PlanarPose(0.3, 0.0))
    small = goals.grid
    goals.go(PlanarPose(9.0, 0.0))
    assert goals.grid is not small
    assert goals.grid.value(9.0, 0.0) == 0
    simulation.run(0.1)
    assert goals.status.state is GoalState.DRIVING


def test_a_map_has_no_more_cells_than_can_be_planned_on(robot):
    goals = Goals(Simulation(robot))
    goals.go(PlanarPose(400.0, 300.0))
    # 404 x 304 m at the resolution 0.02 would be 307 million cells
    assert 0.5e6 < goals.grid.cells.size < 2.1e6
    assert goals.grid.contains(*goals.grid.cell(400.0, 300.0))


def test_a_recorded_navigation_is_replayed_bit_for_bit(simulation, tmp_path):
    navigation = NavigationTopics(simulation)
    feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
    with Recorder(simulation, feed, str(tmp_path / "run.mcap"), world=MAZE):
        simulation.run(0.123)
        simulation.bus.publish("goal_pose", _goal(0.6, 0.6, 1.0))
        simulation.run(4.0)
        simulation.bus.publish("goal_pose", _goal(0.0, 0.0))
        simulation.run(1.5)
        simulation.bus.publish("initialpose", _estimate(0.6, 0.6, 2.0))
        simulation.run(1.0)
    assert navigation.goals.status.state is GoalState.CANCELLED
    again = replay(str(tmp_path / "run.mcap"))
    assert again.is_same, again.difference
    assert again.same_state
    assert again.simulation.ground_truth.pose == simulation.ground_truth.pose


def test_the_same_goals_give_the_same_run(robot):
    ends = []
    for _ in range(2):
        simulation = Simulation(robot, MAZE)
        Goals(simulation).go(PlanarPose(0.6, 0.6))
        simulation.run(5.0)
        ends.append(simulation.state_sha256())
    assert ends[0] == ends[1]


def test_a_command_on_cmd_vel_cancels_the_goal(simulation):
    navigation = NavigationTopics(simulation)
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    simulation.run(1.0)
    simulation.bus.publish("cmd_vel", Twist())
    simulation.run(0.1)
    assert navigation.goals.is_driving
    simulation.bus.publish("cmd_vel", Twist(angular=Vector3(0.0, 0.0, 1.0)))
    simulation.run(0.4)
    assert str(navigation.goals.status) == "cancelled: another command drives the robot"
    assert simulation.ground_truth.twist.yaw == pytest.approx(1.0, abs=0.02)


def test_a_cancel_message_stops_the_robot(simulation):
    navigation = NavigationTopics(simulation)
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    simulation.run(1.0)
    simulation.bus.publish("move_base/cancel", GoalID())
    simulation.run(1.0)
    assert navigation.goals.status.state is GoalState.CANCELLED
    assert abs(simulation.ground_truth.twist.x) < 1e-3


def test_a_reset_cancels_the_goal(simulation):
    goals = Goals(simulation)
    goals.go(PlanarPose(1.2, 1.2))
    simulation.run(2.0)
    simulation.reset()
    simulation.run(0.1)
    assert str(goals.status) == "cancelled: the simulation was reset"
    assert not goals.is_driving


@pytest.mark.parametrize("frame", ["odom", "base_footprint"])
def test_goals_can_be_in_the_frames_of_the_robot_and_its_odometry(robot, frame):
    simulation = Simulation(robot, start=PlanarPose(1.0, 2.0, math.pi / 2))
    navigation = NavigationTopics(simulation)
    plans = _subscribe(simulation, "plan", Path)
    # half a metre ahead of the robot, which is along the world's y
    simulation.bus.publish("goal_pose", _goal(0.5, 0.0, 0.0, frame))
    goal = navigation.goals.status.goal
    assert (goal.x, goal.y, goal.yaw) == pytest.approx((1.0, 2.5, math.pi / 2), abs=1e-6)
    simulation.run(0.1)
    assert plans[-1].header.frame_id == "odom"
    end = plans[-1].poses[-1].pose
    assert (end.position.x, end.position.y) == pytest.approx((0.5, 0.0), abs=1e-4)
    assert end.orientation.w == pytest.approx(1.0)


def test_the_map_is_published_in_the_frame_of_odometry(robot):
    simulation = Simulation(robot, "corridor", start=PlanarPose(1.0, 0.0, math.pi / 2))
    NavigationTopics(simulation)
    (message,) = _subscribe(simulation, "map", OccupancyGrid)
    grid = Grid.from_message(message)
    # the walls are 0.4 m to each side of the corridor's middle, across which the robot stands
    assert grid.value(0.4, 0.0) == grid.value(-0.4, 0.0) == 100
    assert grid.value(0.0, 0.4) == 0


def test_a_pose_estimate_places_the_robot(simulation):
    navigation = NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", _goal(1.2, 1.2))
    simulation.run(1.0)
    simulation.bus.publish("initialpose", _estimate(0.6, 0.6, 1.0))
    pose = simulation.ground_truth.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.6, 0.6, 1.0), abs=1e-6)
    assert states[-1].data == "cancelled: the robot was placed elsewhere"
    simulation.bus.publish("initialpose", _estimate(0.3, 0.0))
    assert "the map shows an obstacle there" in states[-1].data
    assert not navigation.goals.is_driving


def test_each_refused_goal_publishes_a_status(simulation):
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    for _ in range(2):
        simulation.bus.publish("goal_pose", _goal(1.0, 0.0, 0.0, "nowhere"))
    assert len(states) == 2
    assert states[0].data == states[1].data
    assert "nowhere" in states[0].data


def test_a_robot_on_its_back_publishes_a_status_for_each_goal(robot):
    simulation = Simulation(robot)
    _throw_over(simulation, math.pi)
    simulation.run(1.0)
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    for _ in range(2):
        simulation.bus.publish("goal_pose", _goal(1.0, 0.0))
    assert [state.data for state in states] == [states[0].data] * 2
    assert states[0].data.startswith("refused: ")


def test_a_robot_that_cannot_drive_refuses_goals():
    text = """<robot name="r"><link name="l"><collision><geometry><box size="1 1 1"/></geometry></collision>
      </link></robot>"""
    simulation = Simulation(load_robot_text(text, "r.urdf").require())
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    simulation.bus.publish("goal_pose", _goal(1.0, 0.0))
    assert states[-1].data.startswith("refused: robot 'r' cannot drive")
    assert not _subscribe(simulation, "map", OccupancyGrid)
    with pytest.raises(KbotError, match="cannot drive"):
        Goals(simulation).go(PlanarPose(1.0, 0.0))


def test_a_declared_lidar_is_used_to_avoid_obstacles():
    world = World("box", (floor(), box("box", (0.2, 0.5, 0.3), 0.7, 0.0)))
    simulation = Simulation(load_robot("kbot", {"lidar": "true"}).require(), world)
    empty = Grid(np.zeros((100, 100), dtype=np.int8), 0.05, PlanarPose(-2.5, -2.5))
    goals = Goals(simulation, WithMap(simulation, empty))
    goals.go(PlanarPose(1.6, 0.0))
    simulation.run(60.0)
    assert goals.status.state is GoalState.REACHED, goals.status


def _wheel(name, x, y, parent="base"):
    return f"""<link name="{name}"><inertial><mass value="0.2"/>
      <inertia ixx=".001" iyy=".001" izz=".001" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin rpy="1.5708 0 0"/><geometry>
      <cylinder radius="0.05" length="0.02"/></geometry></collision></link>
      <joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>
      <origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>"""


def test_a_goal_of_a_steered_robot_is_reached_by_reversing():
    inertial = """<inertial><mass value="2"/><origin xyz="0.1 0 0.05"/><inertia ixx=".01" iyy=".01" izz=".01"
      ixy="0" ixz="0" iyz="0"/></inertial>"""
    text = f"""<robot name="trike"><link name="base">{inertial}</link>
      {_wheel("left", 0, 0.1)}{_wheel("right", 0, -0.1)}
      <link name="fork">{inertial.replace('"2"', '"0.2"').replace("0.1 0 0.05", "0 0 0")}</link>
      <joint name="steering" type="revolute"><parent link="base"/><child link="fork"/>
      <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="50" velocity="9"/></joint>
      {_wheel("front", 0, 0, "fork")}</robot>"""
    simulation = Simulation(load_robot_text(text, "r.urdf").require())
    goals = Goals(simulation)
    goals.go(PlanarPose(-0.3, 0.2, 0.5))
    simulation.run(30.0)
    assert goals.status == "reached", goals.status
    pose = simulation.ground_truth.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((-0.3, 0.2, 0.5), abs=0.021)


@pytest.mark.parametrize("x", [1e308, -2e6])
def test_goals_that_are_too_far_away_are_refused(simulation, x):
    NavigationTopics(simulation)
    states = _subscribe(simulation, "navigation_status", String)
    for _ in range(2):
        simulation.bus.publish("goal_pose", _goal(x, -x))
        assert "is further than 1e+06 m from the origin" in states[-1].data
        simulation.run(0.1)


@pytest.mark.parametrize("x", [1e308, -1e300, math.inf, math.nan])
def test_coordinates_that_are_too_large_are_outside_a_map(x):
    grid = Grid(np.zeros((2, 2), dtype=np.int8), 0.05)
    assert not grid.contains(*grid.cell(x, 0.0))
    assert grid.value(0.0, x) == -1


def test_objects_that_are_too_far_away_are_left_off_the_map():
    near = box("near", (0.2, 0.2, 0.2), 1.0, 0.0)
    far = box("far", (0.2, 0.2, 0.2), 1e16, -1e300)
    with_both, with_near = (world_grid(World("w", bodies)) for bodies in ((near, far), (near,)))
    assert np.array_equal(with_both.cells, with_near.cells)


def test_a_map_that_fails_refuses_the_goal(simulation, monkeypatch, tmp_path):
    def broken(*_):
        raise OverflowError("a bug")

    monkeypatch.setattr("kbot.navigation.goals.goals_with_map.robot_planner", broken)
    monkeypatch.setattr("kbot.text.crash.state_folder", lambda: tmp_path)
    monkeypatch.setattr("kbot.navigation.goals.goals_with_map.FAULTS", Complaints(logging.getLogger("goals")))
    goals = Goals(simulation)
    for x in (1.0, 2.0):
        goals.go(PlanarPose(x, 0.0))
        failed = "KBot could not process this: OverflowError: a bug; please report it"
        assert str(goals.status) == f"refused: no map: {failed}"
    assert len(list((tmp_path / "crashes").iterdir())) == 1  # the same fault has one crash file


def _throw_over(simulation, roll):
    pose = Transform.from_xyz_rpy((0.0, 0.0, 0.3), (roll, 0.0, 0.0))
    simulation.models.set_model_state(simulation.robots.first.name, pose)


def test_a_robot_on_its_back_refuses_a_goal_at_once(robot):
    """The reason says how the robot lies and what to do. Once it is upright, it drives."""
    simulation = Simulation(robot)
    goals = Goals(simulation)
    _throw_over(simulation, math.pi)
    simulation.run(1.0)
    goals.go(PlanarPose(0.3, 0.0))
    assert goals.status.state is GoalState.REFUSED
    assert "the robot lies on its back (roll " in goals.status.reason
    assert "reset the simulation" in goals.status.reason
    assert not goals.is_driving
    goals.place(PlanarPose(0.1, 0.0))
    goals.go(PlanarPose(0.3, 0.0))
    simulation.run(6.0)
    assert goals.status.state is GoalState.REACHED


@pytest.mark.parametrize("another", [False, True])
def test_a_robot_that_falls_over_ends_its_goal_at_once(robot, another):
    """A new goal is then refused."""
    simulation = Simulation(robot)
    goals = Goals(simulation)
    goals.go(PlanarPose(2.0, 0.0))
    simulation.run(1.0)
    assert goals.status.state is GoalState.DRIVING
    _throw_over(simulation, math.pi / 2)
    if another:
        goals.go(PlanarPose(0.0, 2.0))
    else:
        simulation.run(0.04)
    assert goals.status.state is (GoalState.REFUSED if another else GoalState.STUCK)
    assert "lies on its side (roll 90°, pitch 0°)" in goals.status.reason
    assert not goals.is_driving
    assert simulation.robots.first.commanded_twist == PlanarTwist()
