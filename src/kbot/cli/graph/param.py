"""`kbot param`: values by name that a running KBot keeps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kbot.cli.arguments import examples
from kbot.cli.graph.asking import ask, at_option, full_name, json_option, read_word, read_yaml, to_yaml
from kbot.cli.output import fail, print_json
from kbot.text.files import write_text

if TYPE_CHECKING:
    from kbot.bridges.graph.client import GraphClient


@click.group(
    "param",
    epilog=examples(
        "kbot param get /robot_description > robot.urdf",
        "kbot param set /speed 0.5",
        "kbot param dump -o params.yaml; kbot param load params.yaml",
    ),
)
def command() -> None:
    """Parameters of a running KBot; the same as those of the ROS 1 master that it bridges to."""


@command.command("list", epilog=examples("kbot param list"))
@at_option
def list_(at: str) -> None:
    """Print the names of the parameters."""
    with ask(at) as graph:
        for name in sorted(graph.call("/rosapi/get_param_names")["names"]):
            click.echo(name)


@command.command("get", epilog=examples("kbot param get /use_sim_time"))
@click.argument("name")
@json_option
@at_option
def get(name: str, as_json: bool, at: str) -> None:
    """Print a parameter's value: a text as it stands, else YAML."""
    with ask(at) as graph:
        value = json.loads(graph.call("/rosapi/get_param", name=full_name(name))["value"])
    if as_json:
        print_json(value)
    else:
        click.echo(value if isinstance(value, str) else to_yaml(value))


@command.command("set", epilog=examples("kbot param set /speed 0.5", "kbot param set /names '[a, b]'"))
@click.argument("name")
@click.argument("value")
@at_option
def set_(name: str, value: str, at: str) -> None:
    """Set a parameter to a value in YAML."""
    with ask(at) as graph:
        _set(graph, full_name(name), read_word(value, "VALUE", "0.5 or '[a, b]'"))


@command.command("delete", epilog=examples("kbot param delete /speed"))
@click.argument("name")
@at_option
def delete(name: str, at: str) -> None:
    """Take a parameter away."""
    with ask(at) as graph:
        graph.call("/rosapi/get_param", name=full_name(name))  # says which is meant, where there is none
        graph.call("/rosapi/delete_param", name=full_name(name))


@command.command("dump", epilog=examples("kbot param dump -o params.yaml"))
@click.option("-o", "--output", metavar="FILE", help="Where to write it.  [default: print it]")
@at_option
def dump(output: str | None, at: str) -> None:
    """Print all parameters as YAML, as `rosparam dump` does."""
    with ask(at) as graph:
        names = sorted(graph.call("/rosapi/get_param_names")["names"])
        values = {n: json.loads(graph.call("/rosapi/get_param", name=n)["value"]) for n in names}
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
    """Set the parameters of a YAML file, under a namespace."""
    try:
        text = Path(file).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        fail(f"{file} is no text in UTF-8")
    values = read_yaml(text, file, "gain: 0.5")
    if not isinstance(values, dict):
        fail(f"{file} is to hold parameters by name")
    with ask(at) as graph:
        _load(graph, full_name(namespace).rstrip("/"), values)


def _load(graph: GraphClient, prefix: str, values: dict[str, Any]) -> None:
    for name, value in values.items():
        full = f"{prefix}/{str(name).strip('/')}"
        if isinstance(value, dict):
            _load(graph, full, value)
        else:
            _set(graph, full, value)


def _set(graph: GraphClient, name: str, value: Any) -> None:  # noqa: ANN401 - what a parameter can hold
    if value is None:
        fail(f"{name} is given no value; to take it away: kbot param delete {name}")
    try:
        text = json.dumps(value)
    except (TypeError, ValueError):
        fail(f"{name}: a parameter is a number, a text, true, false, or a list of them")
    graph.call("/rosapi/set_param", name=name, value=text)
