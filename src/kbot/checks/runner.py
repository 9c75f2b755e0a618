"""From a file to its findings: expansion, reader and rules together, each fault said once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.checks.below import improved
from kbot.checks.config import Config, load_config
from kbot.checks.context import Context
from kbot.checks.merge import said_once
from kbot.checks.registry import all_rules
from kbot.checks.suppressions import without_suppressed
from kbot.text import DescriptionError, Diagnostic, Source, Span, read_source

if TYPE_CHECKING:
    from kbot.xacro import Packages

LAUNCH = (".launch", ".launch.xml", ".launch.yaml", ".launch.yml")
"""How launch files end that can be read; one in Python is a program, and read on its own behalf only."""


_OF_THE_WHOLE = frozenset({"U002", "U003", "X100", "X103", "X112", "X121", "X129"})
"""What a part of a robot does not have itself: name, links, and what the file that includes it defines."""


def check_file(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    config: Config | None = None,
) -> tuple[Diagnostic, ...]:
    """What is wrong with a xacro, URDF or launch file, in order of place.

    Errors of expansion and reading are findings too; a file that cannot be read is one (F…).
    `config` defaults to the nearest kbot.toml or pyproject.toml.

    Raises:
        KbotError: the configuration is not usable.
    """
    try:
        source = read_source(path)
    except DescriptionError as error:
        return error.diagnostics
    return check_text(source.text, path, arguments, packages, config)


def check_text(
    text: str,
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    config: Config | None = None,
) -> tuple[Diagnostic, ...]:
    """As `check_file`, for a text that need not be saved; `path` is where it would be.

    Raises:
        KbotError: the configuration is not usable.
    """
    from kbot.xacro import Packages as Finder

    config = config or load_config(str(Path(path).parent))
    packages = (packages or Finder()).beside(path)
    source = Source(path, text)
    if Path(path).name == "package.xml":
        from kbot.checks.manifest import check_manifest

        found, sources = check_manifest(source), [source]
    elif path.endswith((*LAUNCH, ".launch.py")):
        from kbot.checks.launches import check_launch

        found, sources = check_launch(source, arguments or {}, packages), [source]
    else:
        context = examine(source, arguments or {}, packages, config)
        found, sources = findings(context), [f.source for f in context.sources] or [source]
    kept = without_suppressed(found, sources, all_rules())
    wanted = (d for d in kept if config.wants(d.code, d.origin.span.file if d.origin else path))
    return tuple(sorted(wanted, key=lambda d: _place(d, path)))


def examine(source: Source, arguments: Mapping[str, str], packages: Packages, config: Config) -> Context:
    """Expand and read a description, keeping all that is wrong, ready for the rules."""
    from kbot.model.read import read_robot
    from kbot.xacro import expand_text

    expansion = expand_text(source.text, source.path, arguments, packages=packages)
    problems, robot = list(expansion.diagnostics), None
    if expansion.document is not None:
        reading = read_robot(expansion.document, packages)
        robot = reading.robot
        problems += _not_said_before(problems, reading.diagnostics)
    return Context(source, expansion, robot, tuple(problems), packages, config, arguments)


def findings(context: Context) -> list[Diagnostic]:
    """What the floors below said and what the rules say; the same fault in a macro once."""
    found = [improved(d) for d in context.problems if not (context.is_part and d.code in _OF_THE_WHOLE)]
    for rule in all_rules().values():
        if rule.needs != "below" and context.has(rule.needs):
            found += [rule.diagnostic(finding) for finding in rule.check(context)]
    return said_once(found, context.document, context.parameters)


def _not_said_before(said: list[Diagnostic], new: tuple[Diagnostic, ...]) -> list[Diagnostic]:
    """Reader errors, less those about a place that expansion failed at and left as it was written."""
    places = [d.origin.span for d in said if d.is_error and d.origin]
    return [
        d
        for d in new
        if not places
        or not d.origin
        or (
            not (d.code in ("U012", "U013") and ("${" in d.message or "$(" in d.message))
            and not any(_overlap(p, d.origin.span) for p in places)
        )
    ]


def _overlap(a: Span, b: Span) -> bool:
    return a.file == b.file and a.start < b.end and b.start < a.end


def _place(diagnostic: Diagnostic, path: str) -> tuple[bool, str, int, str]:
    if diagnostic.origin is None:
        return (False, "", 0, diagnostic.code)
    span = diagnostic.origin.span
    return (span.file != path, span.file, span.start, diagnostic.code)
