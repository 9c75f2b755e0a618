"""Goals in simulation are reached within their tolerance, or end with a reason, always in bounded time."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.angles import wrap
from kbot.model.load import load_robot
from kbot.navigation.controller import Observation, twist
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.simulated.pilot import Pilot
from kbot.navigation.space.footprint import Outline
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.with_map.navigator import Navigator, NavigatorSettings
from kbot.navigation.with_map.progress_checker import ProgressChecker
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.builders import box, floor
from kbot.world.occupancy import OccupancyGrid
from kbot.world.world import World


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot").require()


@pytest.mark.parametrize(
    ("world", "goal"),
    [("empty", (0.6, -0.4, 2.0)), ("maze:size=3,seed=3", (1.2, 1.2, 1.0)), ("rooms", (2.0, 0.5, 0.0))],
)
def test_goals_are_reached(robot, world, goal):
    trip = go_to(Simulation(robot, world), PlanarPose(*goal))
    assert trip.reached, trip.status
    assert math.hypot(trip.pose.x - goal[0], trip.pose.y - goal[1]) < 0.015
    assert abs(wrap(trip.pose.yaw - goal[2])) < 0.03
    assert trip.distance < 1.1 * trip.shortest + 0.02
    assert trip.odometry_error < 0.005


def test_odometry_can_steer_the_robot(robot):
    simulation = Simulation(robot)
    simulation.models.place(PlanarPose(1.0, 2.0, 0.5))
    trip = go_to(simulation, PlanarPose(1.5, 2.5, 0.0), pose="odometry")
    assert trip.reached
    assert math.hypot(trip.pose.x - 1.5, trip.pose.y - 2.5) < 0.015


@pytest.mark.parametrize(
    ("goal", "words"),
    [((0.3, 0.0), "inside an obstacle"), ((-2.0, 0.0), "no path"), ((0.2, 0.0), "too near")],
)
def test_an_impossible_goal_is_refused_at_once(robot, goal, words):
    trip = go_to(Simulation(robot, "maze:size=3,seed=3"), PlanarPose(*goal))
    assert trip.status.state is GoalState.REFUSED
    assert words in trip.status.reason
    assert trip.time <= 0.02


def test_without_a_map_a_goal_is_refused(robot):
    trip = go_to(Simulation(robot), PlanarPose(1, 0), navigator=Navigator(None))
    assert trip.status.state is GoalState.REFUSED
    assert "no map" in trip.status.reason


def test_a_wall_that_is_not_on_the_map_ends_in_stuck(robot):
    world = World("wall", (floor(), box("wall", (0.1, 6.0, 0.3), 0.6, 0.0)))
    empty = OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 0.05, PlanarPose(-2.5, -2.5))
    settings = NavigatorSettings(patience=1.0, attempts=2)
    trip = go_to(Simulation(robot, world), PlanarPose(1.5, 0.0), empty, settings=settings)
    assert trip.status.state is GoalState.STUCK
    assert "tried 3 times" in trip.status.reason
    assert trip.time < 20.0


def test_a_goal_that_exceeds_its_time_limit_is_stuck(robot):
    trip = go_to(Simulation(robot), PlanarPose(3, 0), timeout=1.0)
    assert trip.status.state is GoalState.STUCK
    assert "not at the goal after 1.0 s" in trip.status.reason
    assert trip.status.reason.startswith("out of time: ")


def test_the_state_of_a_trip_equals_its_text(robot):
    trip = go_to(Simulation(robot), PlanarPose(0.3, 0.0))
    assert trip.state == "reached"
    assert trip.state is GoalState.REACHED
    assert trip.status == "reached"
    assert trip.status != "stuck"
    assert trip.status == GoalReport(PlanarPose(0.3, 0.0), GoalState.REACHED)
    assert trip.status != GoalReport(PlanarPose(0.4, 0.0), GoalState.REACHED)
    assert trip.status != None  # noqa: E711 - any object may be compared
    assert len({trip.status, GoalReport(PlanarPose(0.3, 0.0), GoalState.REACHED)}) == 1


def test_cancelling_stops_the_robot(robot):
    simulation = Simulation(robot)
    grid = OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 0.05, PlanarPose(-2.5, -2.5))
    navigator = Navigator(GridPlanner(grid, 0.13))
    Pilot(simulation, navigator)
    assert navigator.go(PlanarPose(2, 0)).state is GoalState.ACCEPTED
    simulation.run(1.0)
    assert navigator.status.state is GoalState.DRIVING
    assert simulation.ground_truth.twist.x > 0.2
    navigator.cancel("the operator said so")
    simulation.run(1.0)
    assert str(navigator.status) == "cancelled: the operator said so"
    assert abs(simulation.ground_truth.twist.x) < 1e-3


def _lidar_navigator(**settings):
    grid = OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 0.05, PlanarPose(-2.5, -2.5))
    return Navigator(
        GridPlanner(grid, 0.13), NavigatorSettings(**settings), Outline.rectangle(-0.1, 0.06, -0.09, 0.09)
    )


def _end(navigator, observe, seconds=200.0):
    for tick in range(int(seconds / 0.02)):
        navigator.update(observe(tick * 0.02))
        if navigator.status.state.is_end:
            return navigator.status, tick * 0.02
    pytest.fail("no end")


def test_a_silent_lidar_ends_in_stuck():
    navigator = _lidar_navigator(silence=1.0)
    navigator.go(PlanarPose(1, 0))
    status, time = _end(navigator, lambda t: Observation(t, PlanarPose()))
    assert status.state is GoalState.STUCK
    assert "silent" in status.reason
    assert time == pytest.approx(1.02, abs=0.05)


def test_a_robot_that_is_walled_in_ends_in_stuck():
    navigator = _lidar_navigator(patience=1.0, attempts=2)
    angles = np.linspace(-math.pi, math.pi, 180)
    ring = 0.16 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    navigator.go(PlanarPose(1, 0))
    status, time = _end(navigator, lambda t: Observation(t, PlanarPose(), PlanarTwist(), ring, 0.0))
    assert status.state is GoalState.STUCK
    assert time < 20.0


def test_a_robot_that_only_spins_ends_in_stuck():
    navigator = Navigator(GridPlanner(OccupancyGrid(np.zeros((50, 50), dtype=np.int8), 0.1), 0.13))
    navigator.go(PlanarPose(4, 4))
    status, time = _end(navigator, lambda t: Observation(t, PlanarPose(1, 1, 2.0 * t)))
    assert status.state is GoalState.STUCK
    assert time < 60.0


def test_a_user_controller_drives_the_robot(robot):
    class TowardsTheLight:
        def update(self, observation):
            x, y = observation.in_base(1.0, 1.0)
            return twist(0.2 if math.hypot(x, y) > 0.1 else 0.0, 1.5 * math.atan2(y, x))

    simulation = Simulation(robot)
    pilot = Pilot(simulation, TowardsTheLight())
    simulation.run(12.0)
    pilot.close()
    pose = simulation.ground_truth.pose
    assert math.hypot(pose.x - 1, pose.y - 1) < 0.15


def test_what_is_not_a_goal_or_a_timeout_is_an_error(robot):
    with pytest.raises(KbotError, match=r"^a goal must be a PlanarPose\(x, y, yaw\) .*, not \(1, 0\)$"):
        go_to(Simulation(robot), (1, 0))
    with pytest.raises(KbotError, match="finite"):
        go_to(Simulation(robot), PlanarPose(math.nan, 0))
    with pytest.raises(KbotError, match="timeout"):
        go_to(Simulation(robot), PlanarPose(1, 0), timeout=-1.0)


def test_a_last_turn_that_takes_longer_than_the_patience_is_progress():
    progress = ProgressChecker(4.0)
    assert not any(progress.is_stalled(0.1 * tick, 0.3 - 0.03 * tick, 0.0) for tick in range(10))
    # half a turn at 0.3 rad/s
    assert not any(progress.is_stalled(1.0 + 0.1 * tick, 0.0, 3.1 - 0.03 * tick) for tick in range(100))


def test_a_last_turn_that_does_not_end_is_a_stall():
    progress = ProgressChecker(4.0)
    assert not progress.is_stalled(1.0, 0.0, 3.1)
    assert not progress.is_stalled(4.9, 0.0, 3.1)
    assert progress.is_stalled(5.1, 0.0, 3.1)
