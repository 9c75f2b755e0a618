"""What the services of ROS 1's controller manager are asked and answer: controller_manager_msgs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kbot.messages.types import Int32


@dataclass(frozen=True, slots=True)
class HardwareInterfaceResources:
    """An interface of the hardware, and the joints that are claimed by it."""

    hardware_interface: str = ""
    resources: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ControllerState:
    """`state` is initialized, running or stopped."""

    name: str = ""
    state: str = ""
    type: str = ""
    claimed_resources: tuple[HardwareInterfaceResources, ...] = ()


@dataclass(frozen=True, slots=True)
class NothingRequest:
    """What is there is asked for."""


@dataclass(frozen=True, slots=True)
class OkResponse:
    ok: bool = False


@dataclass(frozen=True, slots=True)
class ListControllersResponse:
    controller: tuple[ControllerState, ...] = ()


@dataclass(frozen=True, slots=True)
class ListControllerTypesResponse:
    types: tuple[str, ...] = ()
    base_classes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ControllerRequest:
    """To load one, or to forget it."""

    name: str = ""


@dataclass(frozen=True, slots=True)
class SwitchControllerRequest:
    """`timeout` in s; what is switched is switched at once."""

    BEST_EFFORT: ClassVar[Int32] = 1
    STRICT: ClassVar[Int32] = 2

    start_controllers: tuple[str, ...] = ()
    stop_controllers: tuple[str, ...] = ()
    strictness: Int32 = 0
    start_asap: bool = False
    timeout: float = 0.0


@dataclass(frozen=True, slots=True)
class ReloadControllerLibrariesRequest:
    force_kill: bool = False


CONTROLLER_SERVICES: dict[str, tuple[type, type]] = {
    "controller_manager_msgs/ListControllers": (NothingRequest, ListControllersResponse),
    "controller_manager_msgs/ListControllerTypes": (NothingRequest, ListControllerTypesResponse),
    "controller_manager_msgs/LoadController": (ControllerRequest, OkResponse),
    "controller_manager_msgs/UnloadController": (ControllerRequest, OkResponse),
    "controller_manager_msgs/SwitchController": (SwitchControllerRequest, OkResponse),
    "controller_manager_msgs/ReloadControllerLibraries": (ReloadControllerLibrariesRequest, OkResponse),
}
"""By type, what each is asked and answers."""
