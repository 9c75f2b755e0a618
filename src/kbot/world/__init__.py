"""Worlds: floors, walls and objects that a robot drives on and collides with."""

from kbot.lazy_names import lazy_names, public_names
from kbot.world.builtin.registry import BUILDERS, built_in, parameters
from kbot.world.load import load_world
from kbot.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HeightField,
    Part,
    Plane,
    Shape,
    Sphere,
    TriangleMesh,
    World,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.world.occupancy import OccupancyGrid
    from kbot.world.occupancy_files import read_map, write_map
    from kbot.world.occupancy_of_world import world_grid

_HOMES = {
    "OccupancyGrid": "occupancy",
    "read_map": "occupancy_files",
    "world_grid": "occupancy_of_world",
    "write_map": "occupancy_files",
}

__all__ = [
    "BUILDERS",
    "Body",
    "Box",
    "Capsule",
    "Cylinder",
    "Ellipsoid",
    "HeightField",
    "OccupancyGrid",
    "Part",
    "Plane",
    "Shape",
    "Sphere",
    "TriangleMesh",
    "World",
    "built_in",
    "load_world",
    "parameters",
    "read_map",
    "world_grid",
    "write_map",
]

# imported on first use, for start-up time
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
