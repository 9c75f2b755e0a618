"""What is welded together while a world runs, and let go again."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.sim.engine.welds import STANDING, Weld, weld_as_it_stands
from kbot.sim.population import Population
from kbot.text import KbotError


class Attached(Population):
    """A running world whose links and bodies can hold each other."""

    def attach(self, link: str, to: str, robot: str | None = None, to_robot: str | None = None) -> None:
        """Weld a robot's link, as it stands now, to something: another robot's link where `to_robot` is
        given, else a body of the world or a link of the first robot. A gripper holds what it carries, a
        tug its trailer, a dock its robot. The two do not touch each other any longer.

        A reset takes it apart; `state` and `restore` keep it.

        Raises:
            KbotError: no such robot, link or body, the two are one, or are attached already.
        """
        first, second = self._body_called(link, robot), self._body_called(to, to_robot)
        if first == second == STANDING:
            raise KbotError(f"'{link}' and '{to}' stand still for good")
        if first == second:
            raise KbotError(f"'{link}' cannot be attached to itself")
        model, data = self.engine()
        if model.body(first).weldid == model.body(second).weldid:
            raise KbotError(f"'{link}' and '{to}' are one rigid piece already")
        assembly = self._engine.assembly
        if any({first, second} == {weld.first, weld.second} for weld in assembly.welds):
            raise KbotError(f"'{link}' is attached to '{to}' already")
        weld = weld_as_it_stands(model, data, first, second)
        self._use(assembly.with_welds((*assembly.welds, weld)))
        self._note("attach", link=link, to=to, robot=robot, to_robot=to_robot)

    def detach(self, link: str, robot: str | None = None) -> None:
        """Let go whatever a link, or a body of the world that can move, is attached to.

        Raises:
            KbotError: no such robot, link or body, or it is attached to nothing.
        """
        body = self._body_called(link, robot)
        if body == STANDING:
            raise KbotError(f"'{link}' stands still for good: detach what is attached to it")
        assembly = self._engine.assembly
        kept = tuple(weld for weld in assembly.welds if body not in (weld.first, weld.second))
        if len(kept) == len(assembly.welds):
            raise KbotError(f"'{link}' is attached to nothing")
        self._use(assembly.with_welds(kept))
        self._note("detach", link=link, robot=robot)

    @property
    def attachments(self) -> int:
        """How many pairs are attached to each other."""
        return len(self._engine.assembly.welds)

    def _attach_again(self, welds: Iterable[Weld]) -> None:
        """Attach, as they stand now, what was attached in a world before: those of which both are here."""
        model, data = self.engine()
        names = {model.body(i).name: model.body(i).weldid.item() for i in range(model.nbody)}
        kept = tuple(
            weld_as_it_stands(model, data, weld.first, weld.second)
            for weld in welds
            if weld.first in names and weld.second in names and names[weld.first] != names[weld.second]
        )
        if kept:
            self._use(self._engine.assembly.with_welds(kept))
