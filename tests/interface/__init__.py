"""The public interface of KBot as text: one file for each kind, one fact in each line.

What is public follows from these rules:

- Python: the modules that `kbot.__all__` names, and those that README.md, a page of docs or an example
  imports. Their names are `__all__`, or else what the module defines without an underscore. Of a class, its
  members without an underscore. A class that such a member holds or returns is public too: its members are,
  but no path to import it.
- Command lines: all verbs, arguments and options that `--help` shows, and the exit statuses that it states.
- JSON, files, topics and services: what the verbs print, write and publish for the robot of `kbot new`.
- Rules: all codes. Settings: the names by which users and other programs configure KBot.

`docs/reference/scenario.schema.json` is the part of the interface that describes scenario files.

A change of the interface is an edit of these files, made by `python tests/interface`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from . import commands, python_names, rules, running, settings

FOLDER = Path(__file__).parent / "snapshot"
RENEW = "python tests/interface"

KINDS: dict[str, Callable[[], Iterable[str]]] = {
    "commands": commands.lines,
    "files": running.files,
    "json": running.json_lines,
    "python": python_names.lines,
    "ros": running.ros,
    "rules": rules.lines,
    "settings": settings.lines,
}
"""The kinds of facts by the names of their files."""


def text_of(kind: str) -> str:
    """The facts of a kind as they are now."""
    return "".join(f"{line}\n" for line in KINDS[kind]())
