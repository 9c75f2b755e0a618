"""Rigid transforms, the frame tree, and the drive of a robot.

Names are imported on first use, so that launch files can read the parameters of controllers without numpy.
"""

from kbot.lazy_names import lazy_names, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.kinematics.drive.drive import (
        DifferentialDrive,
        HolonomicDrive,
        NoDrive,
        SteeredDrive,
        find_drive,
    )
    from kbot.kinematics.drive.wheels import Wheel
    from kbot.kinematics.frames import FrameTree
    from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist, integrate
    from kbot.kinematics.transform import Transform

_HOMES = {
    "DifferentialDrive": "drive.drive",
    "FrameTree": "frames",
    "HolonomicDrive": "drive.drive",
    "NoDrive": "drive.drive",
    "PlanarPose": "planar_pose",
    "PlanarTwist": "planar_pose",
    "SteeredDrive": "drive.drive",
    "Transform": "transform",
    "Wheel": "drive.wheels",
    "find_drive": "drive.drive",
    "integrate": "planar_pose",
}

__all__ = [
    "DifferentialDrive",
    "FrameTree",
    "HolonomicDrive",
    "NoDrive",
    "PlanarPose",
    "PlanarTwist",
    "SteeredDrive",
    "Transform",
    "Wheel",
    "find_drive",
    "integrate",
]

__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
