"""Reads SDF links: visuals, collisions and masses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import MassProperties
from kbot.kinematics.inertia_repair import SMALLEST, possible_tensor
from kbot.kinematics.transform import Transform
from kbot.text import Element
from kbot.world.convex_decomposition import convex_pieces
from kbot.world.footprints import corners
from kbot.world.sdf.frames import Frames
from kbot.world.sdf.geometry import Shapes
from kbot.world.sdf.materials import colour
from kbot.world.sdf.values import SdfValues
from kbot.world.world import HEAVIEST, Box, HeightField, Part, Plane, Shape, TriangleMesh

Array = NDArray[np.float64]
FLATNESS = 0.25
"""A box counts as ground if its height is below this share of its shorter side."""
MOST_FRICTION = 1e3
"""Largest coefficient of friction. Larger ones are reduced to it."""


class Links:
    """Reads links. `shapes` resolves the files that their meshes name."""

    def __init__(self, values: SdfValues, shapes: Shapes) -> None:
        self._values, self._shapes = values, shapes

    def parts(
        self, link: Element, frames: Frames, world_from_link: Transform, body_from_link: Transform
    ) -> list[Part]:
        """Visuals and collisions in a body's frame. A visual and an equal collision become one part."""
        name = link.attributes.get("name", "")
        seen = [p for e in link.elements("visual") for p in self._visual(e, frames, name, body_from_link)]
        touched = [
            p
            for e in link.elements("collision")
            for p in self._collision(e, frames, name, world_from_link, body_from_link)
        ]
        at: dict[tuple[Shape, Transform], list[Part]] = {}
        for part in seen:
            at.setdefault((part.shape, part.pose), []).append(part)
        visible = {part.shape for part in seen}
        parts = []
        for part in touched:
            same = at.get((part.shape, part.pose)) if part.shape in visible else None
            if same:
                rgba = same.pop(0).rgba
                part = Part(part.shape, part.pose, rgba, part.friction, part.ground, origin=part.origin)
            parts.append(part)
        return parts + [part for rest in at.values() for part in rest]

    def mass(
        self, link: Element, parts: Sequence[Part], body_from_link: Transform, moves_alone: bool
    ) -> MassProperties:
        """Mass properties in the body's frame. Without `<inertial>`, SDF's defaults: 1 kg and 1 kg m^2.

        `parts` are those of the link, in the body's frame. A link `moves_alone` if no other one is fixed to
        it.
        """
        inertial = link.find("inertial")
        if inertial is None:
            return MassProperties(1.0, np.zeros(3), np.eye(3)).in_frame(body_from_link)
        body_from_inertial = body_from_link @ self._values.pose(inertial.find("pose"))
        mass = self._values.number(inertial, "mass", 1.0, HEAVIEST)
        if mass <= SMALLEST:
            message = f"<mass> must be above {SMALLEST:g} kg, not {mass:g} kg"
            self._values.fault("W204", message, inertial.origin, "uses 1 kg")
            mass = 1.0
        inertia = inertial.find("inertia")
        xx, yy, zz = (self._values.number(inertia, f"i{a}{a}", 1.0, HEAVIEST) for a in "xyz")
        xy, xz, yz = (self._values.number(inertia, tag, 0.0, HEAVIEST) for tag in ("ixy", "ixz", "iyz"))
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if inertia is not None:
            tensor = possible_tensor(
                f"link '{link.attributes.get('name', '')}'",
                mass,
                tensor,
                lambda: corners_of(parts, body_from_inertial.inverse()),
                self._values.fault_at(inertia.origin),
                moves_alone=moves_alone,
            )
        return MassProperties(mass, np.zeros(3), tensor).in_frame(body_from_inertial)

    def _visual(self, visual: Element, frames: Frames, link: str, body_from_link: Transform) -> list[Part]:
        rgba = colour(visual, self._values)
        place = self._place(visual, frames, link)
        found = self._shapes.read(visual.find("geometry"), visual)
        return [
            Part(s, body_from_link @ (place @ at), rgba, solid=False, origin=visual.origin) for s, at in found
        ]

    def _collision(
        self,
        collision: Element,
        frames: Frames,
        link: str,
        world_from_link: Transform,
        body_from_link: Transform,
    ) -> list[Part]:
        place = self._place(collision, frames, link)
        friction = self._friction(collision)
        parts = []
        for whole, at in self._shapes.read(collision.find("geometry"), collision):
            link_from_shape = place @ at
            body_from_shape = body_from_link @ link_from_shape
            world_from_shape = world_from_link @ link_from_shape
            parts += [
                Part(
                    shape,
                    body_from_shape,
                    friction=friction,
                    ground=is_ground(shape, world_from_shape),
                    visible=False,
                    origin=collision.origin,
                )
                for shape in self._touched(whole, collision)
            ]
        return parts

    def _touched(self, shape: Shape, collision: Element) -> list[Shape]:
        """Split a mesh into convex pieces. Other shapes are returned unchanged."""
        if not isinstance(shape, TriangleMesh):
            return [shape]
        pieces = convex_pieces(shape)
        if pieces is None:
            self._values.unsupported(collision, "a mesh of too many pieces collides as its convex hull")
            return [shape]
        return list(pieces)

    def _place(self, element: Element, frames: Frames, link: str) -> Transform:
        written = element.find("pose")
        pose = self._values.pose(written)
        relative = written.attributes.get("relative_to", "") if written is not None else ""
        if written is None or not relative or relative == link:
            return pose
        return frames.pose(link, element).inverse() @ frames.pose(relative, written) @ pose

    def _friction(self, collision: Element) -> float:
        at: Element | None = collision
        for tag in ("surface", "friction", "ode"):
            at = at.find(tag) if at is not None else None
        friction = self._values.number(at, "mu", 1.0)
        written = at.find("mu") if at is not None else None
        if friction < 0.0 and written is not None:
            message = f"<mu> must be at least 0, not {friction:g}"
            self._values.findings.warning("W204", message, written.origin, "KBot uses 0")
        if self._values.number(at, "mu2", friction) != friction:
            self._values.unsupported(
                collision, "friction by direction is not simulated: mu applies in all directions"
            )
        return min(max(friction, 0.0), MOST_FRICTION)


def corners_of(parts: Sequence[Part], frame_from_body: Transform) -> Array:
    """Points (n, 3) in m around the solid parts of a body, or around its other ones if none is solid."""
    around = [part for part in parts if part.solid] or parts
    points = [
        (frame_from_body @ part.pose).apply(found)
        for part in around
        if (found := corners(part.shape)) is not None
    ]
    return np.concatenate(points) if points else np.zeros((0, 3))


def is_ground(shape: Shape, world_from_shape: Transform) -> bool:
    """Whether a shape is ground to drive on: a plane, a height field, or a flat box."""
    if isinstance(shape, Plane | HeightField):
        return True
    if not isinstance(shape, Box):
        return False
    up = np.abs(world_from_shape.rotation[2])
    axis = int(np.argmax(up))
    height = shape.size[axis]
    across = min(size for i, size in enumerate(shape.size) if i != axis)
    return bool(up[axis] > 0.7 and height < FLATNESS * across)
