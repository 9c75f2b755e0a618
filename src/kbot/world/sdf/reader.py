"""From an SDF file to a World: models, includes, frames; everything wrong is told, each at its line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from kbot.kinematics.transform import Transform
from kbot.text import DescriptionError, Diagnostic, Element, KbotError, parse_xml, read_source
from kbot.world.builders import floor
from kbot.world.findings import Findings
from kbot.world.sdf.files import Files, fuel_model, model_file
from kbot.world.sdf.frames import Frames
from kbot.world.sdf.geometry import Shapes
from kbot.world.sdf.links import Links, together
from kbot.world.sdf.values import Values
from kbot.world.world import Body, Part, World

DEEPEST = 20
OUR_OWN = frozenset(
    f"{maker}-{name}-system{ending}"
    for maker in ("gz-sim", "ignition-gazebo")
    for name in ("physics", "user-commands", "scene-broadcaster", "sensors", "contact", "imu")
    for ending in ("", ".so")
)
"""Plugins that are Gazebo itself: what they do, the simulation does."""

NOT_SIMULATED = ("actor", "road", "population", "plugin", "light", "gripper", "wind", "audio")


def read_sdf(path: str) -> World:
    """The world of an SDF file; a file of one model becomes a floor with that model on it.

    Raises:
        DescriptionError: the file cannot be used; it carries every finding.
    """
    findings = Findings()
    world = _Reader(findings).world(path)
    findings.require()
    return World(world.name, world.bodies, world.gravity, tuple(findings.diagnostics))


@dataclass(frozen=True, slots=True)
class _Context:
    """The file that is read, and those that include it."""

    file: str
    files: tuple[str, ...]
    static: bool = False
    prefix: str = ""


class _Reader:
    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.values = Values(findings)
        self.files = Files(self.values)
        self.names: set[str] = set()

    def world(self, path: str) -> World:
        root = parse_xml(read_source(path))
        if root.tag not in ("sdf", "gazebo"):
            raise DescriptionError(self._no_sdf(root))
        context = _Context(path, (str(Path(path).absolute()),))
        element = root.find("world")
        if element is None:
            models = list(root.elements("model"))
            if not models:
                raise DescriptionError(self._no_sdf(root))
            bodies = [floor(), *self._models(root, Frames("world", self.values), context)]
            return World(models[0].attributes.get("name", "model"), tuple(bodies))
        for other in list(root.elements("world"))[1:]:
            self.values.unsupported(other, "of several worlds in a file the first is taken")
        gravity = element.find("gravity")
        pull = self.values.numbers(gravity, 3) if gravity is not None else None
        bodies = self._models(element, Frames("world", self.values), context)
        falling = (pull[0], pull[1], pull[2]) if pull else (0.0, 0.0, -9.81)
        return World(element.attributes.get("name", "world"), tuple(bodies), falling)

    def _no_sdf(self, root: Element) -> tuple[Diagnostic, ...]:
        self.findings.error(
            "W201", f"<{root.tag}> holds no SDF world or model", root.origin,
            "an SDF file is <sdf version='1.7'> with a <world> or a <model> in it",
        )  # fmt: skip
        return tuple(self.findings.diagnostics)

    def _models(self, parent: Element, frames: Frames, context: _Context) -> list[Body]:
        """The bodies of the models and includes directly within a world, in the world's frame."""
        entries = list(self._entries(parent, context))
        for element in parent.elements("frame"):
            frames.add(
                element.attributes.get("name", ""), element, element.attributes.get("attached_to") or "world"
            )
        for entry in entries:
            frames.add(entry.name, entry.placed_by, "world", entry.pose, entry.offset)
            frames.nested[entry.name] = entry.frames
        self._say_what_is_left_out(parent)
        return [
            body
            for entry in entries
            for body in self._bodies(entry, frames.pose(entry.name, entry.placed_by))
        ]

    def _entries(self, parent: Element, context: _Context) -> Iterator[_Entry]:
        """The models and includes within a world or model."""
        for element in parent.elements():
            if element.tag == "model":
                yield self._entry(element, element, None, context)
            elif element.tag == "include":
                entry = self._include(element, context)
                if entry is not None:
                    yield entry

    def _include(self, include: Element, context: _Context) -> _Entry | None:
        uri = include.find("uri")
        if uri is None:
            self.findings.error("W205", "<include> has no <uri>", include.origin)
            return None
        if _is_light(uri.text.strip()):
            return None
        found = self.files.find(uri, context.file)
        if found is None:
            return None
        try:
            file = model_file(found)
            root = parse_xml(read_source(file))
        except DescriptionError as error:
            self.findings.diagnostics.extend(error.diagnostics)
            return None
        except KbotError as error:
            self.findings.error("W202", str(error), uri.origin)
            return None
        absolute = str(Path(file).absolute())
        if absolute in context.files or len(context.files) > DEEPEST:
            ring = " -> ".join(Path(f).parent.name + "/" + Path(f).name for f in (*context.files, absolute))
            self.findings.error("W203", f"includes go round in a ring: {ring}", include.origin)
            return None
        model = root.find("model")
        if model is None:
            if root.find("light") is None:
                self.findings.error("W201", f"{file} has no <model>", include.origin)
            return None
        inner = _Context(file, (*context.files, absolute), context.static, context.prefix)
        return self._entry(model, include, include, inner)

    def _entry(
        self, model: Element, placed_by: Element, include: Element | None, context: _Context
    ) -> _Entry:
        name = model.attributes.get("name", "")
        static = context.static or self.values.truth(model, "static", default=False)
        pose = model.find("pose")
        placement = model.attributes.get("placement_frame", "")
        if include is not None:
            said = include.find("name")
            name = said.text.strip() if said is not None else name
            static = self.values.truth(include, "static", static) or context.static
            pose = include.find("pose") or pose
            frame = include.find("placement_frame")
            placement = frame.text.strip() if frame is not None else placement
        if not name:
            self.findings.error("W205", f"<{model.tag}> has no name", placed_by.origin)
            name = f"unnamed_{len(self.names)}"
        self.names.add(context.prefix + name)
        inner = _Context(context.file, context.files, static, f"{context.prefix}{name}::")
        frames = Frames("__model__", self.values)
        nested = list(self._entries(model, inner))
        self._add_frames(model, frames, nested)
        offset = frames.pose(placement, placed_by).inverse() if placement else Transform.identity()
        self._say_what_is_left_out(model)
        return _Entry(name, model, placed_by, pose, offset, frames, nested, inner)

    def _add_frames(self, model: Element, frames: Frames, nested: list[_Entry]) -> None:
        for link in model.elements("link"):
            frames.add(link.attributes.get("name", ""), link, "__model__")
        for entry in nested:
            frames.add(entry.name, entry.placed_by, "__model__", entry.pose, entry.offset)
            frames.nested[entry.name] = entry.frames
        for joint in model.elements("joint"):
            child = joint.find("child")
            frames.add(
                joint.attributes.get("name", ""), joint, child.text.strip() if child is not None else ""
            )
        for frame in model.elements("frame"):
            default = frame.attributes.get("attached_to") or "__model__"
            frames.add(frame.attributes.get("name", ""), frame, default)

    def _bodies(self, entry: _Entry, world_from_model: Transform) -> Iterator[Body]:
        """A model's own bodies and those of the models within it."""
        file = entry.context.file
        links = Links(self.values, Shapes(self.values, lambda uri: self.files.find(uri, file, needed=False)))
        for group in self._groups(entry):
            yield from self._body(entry, group, links, world_from_model)
        for inner in entry.nested:
            pose = entry.frames.pose(inner.name, inner.placed_by)
            yield from self._bodies(inner, world_from_model @ pose)

    def _body(
        self, entry: _Entry, group: list[Element], links: Links, world_from_model: Transform
    ) -> Iterator[Body]:
        """Links that move as one, in the frame of the first."""
        first = entry.frames.pose(group[0].attributes.get("name", ""), group[0])
        parts: list[Part] = []
        masses = []
        for link in group:
            model_from_link = entry.frames.pose(link.attributes.get("name", ""), link)
            first_from_link = first.inverse() @ model_from_link
            for part in links.parts(link, entry.frames, world_from_model @ model_from_link):
                parts.append(_moved(part, first_from_link))
            if not entry.context.static:
                masses.append(links.mass(link).seen_from(first_from_link))
        name = entry.context.prefix.removesuffix("::")
        if group is not entry.groups[0]:
            name += "::" + group[0].attributes.get("name", "")
        pose = world_from_model @ first
        if entry.context.static:
            yield Body(name, tuple(parts), pose, origin=entry.placed_by.origin)
            return
        whole = together(masses)
        t, (x, y, z) = whole.tensor, whole.centre.tolist()
        inertia = (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2])
        yield Body(name, tuple(parts), pose, whole.mass, (x, y, z), inertia, origin=entry.placed_by.origin)

    def _groups(self, entry: _Entry) -> list[list[Element]]:
        """Links by what moves as one: joints hold the links of a model together."""
        links = {link.attributes.get("name", ""): link for link in entry.model.elements("link")}
        head = {name: name for name in links}

        def top(name: str) -> str:
            while head[name] != name:
                name = head[name]
            return name

        for joint in entry.model.elements("joint"):
            ends = [e.text.strip() for tag in ("parent", "child") if (e := joint.find(tag)) is not None]
            if joint.attributes.get("type") != "fixed" and not entry.context.static:
                self.values.unsupported(
                    joint, "joints of a world's models do not move: they are held as they stand"
                )
            known = [name for name in ends if name in head]
            if len(known) == 2:
                head[top(known[1])] = top(known[0])
        groups: dict[str, list[Element]] = {}
        for name, link in links.items():
            groups.setdefault(top(name), []).append(link)
        entry.groups.extend(groups.values())
        return entry.groups

    def _say_what_is_left_out(self, parent: Element) -> None:
        for element in parent.elements():
            if element.tag == "plugin":
                if element.attributes.get("filename", "").removeprefix("lib") in OUR_OWN:
                    continue
                name = element.attributes.get("filename") or element.attributes.get("name", "")
                self.values.unsupported(element, f"the plugin {name} is not run")
            elif element.tag in NOT_SIMULATED and element.tag != "light":
                self.values.unsupported(element, f"<{element.tag}> is left out")


@dataclass(frozen=True, slots=True)
class _Entry:
    """A model as it stands in a world or in another model."""

    name: str
    model: Element
    placed_by: Element
    pose: Element | None
    offset: Transform
    frames: Frames
    nested: list[_Entry]
    context: _Context
    groups: list[list[Element]] = field(default_factory=list)


def _is_light(uri: str) -> bool:
    """Whether an include is only of light: the page has its own."""
    model = fuel_model(uri)
    return uri in ("model://sun", "model://sky") or (model is not None and model[1].lower() in ("sun", "sky"))


def _moved(part: Part, outer_from_inner: Transform) -> Part:
    return replace(part, pose=outer_from_inner @ part.pose)
