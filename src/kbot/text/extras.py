"""The command that installs an extra of KBot into the environment that runs it.

No package index has KBot, so the command must not name the package `kbot`: pip would not find it, or one day
install somebody else's package.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec
from pathlib import Path

_OWN_PROJECT = re.compile(r'^name = "kbot"$', re.MULTILINE)
_OF_EXTRA = re.compile(r"(?:(.*) and )?extra *== *['\"]([^'\"]+)['\"]")
"""The marker of a requirement of an extra, and the other conditions before it."""


def needs_extra(what: str, extra: str) -> str:
    """The sentences of an error: what needs the extra, and the command that installs it."""
    return f"{what} needs the extra '{extra}'. Install it with: {install_command(extra)}"


def install_command(extra: str) -> str:
    """A command for the user's shell, for the current folder and the environment of this process.

    From a clone it installs the clone again, with the extra. An installed wheel may no longer exist as a
    file, so for a wheel the command names what the extra requires.

    Raises:
        ValueError: KBot has no such extra.
    """
    clone = _clone()
    if clone is not None:
        return _command("-e", f"{_shown(clone)}[{extra}]")
    return _command(*_requirements(extra))


def _command(*words: str) -> str:
    return " ".join(map(_quoted, (*_pip_install(), *words)))


def _pip_install() -> list[str]:
    """The words that install into this environment."""
    python = sys.executable or "python"
    on_path = shutil.which("python")
    is_active = on_path is not None and os.path.abspath(on_path) == os.path.abspath(python)
    shown = "python" if is_active else _shown(Path(python))
    if find_spec("pip") is None:  # uv makes environments without pip
        return ["uv", "pip", "install", "--python", shown]
    return [shown, "-m", "pip", "install"]


def _clone() -> Path | None:
    """The clone that contains this file, None for an installed wheel."""
    root = Path(__file__).parents[3]
    try:
        is_own = _OWN_PROJECT.search((root / "pyproject.toml").read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return None
    return root if is_own else None


def _requirements(extra: str) -> list[str]:
    """What an extra of the installed wheel requires, as pip reads it."""
    found = []
    try:
        listed = requires("kbot") or []
    except PackageNotFoundError:
        listed = []
    for line in listed:
        requirement, _, marker = line.rpartition(";")
        match = _OF_EXTRA.fullmatch(marker.strip())
        if match is not None and match[2] == extra:
            found.append(requirement.rstrip() + (f"; {match[1]}" if match[1] else ""))
    if not found:
        raise ValueError(f"KBot has no extra '{extra}'")
    return found


def _shown(path: Path) -> str:
    """The path, relative if it is the current folder or below it."""
    try:
        return str(path.relative_to(Path.cwd()))
    except (OSError, ValueError):  # elsewhere, or the current folder was removed
        return str(path)


def _quoted(word: str) -> str:
    """The word, quoted for sh, or for cmd. In PowerShell, a quoted program needs `&` before it."""
    if os.name != "nt":
        return shlex.quote(word)
    return f'"{word}"' if re.search(r"[^\w.\-\\/:]", word) else word
