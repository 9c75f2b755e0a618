"""Definitions of service types for ROS 1 and ROS 2, made from the classes of their requests and responses."""

from __future__ import annotations

import dataclasses
import hashlib
from functools import cache
from typing import TYPE_CHECKING, Any

from kbot.record.encodings.definitions import constants, fields, part_name
from kbot.record.encodings.types import ros1_definition, ros2_types
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc

EVENT = "service_msgs/msg/ServiceEventInfo"


@dataclasses.dataclass(frozen=True)
class ServiceType:
    """The type of a service. `name` is in the form of ROS 1, without `/srv/`."""

    name: str
    request: type
    response: type

    @property
    def ros2_name(self) -> str:
        return self.name.replace("/", "/srv/")

    @property
    def request_name(self) -> str:
        """The name of the request's type, in the type stores of ROS 1 and ROS 2."""
        return part_name(self.name, "Request")

    @property
    def response_name(self) -> str:
        """The name of the response's type, in the type stores of ROS 1 and ROS 2."""
        return part_name(self.name, "Response")

    @property
    def md5(self) -> str:
        """The MD5 sum as ROS 1 computes it, over request and response. A nested type counts as its own
        sum."""
        return _md5(self.name)


def service_type(name: str) -> ServiceType:
    """The type of a name with or without `/srv/`. Raises KbotError: KBot does not have it."""
    from kbot.messages.services import SERVICES  # imported lazily, for a fast start-up

    short = name.replace("/srv/", "/")
    if short not in SERVICES:
        hint = did_you_mean(short, SERVICES)
        raise KbotError(f"unknown service type {name}" + (f": {hint}" if hint else ""))
    return ServiceType(short, *SERVICES[short])


@cache
def _md5(service: str) -> str:
    from kbot.messages.services import SERVICES

    digest = hashlib.md5(usedforsecurity=False)
    for cls in SERVICES[service]:
        lines = list(constants(cls))
        for name, kind in fields(cls, ros1=True):
            full = kind.removesuffix("[]").replace("/", "/msg/")
            lines.append(f"{ros1_definition(full)[1] if '/' in kind else kind} {name}")
        digest.update("\n".join(lines).encode())
    return digest.hexdigest()


@cache
def service_hash(name: str) -> str:
    """The RIHS01 hash of a service type, which rmw_zenoh puts into keys. It is computed over a type that
    holds the request, the response and an event. https://github.com/ros-infrastructure/rep/pull/381"""
    kind = service_type(name)
    known = ros2_types().fielddefs
    parts = dict(known[kind.request_name][1]), dict(known[kind.response_name][1])
    return hash_of_service(kind.ros2_name, *parts)


# Any: rosbags describes fields by nested tuples
def hash_of_service(name: str, request: dict[str, Any], response: dict[str, Any]) -> str:
    """The RIHS01 hash of any service type, from the fields of its request and response in the form of
    rosbags."""
    from rosbags.interfaces import Nodetype
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    request_name, response_name, event = f"{name}_Request", f"{name}_Response", f"{name}_Event"

    def at_most_one(part: str) -> FieldDesc:
        return Nodetype.SEQUENCE, ((Nodetype.NAME, part), 1)

    fields: dict[str, dict[str, Any]] = {
        request_name: request,
        response_name: response,
        event: {
            "info": (Nodetype.NAME, EVENT),
            "request": at_most_one(request_name),
            "response": at_most_one(response_name),
        },
        name: {
            "request_message": (Nodetype.NAME, request_name),
            "response_message": (Nodetype.NAME, response_name),
            "event_message": (Nodetype.NAME, event),
        },
    }
    store.fielddefs.update(ros2_types().fielddefs)
    constants, event_fields = store.fielddefs[EVENT]
    # the hash is computed with uint8 where the .msg file of ROS 2 has char
    octets: Any = Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)
    store.fielddefs[EVENT] = (
        constants,
        [(field, octets if field == "client_gid" else desc) for field, desc in event_fields],
    )
    store.fielddefs.update({part: ([], list(found.items())) for part, found in fields.items()})
    return store.hash_rihs01(name)
