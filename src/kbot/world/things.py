"""Things to put into a running world: a box of any size, and the models that ship with KBot."""

from __future__ import annotations

from dataclasses import replace

from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.builders import WOOD
from kbot.world.sdf import read_sdf
from kbot.world.sdf.files import LIBRARY
from kbot.world.world import Body, Box, Part

BOX = "box"
MODELS = tuple(sorted(f.parent.name for f in LIBRARY.glob("*/model.sdf") if f.parent.name != "ground_plane"))
THINGS = (BOX, *MODELS)
DENSITY = 100.0
"""kg/m^3 of a box: a carton with something in it."""
EDGE = 0.1


def thing(kind: str, name: str, pose: Transform, size: tuple[float, float, float] | None = None) -> Body:
    """One of `THINGS`, that stands with its foot at `pose` in the world; `size` (m) is that of a box.

    Raises:
        KbotError: there is no such thing, or it has a size of its own.
    """
    if kind == BOX:
        x, y, z = size or (EDGE, EDGE, EDGE)
        part = Part(Box((x, y, z)), Transform.from_xyz_rpy((0.0, 0.0, z / 2), (0.0, 0.0, 0.0)), WOOD)
        return Body(name, (part,), pose, mass=DENSITY * x * y * z)
    if kind not in MODELS:
        hint = did_you_mean(str(kind), THINGS) or f"there are {', '.join(THINGS)}"
        raise KbotError(f"there is no thing '{kind}': {hint}")
    if size is not None:
        raise KbotError(f"a {kind} has a size of its own: only a box is given one")
    body = read_sdf(str(LIBRARY / kind / "model.sdf")).bodies[-1]
    return replace(body, name=name, model=name, pose=pose @ body.pose)
