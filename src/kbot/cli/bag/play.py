"""`kbot bag play`: plays back a recording in real time, with keys that pause it."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from kbot.cli.keys import keys
from kbot.cli.run_outputs import PeerRequest, run_outputs

if TYPE_CHECKING:
    from kbot.record.player import Player

PERIOD = 0.01
BEHIND = 0.2
"""Seconds of wall time that are caught up at most."""
STEP_SECONDS = 0.1


@dataclass(frozen=True, slots=True)
class Pace:
    """`rate` is a factor of wall-clock time, `delay` in seconds."""

    rate: float
    delay: float
    loop: bool
    paused: bool


def play(player: Player, peers: PeerRequest | None, pace: Pace) -> None:
    """Play it back to peers until its end or Ctrl-C, which is not a failure.

    Raises:
        KbotError: a bridge cannot be opened, or a message cannot be read.
    """
    player.paused = pace.paused
    steps = [0]

    def pressed(key: str) -> None:
        if key == " ":
            player.paused = not player.paused
        elif key == "s":
            steps[0] += 1

    if player.summary.broken:
        click.echo(f"{player.summary.broken}; what can be read is played", err=True)
    for topic in player.unknown:
        kind = player.summary.topics[topic].type_name
        click.echo(f"{topic} is not said: KBot does not know {kind}", err=True)
    with suppress(KeyboardInterrupt), run_outputs(peers=peers, served=True) as outputs, keys(pressed):
        outputs.show(player, player.description, player.path)
        click.echo(_start(player, peers, pace), err=True)
        due = time.monotonic()
        begins = due + pace.delay
        while True:
            player.run_errands()
            waits = player.paused or time.monotonic() < begins
            seconds = 0.0 if waits else PERIOD * pace.rate
            if steps[0]:
                steps[0], seconds = steps[0] - 1, STEP_SECONDS
            if not player.advance(seconds) and seconds:
                if not pace.loop:
                    return
                player.rewind()
            due = max(due + PERIOD, time.monotonic() - BEHIND)
            time.sleep(max(0.0, due - time.monotonic()))


def _start(player: Player, peers: PeerRequest | None, pace: Pace) -> str:
    """What is played back, how long it takes, who receives it, and the keys."""
    receivers = f"{peers.describe()}\n" if peers is not None else ""
    how = " again and again" if pace.loop else ""
    how += f" at {pace.rate:g} times its rate" if pace.rate != 1.0 else ""
    keys_told = "Space pauses it, s steps 0.1 s, Ctrl-C ends it." if sys.stdin.isatty() else "Ctrl-C ends it."
    paused = " It is paused." if player.paused else ""
    return f"{player.path}: {player.length:.3f} s{how}.{paused}\n{receivers}{keys_told}"
