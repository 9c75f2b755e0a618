"""Controllers on an ideal robot that follows commands at once, along exact arcs."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import arc
from kbot.navigation.controller import ControllerLimits, Observation, twist
from kbot.navigation.followers.go_to_pose import GoToPose
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.followers.pure_pursuit import PurePursuit, RegulatedPurePursuit
from kbot.navigation.path import Path
from kbot.navigation.space.footprint import Outline
from kbot.text import KbotError

STEP = 0.02


def _drive(controller, pose, seconds=60.0):
    """The poses until the controller is done, and the highest speeds."""
    poses, last = [pose], PlanarTwist()
    for tick in range(int(seconds / STEP)):
        wanted = controller.update(Observation(tick * STEP, pose, last))
        if controller.is_done:
            return poses
        last = PlanarTwist(wanted.linear.x, 0.0, wanted.angular.z)
        pose = pose @ arc(last.x * STEP, last.yaw * STEP)
        poses.append(pose)
        assert abs(last.x) <= controller.limits.linear + 1e-9
        assert abs(last.yaw) <= controller.limits.angular + 1e-9
    pytest.fail(f"not done after {seconds} s, at {pose}")


@pytest.mark.parametrize(
    "goal", [(1, 0, 0), (-1, 0, 0), (0, 0, 3), (0.5, -2, -1), (0.005, 0, 0), (0.02, 0.05, 2)]
)
def test_go_to_pose_reaches_its_goal(goal):
    goal = PlanarPose(*goal)
    end = _drive(GoToPose(goal), PlanarPose(0, 0, 0.3))[-1]
    assert math.hypot(end.x - goal.x, end.y - goal.y) < 0.012
    assert abs(wrap(end.yaw - goal.yaw)) <= 0.02


def test_pure_pursuit_steers_along_the_arc_through_the_point_ahead():
    path = Path.through([(0.0, 0.05), (5.0, 0.05)])
    pursuit = PurePursuit(path, lookahead=0.4)
    pursuit.update(Observation(0.0, PlanarPose()))
    command = pursuit.update(Observation(0.02, PlanarPose()))
    # the point is 0.4 m along the path from the foot (0, 0.05): (0.4, 0.05)
    assert command.angular.z / command.linear.x == pytest.approx(2 * 0.05 / (0.4**2 + 0.05**2))


@pytest.mark.parametrize("kind", [PurePursuit, RegulatedPurePursuit])
def test_a_circle_is_followed_closely(kind):
    angles = np.linspace(0, 1.5 * math.pi, 200)
    path = Path.through(np.stack([np.sin(angles), 1 - np.cos(angles)], axis=1))
    for pose in _drive(kind(path), PlanarPose()):
        # pure pursuit keeps inside a circle by about L^2 / (8 r) at most
        assert abs(math.hypot(pose.x, pose.y - 1.0) - 1.0) < 0.15**2 / 8 + 0.004


def test_a_corner_is_cut_by_less_than_the_lookahead():
    path = Path.through([(0, 0), (1, 0), (1, 1)], yaw=0.0)
    poses = _drive(RegulatedPurePursuit(path, lookahead=0.1), PlanarPose())
    off = max(min(abs(p.y) if p.x < 1 else 9, math.hypot(p.x - 1, max(-p.y, p.y - 1, 0))) for p in poses)
    assert off < 0.05
    assert math.hypot(poses[-1].x - 1, poses[-1].y - 1) < 0.02
    assert abs(wrap(poses[-1].yaw)) < 0.021


def test_a_path_that_crosses_itself_is_followed_in_order():
    path = Path.through([(0, 0), (2, 0), (2, 1), (1, 1), (1, -1)])
    poses = _drive(PurePursuit(path), PlanarPose())
    assert min(math.hypot(p.x - 2, p.y - 1) for p in poses) < 0.1
    assert math.hypot(poses[-1].x - 1, poses[-1].y + 1) < 0.02


def test_regulation_slows_in_tight_curves_and_near_obstacles():
    path = Path.through([(0, 0.03), (3, 0.03)])
    regulated = RegulatedPurePursuit(
        path, ControllerLimits(linear=0.5), lookahead=0.3, least_radius=2.0, proximity=0.5
    )
    straight = RegulatedPurePursuit(
        Path.through([(0, 0), (3, 0)]), ControllerLimits(linear=0.5), proximity=0.5
    )
    near = np.array([[0.0, 0.25]])
    for _ in range(2):
        curved = regulated.update(Observation(0.0, PlanarPose(), PlanarTwist(0.5)))
        close = straight.update(Observation(0.0, PlanarPose(), PlanarTwist(0.5), near, 0.0))
    curvature = curved.angular.z / curved.linear.x
    assert curved.linear.x == pytest.approx(0.5 / (curvature * 2.0))
    assert close.linear.x == pytest.approx(0.5 * 0.25 / 0.5)


def test_a_lookahead_must_be_a_length():
    with pytest.raises(KbotError):
        PurePursuit(Path.through([(0, 0)]), lookahead=0.0)


class _Ahead:
    def __init__(self, v=0.3, w=0.0):
        self.command = twist(v, w)

    def update(self, observation):
        return self.command


OUTLINE = Outline.rectangle(-0.1, 0.06, -0.09, 0.09)


def test_the_guard_stops_short_of_a_wall():
    wall = np.stack([np.full(81, 1.0), np.linspace(-1, 1, 81)], axis=1)
    guard, pose = ObstacleGuard(_Ahead(), OUTLINE, margin=0.02), PlanarPose()
    for tick in range(500):
        points = wall - (pose.x, pose.y)
        wanted = guard.update(Observation(tick * STEP, pose, PlanarTwist(), points, 0.0))
        pose = pose @ arc(wanted.linear.x * STEP, wanted.angular.z * STEP)
    assert 0.85 < pose.x + 0.06 <= 0.98
    assert guard.blocked_since is not None


def test_the_guard_lets_a_robot_pass_beside_a_wall_and_leave_it():
    side = np.stack([np.linspace(-1, 1, 81), np.full(81, 0.12)], axis=1)
    guard = ObstacleGuard(_Ahead(), OUTLINE, margin=0.02)
    assert guard.update(Observation(0, PlanarPose(), PlanarTwist(), side, 0.0)).linear.x == 0.3
    front = np.array([[0.07, 0.0]])
    assert guard.update(Observation(0, PlanarPose(), PlanarTwist(), front, 0.0)).linear.x == 0.0
    back = ObstacleGuard(_Ahead(-0.1), OUTLINE, margin=0.02)
    assert back.update(Observation(0, PlanarPose(), PlanarTwist(), front, 0.0)).linear.x == -0.1


def test_the_guard_stops_when_the_lidar_is_silent():
    guard = ObstacleGuard(_Ahead(), OUTLINE)
    assert guard.update(Observation(0.0, PlanarPose())).linear.x == 0.0
    assert guard.silent_since == 0.0
    assert guard.update(Observation(3.0, PlanarPose(), PlanarTwist(), np.empty((0, 2)), 0.7)).linear.x == 0.0
    assert guard.silent_since == 0.0
    assert guard.update(Observation(4.0, PlanarPose(), PlanarTwist(), np.empty((0, 2)), 0.1)).linear.x == 0.3
    assert guard.silent_since is None
