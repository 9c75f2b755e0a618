"""Followers of paths with headings, on ideal bases without a simulation."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.planar_pose import arc
from kbot.navigation.controller import ControllerLimits, Observation
from kbot.navigation.followers.holonomic_follower import HolonomicFollower
from kbot.navigation.followers.steered_follower import SteeredFollower, Steering
from kbot.navigation.path import Path
from kbot.navigation.planning.reeds_shepp import path_between
from kbot.text import KbotError

STEP = 0.02
RADIUS = 0.5
ORIGIN = PlanarPose()


def _reeds_shepp(goal, radius=1.05 * RADIUS):
    poses = path_between(PlanarPose(), goal, radius)[0].sample(PlanarPose(), radius, 0.02)
    return Path(poses[:, :2], goal.yaw, yaws=poses[:, 2])


def _drive_car(follower, pose=ORIGIN, rate=math.inf, acceleration=1.0):
    """The poses of a car whose curvature changes by at most `rate` (1/m/s)."""
    poses, speed, curvature = [pose], 0.0, 0.0
    twist = PlanarTwist()
    for tick in range(6000):
        wanted = follower.update(Observation(tick * STEP, pose, twist))
        if follower.is_done:
            break
        change = acceleration * STEP
        speed = min(max(wanted.linear.x, speed - change), speed + change)
        if wanted.linear.x:
            target = wanted.angular.z / wanted.linear.x
            curvature = min(max(target, curvature - rate * STEP), curvature + rate * STEP)
        assert abs(curvature) <= 1.0 / RADIUS + 1e-9
        pose = pose @ arc(speed * STEP, speed * STEP * curvature)
        twist = PlanarTwist(speed, 0.0, speed * curvature)
        poses.append(pose)
    return poses


@pytest.mark.parametrize("rate", [math.inf, 4.0])
@pytest.mark.parametrize(
    "goal",
    [
        PlanarPose(2.0, 1.0, 0.5),
        PlanarPose(-1.5, 0.3, 0.0),
        PlanarPose(0.0, 0.5, 0.0),
        PlanarPose(0.0, 0.0, math.pi),
        PlanarPose(0.3, -0.2, 2.5),
    ],
)
def test_a_steered_base_follows_cusps_to_the_goal(goal, rate):
    follower = SteeredFollower(_reeds_shepp(goal), Steering(RADIUS, 0.1 if math.isinf(rate) else 1.1))
    end = _drive_car(follower, rate=rate)[-1]
    assert follower.is_done
    assert follower.remaining == 0.0
    assert math.hypot(end.x - goal.x, end.y - goal.y) < 0.02
    assert abs(math.remainder(end.yaw - goal.yaw, 2 * math.pi)) < 0.05


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_steered_base_returns_to_its_path(direction):
    x = direction * np.linspace(0.0, 3.0, 100)
    path = Path(np.column_stack([x, np.zeros(100)]), 0.0, yaws=np.zeros(100))
    follower = SteeredFollower(path, Steering(RADIUS))
    poses = _drive_car(follower, PlanarPose(0.0, 0.1, 0.1))
    assert follower.is_done
    assert abs(poses[-1].y) < 0.002
    assert abs(poses[-1].yaw) < 0.01
    # without overshooting
    assert min(pose.y for pose in poses) > -0.02


def test_a_steered_base_keeps_its_speed_limits():
    limits = ControllerLimits(linear=0.8, angular=0.5)
    follower = SteeredFollower(_reeds_shepp(PlanarPose(2.0, 2.0, 3.0)), Steering(RADIUS), limits)
    pose = PlanarPose()
    for tick in range(100):
        wanted = follower.update(Observation(tick * STEP, pose, PlanarTwist(0.5, 0.0, 0.5)))
        assert abs(wanted.linear.x) <= 0.8
        assert abs(wanted.angular.z) <= 0.5 + 1e-9
        pose = pose @ arc(wanted.linear.x * STEP, wanted.angular.z * STEP)


def test_followers_need_headings():
    path = Path.through([(0, 0), (1, 0)])
    with pytest.raises(KbotError, match="needs the heading at each point"):
        SteeredFollower(path, Steering(RADIUS))
    with pytest.raises(KbotError, match="needs the heading at each point"):
        HolonomicFollower(path)


@pytest.mark.parametrize("start", [PlanarPose(), PlanarPose(0.05, -0.05, 0.2)])
def test_a_holonomic_base_reaches_the_heading_on_the_way(start):
    share = np.linspace(0.0, 1.0, 80)
    path = Path(np.column_stack([2.0 * share, share]), 2.0, yaws=2.0 * share)
    limits = ControllerLimits(linear=0.5, angular=1.0)
    follower, pose, twist, time = HolonomicFollower(path, limits), start, PlanarTwist(), 0.0
    while not follower.is_done and time < 30.0:
        wanted = follower.update(Observation(time, pose, twist))
        v = np.array([wanted.linear.x, wanted.linear.y, wanted.angular.z])
        assert math.hypot(v[0], v[1]) <= 0.5 + 1e-9
        assert abs(v[2]) <= 1.0 + 1e-9
        before = np.array([twist.x, twist.y, twist.yaw])
        v = before + np.clip(v - before, -0.02, 0.02)
        twist = PlanarTwist(*v)
        pose = pose @ PlanarPose(v[0] * STEP, v[1] * STEP, v[2] * STEP)
        time += STEP
    assert follower.is_done
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((2.0, 1.0, 2.0), abs=0.01)
    # the turn takes 2 s and the way 4.5 s: they are done at the same time
    assert time < 7.5
