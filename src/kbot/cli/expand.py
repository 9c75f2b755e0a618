"""`kbot expand`: expand xacro to URDF, with the options and output of the `xacro` command."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples, file_and_arguments, output_option, package_path_option
from kbot.cli.output import fail, refuse_to_overwrite, report
from kbot.cli.xacro_command import xacro_arguments
from kbot.text.errors import DescriptionError
from kbot.text.files import write_text
from kbot.text.notes import note
from kbot.xacro import Packages, expand
from kbot.xacro.run import Log
from kbot.xacro.scope import Scope

if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic
    from kbot.xacro.result import Expansion


@click.command(
    "expand",
    epilog=examples(
        "kbot expand robot.xacro -o robot.urdf",
        ("kbot expand robot.xacro name:=value", "set an argument"),
        ("kbot expand robot.xacro --set wheel_radius=0.04", "override a property"),
        "kbot expand robot.xacro --source-map robot.map.json -o robot.urdf",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@output_option()
@click.option("--deps", is_flag=True, help="Print only the files that FILE depends on.")
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="NAME=VALUE",
    help="Override the value of a top-level property. Can be repeated.",
)
@click.option("--plain", is_flag=True, help="Omit the banner comment.")
@click.option("--source-map", metavar="JSON", help="File to write the source location of every element to.")
@click.option(
    "--inorder",
    "-i",
    is_flag=True,
    expose_value=False,
    help="Accepted for compatibility with xacro; has no effect.",
)
@click.option(
    "--root-dir",
    metavar="DIR",
    default=os.curdir,
    show_default="current folder",
    help="Folder that relative paths start from.",
)
@click.option("-q", "quiet", is_flag=True, help="Print no warnings.")
@click.option(
    "-v", "verbose", count=True, help="Log more: -vv logs top-level properties, -vvv also those in macros."
)
@click.option(
    "--verbosity",
    type=int,
    metavar="LEVEL",
    show_default="1",
    help="Log level: 0 no warnings, 1 warnings, 3 like -vv, 4 like -vvv.",
)
@package_path_option
def command(
    words: tuple[str, ...],
    output: str | None,
    deps: bool,
    overrides: tuple[str, ...],
    plain: bool,
    source_map: str | None,
    root_dir: str,
    quiet: bool,
    verbose: int,
    verbosity: int | None,
    package_path: tuple[str, ...],
) -> None:
    """Expand a xacro file to URDF.

    name:=value sets a xacro argument of FILE. As in xacro, undeclared names are ignored, with a warning.

    If there are errors, OUT is not changed.
    """
    file, arguments = file_and_arguments(words)
    properties = dict(_override(text) for text in overrides)
    level = 0 if quiet else verbosity if verbosity is not None else 1 + verbose
    expanded = click.get_current_context().obj
    if expanded is not None:  # kbot.cli.start already expanded the file, but there is something to report
        expansion, notes = expanded
        for text in notes:
            note(text)
    else:
        expansion = expand(
            robot_path(file),
            xacro_arguments(arguments),
            properties=properties,
            packages=Packages(package_path),
            root_dir=root_dir,
            log=_log(level) if level > 2 else None,
        )
    if expansion.ok and properties.keys() - expansion.overridden.keys():
        raise DescriptionError(_not_overridden(properties, expansion))
    if not expansion.ok:
        refuse_launch_file(expansion)
    report(d for d in expansion.diagnostics if d.is_error or level > 0)
    if not expansion.ok:
        sys.stderr.flush()
        click.get_current_context().exit(2)
    for path in (output, source_map):
        if path:
            refuse_to_overwrite(path, [robot_path(file), *expansion.dependencies])
    if output and source_map and os.path.realpath(output) == os.path.realpath(source_map):
        fail(f"-o and --source-map both write {output}. Choose two different files")
    text = expansion.plain_text if plain else expansion.text
    if source_map:
        from kbot.xacro.source_map import SourceMap  # imported lazily: a plain expansion is fast

        _write(source_map, SourceMap(expansion.document, text).to_json())
    if deps:
        _write(output, " ".join(expansion.dependencies))
    else:
        _write(output, text)


def refuse_launch_file(expansion: Expansion) -> None:
    """Raise DescriptionError if the text of a launch file cannot be expanded: its `$(…)` are not those of
    xacro. Other files, such as SDF, may be xacro too."""
    # only for an error: a plain expansion is fast
    from kbot.model.load import error_for_kind, kind_of_unexpanded
    from kbot.text.file_kind import LAUNCH

    if kind_of_unexpanded(expansion) == LAUNCH:
        raise DescriptionError([error_for_kind(LAUNCH, expansion)])


def robot_path(file: str) -> str:
    """The path of FILE. `kbot` means the robot that ships with KBot."""
    if file != "kbot":
        return file
    from kbot.model.load import resolve_robot_path

    return str(resolve_robot_path(file))


def _override(text: str) -> tuple[str, str]:
    name, mark, value = text.partition("=")
    if name.strip().endswith(":"):
        fail(f"--set takes NAME=VALUE. Write {name.strip()[:-1]}={value}")
    if not mark or not name.strip():
        fail(f"--set takes NAME=VALUE, not '{text}'")
    return name.strip(), value


def _not_overridden(names: Iterable[str], expansion: Expansion) -> Iterator[Diagnostic]:
    from kbot.xacro.assignments import unknown

    for name in names:
        if name not in expansion.overridden:
            yield unknown("X207", f"--set: there is no top-level property '{name}'", name, expansion)


def _write(path: str | None, text: str) -> None:
    if path is None:
        sys.stdout.write(text)
        return
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)


def _log(level: int) -> Log:
    def log(what: str, scope: Scope, name: str, value: object) -> None:
        if level > 3 or scope.parent is None:
            sys.stderr.write(f"{' ' * scope.depth}{what} {name}: {value} ({scope.run.file})\n")

    return log
