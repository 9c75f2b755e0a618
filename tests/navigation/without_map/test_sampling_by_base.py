"""Sampled trajectories keep the limits of bases that drive sideways or have a least turning radius."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.planar_pose import arc
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.cost_to_go import Sweeping, weights
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.navigation.without_map.sampling_by_base import HolonomicSampling, SteeredSampling, sampling_for
from kbot.navigation.without_map.trajectory_sampling import SamplingSettings, TrajectorySampling

CORNER, RESOLUTION, STEP = (-3.0, -3.0), 0.05, 0.05
FOOTPRINT = FootprintClearance(Outline.rectangle(-0.1, 0.4, -0.15, 0.15), 0.05)
TURNING = MotionLimits(1.0, 2.0, 2.0, 8.0)
SIDEWAYS = MotionLimits(1.0, 2.0, 2.0, 8.0, lateral=1.0)
STEERED = MotionLimits(1.0, 2.0, 2.0, 8.0, curvature=2.0, steering_time=0.5)
STILL = PlanarTwist()


def _surroundings(goal, occupied=None):
    occupied = np.zeros((120, 120), dtype=bool) if occupied is None else occupied
    sweeping = Sweeping(weights(occupied, RESOLUTION, 0.2, 0.3), CORNER, RESOLUTION, goal)
    while not sweeping.is_done:
        sweeping.sweep()
    return DistanceField.of(occupied, CORNER, RESOLUTION, 1.0), sweeping.result()


def test_the_limits_decide_what_is_sampled():
    kinds = [
        type(sampling_for(FOOTPRINT, limits, SamplingSettings(), 0))
        for limits in (TURNING, SIDEWAYS, STEERED)
    ]
    assert kinds == [TrajectorySampling, HolonomicSampling, SteeredSampling]


def test_a_base_that_drives_sideways_does_not_turn_to_a_goal_beside_it():
    field, way = _surroundings((0.0, 2.0))
    sampling, pose, twist, command = (
        HolonomicSampling(FOOTPRINT, SIDEWAYS, SamplingSettings()),
        PlanarPose(),
        STILL,
        (0.0, 0.0),
    )
    for _ in range(60):
        command = sampling.update(pose, twist, field, way, STEP, command)
        assert math.hypot(command[0], sampling.lateral) <= 1.0 + 1e-6
        twist = PlanarTwist(command[0], sampling.lateral, command[1])
        pose = pose @ PlanarPose(twist.x * STEP, twist.y * STEP, twist.yaw * STEP)
    assert math.hypot(pose.x, pose.y - 2.0) < 0.3
    assert abs(pose.yaw) < 0.8


@pytest.mark.parametrize("goal", [(2.0, 1.0), (0.0, 1.5), (-2.0, 0.0)])
def test_a_steered_base_keeps_its_curvature_and_comes_near_its_goal(goal):
    field, way = _surroundings(goal)
    sampling = SteeredSampling(FOOTPRINT, STEERED, SamplingSettings())
    pose, twist, command, curvature, nearest = PlanarPose(), STILL, (0.0, 0.0), 0.0, math.inf
    for _ in range(400):
        command = sampling.update(pose, twist, field, way, STEP, command)
        v, w = command
        assert abs(w) <= 2.0 * abs(v) + 1e-6
        assert abs(w * v) <= STEERED.curve_acceleration + 1e-6
        target = w / v if v else curvature
        curvature += min(max(target - curvature, -8.0 * STEP), 8.0 * STEP)
        twist = PlanarTwist(v, 0.0, v * curvature)
        pose = pose @ arc(v * STEP, v * curvature * STEP)
        nearest = min(nearest, math.hypot(pose.x - goal[0], pose.y - goal[1]))
    assert nearest < 0.5


def test_a_steered_base_backs_out_of_a_dead_end():
    occupied = np.zeros((120, 120), dtype=bool)
    # walls at x = 0.6 and y = +-0.35 around the robot, open to the rear
    occupied[53:68, 72] = True
    occupied[52, 50:73] = occupied[67, 50:73] = True
    field, way = _surroundings((-2.0, 0.0), occupied)
    sampling = SteeredSampling(FOOTPRINT, STEERED, SamplingSettings(), seed=1)
    pose, command = PlanarPose(), (0.0, 0.0)
    for _ in range(200):
        command = sampling.update(pose, PlanarTwist(command[0], 0.0, command[1]), field, way, STEP, command)
        pose = pose @ arc(command[0] * STEP, command[1] * STEP)
        clearance = FOOTPRINT.of(field, *(np.array([v]) for v in (pose.x, pose.y, pose.yaw)))
        assert clearance[0] > 0.0
    assert pose.x < -0.3
