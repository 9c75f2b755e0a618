"""Splits models into rigid bodies and the joints between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import MassProperties
from kbot.kinematics.inertia_repair import possible_tensor
from kbot.kinematics.transform import Transform
from kbot.text import Element
from kbot.text.progress import working_on
from kbot.text.suggest import did_you_mean
from kbot.world.body_joints import BodyJoint, Freedom, JointMotion, Loop
from kbot.world.sdf.entries import ModelEntry, SdfContext
from kbot.world.sdf.frames import Frames
from kbot.world.sdf.geometry import Shapes
from kbot.world.sdf.links import Links, corners_of
from kbot.world.sdf.resources import ResourceFinder
from kbot.world.sdf.values import SdfValues
from kbot.world.world import FURTHEST, Body, Part

Array = NDArray[np.float64]

FREEDOMS = {
    "revolute": (JointMotion.TURN,),
    "continuous": (JointMotion.TURN,),
    "prismatic": (JointMotion.SLIDE,),
    "ball": (JointMotion.BALL,),
    "universal": (JointMotion.TURN, JointMotion.TURN),
    "revolute2": (JointMotion.TURN, JointMotion.TURN),
    "screw": (JointMotion.TURN, JointMotion.SLIDE),
    "gearbox": (JointMotion.TURN,),
    "fixed": (),
}
ENDLESS = 1e15
"""rad or m from which a limit counts as none. SDF's default limit is 1e16."""


class Joints:
    """Reads the degrees of freedom of joints. Directions are in the model's axes."""

    def __init__(self, values: SdfValues) -> None:
        self._values = values

    def kind(self, joint: Element) -> str:
        """The joint's type. An unknown type is reported and becomes `fixed`."""
        kind = joint.attributes.get("type", "")
        if kind in FREEDOMS:
            return kind
        hint = did_you_mean(kind, FREEDOMS) or f"choose from {', '.join(FREEDOMS)}"
        what = f"the unknown type '{kind}'" if kind else "no type"
        name = joint.attributes.get("name", "")
        self._values.fault("W205", f"joint '{name}' has {what}", joint.origin, "fixes the joint", hint)
        return "fixed"

    def freedoms(self, joint: Element, frames: Frames, context: SdfContext) -> tuple[Freedom, ...]:
        """The child's degrees of freedom, in order from the parent."""
        kind = self.kind(joint)
        if kind == "gearbox":
            self._values.unsupported(joint, "gearbox ratios are not simulated: the joint turns freely")
        motions = FREEDOMS[kind]
        tags = ("axis", "axis2") if kind in ("universal", "revolute2") else ("axis",) * len(motions)
        freedoms = []
        for motion, tag in zip(motions, tags, strict=True):
            if motion is JointMotion.BALL:
                freedoms.append(Freedom(motion, damping=self._damping(joint.find("axis"))))
            else:
                axis = self._axis(joint, tag)
                bounded = kind != "continuous" and not (kind == "screw" and motion is JointMotion.SLIDE)
                freedoms.append(self._about(axis, motion, bounded, joint, frames, context))
        return tuple(freedoms)

    def _axis(self, joint: Element, tag: str) -> Element | None:
        axis = joint.find(tag)
        if axis is None:
            message = f"joint '{joint.attributes.get('name', '')}' has no <{tag}>"
            self._values.findings.warning("W205", message, joint.origin, "KBot uses the z axis")
        return axis

    def lead(self, joint: Element) -> float | None:
        """The lead of a screw in m/rad. None for other joints."""
        if joint.attributes.get("type") != "screw":
            return None
        if joint.find("screw_thread_pitch") is not None:
            return self._values.number(joint, "screw_thread_pitch", 1.0) / (2.0 * pi)
        # Gazebo Classic's tag is in rad/m and has the opposite sign
        pitch = self._values.number(joint, "thread_pitch", 1.0)
        return -1.0 / pitch if pitch else 0.0

    def _about(
        self,
        axis: Element | None,
        motion: JointMotion,
        bounded: bool,
        joint: Element,
        frames: Frames,
        context: SdfContext,
    ) -> Freedom:
        x, y, z = self._direction(axis, joint, frames, context).tolist()
        limit = axis.find("limit") if axis is not None else None
        lower, upper = self._limits(limit) if bounded else (-inf, inf)
        dynamics = axis.find("dynamics") if axis is not None else None
        return Freedom(
            motion,
            (x, y, z),
            lower,
            upper,
            self._damping(axis),
            max(self._values.number(dynamics, "friction", 0.0), 0.0),
            max(self._values.number(dynamics, "spring_stiffness", 0.0), 0.0),
            self._values.number(dynamics, "spring_reference", 0.0),
        )

    def _damping(self, axis: Element | None) -> float:
        dynamics = axis.find("dynamics") if axis is not None else None
        return max(self._values.number(dynamics, "damping", 0.0), 0.0)

    def _limits(self, limit: Element | None) -> tuple[float, float]:
        lower = self._limit(limit, "lower", -inf)
        upper = self._limit(limit, "upper", inf)
        if limit is not None and lower > upper:
            message = f"the lower limit {lower:g} of a joint is above its upper limit {upper:g}"
            self._values.fault("W204", message, limit.origin, "uses no limits", "swap the limits")
            return -inf, inf
        return (-inf if lower < -ENDLESS else lower), (inf if upper > ENDLESS else upper)

    def _limit(self, limit: Element | None, tag: str, default: float) -> float:
        written = limit.find(tag) if limit is not None else None
        if written is not None and written.text.strip().lower().lstrip("+-") in ("inf", "infinity"):
            return -inf if written.text.strip().startswith("-") else inf
        return self._values.number(limit, tag, default)

    def _direction(self, axis: Element | None, joint: Element, frames: Frames, context: SdfContext) -> Array:
        """The axis as a unit vector (3,) in the model's axes."""
        written = axis.find("xyz") if axis is not None else None
        z_axis = "uses the z axis"
        values = self._values.numbers(written, 3, FURTHEST, z_axis) if written is not None else None
        vector = np.array(values or (0.0, 0.0, 1.0))
        length = float(np.linalg.norm(vector))
        if not length > 0.0:
            place = written or joint
            self._values.fault("W204", "the axis of a joint must not be 0 0 0", place.origin, z_axis)
            return np.array([0.0, 0.0, 1.0])
        frame = written.attributes.get("expressed_in", "") if written is not None else ""
        # before SDF 1.5 an axis was in the model's frame; 1.5 and 1.6 have a flag for that
        old = axis is not None and self._values.truth(
            axis, "use_parent_model_frame", context.version < (1, 5)
        )
        if not frame:
            frame = frames.root if old else frames.key(joint)
        turned: Array = frames.pose(frame, written or joint).rotation @ vector / length
        return turned


WORLD = ""
"""The name of the world among the names of links."""


@dataclass(frozen=True, slots=True)
class _Link:
    entry: ModelEntry
    element: Element
    context: SdfContext
    world_from_link: Transform
    model: str
    """The outermost model that contains it."""


@dataclass(frozen=True, slots=True)
class _Hinge:
    """A movable joint between links (by full name). Directions are in the world's axes."""

    name: str
    parent: str
    child: str
    world_from_joint: Transform
    freedoms: tuple[Freedom, ...]
    lead: float | None
    element: Element

    def flipped(self) -> _Hinge:
        """The same joint with parent and child exchanged."""
        freedoms = tuple(_reversed(freedom) for freedom in reversed(self.freedoms))
        return replace(self, parent=self.child, child=self.parent, freedoms=freedoms)


class Articulation:
    """The `bodies` of a world's models, each after its parent, and the `loops` that their joints close."""

    def __init__(
        self,
        values: SdfValues,
        files: ResourceFinder,
        entries: list[ModelEntry],
        frames: Frames,
        world: Element,
        context: SdfContext,
    ) -> None:
        self.values = values
        self._files = files
        self._joints = Joints(values)
        self._links: dict[str, _Link] = {}
        self._head: dict[str, str] = {WORLD: WORLD}
        """For each link, another link of the same rigid body (a union-find structure)."""
        self._hinges: list[_Hinge] = []
        for entry in entries:
            self._collect(entry, frames.pose(entry.name, entry.placed_by), entry.name)
        for joint in world.elements("joint"):
            self._connect(joint, frames, "", Transform.identity(), context)
        self.loops: list[Loop] = []
        self.bodies = self._in_order(list(self._bodies()))

    def _collect(self, entry: ModelEntry, world_from_model: Transform, outermost: str) -> None:
        """Collect the links and joints of a model and its nested models."""
        prefix, frames = entry.context.prefix, entry.frames
        for element, context in entry.elements("link"):
            name = frames.key(element)
            if prefix + name in self._links:
                continue  # of merged models: reported there
            pose = world_from_model @ frames.pose(name, element)
            self._links[prefix + name] = _Link(entry, element, context, pose, outermost)
            self._head[prefix + name] = WORLD if entry.context.static else prefix + name
        for inner in entry.nested:
            pose = frames.pose(inner.name, inner.placed_by)
            self._collect(inner, world_from_model @ pose, outermost)
        for joint, context in entry.elements("joint"):
            self._connect(joint, frames, prefix, world_from_model, context)

    def _connect(
        self, joint: Element, frames: Frames, prefix: str, world_from_model: Transform, context: SdfContext
    ) -> None:
        parent, child = (self._end(joint, tag, frames, prefix) for tag in ("parent", "child"))
        freedoms = self._joints.freedoms(joint, frames, context)
        if parent is None or child is None:
            return
        if parent == child:
            message = f"joint '{joint.attributes.get('name', '')}' connects a link to itself"
            if len({_text(joint, tag) for tag in ("parent", "child")}) == 1:
                self.values.fault("W205", message, joint.origin, "leaves the joint out")
            else:  # by two of its frames, which Gazebo loads
                self.values.findings.warning("W205", message, joint.origin, "KBot leaves the joint out")
            return
        if not freedoms:
            first, second = self._top(parent), self._top(child)
            # the world remains the head of what is fixed to it
            self._head[second if first == WORLD else first] = first if first == WORLD else second
            return
        turn = world_from_model.rotation
        turned = tuple(replace(f, axis=_vector(turn @ np.array(f.axis))) for f in freedoms)
        name = joint.attributes.get("name", "")
        place = world_from_model @ frames.pose(frames.key(joint), joint)
        lead = self._joints.lead(joint)
        self._hinges.append(_Hinge(prefix + name, parent, child, place, turned, lead, joint))

    def _end(self, joint: Element, tag: str, frames: Frames, prefix: str) -> str | None:
        """The full name of the link at an end of a joint. None, with a finding, if there is no such link."""
        element, name = joint.find(tag), _text(joint, tag)
        if element is None or not name:
            message = f"joint '{joint.attributes.get('name', '')}' has no <{tag}>"
            self.values.fault("W205", message, (element or joint).origin, "leaves the joint out")
            return None
        if name == "world" and tag == "parent":
            return WORLD
        found = frames.link(name)
        if found is None or prefix + found not in self._links:
            message = f"joint '{joint.attributes.get('name', '')}' has the unknown {tag} link '{name}'"
            frames.report_unknown(name, message, element, "leaves the joint out")
            return None
        return prefix + found

    def _top(self, link: str) -> str:
        while self._head[link] != link:
            self._head[link] = self._head[self._head[link]]  # path halving: the next search is shorter
            link = self._head[link]
        return link

    def _bodies(self) -> Iterator[Body]:
        groups: dict[tuple[str, str], list[str]] = {}
        for link in self._links:
            top = self._top(link)
            # the static links of a model are one body
            key = (self._links[link].entry.context.prefix, WORLD) if top == WORLD else (WORLD, top)
            groups.setdefault(key, []).append(link)
        names: dict[str, str] = {WORLD: WORLD}
        named: dict[str, list[str]] = {}
        for group in groups.values():
            own = self._links[group[0]].entry.context.prefix.removesuffix("::")
            name = own if own not in named else group[0]
            named[name] = group
            names |= dict.fromkeys(group, name)
        hung = self._hang(names)
        for number, (name, group) in enumerate(named.items(), 1):
            working_on(f"reading '{name}', body {number} of {len(named)}")
            yield self._body(name, group, hung.get(name))

    def _hang(self, names: dict[str, str]) -> dict[str, tuple[str, _Hinge]]:
        """The parent and the joint of each body. The remaining joints close loops."""
        hung: dict[str, tuple[str, _Hinge]] = {}

        def is_fixed(body: str, link: str) -> bool:
            return body == WORLD or self._top(link) == WORLD

        def can_hang(body: str, on: str, link: str) -> bool:
            if body in hung or is_fixed(body, link):
                return False
            while on in hung:
                on = hung[on][0]
            return on != body

        for hinge in self._hinges:
            parent, child = names[hinge.parent], names[hinge.child]
            if parent == child or (is_fixed(parent, hinge.parent) and is_fixed(child, hinge.child)):
                continue
            if can_hang(child, parent, hinge.child):
                hung[child] = (parent, hinge)
            elif can_hang(parent, child, hinge.parent):
                hung[parent] = (child, hinge.flipped())
            else:
                self._close(hinge, parent, child)
        return hung

    def _close(self, hinge: _Hinge, parent: str, child: str) -> None:
        motions = [freedom.motion for freedom in hinge.freedoms]
        anchor = hinge.world_from_joint.translation
        points = [anchor]
        if motions == [JointMotion.TURN]:
            axis = np.array(hinge.freedoms[0].axis)
            points = [anchor - 0.1 * axis, anchor + 0.1 * axis]
        elif motions != [JointMotion.BALL]:
            what = (
                f"joint '{hinge.name}' is ignored: only revolute and ball joints can close a loop of joints"
            )
            self.values.unsupported(hinge.element, what)
            return
        where = tuple(_vector(point) for point in points)
        self.loops.append(Loop(hinge.name, parent, child, where, hinge.element.origin))

    def _body(self, name: str, group: list[str], hung: tuple[str, _Hinge] | None) -> Body:
        """The body of links that are rigidly connected, in the frame of the first link."""
        first = self._links[group[0]]
        pose = first.world_from_link
        is_static = self._top(group[0]) == WORLD
        parts: list[Part] = []
        masses = []
        falling = 0.0
        for link in (self._links[full] for full in group):
            reader = self._reader(link)
            first_from_link = pose.inverse() @ link.world_from_link
            own = reader.parts(link.element, link.entry.frames, link.world_from_link, first_from_link)
            parts += own
            if not is_static:
                mass = reader.mass(link.element, own, first_from_link, moves_alone=len(group) == 1)
                masses.append(mass)
                falling += mass.mass * self.values.truth(link.element, "gravity", default=True)
        origin = first.entry.placed_by.origin
        if is_static:
            return Body(name, tuple(parts), pose, origin=origin, model=self._model(first))
        whole = MassProperties.combined(masses)
        t, centre = whole.tensor, _vector(whole.center)
        if len(group) > 1:  # of links that are all point masses
            at_centre = Transform.from_xyz_rpy(centre, (0.0, 0.0, 0.0)).inverse()
            around = partial(corners_of, parts, at_centre)
            t = possible_tensor(f"'{name}'", whole.mass, t, around, self.values.fault_at(origin))
        inertia = (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2])
        return Body(
            name,
            tuple(parts),
            pose,
            whole.mass,
            centre,
            inertia,
            origin,
            self._joint(pose, *hung) if hung else None,
            self._model(first),
            1.0 - falling / whole.mass,
        )

    def _reader(self, link: _Link) -> Links:
        file = link.context.file
        return Links(self.values, Shapes(self.values, lambda uri: self._files.find(uri, file)))

    @staticmethod
    def _model(link: _Link) -> str:
        """The model whose bodies do not collide with this link. Empty with `<self_collide>`."""
        tags = (element.find("self_collide") for element in (link.entry.model, link.element))
        collides = any(tag is not None and tag.text.strip().lower() in ("1", "true") for tag in tags)
        return "" if collides else link.model

    @staticmethod
    def _joint(world_from_body: Transform, parent: str, hinge: _Hinge) -> BodyJoint:
        body_from_world = world_from_body.inverse()
        anchor = body_from_world.apply(hinge.world_from_joint.translation)
        freedoms = tuple(
            replace(f, axis=_vector(body_from_world.rotation @ np.array(f.axis))) for f in hinge.freedoms
        )
        return BodyJoint(hinge.name, parent, _vector(anchor), freedoms, hinge.lead, hinge.element.origin)

    @staticmethod
    def _in_order(bodies: list[Body]) -> list[Body]:
        """The bodies in their order in the file, but each after its parent."""
        waiting = {body.name: body for body in bodies}
        ordered: list[Body] = []
        for body in bodies:
            chain = []
            current: Body | None = body
            while current is not None and current.name in waiting:
                chain.append(waiting.pop(current.name))
                current = waiting.get(current.joint.parent) if current.joint else None
            ordered += reversed(chain)
        return ordered


def _reversed(freedom: Freedom) -> Freedom:
    """The freedom seen from the other end of the joint: the same angle about the opposite axis."""
    return replace(freedom, axis=_vector(-np.array(freedom.axis)))


def _text(parent: Element, tag: str) -> str:
    element = parent.find(tag)
    return element.text.strip() if element is not None else ""


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
