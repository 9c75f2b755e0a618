"""Rigid transforms, the frame tree, and the drive found from the model."""

from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive, find_drive
from kbot.kinematics.drive.wheels import Wheel
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.odometry import PlanarPose, PlanarTwist, integrate
from kbot.kinematics.transform import Transform

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
