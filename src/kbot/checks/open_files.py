"""Checks files while they are edited, with their unsaved texts."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.runner import check_file
from kbot.text import Diagnostic
from kbot.text.files import unsaved

if TYPE_CHECKING:
    from kbot.xacro import Packages


class OpenFiles:
    """What an editor has open: `edit` at each keystroke, `check` whenever findings are wanted.

    A robot and the files it includes may be open at once, each with text that is not saved; what is not
    open is read from disk, and read anew when it changes there. Every file is parsed once for as long as
    its text stays the same, whichever robots include it: after an edit of one file, only that one is
    parsed again. At most 500 parsed files are kept in a process.

    `packages` is where packages are looked for, also those around each file; `config` stands for the
    nearest kbot.toml or pyproject.toml of each file.
    """

    def __init__(self, packages: Packages | None = None, config: Config | None = None) -> None:
        self._packages = packages
        self._config = config
        self._texts: dict[str, str] = {}

    def edit(self, path: str, text: str) -> None:
        """Take this text for what is in the file, which need not exist."""
        self._texts[os.path.realpath(path)] = text

    def close(self, path: str) -> None:
        """Forget the text of a file: what is on disk counts again."""
        self._texts.pop(os.path.realpath(path), None)

    def check(self, path: str, arguments: Mapping[str, str] | None = None) -> tuple[Diagnostic, ...]:
        """What is wrong with a file, in order of place, as `check_file` says it.

        A file that is neither open nor on disk is a finding (F001). Findings may lie in files that this
        one includes: `finding.origin.span.file` says in which.

        Raises:
            KbotError: the configuration is not usable.
        """
        with unsaved(self._texts):
            return check_file(path, arguments, self._packages, self._config)
