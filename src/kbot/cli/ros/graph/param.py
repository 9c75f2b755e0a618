"""`kbot param`: read and set the parameters of a running KBot."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples, json_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.common import at_option, connect, full_name, read_word, to_yaml

if TYPE_CHECKING:
    from kbot.ros.graph.client import GraphClient


def _name_argument(function: click.decorators.FC) -> click.decorators.FC:
    """Add the argument `NAME`, or `NODE NAME` as in ROS 2, passed as `name: tuple[str, ...]`."""
    return click.argument("name", nargs=-1, required=True, metavar="[NODE] NAME", callback=_two_at_most)(
        function
    )


def _two_at_most(
    context: click.Context, parameter: click.Parameter, words: tuple[str, ...]
) -> tuple[str, ...]:
    if len(words) > 2:
        raise click.UsageError(f"at most one NODE and one NAME are allowed, not {' '.join(words)}", context)
    return words


@click.group(
    "param",
    epilog=examples("kbot param get /robot_description > robot.urdf", "kbot param set /speed 0.5"),
)
def command() -> None:
    """Read and set the parameters of a running KBot, like `ros2 param`.

    Start KBot first, for example `kbot sim kbot` in another terminal. If KBot is connected to a ROS 1
    master, both have the same parameters.
    """


@command.command("list", epilog=examples("kbot param list"))
@click.argument("node", metavar="[NODE]", default="")
@at_option
def list_(node: str, at: str) -> None:
    """List the parameters.

    With NODE, list only the parameters in its namespace. For KBot's own node, /kbot, list all
    parameters.
    """
    with connect(at) as graph:
        names = sorted(graph.call("/rosapi/get_param_names")["names"])
        if node and full_name(node) not in graph.call("/rosapi/nodes")["nodes"]:
            below = full_name(node).rstrip("/") + "/"
            names = [name for name in names if name.startswith(below)] or fail(
                f"no parameters below {below}. List all parameters with: kbot param list"
            )
    click.echo("\n".join(names))


@command.command("get", epilog=examples("kbot param get /use_sim_time", "kbot param get /kbot use_sim_time"))
@_name_argument
@json_option
@at_option
def get(name: tuple[str, ...], as_json: bool, at: str) -> None:
    """Print a parameter's value.

    Strings are printed without quotes, other values as YAML.

    NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    with connect(at) as graph:
        value = json.loads(graph.call("/rosapi/get_param", name=_resolve(graph, *name))["value"])
    if as_json:
        print_json(value)
    else:
        click.echo(value if isinstance(value, str) else to_yaml(value))


@command.command("set", epilog=examples("kbot param set /speed 0.5", "kbot param set /names '[a, b]'"))
@_name_argument
@click.argument("value")
@at_option
def set_(name: tuple[str, ...], value: str, at: str) -> None:
    """Set a parameter.

    VALUE is YAML. NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    example = "0.5 or '[a, b]'"
    parameter = read_word(value, "VALUE", example)
    if parameter is None:
        fail(f"VALUE is empty. Write a value such as {example}")
    with connect(at) as graph:
        graph.call("/rosapi/set_param", name=_resolve(graph, *name), value=json.dumps(parameter))


def _resolve(graph: GraphClient, *words: str) -> str:
    """The full name of `NAME` or `NODE NAME`: NODE/NAME, or /NAME if only that exists."""
    if len(words) == 1:
        return full_name(words[0])
    node, name = words
    own, shared = f"{full_name(node)}{full_name(name)}", full_name(name)
    names = graph.call("/rosapi/get_param_names")["names"]
    return shared if shared in names and own not in names else own
