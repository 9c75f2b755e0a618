"""Carries out a launch that has no robot, but recordings that are said again."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import click

from kbot.cli.companions import companions
from kbot.cli.launch_programs import live_for_programs, start_programs
from kbot.messages import Bus, Clock
from kbot.record.playback import Playback

if TYPE_CHECKING:
    from kbot.bridges.wishes import Wishes
    from kbot.launch import Plan
    from kbot.launch.stage import Stage

PERIOD = 0.01
BEHIND = 0.2
"""Seconds of wall time that are caught up at most."""


@dataclass
class _Said:
    """What peers hear."""

    bus: Bus = field(default_factory=Bus)
    clock: Clock = field(default_factory=Clock)
    errands: list[Callable[[], bool]] = field(default_factory=list)
    paused: bool = False


def play_alone(plan: Plan, staged: Stage, wishes: Wishes) -> int:
    """Say the recordings to peers, with the launch's programs beside, until the end of all, or of a required
    one, or Ctrl-C; the exit status. Of a single recording the time of its run is told on /clock.

    Raises:
        KbotError: a recording cannot be read, or a bridge cannot be opened.
    """
    said, playings, speed = _Said(), staged.playings, 1.0
    if len(playings) == 1:
        speed, playings = playings[0].rate, (replace(playings[0], rate=1.0),)
    is_over = [False]

    def end() -> None:
        is_over[0] = True

    tell: Callable[[str], None] = lambda text: click.echo(text, err=True)  # noqa: E731 - given on as it is
    wishes = live_for_programs(staged.programs, wishes)
    with ExitStack() as stack:
        players = [
            Playback(said.bus, said.clock, playing, tell, on_end=end if playing.required else lambda: None)
            for playing in playings
        ]
        if len(players) == 1:
            said.clock.set(players[0].nanoseconds)
        going = stack.enter_context(companions(wishes, served=True))
        going.show(said, players[0].description, players[0].name)
        processes = start_programs(stack, plan, staged.programs, wishes)
        due = time.monotonic()
        with suppress(KeyboardInterrupt):
            while not is_over[0]:
                for errand in tuple(said.errands):
                    errand()
                if not said.paused:
                    said.clock.advance_to(said.clock.nanoseconds + round(PERIOD * speed * 1e9))
                if all(p.is_over for p in players) and (processes is None or processes.are_over):
                    break
                due = max(due + PERIOD, time.monotonic() - BEHIND)
                time.sleep(max(0.0, due - time.monotonic()))
    return processes.status if processes is not None else 0
