"""`kbot where`: show the source lines behind a link, a joint or a line of the result."""

from __future__ import annotations

import re
from collections.abc import Iterable

import click

from kbot.cli.arguments import (
    examples,
    json_option,
    package_path_option,
    resolve_typed_names,
    split_arguments,
)
from kbot.cli.expand import refuse_launch_file, robot_path
from kbot.cli.output import print_json, report
from kbot.text.errors import KbotError
from kbot.text.span import Span
from kbot.text.suggest import did_you_mean
from kbot.xacro import Packages, expand
from kbot.xacro.binding import Binding
from kbot.xacro.definitions import Definition, definitions
from kbot.xacro.result import Expansion
from kbot.xacro.source_map import Trace, expressions

_PLACE = re.compile(r"(\d+)(?::(\d+))?")


@click.command(
    "where",
    epilog=examples(
        "kbot where kbot left_wheel",
        ("kbot where robot.xacro 120:15", "line 120, column 15 of the expanded file"),
    ),
)
@click.argument("words", nargs=-1, metavar="FILE NAME|LINE[:COLUMN] [name:=value ...]")
@package_path_option
@json_option
def command(words: tuple[str, ...], package_path: tuple[str, ...], as_json: bool) -> None:
    """Show the source lines and macro calls that produced a part of a robot.

    NAME is a link, joint, material, property or macro. LINE[:COLUMN] is a position in the output of
    `kbot expand FILE`.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.
    """
    names, values = split_arguments(words)
    if len(names) != 2:
        raise KbotError("expected a FILE, and a NAME or LINE:COLUMN")
    file, name = names
    given = resolve_typed_names(file, values, package_path)
    expansion = expand(
        robot_path(file), given.arguments, properties=given.properties, packages=Packages(package_path)
    )
    refuse_launch_file(expansion)
    expansion.require()
    report(d for d in expansion.diagnostics if d.is_error)
    found: list[Trace] | list[Definition] = _traces(expansion, name)
    if not found:
        found = definitions(expansion, name)
    if not found:
        known = {*expansion.source_map.names(), *(d.name for d in definitions(expansion))}
        hint = did_you_mean(name, known)
        raise KbotError(f"nothing in {file} is named '{name}'" + (f"; {hint}" if hint else ""))
    if as_json:
        print_json({"found": [_as_json(entry) for entry in found]})
    else:
        click.echo("\n".join(_as_text(entry) for entry in found))


def _traces(expansion: Expansion, name: str) -> list[Trace]:
    match = _PLACE.fullmatch(name)
    if match:
        trace = expansion.source_map.at(int(match[1]), int(match[2] or 1))
        if trace is None:
            raise KbotError(f"the expanded file has no element at line {match[1]}, column {match[2] or 1}")
        return [trace]
    found = expansion.source_map.find(name)
    # other tags may have the name too; if none of these three has it, they are the result
    return [trace for trace in found if trace.element.tag in ("link", "joint", "material")] or found


def _as_text(entry: Trace | Definition) -> str:
    lines = [f"{entry.origin}: {entry.title if isinstance(entry, Definition) else entry.name}"]
    for call in entry.origin.stack:
        what = f"from macro '{call.name}', called" if call.kind == "macro" else f"from {call.name}, included"
        lines.append(f"  {what} at {call.span}")
    if isinstance(entry, Trace):
        line, column = entry.output.source.line_column(entry.output.start)
        lines.append(f"  is line {line}, column {column} of the result")
        lines += [f"  computed by {span.text} at {span}" for span in _expressions(entry)]
        lines += _binding_lines(entry.inputs or _all_inputs(entry), "  ")
    return "\n".join(lines)


def _expressions(entry: Trace) -> list[Span]:
    if entry.attribute is not None:
        return list(entry.expressions)
    names = entry.element.attributes
    return [span for name in names for span in expressions(entry.element.attribute_origin(name).span)]


def _all_inputs(entry: Trace) -> tuple[Binding, ...]:
    inputs = entry.element.inputs or {}
    return tuple({id(binding): binding for some in inputs.values() for binding in some}.values())


def _binding_lines(bindings: Iterable[Binding], indent: str, depth: int = 0) -> list[str]:
    lines = []
    for binding in dict.fromkeys(bindings):
        origin = binding.origin
        if origin is not None:
            lines.append(f"{indent}with {binding.name} = {binding.value} from {origin}")
            if depth < 5:
                lines += _binding_lines(binding.inputs, indent + "  ", depth + 1)
    return lines


def _as_json(entry: Trace | Definition) -> dict[str, object]:
    line, column = entry.origin.span.source.line_column(entry.origin.span.start)
    result: dict[str, object] = {
        "name": entry.title if isinstance(entry, Definition) else entry.name,
        "file": entry.origin.span.file,
        "line": line,
        "column": column,
        "stack": [
            {
                "kind": call.kind,
                "name": call.name,
                "file": call.span.file,
                "line": call.span.line,
                "column": call.span.column,
            }
            for call in entry.origin.stack
        ],
    }
    if isinstance(entry, Trace):
        result["expressions"] = [str(span) for span in _expressions(entry)]
        bindings = entry.inputs or _all_inputs(entry)
        result["bindings"] = [
            {"name": b.name, "value": str(b.value), "at": str(b.origin)} for b in bindings if b.origin
        ]
    return result
