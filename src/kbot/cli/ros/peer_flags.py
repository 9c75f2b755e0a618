"""The options of peers: a flag for each bridge, made from the registry."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

from kbot.cli.output import fail
from kbot.ros.bridges.registry import BRIDGES, bridges_with_peers
from kbot.ros.peer_options import PeerOptions

DEFAULT = PeerOptions()

_Function = TypeVar("_Function", bound=Callable[..., Any])  # Any: a verb takes whatever its options give


def peer_options(function: _Function) -> _Function:
    """Add the options of peers, passed to the verb as one `peers: PeerOptions`."""

    @functools.wraps(function)
    def with_peers(
        *args: object, bridges: str | None, bridge_host: str | None, navigation: bool, **others: object
    ) -> object:
        flagged = [kind.name for kind in BRIDGES if others.pop(kind.name)]
        found = _bridges_with_peers() if bridges else ()
        names = tuple(kind.name for kind in BRIDGES if kind.name in (*flagged, *found))
        if bridge_host is not None and not names:
            fail("--bridge-host needs a bridge: add --ros1 or another one")
        if not navigation and not names:
            fail("--no-navigation needs a bridge: add --ros1 or another one")
        return function(*args, peers=PeerOptions(names, bridge_host, navigation), **others)

    wrapped: Any = with_peers
    for option in reversed(_OPTIONS):
        wrapped = option(wrapped)
    result: _Function = wrapped
    return result


def _bridges_with_peers() -> tuple[str, ...]:
    """The bridges that find a peer. For each other bridge, the reason is printed to stderr."""
    found, missing = bridges_with_peers()
    for reason in missing:
        click.echo(f"no {reason}", err=True)
    return found


_OPTIONS = (
    *(click.option(f"--{kind.name}", is_flag=True, help=kind.help) for kind in BRIDGES),
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
        help="Do not expose KBot's goal, plan and map topics to peers, for example to use Nav2 instead.",
    ),
)
