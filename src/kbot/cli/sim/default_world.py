"""The worlds that `kbot sim` simulates in without `--world`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kbot.model import RobotModel

HEADLESS_WORLD = "empty"
"""Scripts and tests measure driving on a floor without obstacles."""


def page_world(robot: RobotModel | None) -> str:
    """Return the playground, scaled so that the robot can start and drive ahead in it.

    Without a robot yet, it is not scaled.
    """
    if robot is None:
        return "playground"
    # imported lazily, so that -h stays fast
    from kbot.render.bounds import visible_bounds
    from kbot.world.builtin.registry import FREE_REACH

    low, high = visible_bounds(robot)
    reach = max(math.hypot(x, y) for x in (low[0], high[0]) for y in (low[1], high[1]))
    scale = math.ceil(round(10.0 * reach / FREE_REACH, 6)) / 10.0
    return "playground" if scale <= 1.0 else f"playground:scale={min(scale, 100.0):g}"
