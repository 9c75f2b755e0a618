"""What each rviz has: its packages, panels and tools, and the one robot that is shown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeAlias

from kbot.workbench.displays.marked_yaml import Marked

Version: TypeAlias = Literal[1, 2]
ROS1, ROS2 = "rviz", "rviz_default_plugins"
PACKAGES: Mapping[Version, str] = {1: ROS1, 2: ROS2}
"""Where displays, tools and views of each version are."""
NOT_IN_RVIZ_1 = ("TwistStamped", "Wrench")
TOOLS = ("Interact", "MoveCamera", "Select", "FocusCamera", "Measure")
TOPICS_OF_TOOLS = {
    "SetInitialPose": ("/initialpose", "/initialpose"),
    "SetGoal": ("/move_base_simple/goal", "/goal_pose"),
    "PublishPoint": ("/clicked_point", "/clicked_point"),
}
"""Tools that publish, and where they do in rviz 1 and in rviz 2."""

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


def version_of(document: Mapping[str, Any]) -> Version:
    """The rviz that wrote a configuration, by the packages of what is in it; 2 where nothing tells."""
    return 1 if any(name.startswith(f"{ROS1}/") for name in _classes(document)) else 2


def new_document(version: Version) -> dict[str, Any]:
    """A configuration with no displays; with the tools of a new rviz, which has none but a file's."""
    package = PACKAGES[version]
    tools: list[dict[str, Any]] = [{"Class": f"{package}/{name}"} for name in TOOLS]
    for name, topics in TOPICS_OF_TOOLS.items():
        topic = topics[version - 1]
        tools.append({"Class": f"{package}/{name}", "Topic": topic if version == 1 else {"Value": topic}})
    panels = "rviz" if version == 1 else "rviz_common"
    return {
        "Panels": [{"Class": f"{panels}/{name}", "Name": name} for name in ("Displays", "Views")],
        "Visualization Manager": {
            "Class": "",
            "Displays": [],
            "Enabled": True,
            "Global Options": {},
            "Name": "root",
            "Tools": tools,
            "Value": True,
        },
    }


def _classes(part: object) -> Iterator[str]:
    if isinstance(part, Mapping):
        if isinstance(part.get("Class"), str):
            yield part["Class"]
        part = list(part.values())
    for inner in part if isinstance(part, list) else ():
        yield from _classes(inner)
