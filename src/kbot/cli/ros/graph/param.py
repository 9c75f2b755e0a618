"""`kbot param`: values by name that a running KBot keeps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kbot.cli.arguments import examples, json_option, output_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.asking import ask, at_option, full_name, read_word, read_yaml, to_yaml
from kbot.text.files import read_text, write_text

if TYPE_CHECKING:
    from kbot.ros.graph.client import GraphClient

_ROS2_PARAMETERS, _EVERY_NODE = "ros__parameters", "**"
"""What stands between a node and its parameters in files of ROS 2, and instead of a node."""


def _name_argument(function: click.decorators.FC) -> click.decorators.FC:
    """`NAME`, or `NODE NAME` as ROS 2 has it, as `name: tuple[str, ...]`."""
    return click.argument("name", nargs=-1, required=True, metavar="[NODE] NAME", callback=_two_at_most)(
        function
    )


def _two_at_most(
    context: click.Context, parameter: click.Parameter, words: tuple[str, ...]
) -> tuple[str, ...]:
    if len(words) > 2:
        raise click.UsageError(f"one NODE and one NAME are taken, not {' '.join(words)}", context)
    return words


@click.group(
    "param",
    epilog=examples(
        "kbot param get /robot_description > robot.urdf",
        "kbot param set /speed 0.5",
        "kbot param dump -o params.yaml",
        "kbot param load params.yaml",
    ),
)
def command() -> None:
    """Read and set the parameters of a running KBot, like `ros2 param`.

    If KBot is connected to a ROS 1 master, both have the same parameters.
    """


@command.command("list", epilog=examples("kbot param list"))
@click.argument("node", metavar="[NODE]", default="")
@at_option
def list_(node: str, at: str) -> None:
    """List the parameters.

    With NODE, list only the parameters in its namespace. A node of KBot, such as /kbot, has all
    parameters.
    """
    with ask(at) as graph:
        click.echo("\n".join(_names(graph, node)))


@command.command("get", epilog=examples("kbot param get /use_sim_time", "kbot param get /kbot use_sim_time"))
@_name_argument
@json_option
@at_option
def get(name: tuple[str, ...], as_json: bool, at: str) -> None:
    """Print a parameter's value.

    Strings are printed without quotes, other values as YAML.

    NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    with ask(at) as graph:
        value = _get(graph, _found(graph, *name))
    if as_json:
        print_json(value)
    else:
        click.echo(value if isinstance(value, str) else to_yaml(value))


@command.command("describe", epilog=examples("kbot param describe /use_sim_time"))
@_name_argument
@at_option
def describe(name: tuple[str, ...], at: str) -> None:
    """Print a parameter's type.

    NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    with ask(at) as graph:
        full = _found(graph, *name)
        kind = _kind(_get(graph, full))
    click.echo(f"Parameter name: {full}\n  Type: {kind}")


@command.command("set", epilog=examples("kbot param set /speed 0.5", "kbot param set /names '[a, b]'"))
@_name_argument
@click.argument("value")
@at_option
def set_(name: tuple[str, ...], value: str, at: str) -> None:
    """Set a parameter.

    VALUE is YAML. NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    with ask(at) as graph:
        _set(graph, _found(graph, *name), read_word(value, "VALUE", "0.5 or '[a, b]'"))


@command.command("delete", epilog=examples("kbot param delete /speed"))
@_name_argument
@at_option
def delete(name: tuple[str, ...], at: str) -> None:
    """Delete a parameter.

    NODE NAME means NODE/NAME, or /NAME if only that exists.
    """
    with ask(at) as graph:
        full = _found(graph, *name)
        _get(graph, full)  # says which is meant, where there is none
        graph.call("/rosapi/delete_param", name=full)


@command.command("dump", epilog=examples("kbot param dump -o params.yaml"))
@click.argument("node", metavar="[NODE]", default="")
@output_option("--output")
@at_option
def dump(node: str, output: str | None, at: str) -> None:
    """Print the parameters as YAML, like `rosparam dump`.

    With NODE, print only the parameters in its namespace. A node of KBot, such as /kbot, has all
    parameters.
    """
    with ask(at) as graph:
        values = {name: _get(graph, name) for name in _names(graph, node)}
    tree: dict[str, Any] = {}
    for name, value in values.items():
        *folders, last = name.strip("/").split("/")
        place = tree
        for folder in folders:
            place = place.setdefault(folder, {})
        place[last] = value
    if output is None:
        click.echo(to_yaml(tree))
    else:
        write_text(output, to_yaml(tree) + "\n")


@command.command("load", epilog=examples("kbot param load params.yaml", "kbot param load gains.yaml /arm"))
@click.argument("file")
@click.argument("namespace", default="/")
@at_option
def load(file: str, namespace: str, at: str) -> None:
    """Set parameters from a YAML file of ROS 1 or ROS 2.

    NAMESPACE is put before each name. The order of ROS 2, NODE FILE, works too.
    """
    if not Path(file).is_file() and Path(namespace).is_file():
        file, namespace = namespace, file
    text = read_text(file)
    values = read_yaml(text, file, "gain: 0.5")
    if not isinstance(values, dict):
        fail(f"{file} is to hold parameters by name")
    prefix = full_name(namespace).rstrip("/")
    nodes = {f"/{str(name).strip('/')}" for name in values} if _ROS2_PARAMETERS in text else set()
    with ask(at) as graph:
        _load(graph, "" if prefix in nodes else prefix, values)


def _load(graph: GraphClient, prefix: str, values: dict[str, Any]) -> None:
    for name, value in values.items():
        inner = str(name).strip("/")
        full = prefix if inner in (_ROS2_PARAMETERS, _EVERY_NODE) else f"{prefix}/{inner}"
        if isinstance(value, dict):
            _load(graph, full, value)
        else:
            _set(graph, full, value)


def _names(graph: GraphClient, node: str) -> list[str]:
    """The names of all parameters, or of those beneath a name. Raises KbotError: there are none."""
    names = sorted(graph.call("/rosapi/get_param_names")["names"])
    if not node or full_name(node) in graph.call("/rosapi/nodes")["nodes"]:
        return names
    beneath = full_name(node).rstrip("/") + "/"
    found = [name for name in names if name.startswith(beneath)]
    return found or fail(f"there are no parameters beneath {beneath}: see kbot param list")


def _found(graph: GraphClient, *words: str) -> str:
    """The full name of `NAME`, or of ROS 2's `NODE NAME`: the node's own, else the one that all share."""
    if len(words) == 1:
        return full_name(words[0])
    node, name = words
    own, shared = f"{full_name(node)}{full_name(name)}", full_name(name)
    names = graph.call("/rosapi/get_param_names")["names"]
    return shared if shared in names and own not in names else own


def _get(graph: GraphClient, name: str) -> Any:  # noqa: ANN401 - what a parameter can hold
    return json.loads(graph.call("/rosapi/get_param", name=name)["value"])


def _kind(value: object) -> str:
    """In the words of `ros2 param describe`."""
    if isinstance(value, list):
        kinds = {_kind(item) for item in value}
        return f"{kinds.pop()} array" if len(kinds) == 1 else "list"
    return {bool: "boolean", int: "integer", float: "double", str: "string"}.get(type(value), "dictionary")


def _set(graph: GraphClient, name: str, value: Any) -> None:  # noqa: ANN401 - what a parameter can hold
    if value is None:
        fail(f"{name} is given no value; to take it away: kbot param delete {name}")
    try:
        text = json.dumps(value)
    except (TypeError, ValueError):
        fail(f"{name}: a parameter is a number, a text, true, false, or a list of them")
    graph.call("/rosapi/set_param", name=name, value=text)
