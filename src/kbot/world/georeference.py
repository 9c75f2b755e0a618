"""The position of a world on the earth."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.kinematics.planar_pose import PlanarPose


@dataclass(frozen=True, slots=True)
class Georeference:
    """The world's origin: `latitude` and `longitude` in degrees, `altitude` in m above the WGS 84 ellipsoid.

    The world's x points east and its y north. `heading` (rad) rotates both clockwise, as Gazebo's
    `heading_deg` does.
    """

    latitude: float = 0.0
    longitude: float = 0.0
    altitude: float = 0.0
    heading: float = 0.0

    def east_north(self, x: float, y: float) -> tuple[float, float]:
        """A point of the world in m to the east and north of its origin."""
        return PlanarPose(yaw=self.heading).local(x, y)
