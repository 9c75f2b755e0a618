"""The robot model: `RobotModel`, `Link`, `Joint` and their parts, each with its origin in the source."""

from kbot.lazy_names import public_names
from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.read import RobotReading, read_robot
from kbot.model.robot import (
    Collision,
    Dynamics,
    Inertial,
    Joint,
    JointType,
    Limit,
    Link,
    Material,
    Mimic,
    Pose,
    RobotModel,
    SafetyController,
    Visual,
)

__all__ = [
    "Box",
    "Capsule",
    "Collision",
    "Cylinder",
    "Dynamics",
    "Geometry",
    "Inertial",
    "Joint",
    "JointType",
    "Limit",
    "Link",
    "Material",
    "Mesh",
    "Mimic",
    "Pose",
    "RobotModel",
    "RobotReading",
    "SafetyController",
    "Sphere",
    "Visual",
    "read_robot",
]

__dir__ = public_names(__all__)
