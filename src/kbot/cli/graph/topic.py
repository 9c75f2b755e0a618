"""`kbot topic`: what a running KBot says and hears."""

from __future__ import annotations

import itertools
import re
import statistics
import time
from collections import deque
from typing import Any

import click

from kbot.cli.arguments import examples
from kbot.cli.graph.asking import (
    ask,
    at_option,
    full_name,
    json_option,
    listing_options,
    print_listing,
    read_values,
    to_line,
    to_yaml,
)
from kbot.cli.numbers import Within
from kbot.cli.output import fail, print_json

REPORT_SECONDS = 1.0


@click.group(
    "topic",
    epilog=examples(
        "kbot topic list -t",
        "kbot topic echo /odom --field pose.pose.position --once",
        "kbot topic hz /odom",
        "kbot topic pub /cmd_vel '{linear: {x: 0.2}}' --rate 10",
    ),
)
def command() -> None:
    """Topics of a running KBot, with the words of `ros2 topic`."""


@command.command("list", epilog=examples("kbot topic list -t"))
@listing_options
def list_(show_types: bool, as_json: bool, at: str) -> None:
    """Print the names of the topics."""
    with ask(at) as graph:
        topics = graph.topics()
    print_listing(topics, show_types, as_json)


@command.command("type", epilog=examples("kbot topic type /odom"))
@click.argument("topic")
@at_option
def type_(topic: str, at: str) -> None:
    """Print the type of a topic."""
    with ask(at) as graph:
        click.echo(graph.type_of(full_name(topic)))


@command.command("info", epilog=examples("kbot topic info /cmd_vel"))
@click.argument("topic")
@json_option
@at_option
def info(topic: str, as_json: bool, at: str) -> None:
    """Print a topic's type, and who speaks and listens."""
    with ask(at) as graph:
        name = full_name(topic)
        kind = graph.type_of(name)
        publishers = graph.call("/rosapi/publishers", topic=name)["publishers"]
        subscribers = graph.call("/rosapi/subscribers", topic=name)["subscribers"]
    if as_json:
        print_json({"topic": name, "type": kind, "publishers": publishers, "subscribers": subscribers})
        return
    click.echo(f"Type: {kind}")
    click.echo("\n".join([f"Publisher count: {len(publishers)}", *(f"  {node}" for node in publishers)]))
    click.echo("\n".join([f"Subscription count: {len(subscribers)}", *(f"  {node}" for node in subscribers)]))


@command.command("echo", epilog=examples("kbot topic echo /odom --once", "kbot topic echo /scan -n 5 --json"))
@click.argument("topic")
@click.option("--once", is_flag=True, help="Print one message and end.")
@click.option("-n", "count", type=click.IntRange(1), metavar="N", help="Print so many messages and end.")
@click.option("--field", metavar="A.B", help="Print only this part; [2] takes one of a list.")
@click.option("-f", "--full-length", is_flag=True, help="Print long lists and texts whole.")
@json_option
@at_option
def echo(
    topic: str, once: bool, count: int | None, field: str | None, full_length: bool, as_json: bool, at: str
) -> None:
    """Print messages as they come, until Ctrl-C."""
    with ask(at) as graph:
        messages = graph.listen(full_name(topic))
        for _, message in itertools.islice(messages, 1 if once else count):
            value = _part(message, field) if field else message
            click.echo(to_line(value) if as_json else to_yaml(value, full=full_length) + "\n---")


@command.command("hz", epilog=examples("kbot topic hz /odom", "kbot topic hz /scan --window 50 -n 3"))
@click.argument("topic")
@click.option("-w", "--window", type=click.IntRange(2), default=1000, show_default=True, metavar="N")
@click.option("-n", "count", type=click.IntRange(1), metavar="N", help="Report so many times and end.")
@at_option
def hz(topic: str, window: int, count: int | None, at: str) -> None:
    """Print how often a topic is said, by the wall's clock, once a second until Ctrl-C."""
    with ask(at) as graph:
        gaps: deque[float] = deque(maxlen=window)
        before, reported, reports = 0.0, time.monotonic(), 0
        for _ in graph.listen(full_name(topic)):
            now = time.monotonic()
            if before:
                gaps.append(now - before)
            before = now
            if gaps and now - reported >= REPORT_SECONDS:
                reported, reports = now, reports + 1
                mean = statistics.fmean(gaps)
                click.echo(
                    f"average rate: {1.0 / mean:.3f}\n"
                    f"\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s "
                    f"std dev: {statistics.pstdev(gaps):.5f}s window: {len(gaps) + 1}"
                )
                if reports == count:
                    return


@command.command(
    "pub",
    epilog=examples(
        "kbot topic pub /cmd_vel '{linear: {x: 0.2}}' --rate 10",
        "kbot topic pub --once /cmd_vel geometry_msgs/msg/Twist '{angular: {z: 1.0}}'",
    ),
)
@click.argument("topic")
@click.argument("words", nargs=-1, metavar="[TYPE] [VALUES]")
@click.option("-1", "--once", is_flag=True, help="Say it once.")
@click.option("-t", "--times", type=click.IntRange(1), metavar="N", help="Say it so many times.")
@click.option("-r", "--rate", type=Within(0.01, 1000.0), default=1.0, show_default=True, metavar="HZ")
@at_option
def pub(topic: str, words: tuple[str, ...], once: bool, times: int | None, rate: float, at: str) -> None:
    """Say something on a topic that is heard, until Ctrl-C. VALUES are YAML; what is left out is zero."""
    kind = words[0] if words and re.fullmatch(r"\w+(/msg)?/\w+", words[0]) else ""
    message = read_values(words[bool(kind) :], "{linear: {x: 0.2}}")
    with ask(at) as graph:
        name = full_name(topic)
        known = graph.type_of(name)
        due = time.monotonic()
        for number in itertools.count(1):
            if number > 1:
                graph.publish(name, message)
                graph.settle()
            else:
                graph.say(name, message, kind or known)
                click.echo(f"publishing on {name}: {to_line(message)}", err=True)
            if once or number == times:
                return
            due = max(due + 1.0 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))


def _part(message: object, field: str) -> Any:  # noqa: ANN401 - whatever the field holds
    """`pose.pose.position` or `ranges[3]` of a message. Raises KbotError: it has no such part."""
    from kbot.text.suggest import did_you_mean

    value: Any = message
    for name in re.findall(r"[^.\[\]]+", field):
        if isinstance(value, dict) and name in value:
            value = value[name]
        elif isinstance(value, list) and name.isdecimal() and int(name) < len(value):
            value = value[int(name)]
        elif isinstance(value, list):
            fail(f"{field}: '{name}' is none of the {len(value)} items there")
        else:
            names = list(value) if isinstance(value, dict) else []
            hint = did_you_mean(name, names) or f"there are {', '.join(names) or 'none'}"
            fail(f"{field}: there is no '{name}': {hint}")
    return value
