"""Reads numbers, poses and booleans of SDF elements. Invalid ones are reported at their line."""

from __future__ import annotations

from collections.abc import Container
from math import inf, isfinite, radians

from kbot.kinematics.inertia_repair import Report
from kbot.kinematics.transform import Transform
from kbot.text import DiagnosticCollector, Element, Origin
from kbot.text.numbers import to_float
from kbot.world.world import FURTHEST

STRONGEST_PULL = 1e4
"""Strongest gravity in m/s^2: about 1000 times the earth's."""
_NO_OFFSET = "uses 0 0 0 0 0 0"


class SdfValues:
    """Reads values and collects findings about them.

    KBot repairs a fault or leaves the part out, with a warning, so that the rest of the world can be used.
    With `is_strict`, a fault is an error, because a program that spawns a single model must know that the
    model is unusable.
    """

    def __init__(self, findings: DiagnosticCollector, is_strict: bool = False) -> None:
        self.findings = findings
        self.is_strict = is_strict
        self._reported: set[str] = set()
        self._next: dict[tuple[int, str], tuple[Container[str], int]] = {}
        """The next number of a name by the identity of its container, and the container: while it is kept, no
        other one gets its identity."""

    def fault(self, code: str, message: str, origin: Origin, otherwise: str, hint: str = "") -> None:
        """Report a fault. `otherwise` is what KBot does instead: "uses 1 kg", "leaves the joint out"."""
        if self.is_strict:
            self.findings.error(code, message, origin, hint, message)
        else:
            stop = "" if not hint else " " if hint.endswith("?") else ". "
            self.findings.warning(code, message, origin, f"{hint}{stop}KBot {otherwise}", message)

    def fault_at(self, origin: Origin) -> Report:
        """A function that reports repairs of an inertia tensor at this place."""
        return lambda code, problem, instead, hint: self.fault(code, problem, origin, instead, hint)

    def numbers(
        self, element: Element, count: int, most: float = inf, otherwise: str = "ignores the value"
    ) -> tuple[float, ...] | None:
        """`count` finite numbers from `-most` to `most`. Other values are reported and give None."""
        words = element.text.split()
        try:
            values = tuple(to_float(word) for word in words)
        except ValueError:
            values = ()
        finite = len(values) == count and all(isfinite(value) for value in values)
        if finite and all(abs(value) <= most for value in values):
            return values
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        if finite:
            what += f" up to {most:g}"
        text = element.text.strip()
        self.fault("W204", f"<{element.tag}> must be {what}, not '{text}'", element.origin, otherwise)
        return None

    def number(self, parent: Element | None, tag: str, default: float, most: float = inf) -> float:
        element = parent.find(tag) if parent is not None else None
        if element is None:
            return default
        values = self.numbers(element, 1, most, f"uses {default:g}")
        return values[0] if values else default

    def require_positive(self, element: Element | None) -> None:
        """Warn if a number that KBot does not use is not above 0."""
        values = self.numbers(element, 1) if element is not None else None
        if element is not None and values is not None and values[0] <= 0.0:
            message = f"<{element.tag}> must be above 0, not {values[0]:g}"
            self.findings.warning("W204", message, element.origin, "KBot ignores the value")

    def truth(self, parent: Element, tag: str, default: bool) -> bool:
        element = parent.find(tag)
        if element is None:
            return default
        word = element.text.strip().lower()
        if word in ("1", "true", "0", "false"):
            return word in ("1", "true")
        message = f"<{tag}> must be true or false, not '{word}'"
        self.fault("W204", message, element.origin, f"uses {str(default).lower()}")
        return default

    def sizes(
        self,
        element: Element,
        shape: Element,
        tag: str,
        count: int,
        most: float = FURTHEST,
        otherwise: str = "leaves the shape out",
    ) -> tuple[float, ...] | None:
        """`count` numbers above 0, in m, of a shape's child. Other values are reported and give None."""
        values = self.numbers(element, count, most, otherwise)
        if values is not None and any(value <= 0.0 for value in values):
            message = f"<{tag}> of a <{shape.tag}> must be above 0, not '{element.text.strip()}'"
            self.fault("W204", message, element.origin, otherwise)
            return None
        return values

    def pose(self, element: Element | None) -> Transform:
        """A pose `x y z roll pitch yaw`, or with `rotation_format` a quaternion. Empty is the identity.

        With three to five numbers it has no rotation, with a warning. libsdformat 12 rejects these, but the
        older one of Gazebo Classic reads a stream of numbers, and sets a rotation only from three angles.
        """
        if element is None or not element.text.strip():
            return Transform.identity()
        if element.attributes.get("rotation_format") == "quat_xyzw":
            values = self.numbers(element, 7, FURTHEST, _NO_OFFSET)
            if values is None or not any(values[3:]):
                return Transform.identity()
            return Transform.from_quaternion_xyzw(values[3:], values[:3])
        count = len(element.text.split())
        values = self.numbers(element, count if 3 <= count < 6 else 6, FURTHEST, _NO_OFFSET)
        if values is None:
            return Transform.identity()
        if count < 6:
            message = f"<{element.tag}> has {count} of 6 numbers: KBot uses the position without a rotation"
            self.findings.warning("W204", message, element.origin, "write x y z roll pitch yaw")
            return Transform.from_xyz_rpy(values[:3], (0.0, 0.0, 0.0))
        turn = values[3:]
        if element.attributes.get("degrees") in ("1", "true"):
            turn = tuple(radians(angle) for angle in turn)
        return Transform.from_xyz_rpy(values[:3], turn)

    def distinct(self, name: str, taken: Container[str], element: Element) -> str:
        """The name of an element. If it is taken or empty, the first free name with a number, and a
        finding."""
        if name and name not in taken:
            return name
        key, stem = (id(taken), name), name or "unnamed"
        # of thousands, not each must try all numbers
        _, number = self._next.get(key, (taken, 2 if name else 1))
        while (free := f"{stem}_{number}") in taken:
            number += 1
        self._next[key] = (taken, number + 1)
        message = f"duplicate name '{name}'" if name else f"<{element.tag}> has no name"
        self.fault("W208" if name else "W205", message, element.origin, f"calls it '{free}'")
        return free

    def unsupported(self, element: Element, what: str, once: bool = True) -> None:
        """Report that something is not simulated. With `once`, equal messages are reported once."""
        if once and what in self._reported:
            return
        self._reported.add(what)
        self.findings.info("W210", what, element.origin)
