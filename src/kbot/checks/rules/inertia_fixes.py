"""Fixes of an inertial: the right tensor as numbers, or a call of the macro that computes it.

Expressions are copied as they are written, so that a size from a property stays an expression. If a macro
made the inertial, its call is edited and never its body.

While a property is overridden, no fix writes numbers: they would be those of the caller's robot and not
those of the file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from kbot.checks.context import Context
from kbot.checks.edits import remove_element, set_attribute, set_value
from kbot.checks.facts.inertia_macros import InertiaMacro, Kind, find_macros, known_macro
from kbot.kinematics.spatial import rotation, scale_matrix, tensor_in, transpose
from kbot.model import Box, Collision, Cylinder, Inertial, Link, Sphere, Visual
from kbot.text import Call, Edit, Element, Fix
from kbot.xacro.macros import Macro

_WORDS = re.compile(r"(?:\$\{[^}]*(?:\}|\Z)|[^\s$])+")
_COMPUTED = "call the macro that computes the tensor of its shape"


def solid_hint(context: Context, link: Link, inertial: Inertial) -> str:
    """The moments of a solid of the link's shape, as a hint."""
    solid = context.bodies[link.name].solid
    if solid is None or not inertial.mass > 0.0:
        return ""
    t = [[inertial.mass * v for v in row] for row in solid.unit_tensor]
    return (
        f"a solid of its shape and mass has ixx={t[0][0]:.4g} iyy={t[1][1]:.4g} izz={t[2][2]:.4g} kg m^2 "
        "in the link's axes"
    )


def solid_fix(context: Context, link: Link, inertial: Inertial) -> Fix | None:
    """A fix that gives the link the tensor of a solid of its shape.

    It writes the sizes into the call of the inertia macro that made the inertial. If there is no such call,
    it replaces the inertial by a call of a macro that computes the tensor. If there is no such macro either,
    it replaces six plain numbers by those of the tensor."""
    solid = context.bodies[link.name].solid
    if solid is None or not inertial.mass > 0.0:
        return None
    shape = _shape_of(link)
    made = _macro_call(context, inertial)
    if made is not None:
        return _with_sizes(context, made, shape) if shape else None
    return (_as_call(context, inertial, shape) if shape else None) or _as_numbers(context, link, inertial)


def turning_fix(context: Context, link: Link, inertial: Inertial) -> Fix | None:
    """A fix that gives an inertial the rotation of the link's first shape."""
    shapes: tuple[Collision | Visual, ...] = (*link.collisions, *link.visuals)
    title = "rotate the inertial with its geometry"
    if context.expansion.overridden:
        return None
    made = _macro_call(context, inertial)
    if made is not None and (made.macro.rpy or made.macro.block):
        rpy = _angles(context, shapes[0], made.scope)
        name = made.macro.rpy or "rpy"
        element = made.element if made.macro.rpy else made.element.find("origin")
    elif inertial.pose.origin is None:
        text = f'<origin xyz="0 0 0" rpy="{_numbers(shapes[0].pose.rpy)}"/>'
        return context.insert_into(inertial.origin, text, title, safe=False)
    else:
        rpy, name = _numbers(shapes[0].pose.rpy), "rpy"
        element = context.element_at(inertial.pose.origin)
    edits = set_attribute(element, name, rpy) if element is not None else ()
    return Fix(title, edits, safe=False) if edits else None


def exchanging_fix(context: Context, inertial: Inertial, a: int, b: int) -> Fix | None:
    """A fix that swaps the values of two axes (0, 1, 2): two sizes in the call of a box macro, or two
    plain moments."""
    made = _macro_call(context, inertial)
    if made is None:
        names = ("ixx", "iyy", "izz")
        return context.exchange(inertial.inertia_origin, names[a], names[b])
    if made.macro.kind != "box":
        return None
    spans = made.element.attribute_spans()
    first, second = made.macro.sizes[a], made.macro.sizes[b]
    if first not in spans or second not in spans:
        return None
    texts = spans[first][1].text, spans[second][1].text
    edits = (*set_value(spans[first][1], texts[1]), *set_value(spans[second][1], texts[0]))
    return Fix(f"swap {first} and {second}", edits, safe=False) if edits else None


def remove_inertial(context: Context, inertial: Inertial) -> Fix | None:
    """The fix that removes an inertial, or the call of the inertia macro that made it."""
    made = _macro_call(context, inertial)
    if made is None and inertial.origin.call is not None:
        return None
    element = made.element if made is not None else context.element_at(inertial.origin)
    return remove_element(element, safe=False, title="remove the inertial") if element is not None else None


@dataclass(frozen=True, slots=True)
class _Made:
    """The call that made an inertial: its element as written, its macro, and the calls around it."""

    element: Element
    macro: InertiaMacro
    scope: Call | None


def _macro_call(context: Context, inertial: Inertial) -> _Made | None:
    """The call of the inertia macro that made an inertial, if one did."""
    call, table = inertial.origin.call, context.expansion.macros
    if call is None or call.kind != "macro" or table is None:
        return None
    macro = table.find(call.name.removeprefix("xacro:"))
    known = known_macro(macro) if isinstance(macro, Macro) else None
    element = context.call_at(call.span)
    return _Made(element, known, call.caller) if known is not None and element is not None else None


def _shape_of(link: Link) -> Collision | Visual | None:
    """The only shape of a link if it is a box, cylinder or sphere; a collision comes before a visual."""
    shapes: tuple[Collision | Visual, ...] = link.collisions or link.visuals
    return shapes[0] if len(shapes) == 1 and isinstance(shapes[0].geometry, Box | Cylinder | Sphere) else None


def _sizes(context: Context, shape: Collision | Visual, scope: Call | None) -> tuple[Kind, list[str]] | None:
    """A shape's sizes: as written if the same names are defined in `scope`, else as numbers if no property is
    overridden."""
    kind: Kind
    match shape.geometry:
        case Box(size=(x, y, z)):
            kind, names, values = "box", ["size"], [x, y, z]
        case Cylinder(radius=radius, length=length):
            kind, names, values = "cylinder", ["radius", "length"], [radius, length]
        case Sphere(radius=radius):
            kind, names, values = "sphere", ["radius"], [radius]
        case _:
            return None
    numbers = [f"{value:.10g}" for value in values]
    element = context.element_at(shape.geometry.origin)
    spans = element.attribute_spans() if element is not None and shape.geometry.origin.call == scope else {}
    texts = [word for name in names if name in spans for word in _WORDS.findall(spans[name][1].text)]
    if len(texts) == len(numbers):
        return kind, texts
    return None if context.expansion.overridden else (kind, numbers)


def _angles(context: Context, shape: Collision | Visual, scope: Call | None) -> str:
    """A shape's roll, pitch, yaw: as written if the same names are defined in `scope`, else as numbers."""
    origin = shape.pose.origin
    element = context.element_at(origin) if origin is not None and origin.call == scope else None
    spans = element.attribute_spans() if element is not None else {}
    return spans["rpy"][1].text if "rpy" in spans else _numbers(shape.pose.rpy)


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.10g}" for value in values)


def _with_sizes(context: Context, made: _Made, shape: Collision | Visual) -> Fix | None:
    """The call with the sizes of the link's shape as its arguments."""
    sizes = _sizes(context, shape, made.scope)
    spans = made.element.attribute_spans()
    if sizes is None or sizes[0] != made.macro.kind or any(name not in spans for name in made.macro.sizes):
        return None
    pairs = zip(made.macro.sizes, sizes[1], strict=True)
    edits = tuple(edit for name, text in pairs for edit in set_value(spans[name][1], text))
    return Fix("pass the sizes of its shape to the macro", edits, safe=False) if edits else None


def _as_call(context: Context, inertial: Inertial, shape: Collision | Visual) -> Fix | None:
    """A call of a matching inertia macro instead of the inertial, within the same macro call."""
    macros, scope = tuple(find_macros(context.expansion.macros)), inertial.origin.call
    sizes = _sizes(context, shape, scope) if macros and shape.geometry.origin.call == scope else None
    element = context.element_at(inertial.origin) if sizes is not None else None
    if sizes is None or element is None or "<!--" in element.whole.text:
        return None
    mass = element.find("mass")
    weight = mass.attribute_spans().get("value") if mass is not None else None
    macro = next((m for m in macros if m.kind == sizes[0]), None)
    if macro is None or weight is None:
        return None
    rpy = _angles(context, shape, scope) if any(shape.pose.rpy) and macro.kind != "sphere" else ""
    xyz = _numbers(inertial.pose.xyz) if any(inertial.pose.xyz) else ""
    if xyz and context.expansion.overridden:
        return None
    given = {macro.mass: weight[1].text, **dict(zip(macro.sizes, sizes[1], strict=True))}
    end = "/>"
    if macro.block:
        end = f'><origin xyz="{xyz or "0 0 0"}" rpy="{rpy or "0 0 0"}"/></xacro:{macro.name}>'
    elif (xyz and not macro.xyz) or (rpy and not macro.rpy):
        return None
    else:
        given |= {name: text for name, text in ((macro.xyz, xyz), (macro.rpy, rpy)) if text}
    values = " ".join(f'{name}="{text}"' for name, text in given.items())
    return Fix(_COMPUTED, (Edit(element.whole, f"<xacro:{macro.name} {values}{end}"),), safe=False)


def _as_numbers(context: Context, link: Link, inertial: Inertial) -> Fix | None:
    """The tensor of a solid of the link's shape instead of six plain numbers."""
    solid = context.bodies[link.name].solid
    element = context.element_at(inertial.inertia_origin)
    if solid is None or element is None or context.expansion.overridden:
        return None
    turn = transpose(rotation(inertial.pose.rpy))
    tensor = scale_matrix(tensor_in(turn, solid.unit_tensor), inertial.mass)
    spans, edits = element.attribute_spans(), list[Edit]()
    largest = max(tensor[0][0], tensor[1][1], tensor[2][2])
    for i, a in enumerate("xyz"):
        for j, b in list(enumerate("xyz"))[i:]:
            name, value = f"i{a}{b}", tensor[i][j]
            if name not in spans or "$" in spans[name][1].text:
                return None
            text = f"{value:.6g}" if abs(value) > 1e-9 * largest else "0"
            edits += set_value(spans[name][1], text)
    return Fix("write the tensor of a solid of its shape", tuple(edits), safe=False) if edits else None
