"""The tag `xacro:include`: files, file patterns, and namespaces."""

from __future__ import annotations

import os
import re
from itertools import islice

from kbot.text.errors import DescriptionError
from kbot.text.files import is_allowed
from kbot.text.span import Call, Span
from kbot.text.xml import Element
from kbot.xacro.binding import READY, Binding
from kbot.xacro.expander import Expander
from kbot.xacro.expansion_context import ExpansionContext, Node
from kbot.xacro.location import locate
from kbot.xacro.macros import MacroTable
from kbot.xacro.scope import Scope
from kbot.xacro.substitution import ABSENT
from kbot.xacro.tags.attributes import check_attributes
from kbot.xacro.templates import evaluate
from kbot.xacro.xacro_error import XacroError

_PATTERN = re.compile(r"[*[?]")
_MOST_MATCHES = 500
"""Files that one pattern may include. Each may have 32 MB."""
_MOST_WILDCARDS = 3
"""Parts of a pattern that may contain wildcards. Each one multiplies the number of searched folders."""


def include(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Replace the tag by the expanded content of other files."""
    run, attributes = walk.run, node.attributes
    check_attributes(run, node, place)
    inner: list[Node] = []
    target = place.within({}, inner)
    if attributes.get("ns"):
        name = run.budget.text(walk.evaluated(node, "ns", place))
        target.macros, target.scope = MacroTable(), Scope(run, place.scope, is_namespace=True)
        place.macros.own[name] = target.macros
        place.scope.define(Binding(name, target.scope, READY, node, "ns", place.call))
    optional = "optional" in attributes and walk.truth(attributes["optional"], node, "optional", place)
    if next(node.elements(), None) is not None:
        run.warn_at("X208", "the content of <xacro:include> is ignored", node.origin)
    try:
        filename = _file_name(walk, node, place)
    except XacroError as fault:
        run.incomplete = run.incomplete or fault.problem
        raise
    if filename is None:
        return
    content: list[Node] = []
    for file in _files(walk, run.absolute(filename), node, place):
        _include_file(walk, file, node, place, target, optional)
        content.extend(inner)
        walk.gap.spliced(inner, content)
        inner = target.out = []
    walk.replace(content, place, has_next)


def _file_name(walk: Expander, node: Element, place: ExpansionContext) -> str | None:
    """The evaluated `filename`. None if a lenient run skips the include, because its package is absent."""
    run = walk.run
    try:
        value = evaluate(node.attributes["filename"], place.scope)
    except XacroError as fault:
        is_absent = isinstance(fault.key, tuple) and ABSENT in fault.key  # not one of several
        if run.lenient and is_absent and fault.problem is None:
            run.skip_include(fault, locate(node, "filename", place.call, fault.part))
            return None
        raise walk.reported(fault, node, "filename", place) from None
    if run.pending:
        run.flush(node, "filename", place.call)
    return run.budget.text(value)


def _files(walk: Expander, name: str, node: Element, place: ExpansionContext) -> list[str]:
    names = [name]
    if _PATTERN.search(name):
        import glob  # rarely needed: start-up time

        wild = sum(bool(_PATTERN.search(part)) for part in re.split(r"[/\\]", name))
        found = filter(is_allowed, glob.iglob(name))  # a page does not learn other names
        names = sorted(islice(found, _MOST_MATCHES + 1)) if wild <= _MOST_WILDCARDS else []
        if wild > _MOST_WILDCARDS or len(names) > _MOST_MATCHES:
            what = f"matches more than {_MOST_MATCHES} files"
            if wild > _MOST_WILDCARDS:
                what = f"has wildcards in more than {_MOST_WILDCARDS} of its parts"
            fault = XacroError("X117", f"cannot include: '{name}' {what}", "use a more specific pattern")
            problem = walk.run.report(fault, node, "filename", place.call)
            walk.run.incomplete = walk.run.incomplete or problem
            return []
        if not names:
            origin = locate(node, "filename", place.call, None)
            walk.run.warn_at("X204", f"no file matches '{name}'", origin)
    walk.run.dependencies.update(dict.fromkeys(names))
    return names


def _include_file(
    walk: Expander,
    file: str,
    node: Element,
    place: ExpansionContext,
    target: ExpansionContext,
    optional: bool,
) -> None:
    run = walk.run
    if len(run.files) > run.limits.includes:
        around = " -> ".join(os.path.basename(f) for f in run.files[-3:])
        raise run.budget.exceeded("includes", f"circular include: {around}")
    target.call = call = Call("include", file, Span(node.source, node.start, node.tag_end), place.call)
    try:
        document = run.parsed(run.read(file))
    except DescriptionError as error:
        _unreadable(walk, error, node, place, optional, call)
        return
    run.files.append(file)
    if document.diagnostics:
        run.adopt(document.diagnostics, call)
    root = document.root
    target.attributes = walk.attributes(root, target.scope, call, root.childless_copy(call, root.tag, {}))
    walk.children(root.children, target)
    walk.lift(target.attributes, place, node)
    run.files.pop()


def _unreadable(
    walk: Expander,
    error: DescriptionError,
    node: Element,
    place: ExpansionContext,
    optional: bool,
    call: Call,
) -> None:
    run, cause = walk.run, error.diagnostics[0]
    if not cause.code.startswith("F"):
        problem = run.adopt(error.diagnostics, call)
    elif optional:
        return
    else:
        fault = XacroError("X117", f"cannot include: {cause.message}", cause.hint)
        problem = run.report(fault, node, "filename", place.call)
    run.incomplete = run.incomplete or problem
