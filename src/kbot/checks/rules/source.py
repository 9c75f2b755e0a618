"""Rules about xacro source: redefined properties, unprefixed calls, text that xacro does not expand."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.edits import rename_tag, replace_value
from kbot.checks.facts.sources import named
from kbot.checks.facts.unprefixed import outside_extensions
from kbot.checks.facts.vocabulary import ATTRIBUTES
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Comment, Element, Related, Severity, Text

_BOOLEANS = ("true", "True", "false", "False")
"""The texts that xacro converts to a boolean."""


@rule("S106", "redefined-after-use", Severity.WARNING, "source")
def redefined_after_use(context: Context) -> Found:
    """A property gets another value after it was used.

    Why: Elements above the new definition have the old value, elements below it the new one. A robot can thus
    get two wheels with different radii.

    Example: `radius` is 0.035 for the first wheel, then `radius` is set to 0.04 for the second.

    Fix: Give the second property its own name.

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
                    f"the property '{name}' is {before.attributes['value']} where it is used above, "
                    f"and {value} from here on",
                    "give the second property its own name",
                    (Related("the first value", before.origin),),
                )
            last_use.update(dict.fromkeys(words, number))
            if defines:
                first[name] = (number, element)


@rule("S110", "macro-without-prefix", Severity.ERROR, "source")
def macro_without_prefix(context: Context) -> Found:
    """A macro is called without the prefix `xacro:`.

    Why: xacro copies the tag into the result, and URDF parsers ignore it. The part is missing without an
    error message.

    Example: `<wheel prefix="left" reflect="1"/>`

    Fix: Write `<xacro:wheel prefix="left" reflect="1"/>`.

    Autofix: safe: KBot adds the prefix.
    """
    macros = {m.element.attributes["name"]: m for file in context.sources for m in file.macros}
    for file in context.sources:
        for element in outside_extensions(file.root) if macros else ():
            macro = macros.get(element.tag)
            if macro is None or element.tag in ATTRIBUTES or ":" in element.tag:
                continue
            if set(element.attributes) <= set(macro.parameters):
                yield Finding(
                    element.origin,
                    f"<{element.tag}> is a macro called without 'xacro:', so it has no effect",
                    f"write <xacro:{element.tag} …>",
                    (Related("the macro", macro.element.origin),),
                    rename_tag(element, "xacro:" + element.tag, safe=True),
                )


@rule("S115", "tag-without-prefix", Severity.ERROR, "source")
def tag_without_prefix(context: Context) -> Found:
    """A tag of xacro is written without the prefix `xacro:`.

    Why: xacro copies the tag into the result, and URDF parsers ignore it. A property or macro is then not
    defined, and every use of it is an error.

    Example: `<property name="wheel_radius" value="0.035"/>`

    Fix: Write `<xacro:property name="wheel_radius" value="0.035"/>`. KBot does not report the unknown names
    and the other consequences.

    Autofix: safe: KBot adds the prefix.
    """
    for element in context.unprefixed:
        yield Finding(
            element.origin,
            f"<{element.tag}> is a tag of xacro without 'xacro:', so it has no effect",
            f"write <xacro:{element.tag} …>",
            fix=rename_tag(element, f"xacro:{element.tag}", safe=True),
        )


@rule("S112", "argument-before-default", Severity.ERROR, "source")
def argument_before_default(context: Context) -> Found:
    """`$(arg x)` is above the `<xacro:arg name="x" default=…/>` that declares its default.

    Why: xacro reads from top to bottom. If the argument is not on the command line, xacro stops at the first
    use with "Undefined substitution argument x".

    Example: `<xacro:property name="r" value="$(arg radius)"/> <xacro:arg name="radius" default="0.035"/>`

    Fix: Move the `<xacro:arg>` elements to the top.

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
                        f"$(arg {name}) is used before its default is declared",
                        "move <xacro:arg> above it",
                        (Related("the default is declared here", element.origin),),
                    )


@rule("S113", "odd-boolean", Severity.WARNING, "source")
def odd_boolean(context: Context) -> Found:
    """A boolean is written in a form that xacro reads as text, such as `'False '` or `TRUE`.

    Why: xacro converts only `true`, `True`, `false` and `False`. In an expression, any other text that is not
    empty counts as true. If `flag` is `'False '`, `${not flag}` is false, and the robot is built as if `flag`
    were true.

    Example: `<xacro:property name="has_camera" value="False "/>`

    Fix: Write `value="false"`.

    Autofix: safe: KBot removes the white space and writes the value in lower case.
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
                if name == "name" or value in _BOOLEANS or value.strip().lower() not in ("true", "false"):
                    continue
                meant = value.strip().lower()
                yield Finding(
                    element.attribute_origin(name),
                    f"'{value}' is text, not {meant}: it counts as true in an expression",
                    f"write {meant}",
                    fix=replace_value(element, name, meant, f"write {meant}", safe=True),
                )


@rule("S114", "leftover", Severity.WARNING, "document")
def leftover(context: Context) -> Found:
    """The result still contains `${…}`, `$(…)` or a `xacro:` tag.

    Why: URDF parsers read it literally: a link is called `${prefix}_link`, or a number is not valid. The
    cause is `$$`, a file that is loaded without xacro, or a value that itself contains an expression.

    Example: `<link name="$${prefix}base"/>`

    Fix: Write one `$`, and load the file with xacro.

    Autofix: none.
    """
    errors = [d for d in context.problems if d.is_error and d.origin]
    failed = sorted({o.span.start for d in errors for o in (d.origin, *(r.origin for r in d.related)) if o})
    for element in _not_plain(context.root):
        if element.tag.startswith("xacro:"):
            if not _any_within(failed, element.start, element.end):
                yield Finding(element.origin, f"<{element.tag}> remains in the result")
            continue
        for name, value in element.attributes.items():
            if "$" in value and ("${" in value or "$(" in value):
                origin = element.attribute_origin(name)
                if not _any_within(failed, origin.span.start, origin.span.end + 1) and not _any_within(
                    failed, element.start, element.start + 1
                ):
                    yield Finding(origin, f"'{value}' is not expanded in the result")
        for child in element.children:
            if not isinstance(child, Text) or type(child) is Comment or "$" not in child.value:
                continue
            if "${" not in child.value and "$(" not in child.value:
                continue
            if not _any_within(failed, element.start, element.end):
                text = child.value.strip()[:60]
                yield Finding(element.origin, f"'{text}' is not expanded in the result")


def _not_plain(root: Element) -> Iterator[Element]:
    """The elements that use xacro in their source, in document order."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += [c for c in reversed(element.children) if type(c) is Element and not c.is_plain]


def _any_within(places: list[int], start: int, end: int) -> bool:
    """Whether any of the sorted `places` is in a range."""
    return bisect_left(places, start) < bisect_left(places, end)
