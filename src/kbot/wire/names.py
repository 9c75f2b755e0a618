"""Which ROS type each message is, by its name."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from kbot.messages import gz_services
from kbot.messages import services as messages
from kbot.text import KbotError

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

PARTS = {
    cls: f"gazebo_msgs/msg/{cls.__name__}"
    for cls in (
        messages.ModelState,
        messages.LinkState,
        messages.EntityState,
        messages.ModelStates,
        messages.LinkStates,
    )
} | {
    cls: f"ros_gz_interfaces/msg/{cls.__name__}"
    for cls in (
        gz_services.Entity,
        gz_services.EntityFactory,
        gz_services.WorldReset,
        gz_services.WorldControl,
    )
}
"""Messages that only services, or topics beside them, have; ROS's own lists lack them."""


@cache
def shipped_types() -> Typestore:
    """The message types of ROS 2 that the library ships."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)


@cache
def ros_name(message_type: type) -> str:
    """Name of a message's type as ROS 2 writes it: `nav_msgs/msg/Odometry`.

    Raises:
        KbotError: ROS has no such message.
    """
    if message_type in PARTS:
        return PARTS[message_type]
    name = OTHER_NAMES.get(message_type.__name__, message_type.__name__)
    known = shipped_types().fielddefs
    found = next((full for package in PACKAGES if (full := f"{package}/msg/{name}") in known), None)
    if found is None:
        raise KbotError(f"ROS has no message {name}, so it can neither be recorded nor sent")
    return found
