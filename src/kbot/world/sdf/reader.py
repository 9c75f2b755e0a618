"""Reads an SDF file as a World: models, includes and frames. Errors are reported at their line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from kbot.kinematics.spatial import GRAVITY
from kbot.kinematics.transform import Transform
from kbot.text import DescriptionError, Diagnostic, DiagnosticCollector, Element, KbotError, Severity
from kbot.text.diagnostic import one_per_cause
from kbot.world.builders import floor
from kbot.world.georeference import Georeference
from kbot.world.sdf.articulation import Articulation
from kbot.world.sdf.entries import ModelEntry, SdfContext
from kbot.world.sdf.frames import Frames
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.resources import WHOLE, ResourceFinder, fuel_model, read_xml
from kbot.world.sdf.values import STRONGEST_PULL, SdfValues
from kbot.world.world import World


def georeference(world: Element, values: SdfValues) -> Georeference | None:
    """Read `<spherical_coordinates>`. None if it is missing or not valid."""
    element = world.find("spherical_coordinates")
    if element is None:
        return None
    for tag, usual in (("surface_model", "EARTH_WGS84"), ("world_frame_orientation", "ENU")):
        child = element.find(tag)
        if child is not None and child.text.strip() != usual:
            values.unsupported(child, f"KBot uses {usual} for <{tag}>")
    latitude = values.number(element, "latitude_deg", 0.0)
    longitude = values.number(element, "longitude_deg", 0.0)
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        values.fault(
            "W204",
            "the latitude must be from -90 to 90 and the longitude from -180 to 180 degrees,"
            f" not {latitude:g} and {longitude:g}",
            element.origin,
            f"ignores <{element.tag}>",
        )
        return None
    heading = math.radians(values.number(element, "heading_deg", 0.0))
    return Georeference(latitude, longitude, values.number(element, "elevation", 0.0), heading)


DEEPEST = 20
"""Most files that include each other."""
MOST_LINKS = 10_000
"""Most links of a world: a few nested includes can place millions. The engine needs 1 s for as many static
links, and its memory holds about 4000 moving ones."""
MOST_COLLISIONS = 20_000
"""Most collisions of a world: as many as walls of a map. The engine needs a millisecond for each."""
OUR_OWN = frozenset(
    f"{maker}-{name}-system{ending}"
    for maker in ("gz-sim", "ignition-gazebo")
    for name in ("physics", "user-commands", "scene-broadcaster", "sensors", "contact", "imu")
    for ending in ("", ".so")
)
"""Plugins that implement Gazebo itself. KBot simulates what they do."""

NOT_SIMULATED = ("actor", "road", "population", "plugin", "light", "gripper", "wind", "audio")


def read_sdf(path: str, with_floor: bool = True, reach: Reach | None = None) -> World:
    """Read the world of an SDF file. A file of one model becomes a world with a floor and that model.

    What is wrong in a model is repaired or left out, with a warning. With a `reach`, the file may name only
    files within it, and every such fault is an error.

    Raises:
        DescriptionError: the file cannot be used. It carries every finding.
        KbotError: the world is too large.
    """
    findings = DiagnosticCollector()
    world = _Reader(findings, reach).world(path, with_floor)
    findings.diagnostics = list(one_per_cause(findings.diagnostics))
    findings.require()
    return replace(world, diagnostics=tuple(findings.diagnostics))


class _Unusable(Exception):
    """An included model cannot be used."""


class _Reader:
    def __init__(self, findings: DiagnosticCollector, reach: Reach | None) -> None:
        self.findings = findings
        self.values = SdfValues(findings, is_strict=reach is not None)
        self.files = ResourceFinder(self.values, reach)
        self._links = self._collisions = 0

    def world(self, path: str, with_floor: bool) -> World:
        root = read_xml(path, self.findings)
        if root.tag not in ("sdf", "gazebo"):
            raise DescriptionError(self._not_sdf(root))
        context = SdfContext(path, (str(Path(path).absolute()),), _version(root))
        element = root.find("world")
        if element is None:
            first = next((e for e in root.elements() if e.tag in ("model", "actor", "light")), None)
            if first is None:
                raise DescriptionError(self._not_sdf(root))
            built = self._models(root, context)
            name = first.attributes.get("name", "model")
            ground = (floor(),) if with_floor else ()
            return World(name, (*ground, *built.bodies), loops=tuple(built.loops))
        for other in list(root.elements("world"))[1:]:
            self.values.unsupported(other, "only the first world of a file is used")
        gravity = element.find("gravity")
        otherwise = f"uses 0 0 {-GRAVITY:g}"
        pull = self.values.numbers(gravity, 3, STRONGEST_PULL, otherwise) if gravity is not None else None
        for physics in element.elements("physics"):
            self.values.require_positive(physics.find("max_step_size"))
        built = self._models(element, context)
        falling = (pull[0], pull[1], pull[2]) if pull else (0.0, 0.0, -GRAVITY)
        name = element.attributes.get("name", "world")
        place = georeference(element, self.values)
        return World(
            name,
            tuple(built.bodies),
            falling,
            loops=tuple(built.loops),
            georeference=place,
            origin=element.origin,
        )

    def _not_sdf(self, root: Element) -> tuple[Diagnostic, ...]:
        self.findings.error(
            "W201", f"<{root.tag}> contains no SDF world or model", root.origin,
            "an SDF file must be <sdf version='1.7'> with a <world> or a <model>",
        )  # fmt: skip
        return tuple(self.findings.diagnostics)

    def _models(self, parent: Element, context: SdfContext) -> Articulation:
        """The bodies of the models and includes of a world, in the world's frame."""
        frames = Frames("world", self.values, renames=True)
        entries = list(self._entries(parent, context, frames))
        for entry in entries:
            frames.add(entry.name, entry.placed_by, "world", entry.pose, entry.offset)
            frames.nested[entry.name] = entry.frames
        for element in parent.elements("frame"):
            attached = element.attributes.get("attached_to") or "world"
            frames.add(element.attributes.get("name", ""), element, attached, attached_to=attached)
        for joint in parent.elements("joint"):
            frames.add_joint(joint)
        self._report_unsupported(parent)
        return Articulation(self.values, self.files, entries, frames, parent, context)

    def _entries(self, parent: Element, context: SdfContext, frames: Frames) -> Iterator[ModelEntry]:
        """The models and includes of a world or model with these frames."""
        taken = {link.attributes.get("name", "") for link in parent.elements("link")}
        for element in parent.elements():
            if element.tag == "model":
                yield self._entry(element, element, None, context, taken)
            elif element.tag == "include":
                try:
                    entry = self._include(element, context, taken)
                except _Unusable:
                    self._leave_out(element, frames, taken)
                    continue
                if entry is not None:
                    yield entry

    def _include(self, include: Element, context: SdfContext, taken: set[str]) -> ModelEntry | None:
        """The included model. None for what is not a model.

        Raises:
            _Unusable: the model is left out. The reason is reported.
        """
        uri = include.find("uri")
        if uri is None:
            raise self._unusable("W205", "<include> has no <uri>", include)
        if _is_light(uri.text.strip()):
            return None
        found = self.files.find(uri, context.file)
        if found is None:
            raise _Unusable
        try:
            file, root = self.files.model(found)
        except DescriptionError as error:
            errors = error.diagnostics
            if not self.values.is_strict:
                errors = tuple(replace(d, severity=Severity.WARNING) for d in errors)
            self.findings.diagnostics += errors
            raise _Unusable from None
        except KbotError as error:
            raise self._unusable("W202", str(error), uri) from None
        absolute = str(Path(file).absolute())
        if absolute in context.files or len(context.files) > DEEPEST:
            ring = " -> ".join(Path(f).parent.name + "/" + Path(f).name for f in (*context.files, absolute))
            raise self._unusable("W203", f"files include each other in a cycle: {ring}", include)
        model = root.find("model")
        if model is None:
            if root.find("actor") is not None:
                self.values.unsupported(include, "<actor> is not simulated")
            elif root.find("light") is None:
                raise self._unusable("W201", f"{file} has no <model>", include)
            return None
        inner = replace(context, file=file, files=(*context.files, absolute), version=_version(root))
        return self._entry(model, include, include, inner, taken)

    def _unusable(self, code: str, message: str, element: Element) -> _Unusable:
        self.values.fault(code, message, element.origin, "leaves the model out")
        return _Unusable()

    def _leave_out(self, include: Element, frames: Frames, taken: set[str]) -> None:
        """Leave out a model that cannot be used. Poses can be relative to it if the include has its name."""
        frames.is_incomplete = True
        name = include.find("name")
        if name is not None and name.text.strip():
            known = self.values.distinct(name.text.strip(), taken, include)
            taken.add(known)
            frames.add(known, include, frames.root)

    def _entry(
        self,
        model: Element,
        placed_by: Element,
        include: Element | None,
        context: SdfContext,
        taken: set[str],
    ) -> ModelEntry:
        """A model with everything in it. `taken` are the names of what is beside it."""
        self._links += sum(1 for _ in model.elements("link"))
        if self._links > MOST_LINKS:
            raise KbotError(f"{placed_by.origin}: the world has more than {MOST_LINKS} links")
        self._collisions += sum(1 for link in model.elements("link") for _ in link.elements("collision"))
        if self._collisions > MOST_COLLISIONS:
            raise KbotError(f"{placed_by.origin}: the world has more than {MOST_COLLISIONS} collisions")
        name = model.attributes.get("name", "")
        static = context.static or self.values.truth(model, "static", default=False)
        pose = model.find("pose")
        placement = model.attributes.get("placement_frame", "")
        if include is not None:
            own_name = include.find("name")
            name = own_name.text.strip() if own_name is not None else name
            static = self.values.truth(include, "static", static) or context.static
            pose = include.find("pose") or pose
            frame = include.find("placement_frame")
            placement = frame.text.strip() if frame is not None else placement
        name = self.values.distinct(name, taken, placed_by)
        taken.add(name)
        merges = include is not None and include.attributes.get("merge") in ("1", "true")
        prefix = context.prefix if merges and context.prefix else f"{context.prefix}{name}::"
        inner = replace(context, static=static, prefix=prefix)
        frames = Frames("__model__", self.values, renames=context.version < (1, 7))
        nested: list[ModelEntry] = []
        to_merge: list[ModelEntry] = []
        for entry in self._entries(model, inner, frames):
            (to_merge if entry.context.prefix == prefix else nested).append(entry)
        self._add_frames(model, frames, nested)
        merged: list[tuple[Element, SdfContext]] = []
        for entry in to_merge:
            merged += self._merge(entry, frames)
            nested += entry.nested
        offset = frames.pose(placement, placed_by).inverse() if placement else Transform.identity()
        self._report_unsupported(model)
        return ModelEntry(name, model, placed_by, pose, offset, frames, nested, inner, merged)

    @staticmethod
    def _merge(entry: ModelEntry, frames: Frames) -> list[tuple[Element, SdfContext]]:
        """Merge a model into the model around it. Returns the merged models with their contexts."""
        proxy = f"_merged__{entry.name}__model__"
        frames.add(proxy, entry.placed_by, "__model__", entry.pose, entry.offset, entry.frames.canonical)
        frames.merge(entry.frames, proxy)
        return [(entry.model, entry.context), *entry.merged]

    def _add_frames(self, model: Element, frames: Frames, nested: list[ModelEntry]) -> None:
        for link in model.elements("link"):
            frames.add(link.attributes.get("name", ""), link, "__model__")
            frames.canonical = frames.canonical or frames.key(link)
        frames.canonical = model.attributes.get("canonical_link", frames.canonical)
        for entry in nested:
            frames.add(entry.name, entry.placed_by, "__model__", entry.pose, entry.offset)
            frames.nested[entry.name] = entry.frames
            frames.canonical = frames.canonical or f"{entry.name}::{entry.frames.canonical}"
        for joint in model.elements("joint"):
            frames.add_joint(joint)
        for frame in model.elements("frame"):
            attached = frame.attributes.get("attached_to") or "__model__"
            frames.add(frame.attributes.get("name", ""), frame, attached, attached_to=attached)

    def _report_unsupported(self, parent: Element) -> None:
        for element in parent.elements():
            if element.tag == "plugin":
                if element.attributes.get("filename", "").removeprefix("lib") in OUR_OWN:
                    continue
                name = element.attributes.get("filename") or element.attributes.get("name", "")
                self.values.unsupported(element, f"KBot does not run the plugin {name}")
            elif element.tag in NOT_SIMULATED and element.tag != "light":
                self.values.unsupported(element, f"<{element.tag}> is not simulated")


def _is_light(uri: str) -> bool:
    """Whether an include is only a light: the page has its own lights."""
    return uri in ("model://sun", "model://sky") or (fuel_model(uri) or "").lower() in ("sun", "sky")


def _version(root: Element) -> tuple[int, ...]:
    """The version of an `<sdf>`. If it cannot be read, the newest."""
    words = root.attributes.get("version", "").split(".")
    return tuple(map(int, words)) if all(map(WHOLE.fullmatch, words)) else (1, 11)
