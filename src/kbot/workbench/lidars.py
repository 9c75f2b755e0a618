"""What the simulated robot's lidars see, as points for the page."""

from __future__ import annotations

import numpy as np

from kbot.sensors import LidarSensor
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.text import DescriptionError
from kbot.workbench.protocol import Scan


class Lidars:
    """The lidars that a description declares, mounted with all its other sensors."""

    def __init__(self, simulation: Simulation) -> None:
        try:
            mounted, _ = mount_declared(simulation)
        except DescriptionError:
            mounted = {}  # the findings say what is wrong with the declarations
        self._lidars = [sensor for sensor in mounted.values() if isinstance(sensor, LidarSensor)]
        self._told: dict[str, float] = {}

    def news(self) -> list[Scan]:
        """The latest reading of each lidar that was not handed out yet."""
        found = []
        for lidar in self._lidars:
            if lidar.latest is not None and self._told.get(lidar.topic) != lidar.latest_time:
                self._told[lidar.topic] = lidar.latest_time
                found.append(_scan(lidar))
        return found


def _scan(lidar: LidarSensor) -> Scan:
    reading = lidar.latest
    points: tuple[float, ...] = ()
    if reading is not None:
        hit = np.flatnonzero(np.isfinite(reading.ranges))
        angles = reading.angle_min + hit * reading.angle_increment
        ranges = reading.ranges[hit].astype(np.float64)
        flat = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(hit))], axis=-1)
        world_from_sensor = lidar.simulation.link_pose(lidar.spec.link) @ lidar.spec.pose
        points = tuple(np.round(world_from_sensor.apply(flat), 4).ravel().tolist())
    return Scan(lidar.topic, lidar.spec.link, lidar.latest_time, points)
