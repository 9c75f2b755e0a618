"""What verbs print: findings and errors on stderr, results on stdout."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, NoReturn, TextIO

import click

from kbot.text.diagnostic import Diagnostic
from kbot.text.errors import DescriptionError, KbotError
from kbot.text.render import render_text

if TYPE_CHECKING:
    from kbot.xacro import Packages


def has_color(stream: TextIO) -> bool:
    """Whether a stream is a terminal whose user did not ask for plain text (NO_COLOR, TERM=dumb)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def report(diagnostics: Iterable[Diagnostic], stream: TextIO | None = None) -> None:
    """Write diagnostics to stderr, with color and wrapped only on a terminal."""
    stream = stream or sys.stderr
    width = shutil.get_terminal_size().columns if stream.isatty() else None
    text = render_text(diagnostics, color=has_color(stream), width=width)
    if text:
        stream.write(text)
        stream.flush()


def print_note(text: str) -> None:
    """Print a line to stderr, so that stdout holds results alone."""
    click.echo(text, err=True)


def say_how_to_fix(diagnostics: Iterable[Diagnostic]) -> None:
    """The command that applies the safe fixes of what was reported, where there are any."""
    fixes = [d.fix for d in diagnostics if d.fix and d.fix.safe]
    files = dict.fromkeys(edit.span.file for fix in fixes for edit in fix.edits)
    if files:
        sys.stderr.write(f"apply what is safe of it with: {shlex.join(['kbot', 'check', '--fix', *files])}\n")
        sys.stderr.flush()


def report_error(error: Exception) -> None:
    """Write what went wrong to stderr: every diagnostic of a description, or one line."""
    if isinstance(error, DescriptionError) and error.diagnostics:
        report(error.diagnostics)
        say_how_to_fix(error.diagnostics)
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
    """Whether a finding says that a file cannot be read at all: it is not there, no text, or not XML."""
    return diagnostic.is_error and diagnostic.code.startswith(("F", "P"))


def warn_of_others(package: str, packages: Packages) -> None:
    """Name the package that is taken, where the working directory holds several of its name."""
    others = packages.others(package)
    if others:
        taken, also = packages.find(package), ", ".join(others)
        click.echo(f"warning: there are several packages '{package}': {taken} is taken, not {also}", err=True)


def print_json(value: object) -> None:
    """One JSON object on stdout; NaN and infinity, which JSON lacks, are refused."""
    click.echo(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def keep_sources(output: str, sources: Iterable[str]) -> None:
    """Refuse to write a result over a file that it is made from. Raises KbotError."""
    place = os.path.realpath(output)
    if os.path.isfile(place) and place in map(os.path.realpath, sources):  # noqa: PTH113 - any text will do
        fail(f"{output} is a file that this is made from, and would be lost: write to another")


def fail(message: str) -> NoReturn:
    """End the verb with one clear sentence and exit status 2."""
    raise KbotError(message)
