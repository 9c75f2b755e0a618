"""Generates ROS definitions of message and service types from KBot's classes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import ClassVar, get_args, get_origin, get_type_hints

from kbot.messages.checked import ros_type
from kbot.record.encodings.type_names import PARTS, ros_name

ROS1_TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}


def own_definitions() -> Iterator[tuple[str, str]]:
    """Names and texts of the types that the rosbags library lacks, each after the types that it uses."""
    from kbot.messages.services import SERVICES  # imported lazily, for a fast start-up

    for name, cls in parts().items():
        yield name, definition(cls)
    for service, (request, response) in SERVICES.items():
        yield part_name(service, "Request"), definition(request)
        yield part_name(service, "Response"), definition(response)


def parts() -> dict[str, type]:
    """The classes of the types in `PARTS`, by type name."""
    from kbot.messages import actions, navigation, services

    homes = {
        "map_msgs": navigation,
        "gazebo_msgs": services,
        "control_msgs": actions,
        "move_base_msgs": actions,
    }
    return {
        f"{p}/msg/{name}": getattr(homes[p], name) for p, names in PARTS.items() for name in names.split()
    }


def definition(cls: type, *, ros1: bool = False) -> str:
    """The constants and fields of a message as ROS writes them."""
    return "\n".join((*constants(cls), *(f"{kind} {name}" for name, kind in fields(cls, ros1))))


def part_name(service: str, part: str) -> str:
    """The name of the type of a service's `Request` or `Response`."""
    return f"{service.replace('/', '/msg/')}_{part}"


def constants(cls: type) -> Iterator[str]:
    """The constants as ROS writes them and includes them in the MD5 sum: `int32 STRICT=2`."""
    for name, hint in get_type_hints(cls, include_extras=True).items():
        if get_origin(hint) is ClassVar:
            yield f"{ros_type(get_args(hint)[0])} {name}={getattr(cls, name)}"


def fields(cls: type, ros1: bool) -> Iterator[tuple[str, str]]:
    """The name and ROS type of each field."""
    hints = get_type_hints(cls, include_extras=True)
    for field in dataclasses.fields(cls):
        yield field.name, ros_type(hints[field.name], _name_in_ros1 if ros1 else _name)


def _name(message_type: type) -> str:
    return ros_name(message_type).replace("/msg/", "/")


def _name_in_ros1(message_type: type) -> str:
    return ROS1_TIMES.get(_name(message_type), _name(message_type))
