"""Collects the problems and findings of a launch file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from kbot.ros.launch.absent_packages import AbsentPackages, absent_package, readable
from kbot.ros.launch.launch_error import LaunchError
from kbot.text import Diagnostic, Edit, Fix, Origin, Related, Severity, Span
from kbot.text.diagnostic import ROS_PREFIX
from kbot.xacro.budget import Budget
from kbot.xacro.limits import DEFAULT
from kbot.xacro.packages import Packages


class Reporter:
    """Collects problems and findings. The same problem at the same place is reported once."""

    def __init__(self, packages: Packages) -> None:
        self.packages = packages
        self.absent = AbsentPackages()
        self._problems: list[Diagnostic] = []
        self.findings: list[Diagnostic] = []
        self.budget = Budget(DEFAULT)
        """The work left for expressions and substitutions of the file and its includes."""
        self._seen: set[tuple[str, str, str, int]] = set()
        self._is_limit_reached = False

    def problem(
        self,
        code: str,
        message: str,
        origin: Origin,
        hint: str = "",
        *,
        warning: bool = False,
        related: Iterable[Related] = (),
    ) -> None:
        """Report an error in the file itself. A missing file of an absent package is reported as such."""
        severity = Severity.WARNING if warning else Severity.ERROR
        package = absent_package(message)
        if package is not None:
            code, message, hint = "L012", readable(message), self.absent.require(package)
        key = (code, message, origin.span.file, origin.span.start)
        if key not in self._seen:
            self._seen.add(key)
            self._problems.append(Diagnostic(code, severity, message, origin, hint, tuple(related)))

    @property
    def problems(self) -> tuple[Diagnostic, ...]:
        """The problems, and a warning for each absent package of which KBot needs nothing."""
        return (*self._problems, *self.absent.warnings)

    def unneeded_file(self, found: Diagnostic, origin: Origin, node: str, *, stops_ros: bool) -> None:
        """Report a file that cannot be used and that is named at `origin` for a node that KBot does not run.

        `stops_ros`: whether it is an error on ROS, if the package of the file is there.
        """
        message = f"{found.message}: it is a file of {node}, which KBot does not run"
        if stops_ros and absent_package(message) is None:
            self.finding(Diagnostic(found.code, Severity.ERROR, message, origin, found.hint))
        else:
            self.problem("L059", message, origin, found.hint, warning=True)

    def unneeded_include(self, package: str, name: str, origin: Origin) -> None:
        """Report a launch file of an absent package whose nodes KBot does not run."""
        self.absent.require(package)
        message = f"{name} of the absent package '{package}' is not read: KBot does not run its nodes"
        self.problem("L012", message, origin, "run them with ROS", warning=True)

    def fault(self, error: LaunchError, origin: Origin) -> None:
        """Report an error. Once a limit is exceeded, later errors are only its consequences and are not
        reported."""
        if not self._is_limit_reached:
            self.problem(error.code, error.message, origin, error.hint)
            self._is_limit_reached = error.is_limit

    def finding(self, diagnostic: Diagnostic) -> None:
        """Report an error that ROS would raise."""
        if diagnostic.is_error and diagnostic.code.startswith("L"):
            diagnostic = replace(diagnostic, message=ROS_PREFIX + diagnostic.message)
        if diagnostic not in self.findings:
            self.findings.append(diagnostic)


def removal_of(place: Origin, word: str) -> Fix | None:
    """The fix that removes a word of a command, with the white space before it. None if the place is not the
    word alone."""
    span = place.span
    if span.text != word:
        return None
    start, data = span.start, span.source.data
    while data[start - 1 : start].isspace():
        start -= 1
    return Fix(f"remove {word}", (Edit(Span(span.source, start, span.end), ""),), safe=True)


def part_of(origin: Origin, piece: str) -> Origin:
    """Where a piece of an attribute's value was written. If it is not found, where the whole value was."""
    span = origin.span
    at = span.source.data.find(piece.encode(), span.start, span.end) if piece else -1
    if at < 0:
        return origin
    return Origin(Span(span.source, at, at + len(piece.encode())), origin.call)
