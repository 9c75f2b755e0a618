"""Reads the settings of rviz: its display file and its fixed frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from kbot.ros.launch.absent_packages import absent_package, readable
from kbot.ros.launch.known_packages import STAND_IN_PACKAGES, Role, role
from kbot.ros.launch.node_arguments import place_of_value
from kbot.ros.launch.plan import PlannedNode
from kbot.text import Diagnostic, Severity
from kbot.text.folders import names_in
from kbot.text.installed import find_file
from kbot.text.suggest import did_you_mean


@dataclass(frozen=True, slots=True)
class ViewerSettings:
    """`displays` is the display file, which may not exist. An empty value means that rviz uses its
    default."""

    displays: str = ""
    fixed_frame: str = ""


def read_viewer(nodes: Sequence[PlannedNode]) -> tuple[ViewerSettings | None, list[Diagnostic]]:
    """The settings of rviz in a launch, and a warning for each missing display file. None if there is no
    rviz. With several, the first that names a file and the first that names a frame count."""
    if not nodes:
        return None, []
    displays = next((file for node in nodes if (file := display_config(node.args))), "")
    frame = next((frame for node in nodes if (frame := fixed_frame(node.args))), "")
    return ViewerSettings(find_file(displays) or displays, frame), missing_displays(nodes)


def display_config(arguments: str) -> str:
    """The value of `-d` or `--display-config`, empty if neither is given."""
    return _option(arguments, "-d", "--display-config")


def fixed_frame(arguments: str) -> str:
    """The value of `-f` or `--fixed-frame`, empty if neither is given."""
    return _option(arguments, "-f", "--fixed-frame")


def missing_displays(nodes: Iterable[PlannedNode]) -> list[Diagnostic]:
    """A warning for each rviz among the nodes whose display file does not exist."""
    found = []
    for node in nodes:
        file = display_config(node.args) if role(node.package, node.type, node.args) is Role.VIEWER else ""
        package = absent_package(file)
        if package is not None and package not in STAND_IN_PACKAGES:
            continue  # reported with the package
        if file and find_file(file) is None:
            option = "-d" if "-d" in node.args.split() else "--display-config"
            where = place_of_value(node, option)
            message = readable(f"{file} does not exist: rviz shows its default displays")
            found.append(Diagnostic("L059", Severity.WARNING, message, where, _nearest_file(file)))
    return found


def _nearest_file(path: str) -> str:
    return did_you_mean(Path(path).name, names_in(Path(path).parent))


def _option(arguments: str, short: str, long: str) -> str:
    words = arguments.split()
    for at, word in enumerate(words):
        if word in (short, long) and at + 1 < len(words):
            return words[at + 1]
        if word.startswith(f"{long}="):
            return word.partition("=")[2]
    return ""
