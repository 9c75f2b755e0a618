"""Goals, planner, and the controllers that drive a robot to a goal:

from kbot.navigation import go_to
trip = go_to(sim, kbot.PlanarPose(1.8, 1.8, 0.0))
trip.status.state, trip.status.reason
"""

from kbot.navigation.controller import Controller, ControllerLimits, Observation, twist
from kbot.navigation.footprint import Outline, outline, turning_radius
from kbot.navigation.go_to_pose import GoToPose
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.goals import Goals
from kbot.navigation.goals_with_map import WithMap
from kbot.navigation.goals_without_map import WithoutMap
from kbot.navigation.navigator import Navigator, NavigatorSettings
from kbot.navigation.obstacle_guard import ObstacleGuard
from kbot.navigation.path import Path, from_pose_stamped, to_pose_stamped
from kbot.navigation.planner import GridPlanner, NoPath, Refusal
from kbot.navigation.pure_pursuit import PurePursuit, RegulatedPurePursuit
from kbot.navigation.simulated import LidarPoints, Pilot, Trip, go_to
from kbot.navigation.topics import NavigationTopics
from kbot.navigation.without_map import go_to_without_map

__all__ = [
    "Controller",
    "ControllerLimits",
    "GoToPose",
    "GoalReport",
    "GoalState",
    "Goals",
    "GridPlanner",
    "LidarPoints",
    "NavigationTopics",
    "Navigator",
    "NavigatorSettings",
    "NoPath",
    "Observation",
    "ObstacleGuard",
    "Outline",
    "Path",
    "Pilot",
    "PurePursuit",
    "Refusal",
    "RegulatedPurePursuit",
    "Trip",
    "WithMap",
    "WithoutMap",
    "from_pose_stamped",
    "go_to",
    "go_to_without_map",
    "outline",
    "to_pose_stamped",
    "turning_radius",
    "twist",
]
