"""The values that a robot's description gives for the parameters that a log shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbot.identify.log import Array
from kbot.identify.result import (
    LEFT_RADIUS,
    RIGHT_RADIUS,
    SENSOR_X,
    SENSOR_Y,
    SENSOR_YAW,
    WHEEL_SEPARATION,
)
from kbot.kinematics.angles import wrap
from kbot.kinematics.drive.declared import declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive, find_drive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar_pose import PlanarPose
from kbot.model.load import Loaded, load_robot
from kbot.sensors.declared import declared_sensors
from kbot.sensors.lidar import Lidar
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.xacro import Packages


@dataclass(frozen=True, slots=True)
class Nominal:
    """A differential robot as its description defines it.

    loaded        the description
    drive         its two sides
    left, right   mean radius in m of the wheels of each side
    sensor_link   the link whose displacement the reference measures, None if it is unknown
    axle_from_sensor  its pose in the frame at the middle of the axle, None if it is unknown
    """

    loaded: Loaded
    drive: DifferentialDrive
    left: float
    right: float
    sensor_link: str | None
    axle_from_sensor: PlanarPose | None

    def with_sensor(self, link: str) -> Nominal:
        """The robot with another link as the sensor."""
        return replace(self, sensor_link=link, axle_from_sensor=_pose_on_axle(self.loaded, self.drive, link))

    @property
    def declared_sizes(self) -> tuple[float, float]:
        """The wheel radius and separation in m with which the drive's plugin or controller computes."""
        controller = drive_controller(declared_drives(self.loaded.require()))
        radius = controller.radius if controller is not None else None
        separation = controller.separation if controller is not None else None
        return (
            radius.value if radius is not None else self.drive.radius,
            separation.value if separation is not None else self.drive.separation,
        )

    @property
    def values(self) -> Mapping[str, float | None]:
        """The nominal value of each kinematic parameter."""
        sensor = self.axle_from_sensor
        return {
            LEFT_RADIUS: self.left,
            RIGHT_RADIUS: self.right,
            WHEEL_SEPARATION: self.drive.separation,
            SENSOR_X: None if sensor is None else sensor.x,
            SENSOR_Y: None if sensor is None else sensor.y,
            SENSOR_YAW: None if sensor is None else wrap(sensor.yaw),
        }

    @property
    def start(self) -> Array:
        """The parameters of the odometry model, with the sensor on the axle if its pose is unknown."""
        sensor = self.axle_from_sensor or PlanarPose()
        return np.array([self.left, self.right, 1.0 / self.drive.separation, sensor.x, sensor.y, sensor.yaw])


def read_nominal(
    file: str,
    arguments: Mapping[str, str],
    properties: Mapping[str, str],
    packages: Sequence[str],
    sensor: str | None,
) -> Nominal:
    """Read a robot. `sensor` is the link of the sensor, by default that of the only lidar.

    Raises:
        DescriptionError: the description has errors.
        KbotError: it does not have two sides of wheels, or does not have the link.
    """
    loaded = load_robot(file, arguments, properties, Packages(packages))
    robot = loaded.require()
    tree = FrameTree(robot)
    drive = find_drive(robot, tree)
    if isinstance(drive, NoDrive | SteeredDrive | HolonomicDrive):
        raise KbotError(
            f"{file} is not a differential-drive robot: {drive.reason}. Identification estimates the radii "
            "and the separation of left and right wheels"
        )
    if sensor is not None and sensor not in robot.links:
        raise KbotError(f"{file} has no link '{sensor}': {suggest_or_list(sensor, robot.links)}")
    if sensor is None:
        lidars = {spec.link for spec in declared_sensors(robot).specs if isinstance(spec, Lidar)}
        sensor = lidars.pop() if len(lidars) == 1 else None
    left, right = (
        float(np.mean([drive.wheels[name].radius for name in side])) for side in (drive.left, drive.right)
    )
    pose = None if sensor is None else _pose_on_axle(loaded, drive, sensor)
    return Nominal(loaded, drive, left, right, sensor, pose)


def _pose_on_axle(loaded: Loaded, drive: DifferentialDrive, link: str) -> PlanarPose:
    """The pose of a link in the frame at the middle of the axle."""
    base_from_link = FrameTree(loaded.require()).pose(link, in_frame=drive.base)
    axle_from_link = drive.axle_in_base.inverse() @ base_from_link
    x, y, _ = axle_from_link.translation.tolist()
    return PlanarPose(x, y, axle_from_link.yaw)
