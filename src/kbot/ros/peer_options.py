"""The options of peers: which bridges a run opens, and how."""

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
    """`bridges` are names of the registry. `host` is the address at which peers reach them, the loopback if
    None. Without `navigation`, goals, plan and map are not bridged. `parameters`, by full name, are there for
    peers to read."""

    bridges: tuple[str, ...] = ()
    host: str | None = None
    navigation: bool = True
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)

    @property
    def is_live(self) -> bool:
        """Whether a bridge is asked for, so that the run has to keep wall-clock time."""
        return bool(self.bridges)

    def describe(self) -> str:
        """Who receives the run's messages, in one sentence."""
        titles = [kind.title for kind in BRIDGES if kind.name in self.bridges]
        if titles:
            return f"Peers: {', '.join(titles)} and kbot topic echo."
        flags = [f"--{kind.name}" for kind in BRIDGES]
        return f"Peers: kbot topic echo. For others, add {', '.join(flags[:-1])} or {flags[-1]}."

    def open(self, report: Callable[[str], None]) -> RosPeers:
        """`report` receives sentences for the user."""
        from kbot.ros.peers import RosPeers  # when opened: it loads the graph server's websockets

        return RosPeers(
            report, self.bridges, self.host, navigation=self.navigation, parameters=self.parameters
        )
