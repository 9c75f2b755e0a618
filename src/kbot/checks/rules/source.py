"""Rules about xacro source: hidden definitions, and text that does not do what it seems to."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.edits import rename_tag, replace_value
from kbot.checks.facts.sources import named
from kbot.checks.facts.vocabulary import ATTRIBUTES
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Comment, Element, Related, Severity, Text

_TRUTHS = ("true", "True", "false", "False")
_EXTENSIONS = frozenset({"gazebo", "transmission", "ros2_control", "sensor", "plugin", "hardware", "param"})


@rule("S106", "redefined-after-use", Severity.WARNING, "source")
def redefined_after_use(context: Context) -> Found:
    """A property that is given another value after it was used.

    Why: what stands above has the old value, what stands below the new one: two wheels of one robot with
    two radii.

    Example: `radius` 0.035, a wheel, `radius` 0.04, another wheel.

    Fix: give the second its own name.

    Autofix: none.
    """
    for file in context.sources:
        first: dict[str, tuple[int, Element]] = {}
        last_use: dict[str, int] = {}
        for number, (element, words) in enumerate(file.top):
            name = element.attributes.get("name", "")
            value = context.value_in_use(element) if element.tag == "xacro:property" else None
            defines = value is not None
            defined, before = first.get(name, (0, None)) if defines else (0, None)
            if (
                before is not None
                and context.value_in_use(before) != value
                and last_use.get(name, 0) > defined
                and name not in words
            ):
                yield Finding(
                    element.origin,
                    f"the property '{name}' was {before.attributes['value']} where it was used before, "
                    f"and is {value} from here on",
                    "give the second its own name",
                    (Related("the first value", before.origin),),
                )
            last_use.update(dict.fromkeys(words, number))
            if defines:
                first[name] = (number, element)


@rule("S110", "macro-without-prefix", Severity.ERROR, "source")
def macro_without_prefix(context: Context) -> Found:
    """A macro called without `xacro:`.

    Why: it is copied into the result as it stands, and URDF readers ignore it: the part is missing, and
    nothing says so.

    Example: `<wheel prefix="left" reflect="1"/>`

    Fix: `<xacro:wheel prefix="left" reflect="1"/>`.

    Autofix: safe: the prefix is added.
    """
    macros = {m.element.attributes["name"]: m for file in context.sources for m in file.macros}
    for file in context.sources:
        for element in _outside_extensions(file.root) if macros else ():
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


def _outside_extensions(root: Element) -> Iterator[Element]:
    waiting = list(root.elements())[::-1]
    while waiting:
        element = waiting.pop()
        if element.tag not in _EXTENSIONS:
            yield element
            if element.children:
                waiting += [child for child in reversed(element.children) if type(child) is Element]


@rule("S112", "argument-before-default", Severity.ERROR, "source")
def argument_before_default(context: Context) -> Found:
    """`$(arg x)` above the `<xacro:arg name="x" default=…/>` that gives it a value.

    Why: xacro reads from top to bottom: without the argument on the command line the first use stops it with
    "Undefined substitution argument x".

    Example: `<xacro:property name="r" value="$(arg radius)"/> <xacro:arg name="radius" default="0.035"/>`

    Fix: put the `<xacro:arg>`s at the top.

    Autofix: none.
    """
    for problem in context.problems:
        if problem.code != "X112" or problem.origin is None:
            continue
        for file in context.sources:
            for name, element in named(file, "xacro:arg"):
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

    Fix: `value="false"`.

    Autofix: safe: the blank is removed, capitals are made small.
    """
    for file in context.sources:
        for element in file.xacro:
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

    Fix: write one `$`, and give the file to xacro.

    Autofix: none.
    """
    errors = [d for d in context.problems if d.is_error and d.origin]
    failed = sorted({o.span.start for d in errors for o in (d.origin, *(r.origin for r in d.related)) if o})
    for element in _not_plain(context.root):
        if element.tag.startswith("xacro:"):
            if not _any_within(failed, element.start, element.end):
                yield Finding(element.origin, f"<{element.tag}> is left in the result")
            continue
        for name, value in element.attributes.items():
            if "$" in value and ("${" in value or "$(" in value):
                origin = element.attribute_origin(name)
                if not _any_within(failed, origin.span.start, origin.span.end + 1) and not _any_within(
                    failed, element.start, element.start + 1
                ):
                    yield Finding(origin, f"'{value}' is left in the result as it stands")
        for child in element.children:
            if not isinstance(child, Text) or type(child) is Comment or "$" not in child.value:
                continue
            if "${" not in child.value and "$(" not in child.value:
                continue
            if not _any_within(failed, element.start, element.end):
                text = child.value.strip()[:60]
                yield Finding(element.origin, f"'{text}' is left in the result as it stands")


def _not_plain(root: Element) -> Iterator[Element]:
    """The elements that were written with something of xacro's in them, in document order."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += [c for c in reversed(element.children) if type(c) is Element and not c.is_plain]


def _any_within(places: list[int], start: int, end: int) -> bool:
    """Whether one of some sorted places is within a range."""
    return bisect_left(places, start) < bisect_left(places, end)
