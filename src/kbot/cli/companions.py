"""Options of the verbs that simulate: `--record`, and a flag for each bridge."""

from __future__ import annotations

import dataclasses
import functools
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kbot.cli.output import fail
from kbot.ros.peer_options import CompanionOptions

if TYPE_CHECKING:
    from kbot.ros.peers import Companions
    from kbot.sim import Simulation

    Join = Callable[[Simulation, str, str], None]

_Function = TypeVar("_Function", bound=Callable[..., Any])


def companion_options(function: _Function) -> _Function:
    """The options of a recording and of bridges, handed to the verb as one `options: CompanionOptions`."""

    @functools.wraps(function)
    def with_wishes(
        *args: object,
        record: str | None,
        record_topics: tuple[str, ...],
        options: CompanionOptions,
        **others: object,
    ) -> object:
        if record_topics and record is None:
            fail("--record-topic goes with --record FILE")
        if record == "":
            fail("--record is given no name: which file is to be written?")
        options = dataclasses.replace(options, record=record or "", topics=record_topics)
        return function(*args, options=options, **others)

    wrapped: Any = bridge_options(with_wishes)
    for option in reversed(_RECORD_OPTIONS):
        wrapped = option(wrapped)
    result: _Function = wrapped
    return result


def bridge_options(function: _Function) -> _Function:
    """The options of bridges alone, as `options: CompanionOptions`."""

    @functools.wraps(function)
    def with_wishes(
        *args: object,
        ros1: bool,
        ros2: bool,
        zenoh: bool,
        foxglove: bool,
        rosbridge: bool,
        bridges: str | None,
        bridge_host: str | None,
        navigation: bool,
        **others: object,
    ) -> object:
        found = _found() if bridges else ()
        options = CompanionOptions(
            ros1=ros1 or "ros1" in found,
            ros2=ros2 or "ros2" in found,
            zenoh=zenoh or "zenoh" in found,
            foxglove=foxglove or "foxglove" in found,
            rosbridge=rosbridge or "rosbridge" in found,
            host=bridge_host,
            navigation=navigation,
        )
        if bridge_host is not None and not options.is_live:
            fail("--bridge-host goes with a bridge, such as --ros1")
        if not navigation and not options.is_live:
            fail("--no-navigation goes with a bridge, such as --ros1")
        return function(*args, options=options, **others)

    wrapped: Any = with_wishes
    for option in reversed(_BRIDGE_OPTIONS):
        wrapped = option(wrapped)
    result: _Function = wrapped
    return result


def _found() -> tuple[str, ...]:
    """The bridges that have a peer; why the others have none is said."""
    from kbot.ros.bridges.discovery import peers_around

    found, missing = peers_around()
    for why in missing:
        click.echo(f"no {why}", err=True)
    return found


_RECORD_OPTIONS = (
    click.option(
        "--record",
        metavar="FILE",
        help="File to record the run to: .mcap, .bag (ROS 1), or a rosbag2 folder if FILE has no suffix.",
    ),
    click.option(
        "--record-topic",
        "record_topics",
        multiple=True,
        metavar="NAME",
        show_default="all topics",
        help="Topic to record. Can be repeated.",
    ),
)

_BRIDGE_OPTIONS = (
    click.option("--ros1", is_flag=True, help="Connect as a ROS 1 node; start a master if none is running."),
    click.option(
        "--ros2", is_flag=True, help="Connect as a ROS 2 node over DDS. Needs pip install 'kbot[ros2]'."
    ),
    click.option(
        "--zenoh", is_flag=True, help="Connect as a ROS 2 node over Zenoh. Needs pip install 'kbot[zenoh]'."
    ),
    click.option(
        "--foxglove",
        is_flag=True,
        help="Start a server for Foxglove and Lichtblick on port 8765, or the next free port.",
    ),
    click.option(
        "--rosbridge",
        is_flag=True,
        help="Start a server for roslibjs and roslibpy on port 9090, or the next free port.",
    ),
    click.option(
        "--bridges",
        type=click.Choice(["auto"]),
        help="Open the Foxglove and rosbridge servers, and every other bridge that finds a peer.",
    ),
    click.option(
        "--bridge-host",
        metavar="ADDRESS",
        show_default="this machine only",
        help="Address of this machine at which other machines reach the bridges. Also lets KBot contact "
        "ROS 1 nodes on other machines.",
    ),
    click.option(
        "--no-navigation",
        "navigation",
        flag_value=False,
        default=True,
        help="Leave goals, plan and map to a peer such as Nav2.",
    ),
)


@contextmanager
def going_along(options: CompanionOptions, *, served: bool = False) -> Iterator[Join]:
    """What is wished for, until the end of the block; each simulation is to be handed to it. `served`: it
    runs by the wall's clock, so that `kbot topic` and its like may ask it.

    Raises:
        KbotError: the recording cannot be made, or a bridge cannot be opened.
        Exit: with status 2 at the end, if the recording broke off; why was told when it happened.
    """
    if not options and not served:
        yield lambda simulation, description, world: None
        return
    with companions(options, served=served) as going:
        yield going.join


@contextmanager
def companions(options: CompanionOptions, *, served: bool = False) -> Iterator[Companions]:
    """As `going_along`, for those who show robots too.

    Raises:
        KbotError, Exit: as `going_along`.
    """
    from kbot.ros.peers import Companions

    going = Companions(options, lambda text: click.echo(text, err=True), served=served)
    try:
        with _ended_by_signals(going):
            yield going
    finally:
        going.close()
    if going.failure is not None:
        raise click.exceptions.Exit(2)


@contextmanager
def _ended_by_signals(going: Companions) -> Iterator[None]:
    """Within it Ctrl-C, SIGTERM and a terminal that closes end the program in order."""

    def end(number: int, frame: object) -> None:
        going.interrupt(KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number))

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, end) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
