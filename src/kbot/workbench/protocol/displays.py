"""The displays' settings, as files have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from kbot.workbench.protocol.values import Name, SettingsText


@dataclass(frozen=True, slots=True)
class Displays:
    """The displays' settings out of a file, as `workbench.displays.settings` has them. `notes` say what of it
    is not shown, and `file` is where the page may save, empty where it may not."""

    name: str
    file: str
    setup: dict[str, Any]
    notes: tuple[str, ...]
    type: Literal["displays"] = "displays"


@dataclass(frozen=True, slots=True)
class DisplaysText:
    """Settings as the text of a file of that name, for the browser to keep."""

    name: str
    text: str
    notes: tuple[str, ...]
    type: Literal["displays_text"] = "displays_text"


@dataclass(frozen=True, slots=True)
class DisplaysSaved:
    """The settings were written to their file."""

    file: str
    notes: tuple[str, ...]
    type: Literal["displays_saved"] = "displays_saved"


@dataclass(frozen=True, slots=True)
class SaveDisplays:
    """Write the displays' settings: to the file they came from, or as a text of KBot's or rviz's kind for the
    browser to keep."""

    kind: Literal["file", "kbot", "rviz1", "rviz2"]
    setup: dict[str, Any]
    type: Literal["save_displays"] = "save_displays"


@dataclass(frozen=True, slots=True)
class OpenDisplays:
    """Show the settings in a file that was chosen in the browser."""

    name: Name
    text: SettingsText
    type: Literal["open_displays"] = "open_displays"
