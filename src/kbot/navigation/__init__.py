"""Goals, planner, and the controllers that drive a robot to a goal:

from kbot.navigation import go_to
trip = go_to(sim, kbot.PlanarPose(1.8, 1.8, 0.0))
trip.status.state, trip.status.reason
"""

from kbot.lazy_names import public_names
from kbot.navigation.controller import Controller, ControllerLimits, Observation, twist
from kbot.navigation.followers.go_to_pose import GoToPose
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.followers.pure_pursuit import PurePursuit, RegulatedPurePursuit
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.goals.goals import Goals
from kbot.navigation.goals.goals_with_map import WithMap
from kbot.navigation.goals.goals_without_map import WithoutMap
from kbot.navigation.goals.topics import NavigationTopics
from kbot.navigation.path import Path, from_pose_stamped, to_pose_stamped
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.planning.planner import NoPath, Refusal
from kbot.navigation.simulated.lidars import LidarPoints
from kbot.navigation.simulated.pilot import Pilot
from kbot.navigation.simulated.trip import Trip
from kbot.navigation.space.footprint import Outline, outline, turning_radius
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.with_map.navigator import Navigator, NavigatorSettings
from kbot.navigation.without_map.go_to import go_to_without_map
from kbot.navigation.without_map.local_navigator import LocalSettings
from kbot.navigation.without_map.trajectory_sampling import SamplingSettings

__all__ = [
    "Controller",
    "ControllerLimits",
    "GoToPose",
    "GoalReport",
    "GoalState",
    "Goals",
    "GridPlanner",
    "LidarPoints",
    "LocalSettings",
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
    "SamplingSettings",
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

__dir__ = public_names(__all__)
