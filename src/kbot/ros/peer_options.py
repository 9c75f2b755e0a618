"""Options of a run's peers: which bridges it opens, and how."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kbot.ros.bridges.registry import BRIDGES
from kbot.ros.parameter_values import ParameterValue

if TYPE_CHECKING:
    from kbot.ros.peers import RosPeers


@dataclass(frozen=True, slots=True)
class PeerOptions:
    """Which bridges to open, and how.

    bridges     names in the registry
    host        the address at which peers reach the bridges; None means the loopback address
    navigation  whether goals, plan and map are bridged
    parameters  values that peers can read, by full name
    """

    bridges: tuple[str, ...] = ()
    host: str | None = None
    navigation: bool = True
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)

    @property
    def is_live(self) -> bool:
        """Whether a bridge is requested, so that the run must keep wall-clock time."""
        return bool(self.bridges)

    def describe(self) -> str:
        """A sentence that names the peers which receive the run's messages."""
        titles = [kind.title for kind in BRIDGES if kind.name in self.bridges]
        if titles:
            return (
                f"Bridges: {', '.join(titles)}. Commands such as kbot topic echo also receive the messages."
            )
        flags = [f"--{kind.name}" for kind in BRIDGES]
        others = f"{', '.join(flags[:-1])} or {flags[-1]}"
        return f"Commands such as kbot topic echo receive the messages. For other tools, add {others}."

    def open(self, report: Callable[[str], None]) -> RosPeers:
        """Open the bridges. `report` receives sentences for the user."""
        from kbot.ros.peers import RosPeers  # imported here because it loads websockets

        return RosPeers(
            report, self.bridges, self.host, navigation=self.navigation, parameters=self.parameters
        )
