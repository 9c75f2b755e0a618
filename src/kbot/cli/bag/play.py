"""`kbot bag play`: a recording in real time, with keys that pause it."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from kbot.cli.companions import companions
from kbot.cli.keys import keys

if TYPE_CHECKING:
    from kbot.record.player import Player
    from kbot.ros.peer_options import CompanionOptions

PERIOD = 0.01
BEHIND = 0.2
"""Seconds of wall time that are caught up at most."""
STEP_SECONDS = 0.1


def play(player: Player, options: CompanionOptions, *, rate: float, delay: float, loop: bool) -> None:
    """Say it to peers after a delay (s), until its end, or Ctrl-C, which is no failure.

    Raises:
        KbotError: a bridge cannot be opened, or a message cannot be read.
    """
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
    with suppress(KeyboardInterrupt), companions(options, served=True) as going, keys(pressed):
        going.show(player, player.description, player.path)
        click.echo(_start(player, options, rate=rate, loop=loop), err=True)
        due = time.monotonic()
        begins = due + delay
        while True:
            player.run_errands()
            waits = player.paused or time.monotonic() < begins
            seconds = 0.0 if waits else PERIOD * rate
            if steps[0]:
                steps[0], seconds = steps[0] - 1, STEP_SECONDS
            if not player.advance(seconds) and seconds:
                if not loop:
                    return
                player.rewind()
            due = max(due + PERIOD, time.monotonic() - BEHIND)
            time.sleep(max(0.0, due - time.monotonic()))


def _start(player: Player, options: CompanionOptions, *, rate: float, loop: bool) -> str:
    """What a user is told at the start: what is said, for how long, to whom, and the keys."""
    how = " again and again" if loop else ""
    how += f" at {rate:g} times its rate" if rate != 1.0 else ""
    kinds = {
        "ROS 1": options.ros1,
        "ROS 2": options.ros2,
        "Zenoh": options.zenoh,
        "Foxglove": options.foxglove,
        "rosbridge": options.rosbridge,
    }
    bridges = ", ".join(name for name, is_open in kinds.items() if is_open)
    heard = f"By {bridges}, and kbot topic echo hears it."
    if not bridges:
        others = "--ros1, --ros2, --zenoh, --foxglove or --rosbridge lets others"
        heard = f"No bridge: kbot topic echo hears it; {others}."
    keys_told = "Space pauses it, s steps 0.1 s, Ctrl-C ends it." if sys.stdin.isatty() else "Ctrl-C ends it."
    paused = " It is paused." if player.paused else ""
    return f"{player.path}: {player.length:.3f} s{how}.{paused}\n{heard}\n{keys_told}"
