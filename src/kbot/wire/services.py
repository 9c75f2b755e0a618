"""Services' types as ROS 1 and ROS 2 define them, made of what each is asked and answers."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

from kbot.messages import gz_services
from kbot.messages import services as messages
from kbot.messages.services import SERVICES
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc

BASES = {str: "string", bool: "bool", float: "float64"}
ROS1_TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
EVENT = "service_msgs/msg/ServiceEventInfo"
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


def own_definitions() -> Iterator[tuple[str, str]]:
    """Names and texts of the types that are added to those ROS ships, in the order they need each other."""
    for cls, name in PARTS.items():
        yield name, definition(cls)
    for service, (request, response) in SERVICES.items():
        yield _part(service, "Request"), definition(request)
        yield _part(service, "Response"), definition(response)


@dataclasses.dataclass(frozen=True)
class ServiceType:
    """A service's type; `name` as ROS 1 writes it, without `/srv/`."""

    name: str
    request: type
    response: type

    @property
    def ros2_name(self) -> str:
        return self.name.replace("/", "/srv/")

    @property
    def request_name(self) -> str:
        """The name of the type that is asked, in both stores."""
        return _part(self.name, "Request")

    @property
    def response_name(self) -> str:
        return _part(self.name, "Response")

    @property
    def md5(self) -> str:
        """As ROS 1 reckons it: over both parts, each nested type by its own sum."""
        return _md5(self.name)


def service_type(name: str) -> ServiceType:
    """A type by its name, with or without `/srv/`. Raises KbotError: KBot has no such type."""
    short = name.replace("/srv/", "/")
    if short not in SERVICES:
        hint = did_you_mean(short, SERVICES)
        raise KbotError(f"there is no type of service {name}" + (f": {hint}" if hint else ""))
    return ServiceType(short, *SERVICES[short])


def definition(cls: type, *, ros1: bool = False) -> str:
    """The fields of a message as ROS writes them."""
    return "\n".join(f"{kind} {name}" for name, kind in _fields(cls, ros1))


def _part(service: str, part: str) -> str:
    return f"{service.replace('/', '/msg/')}_{part}"


def _fields(cls: type, ros1: bool) -> Iterator[tuple[str, str]]:
    hints = get_type_hints(cls, include_extras=True)
    for field in dataclasses.fields(cls):
        yield field.name, _kind(hints[field.name], ros1)


def _kind(hint: object, ros1: bool) -> str:
    from kbot.wire.types import ros_name

    if get_origin(hint) is Annotated:  # an int, and which one
        return str(get_args(hint)[1])
    if get_origin(hint) is tuple:
        return f"{_kind(get_args(hint)[0], ros1)}[]"
    if hint in BASES:
        return BASES[hint]
    name = ros_name(hint).replace("/msg/", "/")
    return ROS1_TIMES.get(name, name) if ros1 else name


@cache
def _md5(service: str) -> str:
    from kbot.wire.types import ros1_definition

    digest = hashlib.md5(usedforsecurity=False)
    for cls in SERVICES[service]:
        lines = []
        for name, kind in _fields(cls, ros1=True):
            full = kind.removesuffix("[]").replace("/", "/msg/")
            lines.append(f"{ros1_definition(full)[1] if '/' in kind else kind} {name}")
        digest.update("\n".join(lines).encode())
    return digest.hexdigest()


@cache
def service_hash(name: str) -> str:
    """RIHS01 hash of a service's type, as rmw_zenoh puts it into keys: over a type with the request, the
    response and an event. https://github.com/ros-infrastructure/rep/pull/381"""
    from kbot.wire.types import ros2_types

    kind = service_type(name)
    known = ros2_types().fielddefs
    parts = dict(known[kind.request_name][1]), dict(known[kind.response_name][1])
    return hash_of_service(kind.ros2_name, *parts)


def hash_of_service(name: str, request: dict[str, Any], response: dict[str, Any]) -> str:
    """The same of any service, from the fields of its two parts as rosbags describes them."""
    from rosbags.interfaces import Nodetype
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    asked, answered, event = f"{name}_Request", f"{name}_Response", f"{name}_Event"

    def some(part: str) -> FieldDesc:
        return Nodetype.SEQUENCE, ((Nodetype.NAME, part), 1)

    fields: dict[str, dict[str, Any]] = {
        asked: request,
        answered: response,
        event: {
            "info": (Nodetype.NAME, EVENT),
            "request": some(asked),
            "response": some(answered),
        },
        name: {
            "request_message": (Nodetype.NAME, asked),
            "response_message": (Nodetype.NAME, answered),
            "event_message": (Nodetype.NAME, event),
        },
    }
    from kbot.wire.types import ros2_types

    store.fielddefs.update(ros2_types().fielddefs)
    constants, event_fields = store.fielddefs[EVENT]
    # a char of ROS 2's .msg is an uint8 in what is hashed
    octets: Any = Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)
    store.fielddefs[EVENT] = (
        constants,
        [(field, octets if field == "client_gid" else desc) for field, desc in event_fields],
    )
    store.fielddefs.update({part: ([], list(found.items())) for part, found in fields.items()})
    return store.hash_rihs01(name)
