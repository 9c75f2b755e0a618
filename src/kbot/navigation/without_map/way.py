"""The way that a cost-to-go describes: from cell to cell, each nearer to the goal than the one before."""

from __future__ import annotations

import math

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.space.cost_to_go import CostToGo

_STEPS = [
    (row, column)
    for row in range(-2, 3)
    for column in range(-2, 3)
    if math.gcd(row, column) == 1  # the sixteen neighbours of the cost-to-go
]


def way(cost_to_go: CostToGo, start: PlanarPose, goal: PlanarPose) -> Path:
    """The way from a pose to the goal. Beyond the grid it is a straight line."""
    values, resolution = cost_to_go.raw, cost_to_go.resolution
    rows, columns = values.shape
    left, low = cost_to_go.corner
    row = min(max(math.floor((start.y - low) / resolution), 0), rows - 1)
    column = min(max(math.floor((start.x - left) / resolution), 0), columns - 1)
    points = [(start.x, start.y)]
    while True:
        inside = [
            (row + down, column + along)
            for down, along in _STEPS
            if 0 <= row + down < rows and 0 <= column + along < columns
        ]
        # the decrease per length: a knight's step covers more than a straight one
        rates = [
            (values[row, column] - values[cell]) / math.hypot(cell[0] - row, cell[1] - column)
            for cell in inside
        ]
        best = int(np.argmax(rates))
        if rates[best] <= 0.0:
            break
        row, column = inside[best]
        points.append((left + (column + 0.5) * resolution, low + (row + 0.5) * resolution))
    points.append((goal.x, goal.y))
    return Path(np.array(points), goal.yaw)
