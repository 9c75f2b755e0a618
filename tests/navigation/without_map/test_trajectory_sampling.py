"""The controller keeps the robot's limits and the true outline's clearance."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.navigation.perception.moving_obstacles import MovingObstacle
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.cost_to_go import Sweeping, weights
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.navigation.without_map.trajectory_sampling import TrajectorySampling

LIMITS = MotionLimits(1.0, 2.0, 2.0, 8.0)
OUTLINE = Outline.rectangle(-0.2, 0.3, -0.15, 0.15)
CORNER, RESOLUTION = (-3.0, -3.0), 0.05
FOOTPRINT = FootprintClearance(OUTLINE, 0.05)


def _surroundings(occupied, goal):
    sweeping = Sweeping(weights(occupied, RESOLUTION, 0.2, 0.3), CORNER, RESOLUTION, goal)
    while not sweeping.is_done:
        sweeping.sweep()
    return DistanceField.of(occupied, CORNER, RESOLUTION, 1.0), sweeping.result()


def _empty():
    return np.zeros((120, 120), dtype=bool)


def _follow(pose, speed, command, limits=LIMITS, step=0.05):
    """A robot that follows a command within its accelerations."""
    v = speed.x + np.clip(command[0] - speed.x, -limits.acceleration * step, limits.acceleration * step)
    turn = limits.angular_acceleration * step
    w = speed.yaw + np.clip(command[1] - speed.yaw, -turn, turn)
    yaw = pose.yaw + w * step / 2.0
    moved = PlanarPose(
        pose.x + v * step * math.cos(yaw), pose.y + v * step * math.sin(yaw), pose.yaw + w * step
    )
    return moved, PlanarTwist(float(v), 0.0, float(w))


def test_commands_stay_within_the_limits_and_reach_the_goal():
    field, cost_to_go = _surroundings(_empty(), (2.0, 1.5))
    controller = TrajectorySampling(FOOTPRINT, LIMITS)
    pose, speed, before = PlanarPose(-2.0, -2.0, -2.0), PlanarTwist(), (0.0, 0.0)
    nearest = math.inf
    for _ in range(400):
        command = controller.update(pose, speed, field, cost_to_go, 0.05, before)
        assert -LIMITS.linear <= command[0] <= LIMITS.linear
        assert abs(command[1]) <= LIMITS.angular
        assert abs(command[0] - before[0]) <= LIMITS.acceleration * 0.05 + 1e-9
        assert abs(command[1] * speed.x) <= LIMITS.curve_acceleration + 1e-9
        before = command
        pose, speed = _follow(pose, speed, command)
        nearest = min(nearest, math.hypot(pose.x - 2.0, pose.y - 1.5))
        if nearest < 0.2:
            break
    assert nearest < 0.2


def test_a_passage_that_only_fits_the_aligned_outline_is_driven_without_a_contact():
    occupied = _empty()
    occupied[:, 60] = True
    occupied[56:64, 60] = False  # 0.4 m wide for a robot of 0.3 m whose circumscribed circle has 0.59 m
    field, cost_to_go = _surroundings(occupied, (2.0, 0.0))
    controller = TrajectorySampling(FOOTPRINT, LIMITS)
    pose, speed, command = PlanarPose(-2.0, 1.0, 0.0), PlanarTwist(), (0.0, 0.0)
    clearance = math.inf
    for _ in range(400):
        command = controller.update(pose, speed, field, cost_to_go, 0.05, command)
        pose, speed = _follow(pose, speed, command)
        at = (np.array([value]) for value in (pose.x, pose.y, pose.yaw))
        clearance = min(clearance, float(FOOTPRINT.of(field, *at)[0]))
        if pose.x > 1.5:
            break
    assert pose.x > 1.5
    assert clearance > 0.0


def test_an_obstacle_on_all_sides_stops_the_robot():
    occupied = _empty()
    occupied[50:71, 50:71] = True
    occupied[56:64, 55:67] = False  # 5 cm on each side of the outline
    field, cost_to_go = _surroundings(occupied, (2.0, 0.0))
    controller = TrajectorySampling(FOOTPRINT, LIMITS)
    assert controller.update(PlanarPose(), PlanarTwist(1.0), field, cost_to_go, 0.05) == (0.0, 0.0)
    assert controller.is_blocked


def test_the_same_seed_gives_the_same_commands():
    field, cost_to_go = _surroundings(_empty(), (2.0, 1.5))
    first, second = (
        TrajectorySampling(FOOTPRINT, LIMITS, seed=4).update(
            PlanarPose(), PlanarTwist(), field, cost_to_go, 0.05
        )
        for _ in range(2)
    )
    assert first == second


def _at_full_speed(obstacle):
    """The command of a robot that drives east from the origin at 1 m/s and may brake with 2 m/s^2."""
    field, cost_to_go = _surroundings(_empty(), (2.5, 0.0))
    controller = TrajectorySampling(FOOTPRINT, LIMITS)
    return controller.update(
        PlanarPose(), PlanarTwist(1.0), field, cost_to_go, 0.05, (1.0, 0.0), [MovingObstacle(*obstacle)]
    )


# Speeds of 1, 1, 0.8, 0.6, 0.4 and 0.2 m/s for 0.1 s each take the robot 0.4 m. In these 0.6 s, an obstacle
# of 1 m/s that turns back moves 0.6 m. The robot's front is at 0.3 m, the obstacle's radius is 0.2 m and the
# margin 0.08 m. The sum of these is 1.58 m: the robot must brake if the obstacle is nearer than that.
@pytest.mark.parametrize(("x", "speed"), [(1.56, 0.9), (1.6, 1.0)])
def test_the_robot_brakes_while_it_can_still_stop_before_an_obstacle_that_turns_back(x, speed):
    v, _ = _at_full_speed((x, 0.0, 0.2, 1.0, 0.0))
    assert v == pytest.approx(speed, abs=0.01)


def test_the_robot_does_not_brake_for_an_obstacle_that_follows_it():
    v, _ = _at_full_speed((-0.6, 0.0, 0.2, 1.0, 0.0))
    assert v == pytest.approx(1.0, abs=0.01)


def test_the_robot_evades_an_obstacle_that_would_hit_it_where_it_stops():
    _, w = _at_full_speed((1.56, 0.0, 0.2, -1.0, 0.0))
    assert abs(w) > 0.1
