"""Checks files that are open in an editor, with their unsaved texts."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from kbot.brief import Brief, counted
from kbot.checks.config import Config
from kbot.checks.runner import check_file
from kbot.text import Diagnostic
from kbot.text.files import unsaved

if TYPE_CHECKING:
    from kbot.xacro import Packages


class OpenFiles(Brief):
    """The files that are open in an editor. Call `edit` at each keystroke and `check` to get findings.

    A robot and the files it includes may be open at once, each with unsaved text. Other files are read from
    disk, and read again when they change. A parsed file is cached until its text changes, even if several
    robots include it. The cache holds at most 500 files per process.

    `packages` finds packages; those around each file are found too. `config` replaces the nearest kbot.toml
    or pyproject.toml of each file.
    """

    def __init__(self, packages: Packages | None = None, config: Config | None = None) -> None:
        self._packages = packages
        self._config = config
        self._texts: dict[str, str] = {}

    def edit(self, path: str, text: str) -> None:
        """Use this text in place of the file's content. The file need not exist."""
        self._texts[os.path.realpath(path)] = text

    def close(self, path: str) -> None:
        """Forget the unsaved text of a file, and read it from disk again."""
        self._texts.pop(os.path.realpath(path), None)

    def check(self, path: str, arguments: Mapping[str, str] | None = None) -> tuple[Diagnostic, ...]:
        """The findings of a file, sorted by place, as `check_file` returns them.

        A file that is neither open nor on disk is a finding (F001). Findings may be in files that this
        one includes: `finding.origin.span.file` is the path.

        Raises:
            KbotError: the configuration is not usable.
        """
        with unsaved(self._texts):
            return check_file(path, arguments, self._packages, self._config)

    def _shown(self) -> Iterator[str]:
        yield counted(len(self._texts), "open file")
