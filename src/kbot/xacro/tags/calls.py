"""The tags of macros, blocks, and computed elements and attributes."""

from __future__ import annotations

from kbot.text.span import Call, Span
from kbot.text.suggest import did_you_mean
from kbot.text.xml import Element
from kbot.xacro.binding import FAILED, READY, Binding
from kbot.xacro.expander import Expander
from kbot.xacro.expansion_context import ExpansionContext, Node
from kbot.xacro.location import locate, name_span
from kbot.xacro.macros import Macro, MacroParameter, MacroTable, parse_parameters
from kbot.xacro.run import Run
from kbot.xacro.scope import Scope
from kbot.xacro.tags.attributes import check_attributes
from kbot.xacro.tags.properties import compute
from kbot.xacro.templates import evaluate
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import XacroError


def insert_block(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Insert a block, expanded again: its element, or for `**` the content of the element."""
    check_attributes(walk.run, node, place)
    name, scope = node.attributes["name"], place.scope
    several = scope.find(f"**{name}")
    found = scope.find(f"*{name}") if several is None else several
    if found is None:
        raise _undefined(name, node, place, scope)
    block: Element = found.value
    if block.children:  # nodes without expressions are shared, but each use counts
        walk.run.nodes -= sum(1 for _ in block.descendants())
    if several is None:
        place.out.append(walk.element(block, place))
        return
    scratch = block.childless_copy(place.call, block.tag, {})
    attributes = walk.attributes(block, scope, place.call, scratch)
    content: list[Node] = []
    walk.children(block.children, place.within(attributes, content))
    walk.splice(content, place)


def _undefined(name: str, node: Element, place: ExpansionContext, scope: Scope) -> XacroError:
    known = scope.find(name)
    if known is not None and known.state == FAILED and known.problem is not None:
        return XacroError("X129", "", problem=known.problem)
    hint: str = did_you_mean(name, scope.blocks())
    if not hint and known is not None:
        hint = f"'{name}' is a property with a value: write ${{{name}}}"
    origin = locate(node, "name", place.call, None)
    fault = XacroError("X129", f"the block '{name}' is not defined", hint, key=("block", name), origin=origin)
    fault.near = bool(hint)
    return fault


def make_element(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Expand an element with a computed name. The name may be that of a xacro tag."""
    if "xacro:name" not in node.attributes:
        raise XacroError("X120", "<xacro:element> has no attribute 'xacro:name'")
    name = walk.evaluated(node, "xacro:name", place)
    if not name:
        origin = locate(node, "xacro:name", place.call, None)
        raise XacroError("X130", "the element's name is empty", origin=origin)
    attributes = {key: value for key, value in node.attributes.items() if key != "xacro:name"}
    renamed = node.childless_copy(node.call, walk.run.budget.text(name), attributes)
    renamed.children = node.children
    if renamed.tag.startswith("xacro:"):
        walk.tag(renamed, place, has_next)
    else:
        place.out.append(walk.element(renamed, place))


def set_attribute(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Set an attribute with a computed name on the enclosing element."""
    for required in ("name", "value"):
        if required not in node.attributes:
            raise XacroError("X120", f"<xacro:attribute> has no attribute '{required}'")
    name = walk.evaluated(node, "name", place)
    value = walk.evaluated(node, "value", place)
    origin = locate(node, "value", place.call, None)
    if not name:
        raise XacroError(
            "X130", "the attribute's name is empty", origin=locate(node, "name", place.call, None)
        )
    if not value and value != "":
        # the official writer omits false values that are not text
        walk.run.warn_at("X212", f"the value {value!r} becomes an empty string", origin, "write ${str(…)}")
        value = ""
    if place.parent is None:
        hint = "put it directly inside the element that should have the attribute"
        walk.run.warn_at("X211", "the attribute is lost: it belongs to a xacro tag", node.origin, hint)
        return
    key = walk.run.budget.text(name)
    place.attributes[key] = walk.run.budget.text(value)
    place.parent.moved = {**(place.parent.moved or {}), key: origin}


_PARAMETER_STEPS = 4
"""Steps charged for binding a parameter, which takes about 250 bytes."""


def define_macro(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Define a macro."""
    walk.gap.drop_comments(place.out, place.out, has_next)
    check_attributes(walk.run, node, place)
    name = node.attributes["name"]
    if name == "call" or "." in name:
        hint = "a dot separates a namespace from a macro" if "." in name else "it is one of xacro's own tags"
        origin = locate(node, "name", place.call, None)
        raise XacroError("X131", f"a macro cannot be named '{name}'", hint, origin=origin)
    if name.startswith("xacro:"):
        origin = locate(node, "name", place.call, None)
        walk.run.warn_at(
            "X209", f"the macro name '{name}' has the prefix 'xacro:'", origin, "remove the prefix"
        )
        name = name[6:]
    known = place.macros.own.get(name)
    # a redefined macro stays the same object, even for a call that is being expanded
    macro = known if isinstance(known, Macro) else Macro(name, node, ())
    macro.body, macro.parameters, macro.call, macro.problem = node, (), place.call, None
    macro.size = max(node._close - node.start, 0)
    macro.is_plain = not any("$" in v or k.startswith("xmlns:") for k, v in node.attributes.items())
    try:
        macro.parameters = parse_parameters(node.attributes.get("params", ""))
    except ValueError as error:
        macro.problem = walk.run.report(XacroError("X131", str(error)), node, "params", place.call)
    place.macros.own[name] = macro


def call_by_name(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Call a macro by a computed name."""
    if not node.attributes.get("macro"):
        raise XacroError("X120", "<xacro:call> has no attribute 'macro'")
    name = walk.run.budget.text(walk.evaluated(node, "macro", place))
    attributes = {key: value for key, value in node.attributes.items() if key != "macro"}
    renamed = node.childless_copy(node.call, f"xacro:{name}", attributes)
    renamed.children = node.children
    call_macro(walk, renamed, place, has_next)


def call_macro(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Replace a macro call by the expanded body of the macro."""
    run = walk.run
    try:
        macro, macros, outer = _find(walk, node, place)
    except XacroError as fault:
        if not _is_left_over(fault, run, place):
            raise
        message = f"<{node.tag}> is ignored, because there are no macros and the file is URDF"
        run.warn_at("X213", message, node.origin, "remove it, or include the file that defines the macro")
        return
    if macro.problem is not None:
        raise XacroError("X131", "", problem=macro.problem)
    if any("," in parameter.name and not parameter.is_optional for parameter in macro.parameters):
        raise _with_commas(macro)
    run.copied += macro.size
    run.budget.charge(_PARAMETER_STEPS * len(macro.parameters))
    run.macro_depth += 1
    if run.macro_depth > run.limits.macro_calls:
        raise run.budget.exceeded("macro_calls", f"the macro '{macro.name}' never stops calling itself")
    body, is_plain, origin = macro.body, macro.is_plain, macro.call
    local = Scope(run, outer)
    missing = {parameter.name: parameter for parameter in macro.parameters}
    for name in node.attributes:
        if name in missing:
            del missing[name]
            binding = Binding(name, None, READY, node, name, place.call)
            compute(walk, binding, node, name, place)
            local.define(binding)
        else:
            _unknown_parameter(walk, node, name, macro, place)
    if node.children or any(name[0] == "*" for name in missing):
        _fill_blocks(walk, node, macro, missing, local, place)
    if missing:
        _fill_defaults(walk, node, macro, missing, local, place)
    attributes: dict[str, str] = {}
    if not is_plain:  # evaluated at each call, because namespaces are lifted from them
        attributes = walk.attributes(body, local, origin, body.childless_copy(None, body.tag, {}))
    call = Call("macro", macro.name, Span(node.source, node.start, node.tag_end), place.call)
    content: list[Node] = []
    walk.children(body.children, ExpansionContext(local, MacroTable(macros), call, attributes, content))
    if attributes:
        walk.lift(attributes, place, node)
    walk.replace(content, place, has_next)
    run.macro_depth -= 1


def _find(walk: Expander, node: Element, place: ExpansionContext) -> tuple[Macro, MacroTable, Scope]:
    """The macro that a tag calls, and the macros and names that its body can use."""
    name = node.tag[6:]
    macros, scope = place.macros, place.scope
    found = macros.find(name)
    if found is None and "." in name:
        *spaces, last = name.split(".")
        for space in spaces:
            table, binding = macros.find(space), scope.find(space)
            if not isinstance(table, MacroTable) or binding is None or not isinstance(binding.value, Scope):
                raise _unknown(walk, name, place)
            macros, scope = table, binding.value
        found = macros.find(last)
    if not isinstance(found, Macro):
        raise _unknown(walk, name, place)
    return found, macros, scope


def _is_left_over(fault: XacroError, run: Run, place: ExpansionContext) -> bool:
    """Whether ROS ignores a tag that calls no macro: it reads a file `.urdf` without xacro."""
    is_urdf = run.lenient and run.file.endswith(".urdf") and not run.dependencies
    return is_urdf and not fault.near and not place.macros.names()


def _unknown(walk: Expander, name: str, place: ExpansionContext) -> XacroError:
    near = did_you_mean(name, [*place.macros.names(), *(tag[6:] for tag in walk.tags)])
    hint = near or f'define it first: <xacro:macro name="{name}">, or include the file that defines it'
    fault = XacroError("X121", f"there is no macro '{name}'", hint, key=("macro", name))
    fault.near = bool(near)
    return fault


def _with_commas(macro: Macro) -> XacroError:
    """The fault of `params="a,b"`: one parameter whose name has a comma. No call can pass it."""
    from kbot.text.diagnostic import Edit, Fix  # only for an error: start-up time

    written = macro.body.attributes["params"]
    spaced = " ".join(written.replace(",", " ").split())
    origin = locate(macro.body, "params", macro.call, None)
    fault = XacroError(
        "X131",
        f"the parameters of the macro '{macro.name}' are separated by commas",
        f'separate them by spaces: params="{spaced}"',
        origin=origin,
        key=("params", id(macro.body)),
    )
    if origin.span.text == written and "=" not in written:
        fault.fix = Fix(f'write params="{spaced}"', (Edit(origin.span, spaced),), safe=True)
    return fault


def _unknown_parameter(
    walk: Expander, node: Element, name: str, macro: Macro, place: ExpansionContext
) -> None:
    names = [p.name for p in macro.parameters if not p.is_block]
    listed = f"its parameters are {', '.join(names)}" if names else "it has none"
    hint = did_you_mean(name, [n for n in names if n not in node.attributes]) or listed
    message = f"the macro '{macro.name}' has no parameter '{name}'"
    fault = XacroError("X122", message, hint, origin=name_span(node, name, place.call))
    walk.run.report(fault, node, name, place.call)


def _fill_blocks(
    walk: Expander,
    node: Element,
    macro: Macro,
    missing: dict[str, MacroParameter],
    local: Scope,
    place: ExpansionContext,
) -> None:
    """Expand the content of a call, and assign its elements to the block parameters in order."""
    content: list[Node] = []
    walk.children(node.children, place.within({}, content))
    blocks = [child for child in content if isinstance(child, Element)]
    wanted = [name for name in missing if name[0] == "*"]
    for name, block in zip(wanted, blocks, strict=False):
        local.define(Binding(name, block, READY, block, "", place.call))
    absent = wanted[len(blocks) :]
    if absent:
        names = ", ".join(f"'{name.lstrip('*')}'" for name in absent)
        hint = f"write {len(wanted)} element{'s' * (len(wanted) > 1)} inside the call"
        fault = XacroError("X124", f"the call of the macro '{macro.name}' lacks the block {names}", hint)
        problem = walk.run.report(fault, node, "", place.call)
        for name in absent:
            walk.poison(name.lstrip("*"), local, node, place, problem)
    elif len(blocks) > len(wanted):
        extra = blocks[len(wanted)]
        message = f"the macro '{macro.name}' does not take the block <{extra.tag}>"
        fault = XacroError("X125", message, f"it takes {len(wanted) or 'no'} block{'s' * (len(wanted) != 1)}")
        walk.run.report(fault, extra, "", place.call)
    for name in wanted:
        del missing[name]


def _fill_defaults(
    walk: Expander,
    node: Element,
    macro: Macro,
    missing: dict[str, MacroParameter],
    local: Scope,
    place: ExpansionContext,
) -> None:
    """Bind the remaining parameters to their defaults, evaluated in the scope of the call."""
    current = {parameter.name: parameter for parameter in macro.parameters}
    missing = {name: current.get(name, MacroParameter(name)) for name in missing}
    absent = [name for name, parameter in missing.items() if not parameter.is_optional]
    for name, parameter in missing.items():
        if not parameter.is_optional:
            continue
        binding = Binding(name, None, READY, macro.body, "params", macro.call)
        walk.run.used.clear()
        try:
            binding.value = _default(parameter, macro, node, place)
            binding.inputs = tuple(walk.run.used)
        except XacroError as fault:
            binding.problem = walk.run.report(fault, macro.body, "params", place.call)
            binding.state = FAILED
        local.define(binding)
    if absent:
        names = ", ".join(f"'{name}'" for name in absent)
        message = f"the call of the macro '{macro.name}' lacks the parameter{'s' * (len(absent) > 1)} {names}"
        unknown = [name for name in node.attributes if name not in local.values]
        if unknown and did_you_mean(absent[0], unknown):  # already reported as a misspelled parameter
            problem = walk.run.problems[-1]
        else:
            problem = walk.run.report(XacroError("X123", message), node, "", place.call)
        for name in absent:
            walk.poison(name, local, node, place, problem)


def _default(parameter: MacroParameter, macro: Macro, node: Element, place: ExpansionContext) -> Value:
    scope, name = place.scope, parameter.name
    if parameter.forwarded and name in scope:
        try:
            return scope.lookup(name)
        except XacroError as fault:
            fault.origin = node.origin
            raise
    if parameter.default is None:
        message = f"there is no '{name}' to forward to the macro '{macro.name}'"
        hint = f"pass {name}=…, or define the property first"
        raise XacroError("X133", message, hint, origin=locate(node, "", place.call, None))
    try:
        return evaluate(parameter.default, scope)
    except XacroError as fault:
        if fault.part is not None:
            start = macro.body.attributes["params"].find(parameter.default)
            fault.part = (fault.part[0] + start, fault.part[1] + start)
        raise
