"""Computes the poses of the named frames of a model or world from `relative_to` and `attached_to`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from kbot.kinematics.transform import Transform
from kbot.text import Element
from kbot.text.suggest import did_you_mean
from kbot.world.sdf.values import SdfValues


@dataclass(frozen=True, slots=True)
class _Frame:
    pose: Transform
    relative_to: str
    element: Element
    attached_to: str
    """The link or frame that it moves with. Empty for a link."""


@dataclass
class Frames:
    """The frames of one model (root `__model__`) or world (root `world`)."""

    root: str
    values: SdfValues
    renames: bool = False
    """Whether a joint or frame may share a name with another element, as until SDF 1.6."""
    nested: dict[str, Frames] = field(default_factory=dict)
    canonical: str = ""
    """The link that the model's own frame moves with."""
    is_incomplete: bool = False
    """Whether an include is not found. Then an unknown name may be one of the included model."""
    _frames: dict[str, _Frame] = field(default_factory=dict)
    _keys: dict[int, str] = field(default_factory=dict)
    _found: dict[str, Transform] = field(default_factory=dict)
    """Computed values of `root_from_frame`."""

    def add(
        self,
        name: str,
        element: Element,
        default: str,
        pose: Element | None = None,
        offset: Transform | None = None,
        attached_to: str = "",
    ) -> None:
        """Add a frame with the element's `<pose>` (or `pose`), relative to its `relative_to` or to `default`.

        If the pose is that of another frame (a `placement_frame`), `offset` is the transform from that frame
        to this one. A frame that is not a link moves with what it is `attached_to`.
        """
        if name in self._frames and attached_to and self.renames:
            name = f"{name}_{element.tag}"
        name = self.values.distinct(name, self._frames, element)
        self._keys[id(element)] = name
        written = pose if pose is not None else element.find("pose")
        relative = (written.attributes.get("relative_to", "") if written is not None else "") or default
        place = self.values.pose(written)
        self._frames[name] = _Frame(place @ offset if offset else place, relative, element, attached_to)

    def add_joint(self, joint: Element) -> None:
        """Add the frame of a joint. Its pose is relative to the child by default."""
        child = joint.find("child")
        name = child.text.strip() if child is not None else ""
        self.add(joint.attributes.get("name", ""), joint, name, attached_to=name or self.root)

    def merge(self, inner: Frames, proxy: str) -> None:
        """Add the frames of a model that is merged into this one.

        `proxy` is the frame that replaces its root.
        """
        for name, frame in inner._frames.items():
            if name in self._frames:
                message = f"duplicate name '{name}' in models that are merged"
                self.values.fault("W208", message, frame.element.origin, "leaves this element out")
                continue
            is_direct = frame.relative_to in (inner.root, "")
            self._frames[name] = replace(frame, relative_to=proxy if is_direct else frame.relative_to)
        self.nested.update(inner.nested)
        self._keys.update(inner._keys)
        self.canonical = self.canonical or inner.canonical
        self.is_incomplete = self.is_incomplete or inner.is_incomplete

    @property
    def _origin(self) -> str:
        return f"the origin of the {self.root.strip('_')}"

    def key(self, element: Element) -> str:
        """The name under which an element was added."""
        return self._keys.get(id(element), element.attributes.get("name", ""))

    def report_unknown(self, name: str, what: str, element: Element, otherwise: str) -> None:
        """Report an unknown name. KBot does `otherwise`. It may be one of a model that is not found."""
        frames, prefix = self, ""
        while (outer := name.removeprefix(prefix).partition("::")[0]) in frames.nested:
            frames, prefix = frames.nested[outer], f"{prefix}{outer}::"
        names = [prefix + known for known in frames._frames]
        defined = "a model that is not found may define it"
        hint = defined if frames.is_incomplete else did_you_mean(name, names)
        self.values.fault("W207", what, element.origin, otherwise, hint)

    def link(self, name: str) -> str | None:
        """The link that a frame moves with (`model::link` for a nested model). None for an unknown name."""
        seen: set[str] = set()
        while name not in seen:
            seen.add(name)
            if name in (self.root, ""):
                name = self.canonical
                if "::" in name:
                    return name
            outer, _, inner = name.partition("::")
            if outer in self.nested:
                found = self.nested[outer].link(inner)
                return None if found is None else f"{outer}::{found}"
            frame = self._frames.get(name)
            if frame is None or not frame.attached_to:
                return None if frame is None else name
            name = frame.attached_to
        return None

    def pose(self, name: str, element: Element) -> Transform:
        """`root_from_name`. An unknown frame, or a cycle of frames, is reported at `element`."""
        way: dict[str, Transform] = {}
        """The frames from `name` towards the root, each with its pose in the next."""
        while name not in (self.root, "", "world") and name not in self._found:
            if name in way:
                ring = " -> ".join((*way, name))
                message = f"frames are relative to each other in a cycle: {ring}"
                self.values.fault("W207", message, element.origin, f"puts them at {self._origin}")
                self._found |= dict.fromkeys(way, Transform.identity())
                return Transform.identity()
            outer, _, inner = name.partition("::")
            frame = self._frames.get(name)
            if inner and outer in self.nested:
                way[name] = self.nested[outer].pose(inner, element)
                name = outer
            elif frame is not None:
                way[name] = frame.pose
                name, element = frame.relative_to, frame.element
            else:
                what = f"unknown frame '{name}'"
                self.report_unknown(name, what, element, f"uses {self._origin}")
                break
        root_from_frame = self._found.get(name, Transform.identity())
        for step, next_from_step in reversed(way.items()):
            root_from_frame = self._found[step] = root_from_frame @ next_from_step
        return root_from_frame
