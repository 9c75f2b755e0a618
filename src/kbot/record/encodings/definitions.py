"""Generates ROS definitions of message and service types from KBot's classes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Annotated, ClassVar, get_args, get_origin, get_type_hints

import numpy as np

from kbot.record.encodings.type_names import PARTS, ros_name

BASES = {str: "string", bool: "bool", float: "float64"}
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
            yield f"{_kind(get_args(hint)[0], ros1=True)} {name}={getattr(cls, name)}"


def fields(cls: type, ros1: bool) -> Iterator[tuple[str, str]]:
    """The name and ROS type of each field."""
    hints = get_type_hints(cls, include_extras=True)
    for field in dataclasses.fields(cls):
        yield field.name, _kind(hints[field.name], ros1)


def _kind(hint: object, ros1: bool) -> str:
    if get_origin(hint) is Annotated:  # an int with its ROS type
        return str(get_args(hint)[1])
    if get_origin(hint) is np.ndarray:
        return f"{np.dtype(get_args(get_args(hint)[1])[0]).name}[]"
    if get_origin(hint) is tuple:
        return f"{_kind(get_args(hint)[0], ros1)}[]"
    if hint in BASES:
        return BASES[hint]
    name = ros_name(hint).replace("/msg/", "/")
    return ROS1_TIMES.get(name, name) if ros1 else name
