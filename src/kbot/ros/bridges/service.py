"""A service that peers can call: its name, its type, and the function that answers it."""

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
    """`answer` gets the simulation and the request, between two steps, and returns the response.

    If the response type has no field for a failure, it raises KbotError instead. `prepare` does what takes
    longer than a step, on another thread. `answer` then gets its result instead of the request.
    """

    name: str
    type: ServiceType
    answer: Answer
    prepare: Callable[[Any], Any] | None = None


def require_service(services: Mapping[str, Service], name: str) -> Service:
    """The service of this name. Raises KbotError: there is none. The error suggests similar names."""
    if name not in services:
        hint = did_you_mean(name, services)
        raise KbotError(f"there is no service {name}" + (f": {hint}" if hint else ""))
    return services[name]
