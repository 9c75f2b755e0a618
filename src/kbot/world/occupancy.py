"""An occupancy grid: which cells of the plane are free, occupied or unknown (nav_msgs/OccupancyGrid)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import navigation as nav
from kbot.messages import types as msg
from kbot.text import KbotError

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
FREE_BELOW = 50
"""What is likelier taken than free is not driven on."""

START = msg.Time()

_FARTHEST = 2.0**53
"""Cells; further away, floating point tells no neighbours apart."""
MOST_CELLS = 100_000_000
"""A grid larger than this is taken for a mistake in its resolution."""


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """`cells` (rows along y, columns along x) of 0 free to 100 occupied, -1 unknown, as int8.

    `resolution` is a cell's edge in m; `origin` the pose of the first cell's lower left corner in `frame`.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: PlanarPose = field(default_factory=PlanarPose)
    frame: str = "map"

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or not self.cells.size:
            raise KbotError(f"an occupancy grid has rows and columns, not the shape {self.cells.shape}")
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise KbotError(f"a grid's resolution is a length above 0 m, not {self.resolution}")

    @property
    def rows(self) -> int:
        return int(self.cells.shape[0])

    @property
    def columns(self) -> int:
        return int(self.cells.shape[1])

    @property
    def size(self) -> tuple[float, float]:
        """Metres along the grid's own x and y."""
        return self.columns * self.resolution, self.rows * self.resolution

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column that a point in m lies in; they may be outside the grid, and are (-1, -1) for one
        that is nowhere or too far off to tell."""
        along, across = self.origin.local(x, y)
        row, column = across / self.resolution, along / self.resolution
        if not (abs(row) < _FARTHEST and abs(column) < _FARTHEST):
            return -1, -1
        return math.floor(row), math.floor(column)

    def center(self, row: int, column: int) -> tuple[float, float]:
        """The middle of a cell in m."""
        ((x, y),) = self.centers(np.array([[row, column]])).tolist()
        return x, y

    def centers(self, cells: ArrayLike) -> NDArray[np.float64]:
        """The middles (n, 2) in m of cells (n, 2) given as row and column."""
        along = (np.asarray(cells, dtype=np.float64)[:, ::-1] + 0.5) * self.resolution
        return self.origin.apply(along)

    def contains(self, row: int, column: int) -> bool:
        return 0 <= row < self.rows and 0 <= column < self.columns

    def to_message(self, stamp: msg.Time = START) -> nav.OccupancyGrid:
        """nav_msgs/OccupancyGrid."""
        position, turn = msg.Point(self.origin.x, self.origin.y, 0.0), msg.Quaternion.about_z(self.origin.yaw)
        info = nav.MapMetaData(stamp, self.resolution, self.columns, self.rows, msg.Pose(position, turn))
        return nav.OccupancyGrid(msg.Header(stamp, self.frame), info, self.cells.reshape(-1))

    @classmethod
    def from_message(cls, message: nav.OccupancyGrid) -> OccupancyGrid:
        """A grid as SLAM or map_server publish it. Raises KbotError where its size and data do not fit."""
        info, data = message.info, np.asarray(message.data, dtype=np.int8)
        if data.size != info.width * info.height:
            raise KbotError(f"a map of {info.width} x {info.height} cells comes with {data.size}")
        position, yaw = info.origin.position, info.origin.orientation.yaw
        cells = data.reshape(info.height, info.width)
        return cls(cells, info.resolution, PlanarPose(position.x, position.y, yaw), message.header.frame_id)

    def value(self, x: float, y: float) -> int:
        """What stands at a point in m; outside the grid it is unknown."""
        row, column = self.cell(x, y)
        return int(self.cells[row, column]) if self.contains(row, column) else UNKNOWN
