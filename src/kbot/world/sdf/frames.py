"""Where the named frames of a model or world stand, through `relative_to` and `attached_to`."""

from __future__ import annotations

from dataclasses import dataclass, field

from kbot.kinematics.transform import Transform
from kbot.text import Element
from kbot.text.suggest import did_you_mean
from kbot.world.sdf.values import Values


@dataclass(frozen=True, slots=True)
class _Frame:
    pose: Transform
    relative_to: str
    element: Element


@dataclass
class Frames:
    """The frames of one model (root `__model__`) or world (root `world`)."""

    root: str
    values: Values
    nested: dict[str, Frames] = field(default_factory=dict)
    _frames: dict[str, _Frame] = field(default_factory=dict)

    def add(
        self,
        name: str,
        element: Element,
        default: str,
        pose: Element | None = None,
        offset: Transform | None = None,
    ) -> None:
        """Add a frame: the element's own `<pose>` (or `pose`), relative to what it says or to `default`;
        where another frame is what the pose places, `offset` leads from that one to this."""
        if name in self._frames:
            self.values.findings.error("W208", f"'{name}' comes twice", element.origin)
            return
        written = pose if pose is not None else element.find("pose")
        relative = (written.attributes.get("relative_to", "") if written is not None else "") or default
        place = self.values.pose(written)
        self._frames[name] = _Frame(place @ offset if offset else place, relative, element)

    def pose(self, name: str, element: Element) -> Transform:
        """`root_from_name`; a frame that is not there, or a ring of them, is a finding at `element`."""
        return self._pose(name, element, ())

    def _pose(self, name: str, element: Element, seen: tuple[str, ...]) -> Transform:
        if name in (self.root, "", "world"):
            return Transform.identity()
        if name in seen:
            ring = " -> ".join((*seen, name))
            self.values.findings.error(
                "W207", f"frames are relative to each other in a ring: {ring}", element.origin
            )
            return Transform.identity()
        outer, _, inner = name.partition("::")
        if inner and outer in self.nested:
            return self._pose(outer, element, (*seen, name)) @ self.nested[outer].pose(inner, element)
        frame = self._frames.get(name)
        if frame is None:
            hint = did_you_mean(name, self._frames)
            self.values.findings.error("W207", f"there is no frame '{name}'", element.origin, hint)
            return Transform.identity()
        return self._pose(frame.relative_to, frame.element, (*seen, name)) @ frame.pose
