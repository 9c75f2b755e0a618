"""The packages that a launch file names and that are not found: a warning, unless KBot needs one of their
files.

A launch file asks for the folder of a package before it uses a file of it, if at all. So the folder of an
absent package is a path below `share_of`. Where KBot needs a file there, that is the error.
"""

from __future__ import annotations

import re

from kbot.ros.launch.known_packages import STAND_IN_PACKAGES, share_of
from kbot.text import Diagnostic, Origin, Severity
from kbot.xacro.packages import PackageNotFound

_PATH = re.compile(re.escape(share_of("")).replace("/", r"[/\\]") + r"(\w+)(?:[/\\]+([^\s:'\"]*))?")
"""A path below `share_of` in a message, also with the separators of Windows."""


class AbsentPackages:
    """Collects the absent packages of a launch file and of those that it includes."""

    def __init__(self) -> None:
        self._warnings: dict[str, Diagnostic] = {}
        self._needed: set[str] = set()

    def share_of(self, error: PackageNotFound, origin: Origin) -> str:
        """The path that replaces the share folder of a package that is used at `origin`."""
        if error.name not in STAND_IN_PACKAGES and error.name not in self._warnings:
            message = f"{error.problem}: KBot continues without its files"
            self._warnings[error.name] = Diagnostic("L012", Severity.WARNING, message, origin, error.hint)
        return share_of(error.name)

    def require(self, package: str) -> str:
        """Note that KBot needs a file of a package: the error about it replaces the warning. Returns what the
        user can do."""
        self._needed.add(package)
        warning = self._warnings.get(package)
        return warning.hint if warning else "install the package"

    def missing_include(self, package: str, name: str) -> tuple[str, str]:
        """The message and the hint of the error for a launch file of a package that is not installed."""
        hint = self.require(package)
        if package in self._warnings:
            return f"the package '{package}' is not found", hint
        return f"the package '{package}' is not installed, and KBot cannot replace its {name}", hint

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """A warning for each package of which KBot needs nothing, where it is used first."""
        return tuple(warning for name, warning in self._warnings.items() if name not in self._needed)


def absent_package(message: str) -> str | None:
    """The package of the first path below `share_of` in a message."""
    found = _PATH.search(message)
    return found[1] if found else None


def readable(message: str) -> str:
    """A message in which paths below `share_of` name the package instead of a folder that does not exist."""
    return _PATH.sub(lambda path: f"{path[2] or 'the folder'} of the absent package '{path[1]}'", message)
