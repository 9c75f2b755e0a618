"""Services that peers can call: name, type, and the function that answers on the simulation's thread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kbot.ros.service_types import ServiceType
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.sim import Simulation

Answer = Callable[["Simulation", Any], Any]  # Any: each service has its own types


@dataclass(frozen=True, slots=True)
class Service:
    """`answer` is given the simulation between two steps, and the request; it returns the response, or
    raises KbotError where the type has no other way to say no."""

    name: str
    type: ServiceType
    answer: Answer


def require_service(services: Mapping[str, Service], name: str) -> Service:
    """Raises KbotError: there is none of this name; the nearest names are said."""
    if name not in services:
        hint = did_you_mean(name, services)
        raise KbotError(f"there is no service {name}" + (f": {hint}" if hint else ""))
    return services[name]
