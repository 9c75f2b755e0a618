"""Prints findings and errors to stderr, and results to stdout."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn, TextIO

import click

from kbot.text.diagnostic import Diagnostic
from kbot.text.errors import DescriptionError, KbotError
from kbot.text.file_kind import MAY_BE_ROBOT, ROBOT, kind_of_file
from kbot.text.files import read_source
from kbot.text.render import render_text

if TYPE_CHECKING:
    from kbot.model.load import Loaded


def has_color(stream: TextIO) -> bool:
    """Whether to print colors: the stream is a terminal, and neither NO_COLOR nor TERM=dumb is set."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def report(diagnostics: Iterable[Diagnostic], stream: TextIO | None = None) -> None:
    """Write diagnostics to stderr, with color and wrapped only on a terminal."""
    stream = stream or sys.stderr
    width = shutil.get_terminal_size().columns if stream.isatty() else None
    text = render_text(diagnostics, color=has_color(stream), width=width)
    if text:
        stream.write(text)
        stream.flush()


def report_for_page(loaded: Loaded) -> None:
    """Report the errors of a description that a page shows. They do not end the verb, because the user fixes
    them while the page is open.

    Raises:
        DescriptionError: the file is missing, not text, or not meant to describe a robot, such as a world.
    """
    if loaded.has_errors:
        path = loaded.expansion.path or ""
        read_source(path)
        is_other_kind = any(diagnostic.code == "U001" for diagnostic in loaded.diagnostics)
        # a file of such an ending may become a robot, even if it is empty or broken now
        if is_other_kind or not (path.endswith(MAY_BE_ROBOT) or kind_of_file(path) == ROBOT):
            raise DescriptionError(loaded.diagnostics)
        report(loaded.diagnostics)
        print_fix_command(loaded.diagnostics)


def print_note(text: str) -> None:
    """Print a line to stderr: stdout is for results only."""
    click.echo(text, err=True)


@contextmanager
def unwritten_reported(*paths: str | None) -> Iterator[None]:
    """If Ctrl-C, SIGTERM or a closed terminal ends the block, report that these files were not written."""
    try:
        yield
    except KeyboardInterrupt:
        report_unwritten(*paths)
        raise


def report_unwritten(*paths: str | None) -> None:
    if names := ", ".join(filter(None, paths)):
        print_note(f"interrupted: nothing was written to {names}")


def print_fix_command(diagnostics: Iterable[Diagnostic]) -> None:
    """Print the command that applies the safe fixes of these diagnostics, if there are any."""
    fixes = [d.fix for d in diagnostics if d.fix and d.fix.safe]
    files = dict.fromkeys(edit.span.file for fix in fixes for edit in fix.edits)
    if files:
        sys.stderr.write(f"apply the safe fixes with: {shlex.join(['kbot', 'check', '--fix', *files])}\n")
        sys.stderr.flush()


def report_error(error: Exception) -> None:
    """Write an error to stderr: all diagnostics of a description, or one line."""
    if isinstance(error, DescriptionError) and error.diagnostics:
        report(error.diagnostics)
        print_fix_command(error.diagnostics)
        return
    head = "\x1b[1;31merror:\x1b[0m" if has_color(sys.stderr) else "error:"
    if isinstance(error, click.ClickException):
        text = error.format_message()
        context = error.ctx if isinstance(error, click.UsageError) else None
        if isinstance(error, click.NoSuchOption) and error.option_name == "--set" and _takes_values(context):
            text = "No such option '--set'. Write name:=value, for example wheel_radius:=0.05."
        if context is not None:
            text += f"\nTry '{context.command_path} --help'."
    elif isinstance(error, OSError):
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror or str(error)
    else:
        text = str(error)
    sys.stderr.write(f"{head} {text}\n")
    sys.stderr.flush()


def _takes_values(context: click.Context | None) -> bool:
    """Whether a verb takes `name:=value` words."""
    params = context.command.params if context is not None else ()
    return any(":=" in (param.metavar or "") for param in params)


def is_unusable(diagnostic: Diagnostic) -> bool:
    """Whether a finding means that a file is unusable: it is missing, not text, or not XML."""
    return diagnostic.is_error and diagnostic.code.startswith(("F", "P"))


def print_json(value: object, indent: int | None = 2) -> None:
    """Print one JSON object. NaN and infinity raise ValueError, because JSON cannot express them."""
    click.echo(json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False))


def refuse_to_overwrite(output: str, sources: Iterable[str]) -> None:
    """Raise KbotError if the output would overwrite a file that it is computed from."""
    place = os.path.realpath(output)
    if os.path.isfile(place) and place in map(os.path.realpath, sources):  # noqa: PTH113 - any text will do
        fail(f"{output} is an input of this command and would be overwritten. Choose another output file")


def fail(message: str) -> NoReturn:
    """End the verb with an error message and exit status 2."""
    raise KbotError(message)
