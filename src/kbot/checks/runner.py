"""Checks a file of any kind: reads it, runs the rules, and removes suppressed findings."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.consequences import without_consequences
from kbot.checks.context import Context
from kbot.checks.file_kinds import kind_of
from kbot.checks.merge import merge_findings
from kbot.checks.registry import all_rules, rules_by_need
from kbot.checks.settings import load_config
from kbot.checks.suppressions import without_suppressed
from kbot.model.load import needed_packages, not_reported_before
from kbot.model.read import read_robot
from kbot.text import DescriptionError, Diagnostic, Source, read_source
from kbot.text.diagnostic import bounded, one_per_cause
from kbot.text.errors import reading
from kbot.xacro import Packages, expand_text

if TYPE_CHECKING:
    from kbot.checks.context import Context
    from kbot.model.load import Loaded


_ALLOWED_IN_PARTS = frozenset({"U002", "U003", "X100", "X103", "X112", "X121", "X129"})
"""Not reported for a file that is meant to be included: it has no robot name and no links, and it uses names
that the including file defines."""


def examine(
    source: Source,
    arguments: Mapping[str, str],
    packages: Packages,
    config: Config,
    properties: Mapping[str, str] | None = None,
) -> Context:
    """Expand and read a description, and keep all errors, as input for the rules."""
    expansion = expand_text(
        source.text, source.path, arguments, properties=properties, packages=packages, lenient=True
    )
    problems, robot = list(expansion.diagnostics), None
    if expansion.document is not None:
        reading = read_robot(expansion.document, packages, expansion.names_at)
        robot = reading.robot
        found = not_reported_before(problems, reading.diagnostics)
        problems = [*needed_packages(problems, found), *found]
    return Context(source, expansion, robot, tuple(problems), packages, config, arguments)


def as_loaded(loaded: Loaded, source: Source, config: Config) -> Context:
    """A loaded description as input for the rules."""
    return Context(source, loaded.expansion, loaded.robot, loaded.diagnostics, loaded.packages, config, {})


def findings(context: Context) -> list[Diagnostic]:
    """The findings of expansion, reading and the rules, without consequences of errors. A fault in a macro is
    reported once."""
    found = [d for d in context.problems if not (context.is_part and d.code in _ALLOWED_IN_PARTS)]
    for needs, rules in rules_by_need().items():
        for rule in rules if context.has(needs) else ():
            found += [rule.diagnostic(finding) for finding in rule.check(context)]
    return merge_findings(without_consequences(found, context), context)


def check_file(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    config: Config | None = None,
    properties: Mapping[str, str] | None = None,
) -> tuple[Diagnostic, ...]:
    """Check a xacro, URDF or launch file. Returns the findings, sorted by place.

    Errors of expansion and reading are findings too. A file that cannot be read is a finding (F…).
    `config` defaults to the nearest kbot.toml or pyproject.toml. `properties` override top-level properties
    of a description.

    Raises:
        KbotError: the configuration is not valid.
    """
    try:
        source = read_source(path)
    except DescriptionError as error:
        return error.diagnostics
    return check_text(source.text, path, arguments, packages, config, properties)


def check_text(
    text: str,
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    config: Config | None = None,
    properties: Mapping[str, str] | None = None,
) -> tuple[Diagnostic, ...]:
    """Like `check_file`, for a text that need not be saved. `path` is where it would be.

    Raises:
        KbotError: the configuration is not valid.
    """
    config = config or load_config(str(Path(path).parent))
    packages = (packages or Packages()).beside(path)
    with reading(path), _without_collecting():
        found = _findings(Source(path, text), path, arguments or {}, packages, config, properties)
    return _wanted(found, path, config)


def check_loaded(loaded: Loaded, config: Config | None = None) -> tuple[Diagnostic, ...]:
    """Like `check_file`, for a description that is already loaded, with its arguments.

    Raises:
        KbotError: the configuration is not valid.
    """
    if loaded.expansion.document is None:
        return loaded.diagnostics
    source = loaded.expansion.document.source
    config = config or load_config(str(Path(source.path).parent))
    with reading(source.path), _without_collecting():
        found = _of_description(as_loaded(loaded, source, config))
    return _wanted(found, source.path, config)


@contextmanager
def _without_collecting() -> Iterator[None]:
    """Disable Python's garbage collector: it takes an eighth of the time of a check and finds few cycles."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _findings(
    source: Source,
    path: str,
    arguments: Mapping[str, str],
    packages: Packages,
    config: Config,
    properties: Mapping[str, str] | None,
) -> list[Diagnostic]:
    """The findings of a file, by its kind, without those that a comment suppresses."""
    kind = kind_of(path, source.text)
    if kind is None:
        return _of_description(examine(source, arguments, packages, config, properties))
    found, sources = kind.check(source, arguments, packages, config)
    return without_suppressed(found, sources, all_rules())


def _of_description(context: Context) -> list[Diagnostic]:
    sources = [file.source for file in context.sources] or [context.entry]
    return without_suppressed(findings(context), sources, all_rules())


def _wanted(found: list[Diagnostic], path: str, config: Config) -> tuple[Diagnostic, ...]:
    """The findings that the configuration selects, one per cause, sorted by place."""
    wanted = (d for d in found if config.wants(d.code, d.origin.span.file if d.origin else path))
    return bounded(one_per_cause(sorted(wanted, key=lambda d: _place(d, path))))


def _place(diagnostic: Diagnostic, path: str) -> tuple[bool, str, int, str]:
    if diagnostic.origin is None:
        return (False, "", 0, diagnostic.code)
    span = diagnostic.origin.span
    return (span.file != path, span.file, span.start, diagnostic.code)
