"""Lidars: one row of beams gives a LaserScan, several rows give a PointCloud2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypedDict, TypeVar, cast, overload

import numpy as np
from numpy.typing import NDArray

from kbot.messages.sensing import LaserScan, PointCloud2, PointField
from kbot.sensors.noise import NONE, Noise, NoiseSource
from kbot.sensors.rays import Fan, Rays, within
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError

if TYPE_CHECKING:
    from typing import Unpack

    import typing_extensions  # typing has defaults of type variables from Python 3.13

    from kbot.kinematics.transform import Transform
    from kbot.text import Origin

    S_co = typing_extensions.TypeVar(
        "S_co",
        bound="LidarSensor | CloudSensor",
        covariant=True,
        default="LidarSensor | CloudSensor",
    )

    class LidarValues(TypedDict, total=False):
        """The arguments of a Lidar besides `link` and `rows`, for type checkers."""

        name: str
        pose: Transform
        rate: float
        latency: float
        topic: str
        frame: str
        robot: str
        origin: Origin | None
        samples: int
        angle_min: float
        angle_max: float
        range_min: float
        range_max: float
        elevation_min: float
        elevation_max: float
        noise: Noise

else:
    S_co = TypeVar("S_co", covariant=True)

_MOST_BEAMS = 10_000_000
"""Bounds the memory that a reading takes."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Lidar(Spec, Generic[S_co]):
    """A lidar with evenly spaced beams from `angle_min` to `angle_max` (rad, about z).

    Both ends are included, as in Gazebo. `angle_max` may be below `angle_min`, for a lidar mounted upside
    down. `range_min` and `range_max` are in m. With several `rows`, the beams are also spread from
    `elevation_min` to `elevation_max`, and the readings are point clouds.
    """

    kind: ClassVar[str] = "scan"
    samples: int = 360
    angle_min: float = -math.pi
    angle_max: float = math.pi
    range_min: float = 0.05
    range_max: float = 10.0
    rows: int = 1
    elevation_min: float = 0.0
    elevation_max: float = 0.0
    noise: Noise = NONE

    if TYPE_CHECKING:
        # A type checker infers the sensor from `rows`: the readings of one row are scans. Hence Any for a
        # number of rows that is known only at run time, which may be 1.
        @overload
        def __init__(
            self: Lidar[LidarSensor], *, link: str, rows: Literal[1] = 1, **values: Unpack[LidarValues]
        ) -> None: ...
        @overload
        def __init__(
            self: Lidar[CloudSensor | Any], *, link: str, rows: int, **values: Unpack[LidarValues]
        ) -> None: ...
        def __init__(self, *, link: str, rows: int = 1, **values: Unpack[LidarValues]) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (1 <= self.samples <= 1_000_000 and 1 <= self.rows <= 10_000):
            raise KbotError(f"{self.label}: a lidar must have 1 to 1000000 beams per row and 1 to 10000 rows")
        if self.samples * self.rows > _MOST_BEAMS:
            raise KbotError(f"{self.label}: a lidar may have at most {_MOST_BEAMS} beams in all rows")
        if not (math.isfinite(self.angle_min) and math.isfinite(self.angle_max)):
            raise KbotError(
                f"{self.label}: the angles must be finite, not {self.angle_min} to {self.angle_max}"
            )
        if not -math.pi / 2 - 1e-6 <= self.elevation_min <= self.elevation_max <= math.pi / 2 + 1e-6:
            raise KbotError(
                f"{self.label}: the elevations must increase and be from -pi/2 to pi/2 rad,"
                f" not {self.elevation_min} to {self.elevation_max}"
            )
        if not 0.0 <= self.range_min < self.range_max < math.inf:
            raise KbotError(
                f"{self.label}: the minimum range must be at least 0 m and below the maximum range,"
                f" not {self.range_min} to {self.range_max} m"
            )

    @property
    def increment(self) -> float:
        """The angle between neighbouring beams of a row in rad."""
        return (self.angle_max - self.angle_min) / max(self.samples - 1, 1)

    @property
    def directions(self) -> NDArray[np.float64]:
        """The directions (rows * samples, 3) of all beams in the sensor's frame, from the lowest row up."""
        angles = np.linspace(self.angle_min, self.angle_max, self.samples)
        elevations = np.linspace(self.elevation_min, self.elevation_max, self.rows)[:, None]
        level = np.cos(elevations)
        parts = (level * np.cos(angles), level * np.sin(angles), np.sin(elevations) + 0.0 * angles)
        return np.stack(parts, axis=-1).reshape(-1, 3)

    def mount(self, simulation: Simulation) -> S_co:
        sensor = LidarSensor(simulation, self) if self.rows == 1 else CloudSensor(simulation, self)
        return cast("S_co", sensor)


class _Beams:
    """Measures the distances of a lidar's beams, with noise."""

    def __init__(self, simulation: Simulation, spec: Lidar, owner: str) -> None:
        self.spec = spec
        self.directions = spec.directions
        fan = Fan(spec.angle_min, spec.increment) if spec.rows == 1 and not spec.elevation_min else None
        self.rays = Rays(owner, self.directions, fan)
        self.seed(simulation.seed)

    def seed(self, seed: int) -> None:
        spec = self.spec
        count, period = len(self.directions), 1.0 / spec.rate
        self.noise = NoiseSource(spec.noise, seed, f"{spec.label}/range", count, period)

    def noisy(self, distances: NDArray[np.float64], sample: int | None) -> NDArray[np.float64]:
        """The distances with noise. Returns stay within the range limits, as in Gazebo."""
        spec = self.spec
        ranges = within(distances, spec.range_min, spec.range_max)
        if sample is None or spec.noise.is_none:
            return ranges
        clipped = np.clip(self.noise.apply(ranges, sample), spec.range_min, spec.range_max)
        return np.where(np.isfinite(ranges), clipped, ranges)


class LidarSensor(Sensor[LaserScan]):
    """Publishes a LaserScan. All beams are measured at the same time."""

    message_type = LaserScan
    spec: Lidar

    def __init__(self, simulation: Simulation, spec: Lidar) -> None:
        super().__init__(simulation, spec)
        self._beams = _Beams(simulation, spec, self.owner)
        self._intensities = np.empty(0, dtype=np.float32)

    def reseed(self) -> None:
        """Use the random numbers of the simulation's seed, which has changed."""
        self._beams.seed(self.simulation.seed)

    def distances(self) -> NDArray[np.float64]:
        """The current distances in m without noise. inf: nothing is in range."""
        return self._beams.rays.cast(*self._place(), self.spec.range_max)

    def measure(self, sample: int | None = None) -> LaserScan:
        spec = self.spec
        ranges = self._beams.noisy(self.distances(), sample)
        return LaserScan(
            self._header(),
            spec.angle_min,
            spec.angle_max,
            spec.increment,
            0.0,
            self._period,
            spec.range_min,
            spec.range_max,
            ranges.astype(np.float32),
            self._intensities,
        )


_FIELDS = tuple(PointField(name, 4 * at) for at, name in enumerate("xyz"))


class CloudSensor(Sensor[PointCloud2]):
    """Publishes a PointCloud2 with a row of points per row of beams. As in gz, no return is inf."""

    message_type = PointCloud2
    spec: Lidar

    def __init__(self, simulation: Simulation, spec: Lidar) -> None:
        super().__init__(simulation, spec)
        self._beams = _Beams(simulation, spec, self.owner)

    def points(self, sample: int | None = None) -> NDArray[np.float64]:
        """Points (rows, samples, 3) in m in the sensor's frame. Points without a return are not finite."""
        spec = self.spec
        ranges = self._beams.noisy(self._beams.rays.cast(*self._place(), spec.range_max), sample)
        with np.errstate(invalid="ignore"):
            points = ranges[:, None] * self._beams.directions
        points[~np.isfinite(ranges)] = np.inf
        return points.reshape(spec.rows, spec.samples, 3)

    def measure(self, sample: int | None = None) -> PointCloud2:
        points = self.points(sample).astype("<f4")
        rows, samples, _ = points.shape
        dense = bool(np.isfinite(points).all())
        return PointCloud2(
            self._header(), rows, samples, _FIELDS, False, 12, 12 * samples, points.tobytes(), dense
        )


def scan_points(scan: LaserScan, base_from_sensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """A scan's returns as points (n, 2) in m in the base's frame. `base_from_sensor` is a (4, 4) matrix."""
    at = np.flatnonzero(np.isfinite(scan.ranges))
    angles = scan.angle_min + at * scan.angle_increment
    ranges = scan.ranges[at].astype(np.float64)
    flat = np.stack([ranges * np.cos(angles), ranges * np.sin(angles)])
    points: NDArray[np.float64] = (base_from_sensor[:2, :2] @ flat).T + base_from_sensor[:2, 3]
    return points
