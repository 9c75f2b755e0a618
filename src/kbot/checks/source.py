"""Rules about the xacro as it is written: what is never used, what hides, what does not mean what it says."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.fixing import remove_element, rename_tag, replace_value
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.sources import MacroText, SourceFile, parameters_of
from kbot.checks.vocabulary import ATTRIBUTES
from kbot.text import Comment, Element, Related, Severity

_TRUTHS = ("true", "True", "false", "False")
_EXTENSIONS = frozenset({"gazebo", "transmission", "ros2_control", "sensor", "plugin", "hardware", "param"})


def _entry(context: Context) -> SourceFile | None:
    """The entry file of a whole description; None for a library of macros, and where a file is missing.

    What a library defines and this robot does not use is used by another.
    """
    if context.document is None or not any(True for _ in context.document.elements("link")):
        return None
    if any(d.code in ("X117", "X199", "X190") for d in context.problems):
        return None
    first = context.sources[0] if context.sources else None
    return first if first and first.path == context.entry.path else None


def _used(context: Context) -> frozenset[str]:
    return frozenset().union(*(file.words for file in context.sources))


def _named(file: SourceFile, tag: str) -> Iterator[tuple[str, Element]]:
    for element in file.elements:
        if element.tag == tag and "name" in element.attributes and "$" not in element.attributes["name"]:
            yield element.attributes["name"], element


@rule("S101", "unused-property", Severity.WARNING, "source")
def unused_property(context: Context) -> Found:
    """A property that nothing uses.

    Why: whoever changes it thinks that the robot changes. A `wheel_separation` that no joint is placed by
    says one thing while the wheels stand at another.

    Example: `<xacro:property name="wheel_separation" value="0.15"/>`, and nowhere `${wheel_separation}`.

    Mend: use it, or remove it. Properties of included files are left alone: others may use them.

    Fix: unsafe: the property is removed.
    """
    file = _entry(context)
    if file is None:
        return
    used = _used(context)
    for name, element in _named(file, "xacro:property"):
        if name not in used:
            yield Finding(
                element.attribute_origin("name"),
                f"the property '{name}' is never used: changing it changes nothing",
                "use it, or remove it",
                fix=remove_element(element, safe=False),
            )


@rule("S102", "unused-macro", Severity.INFO, "source")
def unused_macro(context: Context) -> Found:
    """A macro, defined in the robot's own file, that nothing calls.

    Why: it is read and kept in step for nothing; or its call was lost.

    Example: `<xacro:macro name="rear_wheel" …>` without `<xacro:rear_wheel …/>`.

    Mend: call it, or remove it. Macros of included files are left alone: that is what libraries are.

    Fix: unsafe: the macro is removed.
    """
    file = _entry(context)
    if file is None:
        return
    used = _used(context)
    for name, element in _named(file, "xacro:macro"):
        if name.removeprefix("xacro:") not in used:
            yield Finding(
                element.attribute_origin("name"),
                f"the macro '{name}' is never called",
                "call it, or remove it",
                fix=remove_element(element, safe=False),
            )


@rule("S103", "unused-argument", Severity.WARNING, "source")
def unused_argument(context: Context) -> Found:
    """An argument that nothing reads.

    Why: whoever passes it gets the same robot, and no word about it.

    Example: `<xacro:arg name="use_sim" default="true"/>`, and nowhere `$(arg use_sim)`.

    Mend: use it, or remove it.

    Fix: unsafe: the argument is removed.
    """
    file = _entry(context)
    if file is None:
        return
    used = _used(context)
    for name, element in _named(file, "xacro:arg"):
        if name not in used and "${" not in name:
            yield Finding(
                element.attribute_origin("name"),
                f"the argument '{name}' is never read: passing it changes nothing",
                "use it, or remove it",
                fix=remove_element(element, safe=False),
            )


@rule("S104", "unused-parameter", Severity.INFO, "source")
def unused_parameter(context: Context) -> Found:
    """A macro's parameter that its body does not use.

    Why: each call passes a value that has no effect; a body that reads another name in its place is a common
    slip, and then every call gives the same part.

    Example: `params="m w h d"` where the body has no `${d}`.

    Mend: use it, or take it out of `params` and of the calls.

    Fix: none.
    """
    macros = {m.element.attributes["name"]: m for file in context.sources for m in file.macros}
    for file in context.sources:
        for macro in file.macros:
            seen = _words_reached(macro, macros)
            for name in macro.parameters:
                if name not in seen:
                    yield Finding(
                        macro.element.attribute_origin("params"),
                        f"the macro '{macro.element.attributes['name']}' does not use its parameter '{name}'",
                        "use it, or take it out",
                    )


def _words_reached(macro: MacroText, macros: dict[str, MacroText]) -> set[str]:
    """Words of a macro and of the macros it calls, which see its parameters."""
    words: set[str] = set()
    waiting, done = [macro], set()
    while waiting:
        one = waiting.pop()
        words |= one.words
        for name in one.words & macros.keys():
            if name not in done:
                done.add(name)
                waiting.append(macros[name])
    for name, default in parameters_of(macro.element).items():
        if "$" in default:
            words |= {w for w in parameters_of(macro.element) if w in default and w != name}
    return words


@rule("S106", "redefined-after-use", Severity.WARNING, "source")
def redefined_after_use(context: Context) -> Found:
    """A property that is given another value after it was used.

    Why: what stands above has the old value, what stands below the new one: two wheels of one robot with
    two radii.

    Example: `radius` 0.035, a wheel, `radius` 0.04, another wheel.

    Mend: give the second its own name.

    Fix: none.
    """
    for file in context.sources:
        first: dict[str, Element] = {}
        used_after: dict[str, set[str]] = {}
        for element, words in file.top:
            name, value = element.attributes.get("name", ""), element.attributes.get("value")
            defines = element.tag == "xacro:property" and value is not None
            before = first.get(name) if defines else None
            if (
                before is not None
                and before.attributes["value"] != value
                and name in used_after[name] - words
            ):
                yield Finding(
                    element.origin,
                    f"the property '{name}' was {before.attributes['value']} where it was used before, "
                    f"and is {value} from here on",
                    "give the second its own name",
                    (Related("the first value", before.origin),),
                )
            for seen in used_after.values():
                seen |= words
            if defines:
                first[name], used_after[name] = element, set()


@rule("S110", "macro-without-prefix", Severity.ERROR, "source")
def macro_without_prefix(context: Context) -> Found:
    """A macro called without `xacro:`.

    Why: it is copied into the result as it stands, and URDF readers ignore it: the part is missing, and
    nothing says so.

    Example: `<wheel prefix="left" reflect="1"/>`

    Mend: `<xacro:wheel prefix="left" reflect="1"/>`.

    Fix: safe: the prefix is added.
    """
    macros = {m.element.attributes["name"]: m for file in context.sources for m in file.macros}
    for file in context.sources:
        for element in _outside_extensions(file):
            macro = macros.get(element.tag)
            if macro is None or element.tag in ATTRIBUTES or ":" in element.tag:
                continue
            if set(element.attributes) <= set(macro.parameters):
                yield Finding(
                    element.origin,
                    f"<{element.tag}> is the name of a macro, called without 'xacro:': it does nothing",
                    f"write <xacro:{element.tag} …>",
                    (Related("the macro", macro.element.origin),),
                    rename_tag(element, "xacro:" + element.tag, safe=True),
                )


def _outside_extensions(file: SourceFile) -> Iterator[Element]:
    at = 1
    while at < len(file.elements):
        element = file.elements[at]
        if element.tag in _EXTENSIONS:
            at = file.ends[at]
        else:
            yield element
            at += 1


@rule("S112", "argument-before-default", Severity.ERROR, "source")
def argument_before_default(context: Context) -> Found:
    """`$(arg x)` above the `<xacro:arg name="x" default=…/>` that gives it a value.

    Why: xacro reads from top to bottom: without the argument on the command line the first use stops it with
    "Undefined substitution argument x".

    Example: `<xacro:property name="r" value="$(arg radius)"/> <xacro:arg name="radius" default="0.035"/>`

    Mend: put the `<xacro:arg>`s at the top.

    Fix: none.
    """
    for problem in context.problems:
        if problem.code != "X112" or problem.origin is None:
            continue
        for file in context.sources:
            for name, element in _named(file, "xacro:arg"):
                if f"'{name}'" in problem.message and "default" in element.attributes:
                    yield Finding(
                        problem.origin,
                        f"$(arg {name}) is read before its default is given",
                        "put <xacro:arg> above it",
                        (Related("the default is given here", element.origin),),
                    )


@rule("S113", "odd-boolean", Severity.WARNING, "source")
def odd_boolean(context: Context) -> Found:
    """A truth value in a form that xacro takes for a text: `'False '`, `TRUE`, `no`.

    Why: xacro knows `true`, `True`, `false` and `False`. Any other text that is not empty counts as true
    in an expression: `${not flag}` of `'False '` is false, and the part that was switched off stays on.

    Example: `<xacro:property name="has_camera" value="False "/>`

    Mend: `value="false"`.

    Fix: safe: the blank is removed, capitals are made small.
    """
    for file in context.sources:
        for element in file.elements:
            if not element.tag.startswith("xacro:") or element.tag in (
                "xacro:if",
                "xacro:unless",
                "xacro:include",
            ):
                continue
            for name, value in element.attributes.items():
                if name == "name" or value in _TRUTHS or value.strip().lower() not in ("true", "false"):
                    continue
                meant = value.strip().lower()
                yield Finding(
                    element.attribute_origin(name),
                    f"'{value}' is a text and not {meant}: in an expression it counts as true",
                    f"write {meant}",
                    fix=replace_value(element, name, meant, f"write {meant}", safe=True),
                )


@rule("S114", "leftover", Severity.WARNING, "document")
def leftover(context: Context) -> Found:
    """`${…}`, `$(…)` or a `xacro:` tag that is left in the result.

    Why: readers take it as it stands: a name of `${prefix}_link`, a number that is none. It comes of
    `$$`, of a file that is no xacro to those who load it, or of a value that holds one.

    Example: `<link name="$${prefix}base"/>`

    Mend: write one `$`, and give the file to xacro.

    Fix: none.
    """
    errors = [d for d in context.problems if d.is_error and d.origin]
    failed = {o.span.start for d in errors for o in (d.origin, *(r.origin for r in d.related)) if o}
    for element in context.elements:
        if element.tag.startswith("xacro:"):
            if element.start not in failed and not _failed_in(element, failed):
                yield Finding(element.origin, f"<{element.tag}> is left in the result")
            continue
        if not any("$" in v for v in element.attributes.values()) and not any(
            "$" in c.value for c in element.children if not isinstance(c, Element)
        ):
            continue
        for name, value in element.attributes.items():
            if "$" in value and ("${" in value or "$(" in value):
                origin = element.attribute_origin(name)
                if (
                    not any(origin.span.start <= at <= origin.span.end for at in failed)
                    and element.start not in failed
                ):
                    yield Finding(origin, f"'{value}' is left in the result as it stands")
        for child in element.children:
            if isinstance(child, Element | Comment) or not ("${" in child.value or "$(" in child.value):
                continue
            if not _failed_in(element, failed):
                text = child.value.strip()[:60]
                yield Finding(element.origin, f"'{text}' is left in the result as it stands")


def _failed_in(element: Element, failed: set[int]) -> bool:
    return any(element.start <= at < element.end for at in failed)
