"""Read and write the file of the display settings: KBot's own (`.kbot.yaml`) or rviz's (`.rviz`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path

from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.files import read_source, write_text
from kbot.workbench.displays.display_settings import (
    Display,
    DisplaySettings,
    View,
    check,
    marked,
    plain,
    read_settings,
    write_settings,
)
from kbot.workbench.displays.kinds import TOPIC_KINDS
from kbot.workbench.displays.rviz import Version, read_rviz, unsupported, version_of, write_rviz
from kbot.workbench.protocol import Displays, DisplaysSaved, DisplaysText

RVIZ = ".rviz"
SUFFIXES = (".yaml", ".yml", RVIZ)
TITLES = {"kbot": "displays.kbot.yaml", "rviz1": "displays.rviz", "rviz2": "displays.rviz"}
VERSIONS: Mapping[str, Version] = {"rviz1": 1, "rviz2": 2}
SENSORS = ("LaserScan", "PointCloud2", "Range")
"""The displays of sensors that are shown without being asked for. Images hide the view."""
MOST_SENSORS = 8
"""Most of them: each reads its topic from the recording."""


class DisplayFile:
    """Reads and writes display settings. Whatever else is in an rviz file is kept and written back."""

    def __init__(self, path: str = "") -> None:
        """`path` is the file to read and to save to. It may be missing, and it may be empty for no file.

        Raises:
            KbotError: the file is of another kind, cannot be read, or is malformed; with file:line.
        """
        self.path = path
        self.greeting: Displays | None = None
        """The settings that a page receives when it connects, or None."""
        self._rviz: Mapping[str, object] | None = None
        if path:
            _require_known_suffix(path)
            text = read_source(path).text if Path(path).exists() else ""
            self.greeting = self.open(path, text) if text else Displays(Path(path).name, path, {}, ())

    @property
    def notes(self) -> tuple[str, ...]:
        """What the page does not display of the file."""
        return self.greeting.notes if self.greeting is not None else ()

    def open(self, name: str, text: str) -> Displays:
        """Return the settings in a file's text.

        Raises:
            KbotError: the file is of another kind or malformed; with name:line.
        """
        _require_known_suffix(name)
        with reading(name):
            if name.endswith(RVIZ):
                found = read_rviz(text, name)
                self._rviz = found.document
                return Displays(Path(name).name, self.path, plain(found.settings), found.notes)
            return Displays(Path(name).name, self.path, plain(read_settings(text, name)), ())

    def show_frames(self, base: str, topics: Mapping[str, str]) -> None:
        """Show frames with their names and the sensors of `topics` (ROS types, by name), but no robot.

        The view follows the frame `base`.
        """
        sensors = (
            Display(kind.name, name, properties={"topic": name})
            for name, type_name in topics.items()
            for kind in TOPIC_KINDS
            if kind.name in SENSORS and type_name in kind.topics
        )
        # the page would choose sizes for the robot, which has none here
        frames = Display("TF", "TF", properties={"axes": True, "names": True, "length": 0.2})
        view = View(eye=(-3.0, -2.0, 3.0), target=(1.0, 0.0, 0.0), frame=base)
        displays = (Display("Grid", "Grid"), frames, *islice(sensors, MOST_SENSORS))
        settings = DisplaySettings({}, displays, view)
        self.greeting = Displays("", "", plain(settings), ())

    def set_fixed_frame(self, frame: str) -> None:
        """Set the fixed frame, regardless of the file."""
        settings = self.greeting or Displays("", "", {}, ())
        options = {**settings.setup.get("globals", {}), "frame": frame}
        self.greeting = replace(settings, setup={**settings.setup, "globals": options})

    def save(self, kind: str, setup: Mapping[str, object], frame: str = "") -> DisplaysText | DisplaysSaved:
        """Write a page's settings: `file` to the file, `kbot`, `rviz1` or `rviz2` as text for the browser.

        What else an rviz file holds is kept for the rviz version that wrote it. `frame` is the fixed frame of
        an rviz file if the settings choose none, because rviz displays nothing without one.

        Raises:
            KbotError: there is no file, it cannot be written, or the settings are invalid.
        """
        settings = check(marked(dict(setup), "the page"))
        if kind != "file":
            text, notes = self._text(settings, VERSIONS.get(kind), frame)
            return DisplaysText(TITLES[kind], text, notes)
        if not self.path:
            raise KbotError(
                "there is no file to save to: start kbot view or kbot sim --config FILE, or save a copy"
            )
        text, notes = self._text(settings, self._version if self.path.endswith(RVIZ) else None, frame)
        write_text(self.path, text)
        # pages that connect later start with the saved settings
        self.greeting = self.open(self.path, text)
        return DisplaysSaved(self.path, notes)

    @property
    def _version(self) -> Version:
        """The version of the rviz file that was read, otherwise 2."""
        return 2 if self._rviz is None else version_of(self._rviz)

    def _text(
        self, settings: DisplaySettings, version: Version | None, frame: str
    ) -> tuple[str, tuple[str, ...]]:
        if version is None:
            return write_settings(settings), ()
        if frame and not settings.globals.get("frame"):
            settings = replace(settings, globals={**settings.globals, "frame": frame})
        notes = [
            f"{name} is not saved: rviz {version} does not have this display"
            for name in unsupported(settings, version)
        ]
        if self._rviz is None or self._version == version:
            return write_rviz(settings, self._rviz, version), tuple(notes)
        notes.append(f"settings that only rviz {self._version} has are not saved")
        own = [replace(display, source=-1) for display in settings.displays]
        return write_rviz(replace(settings, displays=tuple(own)), None, version), tuple(notes)


def _require_known_suffix(name: str) -> None:
    if not name.endswith(SUFFIXES):
        raise KbotError(f"{name}: display settings must be in a .kbot.yaml or a .rviz file")
