"""Which ROS type each message is, and how ROS 1 and ROS 2 define it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from kbot.messages import control, navigation, sensing, visualization
from kbot.messages import types as messages
from kbot.text import KbotError
from kbot.wire.services import PARTS, own_definitions

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

PACKAGES = (
    "std_msgs",
    "geometry_msgs",
    "nav_msgs",
    "sensor_msgs",
    "trajectory_msgs",
    "tf2_msgs",
    "rosgraph_msgs",
    "actionlib_msgs",
    "visualization_msgs",
    "builtin_interfaces",
)
"""Where a message's namesake is looked for."""

OTHER_NAMES = {"ClockMessage": "Clock"}
TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"


@cache
def ros2_types() -> Typestore:
    """The message types of ROS 2, and those of the services that are offered."""
    return _with_own(_shipped())


@cache
def _shipped() -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)


@cache
def ros1_types() -> Typestore:
    """The same of ROS 1; tf2's are not among those that the library ships."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(TF_MESSAGE, "tf2_msgs/msg/TFMessage"))
    return _with_own(store)


def _with_own(store: Typestore) -> Typestore:
    from rosbags.typesys import get_types_from_msg

    types = {}
    for name, text in own_definitions():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store


@cache
def ros_name(message_type: type) -> str:
    """Name of a message's type as ROS 2 writes it: `nav_msgs/msg/Odometry`.

    Raises:
        KbotError: ROS has no such message.
    """
    if message_type in PARTS:
        return PARTS[message_type]
    name = OTHER_NAMES.get(message_type.__name__, message_type.__name__)
    known = _shipped().fielddefs
    found = next((full for package in PACKAGES if (full := f"{package}/msg/{name}") in known), None)
    if found is None:
        raise KbotError(f"ROS has no message {name}, so it can neither be recorded nor sent")
    return found


@cache
def _known() -> dict[str, type]:
    homes = (messages, sensing, navigation, control, visualization)
    own = {name: message_type for message_type, name in PARTS.items()}
    found = [(home, value) for home in homes for value in vars(home).values() if isinstance(value, type)]
    return own | {ros_name(value): value for home, value in found if value.__module__ == home.__name__}


def known_type(name: str) -> type | None:
    """The message type of a ROS name, with or without `/msg/`; None where KBot has none."""
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
