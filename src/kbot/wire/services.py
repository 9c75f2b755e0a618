"""Services' types as ROS 1 and ROS 2 define them, made of what each is asked and answers."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from kbot.messages import services as messages
from kbot.messages.services import SERVICES
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

BASES = {str: "string", bool: "bool", float: "float64"}
ROS1_TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
PARTS = {
    cls: f"gazebo_msgs/msg/{cls.__name__}"
    for cls in (
        messages.ModelState,
        messages.LinkState,
        messages.EntityState,
        messages.ModelStates,
        messages.LinkStates,
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
    hints = get_type_hints(cls)
    for field in dataclasses.fields(cls):
        yield field.name, _kind(hints[field.name], ros1)


def _kind(hint: Any, ros1: bool) -> str:  # noqa: ANN401
    from kbot.wire.types import ros_name

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
