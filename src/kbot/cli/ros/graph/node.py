"""`kbot node`: list and describe the nodes of a running KBot."""

from __future__ import annotations

import click

from kbot.cli.arguments import examples, json_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.common import at_option, connect, count_option, full_name


@click.group("node", epilog=examples("kbot node list", "kbot node info /kbot"))
def command() -> None:
    """List and describe the nodes of a running KBot, like `ros2 node`.

    Start KBot first, for example `kbot sim kbot` in another terminal.
    """


@command.command("list", epilog=examples("kbot node list"))
@count_option
@json_option
@at_option
def list_(count: bool, as_json: bool, at: str) -> None:
    """List the nodes."""
    with connect(at) as graph:
        nodes = graph.call("/rosapi/nodes")["nodes"]
    if count:
        click.echo(len(nodes))
    elif as_json:
        print_json(nodes)
    else:
        click.echo("\n".join(nodes))


@command.command("info", epilog=examples("kbot node info /kbot"))
@click.argument("node")
@json_option
@at_option
def info(node: str, as_json: bool, at: str) -> None:
    """Print the topics a node subscribes to and publishes, and its services."""
    with connect(at) as graph:
        name = full_name(node)
        nodes = graph.call("/rosapi/nodes")["nodes"]
        if name not in nodes:
            fail(f"there is no node {name}. KBot's nodes: {', '.join(nodes)}")
        details = graph.call("/rosapi/node_details", node=name)
        topics = graph.topics()
        services = {s: graph.call("/rosapi/service_type", service=s)["type"] for s in details["services"]}
    found = {
        "Subscribers": {topic: topics[topic] for topic in sorted(details["subscribing"])},
        "Publishers": {topic: topics[topic] for topic in sorted(details["publishing"])},
        "Service Servers": {s: kind.replace("/", "/srv/") for s, kind in sorted(services.items())},
    }
    if as_json:
        print_json({"node": name, **found})
        return
    lines = [name]
    for title, items in found.items():
        lines += [f"  {title}:", *(f"    {item}: {kind}" for item, kind in items.items())]
    click.echo("\n".join(lines))
