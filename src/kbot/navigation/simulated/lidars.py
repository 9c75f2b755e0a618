"""The level lidars of a simulated robot, and the points that they detect."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.messages.sensing import LaserScan
from kbot.navigation.lidar_view import LidarView
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import LidarSensor, scan_points
from kbot.sim import Simulation

LEVEL = math.cos(math.radians(5.0))
"""Cosine of the angle by which a lidar may be tilted to count as level."""


def level_lidars(simulation: Simulation) -> list[LidarSensor]:
    """The level lidars with one row of beams that the description declares, mounted."""
    sensors, _ = mount_declared(simulation, strict=False)
    found = []
    for sensor in sensors.values():
        if isinstance(sensor, LidarSensor) and sensor.owner == simulation.robots.first.name:
            up = (simulation.link_pose(sensor.spec.link) @ sensor.spec.pose).rotation[2, 2]
            base_up = simulation.link_pose(simulation.robot.root).rotation[2, 2]
            if abs(up) >= LEVEL * abs(base_up):
                found.append(sensor)
    return found


def level_lidar(simulation: Simulation) -> LidarSensor | None:
    """The first level lidar that the description declares, mounted; None if there is none."""
    return next(iter(level_lidars(simulation)), None)


def base_from_lidar(lidar: LidarSensor) -> NDArray[np.float64]:
    """The pose (4, 4) of a lidar in the frame of its robot's base, on which it must be mounted rigidly."""
    simulation, spec = lidar.simulation, lidar.spec
    drive = simulation.robots.first.drive
    base = drive.base if isinstance(drive, DifferentialDrive) else simulation.robot.root
    base_from_link = simulation.link_pose(base).inverse() @ simulation.link_pose(spec.link)
    pose: NDArray[np.float64] = (base_from_link @ spec.pose).matrix
    return pose


def lidar_view(lidar: LidarSensor) -> LidarView:
    """What a lidar sees of its robot's surroundings."""
    spec = lidar.spec
    return LidarView.of_beams(spec.angle_min, spec.angle_max, spec.range_max, base_from_lidar(lidar))


class LidarPoints(Brief):
    """Returns the points of a lidar's last scan, in the frame of its robot's base, and the scan's time.

    `view` is what the lidar sees of the surroundings."""

    def __init__(self, lidar: LidarSensor) -> None:
        """The lidar must be mounted rigidly on the base."""
        self._lidar = lidar
        self._base_from_sensor = base_from_lidar(lidar)
        self.view = lidar_view(lidar)
        self._points: NDArray[np.float64] | None = None
        self._scan: LaserScan | None = None

    def __call__(self) -> tuple[NDArray[np.float64] | None, float]:
        if not self._lidar.has_reading:
            return None, -math.inf
        scan = self._lidar.latest
        if scan is not self._scan:  # after a reset, scans have the same stamps again
            self._points, self._scan = scan_points(scan, self._base_from_sensor), scan
        return self._points, scan.header.stamp.seconds
