"""`kbot bag play`: play back a recording in real time, with keys to pause and step."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from kbot.cli.keys import keys
from kbot.cli.run_outputs import PeerRequest, run_outputs
from kbot.text.render import printable

if TYPE_CHECKING:
    from kbot.record.player import Player

PERIOD = 0.01
"""Wall-clock seconds between two advances of the player."""
BEHIND = 0.2
"""Longest delay, in wall-clock seconds, that playback makes up for. A longer one moves its end."""
STEP_SECONDS = 0.1
"""Seconds of the recording that the key s plays."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How to play back. `rate` is a factor of wall-clock time, `delay` is in seconds."""

    rate: float
    delay: float
    loop: bool
    paused: bool


def play(player: Player, peers: PeerRequest | None, pace: Pace) -> None:
    """Play back to peers until the end or Ctrl-C. Ctrl-C is not an error.

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
        click.echo(f"{player.summary.broken}; playing back the readable part", err=True)
    for topic in player.unknown:
        kind = player.summary.topics[topic].type_name
        click.echo(printable(f"{topic} is not played back: KBot does not know the type {kind}"), err=True)
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
    """The text that is printed at the start: file, duration, receivers, and keys."""
    receivers = f"{peers.describe()}\n" if peers is not None else ""
    how = ", repeated" if pace.loop else ""
    how += f", at {pace.rate:g} times its speed" if pace.rate != 1.0 else ""
    key_help = "Space pauses, s advances by 0.1 s, Ctrl-C stops." if sys.stdin.isatty() else "Ctrl-C stops."
    paused = " It is paused." if player.paused else ""
    return f"{player.path}: {player.length:.3f} s{how}.{paused}\n{receivers}{key_help}"
