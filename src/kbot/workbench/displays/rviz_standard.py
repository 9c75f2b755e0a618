"""What needs no word in a configuration of rviz: what each rviz has, and the one robot that is shown."""

from __future__ import annotations

from kbot.workbench.displays.marked_yaml import Marked

STANDARD = ("rviz", "rviz_common", "rviz_default_plugins")
"""Packages whose panels and tools every rviz has."""
THE_ROBOT = {"Robot Description": "robot_description", "Description Topic": "/robot_description"}
"""Where rviz 1 and rviz 2 have the robot from that is shown here anyway."""


def plugins(entries: object) -> list[str]:
    """Classes of panels or tools that do not come with rviz."""
    tables = [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    names = [table["Class"] for table in tables if isinstance(table.get("Class"), str)]
    return [name for name in names if name.partition("/")[0] not in STANDARD]


def is_the_robot(label: str, value: Marked) -> bool:
    """Whether a display's field says no more than that it shows the robot."""
    said = value.plain.get("Value") if isinstance(value.plain, dict) else value.plain
    return label in THE_ROBOT and said == THE_ROBOT[label]
