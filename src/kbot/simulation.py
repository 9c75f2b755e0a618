"""`kbot.Simulation`: a simulation that a notebook can show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kbot import sim

if TYPE_CHECKING:
    from kbot.workbench.notebook import NotebookView


class Simulation(sim.Simulation):
    __doc__ = sim.Simulation.__doc__

    def show(self, moments: Sequence[sim.State] = (), *, height: int = 480) -> NotebookView:
        """The robot and its world as they stand, for a notebook; `height` in pixels.

        `moments` are what `state()` gave, in order of time: with them a slider goes through what was.

            moments = []
            for _ in range(100):
                sim.run(0.05)
                moments.append(sim.state())
            sim.show(moments)

        Raises:
            KbotError: a moment is another simulation's.
        """
        from kbot.workbench.notebook import show_simulation

        return show_simulation(self, moments, height)
