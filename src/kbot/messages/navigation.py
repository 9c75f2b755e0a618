"""Messages of goals, paths and maps: geometry_msgs poses, nav_msgs, actionlib_msgs/GoalID, map_msgs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from kbot.brief import Brief
from kbot.messages.arrays import Array
from kbot.messages.types import Float32, Header, Int32, Pose, PoseWithCovariance, Time, UInt32

HEADER, ORIGIN, ESTIMATE, START = Header(), Pose(), PoseWithCovariance(), Time()


@dataclass(frozen=True, slots=True, repr=False)
class PoseStamped(Brief):
    header: Header = HEADER
    pose: Pose = ORIGIN


@dataclass(frozen=True, slots=True, repr=False)
class PoseWithCovarianceStamped(Brief):
    header: Header = HEADER
    pose: PoseWithCovariance = ESTIMATE


@dataclass(frozen=True, slots=True)
class GoalID:
    """Identifies a goal. In a request to cancel, an empty one means the current goal."""

    stamp: Time = START
    id: str = ""


@dataclass(frozen=True, slots=True, repr=False)
class Path(Brief):
    """Poses in the order of travel."""

    header: Header = HEADER
    poses: tuple[PoseStamped, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class MapMetaData(Brief):
    """`resolution` in m per cell. `origin` is the pose of the corner of the first cell."""

    map_load_time: Time = START
    resolution: Float32 = 0.0
    width: UInt32 = 0
    height: UInt32 = 0
    origin: Pose = ORIGIN


def _empty() -> Array[np.int8]:
    return np.empty(0, dtype=np.int8)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OccupancyGrid(Brief):
    """Cells row by row from the origin, a row is along x. 0 is free, 100 occupied, -1 unknown."""

    header: Header = HEADER
    info: MapMetaData = MapMetaData()
    data: Array[np.int8] = field(default_factory=_empty)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OccupancyGridUpdate(Brief):
    """The cells of a rectangle of a map, row by row. Its first cell is in column `x` and row `y`."""

    header: Header = HEADER
    x: Int32 = 0
    y: Int32 = 0
    width: UInt32 = 0
    height: UInt32 = 0
    data: Array[np.int8] = field(default_factory=_empty)
