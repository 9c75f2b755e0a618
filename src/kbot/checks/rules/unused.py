"""Rules about xacro definitions that nothing uses."""

from __future__ import annotations

import re

from kbot.checks.context import Context
from kbot.checks.edits import remove_element
from kbot.checks.facts.sources import MacroText, SourceFile, named, parameters_of
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Element, Origin, Severity, Span

_WORD = re.compile(rb"[\w\x80-\xff-]+")


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


def _unused(context: Context, tag: str, message: str, hint: str) -> Found:
    """Of each element of a tag in the entry file whose name stands nowhere else; `{}` in `message` is it.

    While there are errors no fix removes it: a misspelled name may mean it, and its value would be lost.
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
    """A property that nothing uses.

    Why: whoever changes it thinks that the robot changes. A `wheel_separation` that no joint is placed by
    says one thing while the wheels stand at another.

    Example: `<xacro:property name="wheel_separation" value="0.15"/>`, and nowhere `${wheel_separation}`.

    Fix: use it, or remove it. Properties of included files are not reported: other files may use them.

    Autofix: unsafe: the property is removed, while nothing else is an error.
    """
    return _unused(
        context,
        "xacro:property",
        "the property '{}' is never used: changing it changes nothing",
        "use it, or remove it",
    )


@rule("S102", "unused-macro", Severity.INFO, "source")
def unused_macro(context: Context) -> Found:
    """A macro, defined in the robot's own file, that nothing calls.

    Why: it is read and kept in step for nothing; or its call was lost.

    Example: `<xacro:macro name="rear_wheel" …>` without `<xacro:rear_wheel …/>`.

    Fix: call it, or remove it. Macros of included files are not reported: other files may call them.

    Autofix: unsafe: the macro is removed, while nothing else is an error.
    """
    return _unused(context, "xacro:macro", "the macro '{}' is never called", "call it, or remove it")


@rule("S103", "unused-argument", Severity.WARNING, "source")
def unused_argument(context: Context) -> Found:
    """An argument that nothing reads.

    Why: whoever passes it gets the same robot, and no word about it.

    Example: `<xacro:arg name="use_sim" default="true"/>`, and nowhere `$(arg use_sim)`.

    Fix: use it, or remove it.

    Autofix: unsafe: the argument is removed, while nothing else is an error.
    """
    return _unused(
        context,
        "xacro:arg",
        "the argument '{}' is never read: passing it changes nothing",
        "use it, or remove it",
    )


@rule("S104", "unused-parameter", Severity.INFO, "source")
def unused_parameter(context: Context) -> Found:
    """A macro's parameter that its body does not use.

    Why: each call passes a value that has no effect; a body that reads another name in its place is a common
    slip, and then every call gives the same part.

    Example: `params="m w h d"` where the body has no `${d}`.

    Fix: use it, or take it out of `params` and of the calls. A macro that calls more than 500 others is
    reported as not checked.

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
                    "check the macros that it calls in a file of their own",
                )
                return  # once: the macros that it calls may call as many
            unused = [name for name in macro.parameters if name not in seen]
            if unused:
                origins = _parameter_origins(macro.element)
                for name in unused:
                    yield Finding(
                        origins.get(name) or macro.element.attribute_origin("params"),
                        f"the macro '{macro.element.attributes['name']}' does not use its parameter '{name}'",
                        "use it, or take it out",
                    )


def _parameter_origins(macro: Element) -> dict[str, Origin]:
    """Where each word of a macro's `params` is first; a parameter may be written otherwise, as `&#97;`."""
    origin = macro.attribute_origin("params")
    source = origin.span.source
    found: dict[str, Origin] = {}
    for match in _WORD.finditer(source.data, origin.span.start, origin.span.end):
        word = match[0].decode("utf-8", "replace")
        found.setdefault(word, Origin(Span(source, match.start(), match.end()), origin.call))
    return found


_MOST_REACHED = 500
"""Macros that are followed from one: those of real robots call some dozen."""


def _words_reached(macro: MacroText, macros: dict[str, MacroText]) -> set[str] | None:
    """Words of a macro and of the macros it calls, which see its parameters; None if these are too many."""
    words: set[str] = set()
    waiting, done = [macro], set[str]()
    while waiting:
        if len(done) > _MOST_REACHED:
            return None
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
