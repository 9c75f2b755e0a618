"""Rigid transforms, the frame tree, and differential drive found from the model."""

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive, find_drive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.odometry import PlanarPose, PlanarTwist, integrate
from kbot.kinematics.transform import Transform
from kbot.kinematics.wheels import Wheel

__all__ = [
    "DifferentialDrive",
    "FrameTree",
    "NoDrive",
    "PlanarPose",
    "PlanarTwist",
    "Transform",
    "Wheel",
    "find_drive",
    "integrate",
]
