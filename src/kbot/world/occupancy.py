"""Occupancy grids: which cells of the plane are free, occupied or unknown (nav_msgs/OccupancyGrid)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import navigation as nav
from kbot.messages import types as msg
from kbot.text import KbotError

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
FREE_BELOW = 50
"""Occupancy in percent below which a cell is drivable: it is more likely free than occupied."""

START = msg.Time()

_FARTHEST = 2.0**53
"""Largest cell index: beyond it, floating point does not distinguish neighbouring cells."""
MOST_CELLS = 100_000_000
"""Most cells of a grid. More are likely an error in the resolution."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OccupancyGrid(Brief):
    """An occupancy grid.

    `cells` (rows along y, columns along x; int8) are from 0 (free) to 100 (occupied), or -1 (unknown).
    `resolution` is a cell's edge in m. `origin` is the pose of the first cell's lower left corner in `frame`.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: PlanarPose = field(default_factory=PlanarPose)
    frame: str = "map"

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or not self.cells.size:
            raise KbotError(
                f"the cells of a grid must have rows and columns, not the shape {self.cells.shape}"
            )
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise KbotError(f"the resolution of a grid must be above 0 m, not {self.resolution}")

    @property
    def rows(self) -> int:
        return int(self.cells.shape[0])

    @property
    def columns(self) -> int:
        return int(self.cells.shape[1])

    @property
    def size(self) -> tuple[float, float]:
        """Size in m along the grid's own x and y."""
        return self.columns * self.resolution, self.rows * self.resolution

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of a point in m, which may be outside the grid.

        (-1, -1) if the point is not finite or too far away.
        """
        along, across = self.origin.local(x, y)
        row, column = across / self.resolution, along / self.resolution
        if not (abs(row) < _FARTHEST and abs(column) < _FARTHEST):
            return -1, -1
        return math.floor(row), math.floor(column)

    def center(self, row: int, column: int) -> tuple[float, float]:
        """The centre of a cell in m."""
        ((x, y),) = self.centers(np.array([[row, column]])).tolist()
        return x, y

    def centers(self, cells: ArrayLike) -> NDArray[np.float64]:
        """The centres (n, 2) in m of cells (n, 2) given as row and column."""
        along = (np.asarray(cells, dtype=np.float64)[:, ::-1] + 0.5) * self.resolution
        return self.origin.apply(along)

    def contains(self, row: int, column: int) -> bool:
        return 0 <= row < self.rows and 0 <= column < self.columns

    def to_message(self, stamp: msg.Time = START) -> nav.OccupancyGrid:
        """The grid as nav_msgs/OccupancyGrid."""
        position, turn = msg.Point(self.origin.x, self.origin.y, 0.0), msg.Quaternion.about_z(self.origin.yaw)
        info = nav.MapMetaData(stamp, self.resolution, self.columns, self.rows, msg.Pose(position, turn))
        return nav.OccupancyGrid(msg.Header(stamp, self.frame), info, self.cells.reshape(-1))

    @classmethod
    def from_message(cls, message: nav.OccupancyGrid) -> OccupancyGrid:
        """A grid from a message of SLAM or map_server. Raises KbotError if its size and data do not match."""
        info, data = message.info, np.asarray(message.data, dtype=np.int8)
        size = info.width * info.height
        if data.size != size:
            shape = f"{info.width} x {info.height} cells"
            raise KbotError(f"a map of {shape} must have {size} values, not {data.size}")
        position, yaw = info.origin.position, info.origin.orientation.yaw
        cells = data.reshape(info.height, info.width)
        return cls(cells, info.resolution, PlanarPose(position.x, position.y, yaw), message.header.frame_id)

    def value(self, x: float, y: float) -> int:
        """The value at a point in m. Outside the grid it is unknown."""
        row, column = self.cell(x, y)
        return int(self.cells[row, column]) if self.contains(row, column) else UNKNOWN
