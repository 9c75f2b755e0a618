"""Gives the core access to higher layers: parts of `kbot.ros`, and the views of the workbench.

The core uses this module and does not import them itself. A part that is not installed adds nothing.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Protocol

from kbot.text.errors import KbotError

PARTS = ("kbot.ros",)
"""Packages whose module `extensions` adds file kinds of `kbot check`, verbs and peers."""
_NOTEBOOK = "kbot.workbench.notebook"
_LIVE_PAGE = "kbot.workbench.live_page"


class NotebookView(Protocol):
    """The result of `show()`: notebooks display it, `save` writes it to a file. `page` is its HTML."""

    page: str

    def _repr_html_(self) -> str: ...

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page as one HTML file. Raises KbotError: the folder is missing or not writable."""
        ...


class LivePage(Protocol):
    """The result of `Simulation.serve()`. `url` is its address. The end of a `with` block closes it."""

    url: str

    def wait(self) -> None:
        """Serve until Ctrl-C, while the simulation runs on in real time and the page's keys drive."""
        ...

    def close(self) -> None:
        """Close the page. The simulation then steps as fast as possible again."""
        ...

    def __enter__(self) -> LivePage: ...

    def __exit__(self, *_: object) -> None: ...


class TrialProgram(Protocol):
    """A controller that runs as its own process in a trial."""

    @property
    def file(self) -> str:
        """A Python file or an executable."""
        ...

    @property
    def arguments(self) -> Sequence[str]:
        """Of its command line, such as `_speed:=0.2`."""
        ...

    @property
    def transport(self) -> str:
        """How it connects: `local`, `ros1` or `ros2`."""
        ...

    @property
    def lockstep(self) -> bool:
        """Whether time waits for it. Only a `kbot.Node` answers. Without it, the run keeps real time."""
        ...

    @property
    def time_limit(self) -> float:
        """Seconds of wall-clock time within which it answers a tick."""
        ...


class ProgramFailed(KbotError):
    """A program of a trial exited, does not answer, or never connected. `run` and `join` raise it."""


def program_runner() -> ModuleType:
    """The module that runs the programs of trials. It is imported at the first use.

    Its `open_programs(programs, report)` gets each TrialProgram, and returns the `Peers` of a run.

    Raises:
        KbotError: kbot.ros is not installed.
    """
    for part in parts():
        if hasattr(part, "PROGRAM_RUNNER"):
            return import_module(part.PROGRAM_RUNNER)
    raise KbotError("programs of trials need kbot.ros, which is not installed")


def live_page() -> ModuleType:
    """The module that serves a page for a running simulation. It is imported at the first use."""
    return import_module(_LIVE_PAGE)


def notebook() -> ModuleType:
    """The module that shows robots and simulations in a notebook. It is imported at the first use."""
    return import_module(_NOTEBOOK)


@cache
def parts() -> tuple[ModuleType, ...]:
    """The module `extensions` of each installed part."""
    found = []
    for part in PARTS:
        try:
            found.append(import_module(f"{part}.extensions"))
        except ModuleNotFoundError as error:
            if error.name not in (part, f"{part}.extensions"):
                raise
    return tuple(found)
