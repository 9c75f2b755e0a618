"""Rules about unused xacro definitions."""

from __future__ import annotations

import os
import re

from kbot.checks.context import Context
from kbot.checks.edits import remove_element
from kbot.checks.facts.sources import MacroText, SourceFile, named, parameters_of
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Element, Origin, Severity, Span

_COMPUTED = frozenset("${}()*")
"""Characters of a file name that xacro computes."""
_WORD = re.compile(rb"[\w\x80-\xff-]+")


def _entry(context: Context) -> SourceFile | None:
    """The entry file of a whole description. None for a library of macros, or if a file is missing.

    Other robots may use what a library defines. A missing file, or one that is only included with other
    arguments, may use any definition.
    """
    if context.document is None or not any(True for _ in context.document.elements("link")):
        return None
    if any(d.code in ("X117", "X199", "X190") for d in context.problems):
        return None
    if _skips_includes(context):
        return None
    first = context.sources[0] if context.sources else None
    return first if first and first.path == context.entry.path else None


def _skips_includes(context: Context) -> bool:
    """Whether an `<xacro:include>`, in an `<xacro:if>` for example, was not read with these arguments."""
    read = {os.path.basename(file.path) for file in context.sources}
    wanted = (
        element.attributes.get("filename", "").rpartition("/")[2]
        for file in context.sources
        for element in file.elements
        if element.tag == "xacro:include"
    )
    return any(name not in read and not _COMPUTED & {*name} for name in wanted)


def _unused(context: Context, tag: str, message: str, hint: str) -> Found:
    """Report each element of a tag in the entry file whose name is not used. `{}` in `message` is the name.

    The fix removes the element, but not while there are errors: a misspelled name may mean this element, and
    its value would be lost.
    """
    file = _entry(context)
    is_sure = not any(d.is_error for d in context.problems)
    for name, element in named(file, tag) if file is not None else ():
        if name.removeprefix("xacro:") not in context.words and "${" not in name:
            yield Finding(
                element.attribute_origin("name"),
                message.format(name),
                hint,
                fix=remove_element(element, safe=False) if is_sure else None,
            )


@rule("S101", "unused-property", Severity.WARNING, "source")
def unused_property(context: Context) -> Found:
    """A property is never used.

    Why: You can change the property and believe that the robot changes. For example, changing an
    unused `wheel_separation` does not move the wheels.

    Example: `<xacro:property name="wheel_separation" value="0.15"/>` without any `${wheel_separation}`.

    Fix: Use the property, or remove it. Properties of included files are not reported, because other files
    may use them.

    Autofix: unsafe: KBot removes the property, if the description has no errors.
    """
    return _unused(
        context,
        "xacro:property",
        "the property '{}' is never used: changing it has no effect",
        "use it, or remove it",
    )


@rule("S102", "unused-macro", Severity.INFO, "source")
def unused_macro(context: Context) -> Found:
    """A macro in the main file of the robot is never called.

    Why: Either you maintain it for nothing, or its call was deleted by mistake.

    Example: `<xacro:macro name="rear_wheel" …>` without `<xacro:rear_wheel …/>`.

    Fix: Call the macro, or remove it. Macros of included files are not reported, because other files may call
    them.

    Autofix: unsafe: KBot removes the macro, if the description has no errors.
    """
    return _unused(context, "xacro:macro", "the macro '{}' is never called", "call it, or remove it")


@rule("S103", "unused-argument", Severity.WARNING, "source")
def unused_argument(context: Context) -> Found:
    """An argument is never used.

    Why: Passing the argument does not change the robot, and there is no error message.

    Example: `<xacro:arg name="use_sim" default="true"/>` without any `$(arg use_sim)`.

    Fix: Use the argument, or remove it.

    Autofix: unsafe: KBot removes the argument, if the description has no errors.
    """
    return _unused(
        context,
        "xacro:arg",
        "the argument '{}' is never used: passing it has no effect",
        "use it, or remove it",
    )


@rule("S104", "unused-parameter", Severity.INFO, "source")
def unused_parameter(context: Context) -> Found:
    """The body of a macro does not use one of its parameters.

    Why: The value that each call passes has no effect. Often the body uses another name by mistake, and then
    every call makes the same part.

    Example: `params="m w h d"` with a body without `${d}`.

    Fix: Use the parameter, or remove it from `params` and from the calls. A macro that calls more than 500
    others is reported as not checked.

    Autofix: none.
    """
    macros = {m.element.attributes["name"]: m for file in context.sources for m in file.macros}
    for file in context.sources:
        for macro in file.macros:
            seen = _words_reached(macro, macros)
            if seen is None:
                yield Finding(
                    macro.element.attribute_origin("name"),
                    f"the parameters of the macro '{macro.element.attributes['name']}' are not checked: "
                    f"it calls more than {_MOST_REACHED} macros",
                    "move the macros that it calls to their own file and check that",
                )
                return  # report it once: the macros that it calls may call as many
            unused = [name for name in macro.parameters if name not in seen]
            if unused:
                origins = _parameter_origins(macro.element)
                for name in unused:
                    yield Finding(
                        origins.get(name) or macro.element.attribute_origin("params"),
                        f"the macro '{macro.element.attributes['name']}' does not use its parameter '{name}'",
                        "use it, or remove it",
                    )


def _parameter_origins(macro: Element) -> dict[str, Origin]:
    """The first place of each word in a macro's `params`. A parameter written as `&#97;` is not found."""
    origin = macro.attribute_origin("params")
    source = origin.span.source
    found: dict[str, Origin] = {}
    for match in _WORD.finditer(source.data, origin.span.start, origin.span.end):
        word = match[0].decode("utf-8", "replace")
        found.setdefault(word, Origin(Span(source, match.start(), match.end()), origin.call))
    return found


_MOST_REACHED = 500
"""Macros that are followed from one macro. Those of real robots call a few dozen."""


def _words_reached(macro: MacroText, macros: dict[str, MacroText]) -> set[str] | None:
    """The names used by a macro and by the macros it calls, which see its parameters. None if these are too
    many."""
    words: set[str] = set()
    waiting, done = [macro], set[str]()
    while waiting:
        if len(done) > _MOST_REACHED:
            return None
        current = waiting.pop()
        words |= current.words
        for name in current.words & macros.keys():
            if name not in done:
                done.add(name)
                waiting.append(macros[name])
    for name, default in parameters_of(macro.element).items():
        if "$" in default:
            words |= {w for w in parameters_of(macro.element) if w in default and w != name}
    return words
