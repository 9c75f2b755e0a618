"""Messages of goals, paths and maps: geometry_msgs poses, nav_msgs, actionlib_msgs/GoalID, map_msgs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbot.messages.types import Header, Int32, Pose, PoseWithCovariance, Time, UInt32

HEADER, ORIGIN, ESTIMATE, START = Header(), Pose(), PoseWithCovariance(), Time()


@dataclass(frozen=True, slots=True)
class PoseStamped:
    header: Header = HEADER
    pose: Pose = ORIGIN


@dataclass(frozen=True, slots=True)
class PoseWithCovarianceStamped:
    header: Header = HEADER
    pose: PoseWithCovariance = ESTIMATE


@dataclass(frozen=True, slots=True)
class GoalID:
    """Which goal is meant; as a request to cancel it is, empty, whichever there is."""

    stamp: Time = START
    id: str = ""


@dataclass(frozen=True, slots=True)
class Path:
    """Poses in the order in which they are passed."""

    header: Header = HEADER
    poses: tuple[PoseStamped, ...] = ()


@dataclass(frozen=True, slots=True)
class MapMetaData:
    """`resolution` in m a cell; `origin` is the pose of the first cell's corner."""

    map_load_time: Time = START
    resolution: float = 0.0
    width: int = 0
    height: int = 0
    origin: Pose = ORIGIN


def _nothing() -> NDArray[np.int8]:
    return np.empty(0, dtype=np.int8)


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Row by row from the origin along x: 0 free to 100 occupied, -1 unknown."""

    header: Header = HEADER
    info: MapMetaData = MapMetaData()
    data: NDArray[np.int8] = field(default_factory=_nothing)


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGridUpdate:
    """A part of a map, from its column `x` and row `y` on, row by row."""

    header: Header = HEADER
    x: Int32 = 0
    y: Int32 = 0
    width: UInt32 = 0
    height: UInt32 = 0
    data: NDArray[np.int8] = field(default_factory=_nothing)
