"""Explains an argument that is used as a property, and a property that is read as an argument."""

from __future__ import annotations

import re

from kbot.text.numbers import NUMBER
from kbot.text.suggest import Suggestion
from kbot.xacro.xacro_error import XacroError, consequence

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.binding import Binding

_BOOLEANS = ("true", "false", "True", "False")
_OF_EVAL = re.compile(r"\b(arg|find|env|optenv|dirname) *\(")
"""The functions that only `$(eval …)` has."""


def argument_as_property(name: str, value: str) -> XacroError:
    """The fault of an expression that uses an argument's name as a property.

    The property that the hint defines has the argument's value in every expression, as a number or truth
    value if it is one. `$(arg …)` inserts the text itself, so a text needs quotes, a negative number needs
    brackets, and for a truth value there is no short form.
    """
    inserted = f"$(arg {name})"
    if NUMBER.fullmatch(value.strip()):
        written = f"({inserted})" if value.strip().startswith("-") else inserted
    else:
        written = "" if value.strip() in _BOOLEANS or "'" in value else f"'{inserted}'"
    define = f'define a property with that value: <xacro:property name="{name}" value="{inserted}"/>'
    hint = Suggestion(f"write {written}, or {define}" if written else define, name)
    return XacroError(
        "X103", f"'{name}' is an argument, not a property", hint, key=("undefined", name, "argument")
    )


def property_as_argument(binding: Binding, content: str) -> XacroError:
    """The fault of `$(content)`, which reads a property or a macro's parameter as an argument."""
    if binding.problem is not None:
        return consequence(binding.problem)
    node, name = binding.node, binding.name
    kind = "property" if node is None or node.tag == "xacro:property" else "parameter of the macro"
    if content.startswith("eval "):
        message = f"'{name}' is a {kind}, and $(eval …) knows only arguments"
        expression = content[5:].strip()
        hint = "" if _OF_EVAL.search(expression) else f"write ${{{expression}}}"
        return XacroError("X112", message, hint, key=("argument", name, "eval"))
    hint = Suggestion(f"write ${{{name}}}", name)
    return XacroError(
        "X112", f"'{name}' is a {kind}, not an argument", hint, key=("argument", name, "property")
    )
