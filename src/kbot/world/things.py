"""Objects to spawn into a running world: boxes, and the models that ship with KBot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from kbot.kinematics.transform import Transform
from kbot.text import DescriptionError, Diagnostic, KbotError, Severity
from kbot.text.files import unsaved
from kbot.text.suggest import did_you_mean
from kbot.world.body_joints import Loop
from kbot.world.builders import WOOD
from kbot.world.sdf import read_sdf
from kbot.world.sdf.model_paths import LIBRARY
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.resources import read_xml
from kbot.world.world import Body, Box, Part

BOX = "box"
MODELS = tuple(sorted(f.parent.name for f in LIBRARY.glob("*/model.sdf") if f.parent.name != "ground_plane"))
THINGS = (BOX, *MODELS)
DENSITY = 100.0
"""Density of a box in kg/m^3: that of a filled carton."""
EDGE = 0.1
"""Default edge of a box in m."""


def thing(kind: str, name: str, pose: Transform, size: tuple[float, float, float] | None = None) -> Body:
    """The body of one of `THINGS`, with its foot at `pose` in the world. `size` (m) is that of a box.

    Raises:
        KbotError: the object does not exist, or a size is given for an object other than a box.
    """
    if kind == BOX:
        x, y, z = size or (EDGE, EDGE, EDGE)
        part = Part(Box((x, y, z)), Transform.from_xyz_rpy((0.0, 0.0, z / 2), (0.0, 0.0, 0.0)), WOOD)
        return Body(name, (part,), pose, mass=DENSITY * x * y * z)
    if kind not in MODELS:
        hint = did_you_mean(str(kind), THINGS) or f"choose from {', '.join(THINGS)}"
        raise KbotError(f"unknown object '{kind}': {hint}")
    if size is not None:
        raise KbotError(f"the size of a {kind} cannot be set: only a box takes a size")
    body = read_sdf(str(LIBRARY / kind / "model.sdf")).bodies[-1]
    return replace(body, name=name, model=name, pose=pose @ body.pose)


@dataclass(frozen=True, slots=True)
class SdfModel:
    """An SDF model as it was read, at the origin and with its own name.

    `sdf` is its text or the name of its file, and `is_confined` means that it came from a peer.
    """

    sdf: str
    is_confined: bool
    name: str
    bodies: tuple[Body, ...]
    loops: tuple[Loop, ...]
    diagnostics: tuple[Diagnostic, ...]

    def placed(self, name: str | None, pose: Transform) -> tuple[tuple[Body, ...], tuple[Loop, ...]]:
        """Return its bodies and loops under another name, with `pose` applied before its own pose."""
        old, new = self.name, name or self.name

        def renamed(text: str) -> str:
            return new + text.removeprefix(old) if text == old or text.startswith(f"{old}::") else text

        def moved(body: Body) -> Body:
            joint = body.joint and replace(body.joint, parent=renamed(body.joint.parent))
            mates = body.model and new
            return replace(body, name=renamed(body.name), model=mates, pose=pose @ body.pose, joint=joint)

        loops = (
            replace(
                loop,
                name=renamed(loop.name),
                first=renamed(loop.first),
                second=renamed(loop.second),
                points=tuple(_moved(pose, point) for point in loop.points),
            )
            for loop in self.loops
        )
        return tuple(map(moved, self.bodies)), tuple(loops)


def read_sdf_model(sdf: str, name: str | None, *, is_confined: bool = False) -> SdfModel:
    """Read an SDF model, given as its text or the name of its file. `name` is used in errors about a text.

    Use `is_confined` for models that a peer sends. Then the model may name only the files that
    `kbot.world.sdf.reach` allows, and what would be repaired or left out is an error.

    Raises:
        DescriptionError: the model cannot be used. It carries every finding.
        KbotError: the file contains no model, or several.
    """
    texts: dict[str, str] = {}
    if sdf.lstrip().startswith("<"):
        path = f"{name or 'model'}.sdf"
        texts[path] = sdf
    else:
        path = str(Path(sdf) / "model.sdf" if Path(sdf).is_dir() else sdf)
    with unsaved(texts):
        world = read_sdf(path, with_floor=False, reach=Reach() if is_confined else None)
        models = {body.belongs_to for body in world.bodies}
        faults = [d for d in world.diagnostics if d.severity is Severity.WARNING]
        if faults and not models:  # they are why
            raise DescriptionError([replace(d, severity=Severity.ERROR) for d in faults])
        if len(models) != 1:
            raise KbotError(_not_one_model(path, len(models)))
    return SdfModel(sdf, is_confined, models.pop(), world.bodies, world.loops, world.diagnostics)


def _moved(pose: Transform, point: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (pose @ Transform.from_xyz_rpy(point, (0.0, 0.0, 0.0))).translation.tolist()
    return x, y, z


def _not_one_model(path: str, with_links: int) -> str:
    root = read_xml(path)
    count = max(with_links, len(list((root.find("world") or root).elements("model"))))
    if count == 1:
        return f"the model in {path} has no link"
    return f"{path} contains {count or 'no'} models: a file to spawn must contain exactly one"
