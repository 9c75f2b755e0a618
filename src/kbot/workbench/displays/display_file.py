"""The file with the displays' settings: KBot's own (`.kbot.yaml`) or rviz's (`.rviz`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.files import read_source, write_bytes
from kbot.workbench.displays.display_settings import (
    DisplaySettings,
    check,
    marked,
    plain,
    read_settings,
    write_settings,
)
from kbot.workbench.displays.rviz import Version, read_rviz, unwritten, version_of, write_rviz
from kbot.workbench.protocol import Displays, DisplaysSaved, DisplaysText

RVIZ = ".rviz"
SUFFIXES = (".yaml", ".yml", RVIZ)
TITLES = {"kbot": "displays.kbot.yaml", "rviz1": "displays.rviz", "rviz2": "displays.rviz"}
VERSIONS: Mapping[str, Version] = {"rviz1": 1, "rviz2": 2}


class DisplayFile:
    """Reads and writes settings; keeps what a file of rviz has besides, so that it is written back."""

    def __init__(self, path: str = "") -> None:
        """`path` is the file to read and to save to, which need not be there yet; none where it is empty.

        Raises:
            KbotError: it is of another kind, cannot be read, or is malformed; with file:line.
        """
        self.path = path
        self.greeting: Displays | None = None
        """What pages are told first, None where there is nothing to tell."""
        self._rviz: Mapping[str, object] | None = None
        if path:
            _of_known_kind(path)
            text = read_source(path).text if Path(path).exists() else ""
            self.greeting = self.open(path, text) if text else Displays(Path(path).name, path, {}, ())

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the file the page does not show."""
        return self.greeting.notes if self.greeting is not None else ()

    def open(self, name: str, text: str) -> Displays:
        """The settings in a file's text.

        Raises:
            KbotError: it is of another kind, or malformed; with name:line.
        """
        _of_known_kind(name)
        with reading(name):
            if name.endswith(RVIZ):
                found = read_rviz(text, name)
                self._rviz = found.document
                return Displays(Path(name).name, self.path, plain(found.settings), found.notes)
            return Displays(Path(name).name, self.path, plain(read_settings(text, name)), ())

    def hold(self, frame: str) -> None:
        """Make a frame the fixed one, whatever the file says."""
        told = self.greeting or Displays("", "", {}, ())
        options = {**told.setup.get("globals", {}), "frame": frame}
        self.greeting = replace(told, setup={**told.setup, "globals": options})

    def save(self, kind: str, setup: Mapping[str, object], frame: str = "") -> DisplaysText | DisplaysSaved:
        """Write a page's settings: `file` to the file; as a text `kbot`, or `rviz1` or `rviz2`.
        What a file of rviz has besides is kept for the version that wrote it; `frame` is the fixed frame
        there where the settings choose none, for rviz shows nothing without one.

        Raises:
            KbotError: there is no file, it cannot be written, or the settings are none.
        """
        settings = check(marked(dict(setup), "the page"))
        if kind != "file":
            text, notes = self._text(settings, VERSIONS.get(kind), frame)
            return DisplaysText(TITLES[kind], text, notes)
        if not self.path:
            raise KbotError("there is no file to save to: start with --config FILE, or keep a copy instead")
        text, notes = self._text(settings, self._version if self.path.endswith(RVIZ) else None, frame)
        write_bytes(self.path, text.encode())
        # a page that comes later starts with what was saved
        self.greeting = self.open(self.path, text)
        return DisplaysSaved(self.path, notes)

    @property
    def _version(self) -> Version:
        """That of the file of rviz that was read, or that a new one is for."""
        return 2 if self._rviz is None else version_of(self._rviz)

    def _text(
        self, settings: DisplaySettings, version: Version | None, frame: str
    ) -> tuple[str, tuple[str, ...]]:
        if version is None:
            return write_settings(settings), ()
        if frame and not settings.globals.get("frame"):
            settings = replace(settings, globals={**settings.globals, "frame": frame})
        left = [
            f"{name} is left out: rviz {version} has no such display" for name in unwritten(settings, version)
        ]
        if self._rviz is None or self._version == version:
            return write_rviz(settings, self._rviz, version), tuple(left)
        left.append(f"what rviz {self._version} alone knows of the file that was read is left out")
        own = [replace(display, source=-1) for display in settings.displays]
        return write_rviz(replace(settings, displays=tuple(own)), None, version), tuple(left)


def _of_known_kind(name: str) -> None:
    if not name.endswith(SUFFIXES):
        raise KbotError(f"{name}: settings of displays are in a .kbot.yaml or a .rviz file")
