"""The quality of service (QoS) that publishers of a recorded topic offered, as rosbag2 records it.

A player offers the same. Without it, a player offers latched topics as volatile, and late subscribers such as
rviz2 miss them.

The layout is that of rosbag2 up to version 8 of its metadata, with the numbers of rmw/types.h: Humble reads
nothing else, and Jazzy and later recognise the numbers (rosbag2_storage/src/rosbag2_storage/qos.cpp).
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import TYPE_CHECKING

from kbot.text.yaml import YamlError, load_yaml

if TYPE_CHECKING:
    from rosbags.interfaces import Qos

NOTES_TOPIC = "/kbot/recording"
"""The topic on which formats without metadata records carry metadata, as JSON in a String."""
_LATCHED = frozenset({"/tf_static", "/robot_description", "/map", NOTES_TOPIC})
"""Topics that are latched if a recording does not contain the quality of service."""
_FOREVER = (9223372036, 854775807)
"""Seconds and nanoseconds of RMW_DURATION_INFINITE, the largest time in 63 bits."""
_FOREVER_IN_FOXY = frozenset({(0x7FFFFFFF, 0xFFFFFFFF), (0x7FFFFFFF, 0x7FFFFFFF)})
"""What Foxy and earlier versions of KBot recorded instead. Later versions of rosbag2 replace it too."""
_LONGEST = 1 << 16
"""Characters of a text that is read. A profile has about 300, and each publisher of the topic has one."""


@cache
def offered_qos(is_latched: bool) -> str:
    """The text for a topic that KBot publishes: reliable, and transient local (1) if latched, else volatile
    (2)."""
    from rosbags import interfaces as ros  # imported lazily: rosbags is slow to import

    depth, durability = (
        (1, ros.QosDurability.TRANSIENT_LOCAL) if is_latched else (10, ros.QosDurability.VOLATILE)
    )
    history, reliability, liveliness = (
        ros.QosHistory.KEEP_LAST,
        ros.QosReliability.RELIABLE,
        ros.QosLiveliness.AUTOMATIC,
    )
    forever = ros.QosTime(*_FOREVER)
    return _text(
        ros.Qos(history, depth, reliability, durability, forever, forever, liveliness, forever, False)
    )


@lru_cache(maxsize=1024)
def recorded_qos(topic: str, text: str) -> str:
    """The text for a topic whose recording contains `text`, with numbers.

    If it is empty or not rosbag2's, the text is `offered_qos`, latched for the topics that always are.
    """
    profiles = parsed_qos(text)
    return "\n".join(_text(profile) for profile in profiles) or offered_qos(topic in _LATCHED)


@lru_cache(maxsize=1024)
def is_latched(text: str) -> bool:
    """Whether a publisher of the topic kept messages for late subscribers."""
    return any(profile.durability.name == "TRANSIENT_LOCAL" for profile in parsed_qos(text))


def latches(topic: str, text: str) -> bool:
    """Whether a topic is latched whose recording contains `text`."""
    return is_latched(recorded_qos(topic, text))


def parsed_qos(text: str) -> list[Qos]:
    """The profiles in a text with numbers or names. Empty if the text is empty or not rosbag2's."""
    if not 0 < len(text) <= _LONGEST:
        return []
    from rosbags.rosbag2.metadata import parse_qos

    try:
        found = load_yaml(text)
        # anything but a list is refused: rosbags would parse a text as YAML once more
        return [each for each in parse_qos(found) if _is_valid(each)] if isinstance(found, list) else []
    except (YamlError, LookupError, TypeError, AttributeError):
        return []


def _text(profile: Qos) -> str:
    return (
        f"- history: {profile.history.value}\n  depth: {profile.depth}\n"
        f"  reliability: {profile.reliability.value}\n  durability: {profile.durability.value}\n"
        f"  deadline:\n{_time(profile.deadline)}  lifespan:\n{_time(profile.lifespan)}"
        f"  liveliness: {profile.liveliness.value}\n"
        f"  liveliness_lease_duration:\n{_time(profile.liveliness_lease_duration)}"
        f"  avoid_ros_namespace_conventions: {str(bool(profile.avoid_ros_namespace_conventions)).lower()}"
    )


def _time(time: tuple[int, int]) -> str:
    seconds, nanoseconds = _FOREVER if tuple(time) in _FOREVER_IN_FOXY else time
    return f"    sec: {seconds}\n    nsec: {nanoseconds}\n"


def _is_valid(profile: Qos) -> bool:
    durations = (profile.deadline, profile.lifespan, profile.liveliness_lease_duration)
    numbers = (profile.depth, *(number for duration in durations for number in duration))
    return all(type(number) is int and 0 <= number < 1 << 63 for number in numbers)
