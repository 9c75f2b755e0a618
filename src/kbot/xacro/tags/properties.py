"""The tags `xacro:property` and `xacro:arg`."""

from __future__ import annotations

from kbot.text.xml import Element
from kbot.xacro.binding import FAILED, LAZY, READY, Binding
from kbot.xacro.expander import Expander
from kbot.xacro.expansion_context import ExpansionContext
from kbot.xacro.expressions.compiler import is_identifier
from kbot.xacro.location import locate, name_span
from kbot.xacro.scope import Scope
from kbot.xacro.tags.attributes import check_attributes
from kbot.xacro.templates import shortened
from kbot.xacro.values import literal
from kbot.xacro.xacro_error import XacroError


def declare_argument(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Declare an argument, and set its default if it has no value."""
    check_attributes(walk.run, node, place)
    run, name = walk.run, node.attributes["name"]
    run.declared.add(name)
    argument = run.defaults.setdefault(name, Binding(name, None, READY, node, "default", place.call))
    argument.is_given = name in run.given
    if name not in run.arguments:
        run.used.clear()
        try:
            run.arguments[name] = run.budget.text(walk.evaluated(node, "default", place))
            argument.inputs = tuple(run.used)
        except XacroError as fault:
            if fault.problem is None:
                raise
            run.failed_arguments[name] = fault.problem
    argument.value = literal(run.arguments.get(name))
    walk.gap.drop_comments(place.out, place.out, has_next)


def define_property(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Define or remove a property or a block."""
    walk.gap.drop_comments(place.out, place.out, has_next)
    scope, attributes = place.scope, node.attributes
    if tuple(attributes) == ("name", "value") and not walk.overrides:
        name = attributes["name"]
        if is_identifier(name) and not name.startswith("__"):  # fast path: nearly every property is like this
            scope.define(Binding(name, attributes["value"], LAZY, node, "value", place.call))
            return
    check_attributes(walk.run, node, place)
    name = _name(walk, node, place)
    remove = "remove" in attributes and _flag(walk, node, "remove", place)
    if ("value" in attributes) + ("default" in attributes) + remove > 1:
        raise XacroError("X127", f"the property '{name}' has more than one of value, default and remove")
    if remove and name in scope:
        scope.remove(name)
        return
    if "default" in attributes:
        if "scope" in attributes:
            origin = name_span(node, "scope", place.call)
            walk.run.warn_at("X210", "scope has no effect: a default is always local", origin)
        if name in scope:
            return
    _bind(walk, name, node, place)


def _bind(walk: Expander, name: str, node: Element, place: ExpansionContext) -> None:
    attributes, scope = node.attributes, place.scope
    source = "default" if "default" in attributes else "value"
    lazy = "lazy_eval" not in attributes or _flag(walk, node, "lazy_eval", place)
    target = scope
    if attributes.get("scope") == "global":
        target, lazy = scope.top(), False
    elif attributes.get("scope") == "parent":
        target, lazy = _parent(node, scope, place), False
    if source not in attributes:
        binding = Binding(f"**{name}", node, READY, node, "name", place.call)
    elif target.parent is None and name in walk.overrides:
        walk.overridden.add(name)
        binding = Binding(name, walk.overrides[name], READY, node, source, place.call)
        binding.is_given = True
    else:
        binding = Binding(name, attributes[source], LAZY, node, source, place.call)
        if not lazy:
            compute(walk, binding, node, source, place)
    target.define(binding)


def compute(walk: Expander, binding: Binding, node: Element, attribute: str, place: ExpansionContext) -> None:
    """Evaluate an attribute at once, and set it as the value of a binding."""
    used = walk.run.used
    used.clear()
    try:
        binding.value = walk.evaluated(node, attribute, place)
        binding.state = READY
        if used:
            binding.inputs = tuple(used)
    except XacroError as fault:
        if fault.problem is None:  # a limit
            raise
        binding.problem = fault.problem
        binding.state = FAILED


def _name(walk: Expander, node: Element, place: ExpansionContext) -> str:
    name = walk.evaluated(node, "name", place)
    if type(name) is not str or not is_identifier(name):
        shown = shortened(walk.run.budget.text(name), 60)
        message = f"'{shown}' is not a valid property name"
        hint = "use letters, digits and underscores; do not begin with a digit or use a Python keyword"
    elif name.startswith("__"):
        message, hint = f"the property name '{name}' begins with two underscores", "remove one of them"
    else:
        return name
    raise XacroError("X126", message, hint, origin=locate(node, "name", place.call, None))


def _flag(walk: Expander, node: Element, name: str, place: ExpansionContext) -> bool:
    return walk.truth(walk.evaluated(node, name, place), node, name, place)


def _parent(node: Element, scope: Scope, place: ExpansionContext) -> Scope:
    """The caller's scope. Namespaces are skipped."""
    target = scope.parent
    if target is None:
        origin = locate(node, "scope", place.call, None)
        raise XacroError(
            "X132",
            "there is no parent scope here",
            'remove scope="parent"',
            origin=origin,
        )
    if not scope.is_namespace:
        while target.is_namespace and target.parent is not None:
            target = target.parent
    return target
