"""From a file of any kind to its findings: what is wrong in it, and what no comment suppresses."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.examination import as_loaded, examine, findings
from kbot.checks.file_kinds import kind_of
from kbot.checks.registry import all_rules
from kbot.checks.settings import load_config
from kbot.checks.suppressions import without_suppressed
from kbot.text import DescriptionError, Diagnostic, Source, read_source
from kbot.text.diagnostic import bounded
from kbot.text.errors import reading
from kbot.xacro import Packages

if TYPE_CHECKING:
    from kbot.checks.context import Context
    from kbot.model.load import Loaded


def check_file(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    config: Config | None = None,
    properties: Mapping[str, str] | None = None,
) -> tuple[Diagnostic, ...]:
    """What is wrong with a xacro, URDF or launch file, in order of place.

    Errors of expansion and reading are findings too; a file that cannot be read is one (F…).
    `config` defaults to the nearest kbot.toml or pyproject.toml. `properties` override top-level properties
    of a description.

    Raises:
        KbotError: the configuration is not usable.
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
    """As `check_file`, for a text that need not be saved; `path` is where it would be.

    Raises:
        KbotError: the configuration is not usable.
    """
    config = config or load_config(str(Path(path).parent))
    packages = (packages or Packages()).beside(path)
    with reading(path), _without_collecting():
        found = _findings(Source(path, text), path, arguments or {}, packages, config, properties)
    return _wanted(found, path, config)


def check_loaded(loaded: Loaded, config: Config | None = None) -> tuple[Diagnostic, ...]:
    """As `check_file`, for a description as it was loaded, with the values that it was given.

    Raises:
        KbotError: the configuration is not usable.
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
    """Python's collector kept off: an eighth of the time goes into looking for cycles, and there are few."""
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
    """What is wrong with a file, by its kind, and what no comment suppresses."""
    kind = kind_of(path)
    if kind is None:
        return _of_description(examine(source, arguments, packages, config, properties))
    found, sources = kind.check(source, arguments, packages, config)
    return without_suppressed(found, sources, all_rules())


def _of_description(context: Context) -> list[Diagnostic]:
    sources = [file.source for file in context.sources] or [context.entry]
    return without_suppressed(findings(context), sources, all_rules())


def _wanted(found: list[Diagnostic], path: str, config: Config) -> tuple[Diagnostic, ...]:
    """Those that the configuration wants, in order of place."""
    wanted = (d for d in found if config.wants(d.code, d.origin.span.file if d.origin else path))
    return bounded(sorted(wanted, key=lambda d: _place(d, path)))


def _place(diagnostic: Diagnostic, path: str) -> tuple[bool, str, int, str]:
    if diagnostic.origin is None:
        return (False, "", 0, diagnostic.code)
    span = diagnostic.origin.span
    return (span.file != path, span.file, span.start, diagnostic.code)
