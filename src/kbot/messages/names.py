"""Checks names of topics by ROS's rules."""

from __future__ import annotations

import re

from kbot.text import KbotError

LONGEST = 255
_FULL = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


def require_topic_name(topic: str) -> None:
    """Raises KbotError: a topic's full name is none in ROS.

    Of ROS 2's rules those that hold in ROS 1 too, and the length that fits into DDS:
    https://design.ros2.org/articles/topic_and_service_names.html
    """
    shown = topic if len(topic) <= 60 else f"{topic[:57]}..."
    if not _FULL.fullmatch(topic):
        rule = "letters, digits and _ between slashes, no digit first"
        raise KbotError(f"{shown!a} is no topic's name in ROS: {rule}")
    if len(topic) > LONGEST:
        raise KbotError(f"'{shown}' is too long for a topic's name: {len(topic)} characters, not {LONGEST}")
