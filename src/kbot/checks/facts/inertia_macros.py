"""Finds macros that write the inertial of a solid body, by calling them with known sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations
from typing import Literal

from kbot.text import Element
from kbot.xacro import expand_text
from kbot.xacro.macros import Macro, MacroTable

Kind = Literal["box", "cylinder", "sphere"]
Moments = tuple[float, float, float]

_MASS = 0.7
_SIZES = (0.3, 0.5, 0.2)
"""Test values, kg and m. They differ from each other, so that the moments show which parameter is which."""
_TOLERANCE = 1e-3
_ROBOT = '<robot name="probe" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
_POSE = '<origin xyz="0 0 0" rpy="0 0 0"/>'


@dataclass(frozen=True, slots=True)
class InertiaMacro:
    """A macro that writes an inertial, and the meaning of its parameters.

    `sizes` names the edges along x, y, z of a box, radius and length of a cylinder along z, or the radius of
    a sphere. `xyz` and `rpy` name the parameters that place the inertial, and `block` the one that takes its
    `<origin>`. Each is empty if the macro has no such parameter.
    """

    name: str
    kind: Kind
    mass: str
    sizes: tuple[str, ...]
    xyz: str = ""
    rpy: str = ""
    block: str = ""


def find_macros(table: MacroTable | None) -> Iterator[InertiaMacro]:
    """The inertia macros among the top-level macros of a description."""
    for entry in table.own.values() if table is not None else ():
        found = known_macro(entry) if isinstance(entry, Macro) else None
        if found is not None:
            yield found


def known_macro(macro: Macro) -> InertiaMacro | None:
    """Recognise an inertia macro. None if the macro does anything else than write the inertial of a solid
    body."""
    if "<inertial" not in macro.body.whole.text:
        return None
    needed = tuple(p.name for p in macro.parameters if not p.is_optional and not p.is_block)
    blocks = tuple(p.name.lstrip("*") for p in macro.parameters if p.is_block)
    optional = tuple(p.name for p in macro.parameters if p.is_optional and not p.is_block)
    return _probed(macro.name, macro.body.whole.text, needed, blocks, optional)


@lru_cache(maxsize=256)
def _probed(
    name: str, text: str, needed: tuple[str, ...], blocks: tuple[str, ...], optional: tuple[str, ...]
) -> InertiaMacro | None:
    """Call the macro with known sizes and compare the moments with those of each solid."""
    if not 2 <= len(needed) <= 4 or len(blocks) > 1:
        return None
    block = _POSE if blocks else ""
    for mass in needed:
        sizes = [n for n in needed if n != mass]
        given = {n: str(v) for n, v in {mass: _MASS, **dict(zip(sizes, _SIZES, strict=False))}.items()}
        made = _called(text, name, given, block)
        if made is None or made.find("mass") is None or _pose(made, "xyz") or _pose(made, "rpy"):
            continue
        if not math.isclose(_number(made.find("mass"), "value"), _MASS, rel_tol=_TOLERANCE):
            continue
        fit = _fit(made, sizes)
        if fit is not None:
            kind, order = fit
            xyz, rpy = (_placing(text, name, given, block, optional, what) for what in ("xyz", "rpy"))
            return InertiaMacro(name, kind, mass, order, xyz, rpy, blocks[0] if blocks else "")
    return None


def _called(text: str, name: str, given: Mapping[str, str], block: str) -> Element | None:
    """The inertial that a call expands to. None if it expands to anything else."""
    values = " ".join(f'{key}="{value}"' for key, value in given.items())
    call = f"<xacro:{name} {values}>{block}</xacro:{name}>"
    result = expand_text(_ROBOT.format(text + call), "the tested inertia macro")
    made = list(result.document.elements()) if result.ok and result.document is not None else []
    return made[0] if len(made) == 1 and made[0].tag == "inertial" else None


def _fit(made: Element, sizes: list[str]) -> tuple[Kind, tuple[str, ...]] | None:
    """The kind of solid whose moments an inertial has, and the size parameters in order."""
    inertia = made.find("inertia")
    own = tuple(_number(inertia, name) for name in ("ixx", "iyy", "izz"))
    if any(_number(inertia, name) != 0.0 for name in ("ixy", "ixz", "iyz")):
        return None
    kind: Kind = "sphere" if len(sizes) == 1 else "cylinder" if len(sizes) == 2 else "box"
    known = dict(zip(sizes, _SIZES, strict=False))
    for order in permutations(sizes):
        due = moments(kind, _MASS, [known[name] for name in order])
        if all(math.isclose(a, b, rel_tol=_TOLERANCE) for a, b in zip(own, due, strict=True)):
            return kind, order
    return None


def moments(kind: Kind, mass: float, sizes: list[float]) -> Moments:
    """Principal moments of a solid body of uniform density, kg m^2."""
    if kind == "sphere":
        moment = 0.4 * mass * sizes[0] ** 2
        return moment, moment, moment
    if kind == "cylinder":
        across = mass * (3.0 * sizes[0] ** 2 + sizes[1] ** 2) / 12.0
        return across, across, mass * sizes[0] ** 2 / 2.0
    x, y, z = (size * size * mass / 12.0 for size in sizes)
    return y + z, x + z, x + y


def _placing(
    text: str, name: str, given: Mapping[str, str], block: str, optional: tuple[str, ...], what: str
) -> str:
    """The optional parameter that sets the inertial's `xyz` or `rpy`. Empty if there is none."""
    for parameter in optional:
        made = _called(text, name, {**given, parameter: "0.1 0.2 0.3"}, block)
        if made is not None and _pose(made, what) == "0.1 0.2 0.3":
            return parameter
    return ""


def _pose(inertial: Element, name: str) -> str:
    """The text of the inertial's `xyz` or `rpy`. Empty if all its numbers are zero."""
    origin = inertial.find("origin")
    value = origin.attributes.get(name, "").strip() if origin is not None else ""
    return "" if all(word.strip("-+0.") == "" for word in value.split()) else value


def _number(element: Element | None, name: str) -> float:
    try:
        return float(element.attributes.get(name, "nan")) if element is not None else math.nan
    except ValueError:
        return math.nan
