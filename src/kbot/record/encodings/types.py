"""The message types of ROS 1 and ROS 2, and KBot's class for each."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from kbot.record.encodings.definitions import own_definitions, parts
from kbot.record.encodings.type_names import ros_name, shipped_types

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

    from kbot.record.encodings.safe_store import SafeStore

TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"
LOG = "time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n"


@cache
def ros2_types() -> SafeStore:
    """The message types of ROS 2, and those of KBot's services."""
    return _with_own(shipped_types())


@cache
def ros1_types() -> SafeStore:
    """The message types of ROS 1. The library lacks that of tf2, and ROS 1 itself that of ROS 2's log."""
    # imported lazily: rosbags is slow to import
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(TF_MESSAGE, "tf2_msgs/msg/TFMessage"))
    store.register(get_types_from_msg(LOG, "rcl_interfaces/msg/Log"))
    return _with_own(store)


def _with_own(store: Typestore) -> SafeStore:
    from rosbags.typesys import get_types_from_msg

    from kbot.record.encodings.safe_store import safe_copy

    types = {}
    for name, text in own_definitions():
        types.update(get_types_from_msg(text, name))
    own = safe_copy(store)
    own.register(types)
    return own


@cache
def _known() -> dict[str, type]:
    from kbot.messages import actions, control, log, navigation, sensing, types, visualization

    homes = (types, sensing, navigation, control, actions, visualization, log)
    found = [(home, value) for home in homes for value in vars(home).values() if isinstance(value, type)]
    return parts() | {ros_name(value): value for home, value in found if value.__module__ == home.__name__}


def known_type(name: str) -> type | None:
    """KBot's class for a ROS type name, with or without `/msg/`. None if there is none."""
    package, _, rest = name.partition("/")
    return _known().get(f"{package}/msg/{rest.removeprefix('msg/')}")


@cache
def ros1_definition(name: str) -> tuple[str, str]:
    """Full text and MD5 of a type's definition in ROS 1."""
    text, md5 = ros1_types().generate_msgdef(name)
    return text, md5


@cache
def ros2_definition(name: str) -> tuple[str, str]:
    """Full text and RIHS01 hash of a type's definition in ROS 2."""
    store = ros2_types()
    return store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name)
