"""Checks topic names by the rules of ROS."""

from __future__ import annotations

import re

from kbot.text import KbotError

LONGEST = 255
"""Characters of a topic name, the limit of DDS."""
_FULL = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


def require_topic_name(topic: str) -> None:
    """Raises KbotError: ROS does not accept the full name of a topic.

    The rules are those that hold in ROS 1 and in ROS 2, and the length is that of DDS:
    https://design.ros2.org/articles/topic_and_service_names.html
    """
    shown = topic if len(topic) <= 60 else f"{topic[:57]}..."
    if not _FULL.fullmatch(topic):
        rule = "use letters, digits and _ between slashes, and no digit after a slash"
        raise KbotError(f"{shown!a} is not a valid topic name in ROS: {rule}")
    if len(topic) > LONGEST:
        raise KbotError(f"the topic name '{shown}' has {len(topic)} characters: the limit is {LONGEST}")
