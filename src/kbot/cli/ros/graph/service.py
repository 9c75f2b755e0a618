"""`kbot service`: list, describe and call services of a running KBot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples, json_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.common import (
    at_option,
    connect,
    full_name,
    listing_options,
    print_listing,
    read_values,
    to_yaml,
)
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.ros.graph.client import GraphClient

_OUTCOME = ("success", "status_message")
"""The fields in which Gazebo's services report success or failure."""


@click.group(
    "service",
    epilog=examples(
        "kbot service list -t",
        "kbot service call /gazebo/pause_physics",
        "kbot service call /gazebo/get_model_state '{model_name: kbot}'",
    ),
)
def command() -> None:
    """List, describe and call services of a running KBot, like `ros2 service`.

    Start KBot first, for example `kbot sim kbot` in another terminal. A simulation provides Gazebo's
    services, such as /gazebo/reset_world and /gazebo/spawn_urdf_model.
    """


@command.command("list", epilog=examples("kbot service list -t"))
@listing_options
def list_(show_types: bool, count: bool, as_json: bool, at: str) -> None:
    """List the services."""
    with connect(at) as graph:
        types = _types(graph, typed=show_types or as_json)
    print_listing(types, show_types, as_json, count)


def _types(graph: GraphClient, *, typed: bool) -> dict[str, str]:
    """The services and, if `typed`, their types as ROS 2 writes them."""
    names = sorted(graph.call("/rosapi/services")["services"])
    names = [name for name in names if not name.startswith("/rosapi/")]
    types = {n: graph.call("/rosapi/service_type", service=n)["type"] if typed else "" for n in names}
    return {name: kind.replace("/", "/srv/") for name, kind in types.items()}


@command.command("type", epilog=examples("kbot service type /gazebo/spawn_urdf_model"))
@click.argument("service")
@at_option
def type_(service: str, at: str) -> None:
    """Print a service's type, request and response."""
    from kbot.record.encodings.definitions import definition  # imported lazily, so that -h stays fast
    from kbot.ros.service_types import service_type

    with connect(at) as graph:
        name = full_name(service)
        kind = graph.call("/rosapi/service_type", service=name)["type"]
        if not kind:
            hint = did_you_mean(name, graph.call("/rosapi/services")["services"])
            fail(f"there is no service {name}" + (f": {hint}" if hint else ""))
    found = service_type(kind)
    click.echo(f"{found.ros2_name}\n{definition(found.request)}\n---\n{definition(found.response)}")


@command.command(
    "call",
    epilog=examples(
        "kbot service call /gazebo/reset_world",
        "kbot service call /gazebo/delete_model '{model_name: crate}' --json",
    ),
)
@click.argument("service")
@click.argument("words", nargs=-1, metavar="[TYPE] [VALUES]")
@json_option
@at_option
def call(service: str, words: tuple[str, ...], as_json: bool, at: str) -> int:
    """Call a service and print its response.

    VALUES are the fields of the request in YAML, as one quoted argument. Fields that you leave out are
    zero or empty.

    Exit status: 0 success; 1 the service reports a failure; 2 the service cannot be called.
    """
    rest = words[1:] if words and "/" in words[0] and not words[0].lstrip().startswith(("{", "[")) else words
    values = read_values(rest, "{model_name: kbot}")
    with connect(at) as graph:
        response = graph.call(full_name(service), **values)
    failed = response.get("success") is False
    if failed:
        click.echo(f"{full_name(service)} failed: {response['status_message']}", err=True)
    if as_json:
        print_json(response)
    elif response:
        # the other fields of a failed call are zero: a reader would take a zero pose for the result
        shown = {key: response[key] for key in _OUTCOME if key in response} if failed else response
        click.echo(to_yaml(shown))
    return int(failed)
