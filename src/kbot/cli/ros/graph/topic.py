"""`kbot topic`: list, print, measure and publish topics of a running KBot."""

from __future__ import annotations

import csv
import io
import itertools
import re
import statistics
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from itertools import pairwise
from typing import Any

import click

from kbot.cli.arguments import examples, json_option, rate_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.common import (
    at_option,
    connect,
    full_name,
    is_type,
    listing_options,
    messages,
    print_listing,
    read_values,
    to_line,
    to_yaml,
)

_KINDS = {int: "integers", float: "numbers", bool: "booleans", str: "strings", dict: "messages"}


@dataclass(frozen=True, slots=True)
class Style:
    """How `echo` prints messages: each field is an option of that name."""

    as_json: bool = False
    csv: bool = False
    flow_style: bool = False
    full: bool = False
    no_arr: bool = False
    no_str: bool = False

    def text(self, value: object) -> str:
        """A value as it is printed. In YAML, a line `---` ends each message."""
        value = self._reduced(value) if self.no_arr or self.no_str else value
        if self.as_json:
            return to_line(value)
        if self.csv:
            line = io.StringIO()
            csv.writer(line, lineterminator="").writerow(_leaves(value))
            return line.getvalue()
        return to_yaml(value, full=self.full, flow=self.flow_style) + "\n---"

    def _reduced(self, value: object) -> object:
        if isinstance(value, dict):
            return {key: self._reduced(item) for key, item in value.items()}
        if isinstance(value, list) and self.no_arr:
            kind = _KINDS.get(type(value[0]), "values") if value else "values"
            return f"<{len(value)} {kind}>"
        if isinstance(value, list):
            return [self._reduced(item) for item in value]
        if isinstance(value, str) and self.no_str:
            return f"<{len(value)} characters>"
        return value


def style_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of `Style`, passed as `style: Style`."""

    @wraps(function)
    def styled(*, as_json: bool, as_csv: bool, **others: Any) -> Any:  # noqa: ANN401 - a click callback
        names = ("flow_style", "full", "no_arr", "no_str")
        chosen = {name: others.pop(name) for name in names}
        return function(style=Style(as_json=as_json, csv=as_csv, **chosen), **others)

    options = (
        click.option(
            "-f", "--full-length", "full", is_flag=True, help="Print long lists and strings in full."
        ),
        click.option("--no-arr", is_flag=True, help="Print only the length of lists."),
        click.option("--no-str", is_flag=True, help="Print only the length of strings."),
        click.option("--flow-style", is_flag=True, help="Print each message as one line of YAML."),
        click.option("--csv", "as_csv", is_flag=True, help="Print only the values, separated by commas."),
    )
    styled = json_option(styled)
    for option in reversed(options):
        styled = option(styled)
    return styled


def _leaves(value: object) -> Iterator[object]:
    if isinstance(value, dict):
        value = list(value.values())
    if not isinstance(value, list):
        yield value
        return
    for item in value:
        yield from _leaves(item)


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
    """List, print, measure and publish topics of a running KBot, like `ros2 topic`.

    Start KBot first, for example `kbot sim kbot` in another terminal. ROS is not needed.
    """


@command.command("list", epilog=examples("kbot topic list -t"))
@listing_options
@click.option(
    "-v", "--verbose", is_flag=True, help="List published and subscribed topics separately, with types."
)
def list_(show_types: bool, count: bool, as_json: bool, at: str, verbose: bool) -> None:
    """List the topics that KBot publishes or subscribes to."""
    with connect(at) as graph:
        topics = graph.topics()
        subscribed = graph.subscribed() if verbose else set()
    if not verbose or as_json or count:
        print_listing(topics, show_types, as_json, count)
        return
    sections = {
        "Published": {name: kind for name, kind in topics.items() if name not in subscribed},
        "Subscribed": {name: topics[name] for name in sorted(subscribed)},
    }
    for title, part in sections.items():
        click.echo("\n".join([f"{title} topics:", *(f" * {name} [{kind}]" for name, kind in part.items())]))


@command.command("type", epilog=examples("kbot topic type /odom"))
@click.argument("topic")
@at_option
def type_(topic: str, at: str) -> None:
    """Print a topic's type."""
    with connect(at) as graph:
        click.echo(graph.type_of(full_name(topic)))


@command.command("info", epilog=examples("kbot topic info /cmd_vel"))
@click.argument("topic")
@click.option(
    "-v", "--verbose", is_flag=True, help="Print the name, namespace and endpoint type of each node."
)
@json_option
@at_option
def info(topic: str, verbose: bool, as_json: bool, at: str) -> None:
    """Print a topic's type, publishers and subscribers."""
    with connect(at) as graph:
        name = full_name(topic)
        kind = graph.type_of(name)
        publishers = graph.call("/rosapi/publishers", topic=name)["publishers"]
        subscribers = graph.call("/rosapi/subscribers", topic=name)["subscribers"]
    if as_json:
        print_json({"topic": name, "type": kind, "publishers": publishers, "subscribers": subscribers})
        return
    click.echo(f"Type: {kind}")
    for title, end, nodes in (
        ("Publisher", "PUBLISHER", publishers),
        ("Subscription", "SUBSCRIPTION", subscribers),
    ):
        lines = [f"  {node}" for node in nodes]
        if verbose:
            lines = [line for node in nodes for line in _end(node, kind, end)]
        click.echo("\n".join([f"{title} count: {len(nodes)}", *lines]))


def _end(node: str, kind: str, end: str) -> list[str]:
    """One endpoint of a topic, in the format of `ros2 topic info -v`."""
    namespace, _, name = node.rpartition("/")
    return [
        "",
        f"Node name: {name}",
        f"Node namespace: {namespace or '/'}",
        f"Topic type: {kind}",
        f"Endpoint type: {end}",
        "",
    ]


@command.command("echo", epilog=examples("kbot topic echo /odom --once", "kbot topic echo /scan -n 5 --json"))
@click.argument("topic")
@click.argument("type_name", metavar="[TYPE]", default="")
@click.option("--once", is_flag=True, help="Print one message and exit.")
@click.option("-n", "count", type=click.IntRange(1), metavar="N", help="Print N messages and exit.")
@click.option("--field", metavar="A.B", help="Field to print, such as pose.pose or ranges[2].")
@style_options
@at_option
def echo(
    topic: str, type_name: str, once: bool, count: int | None, field: str | None, style: Style, at: str
) -> None:
    """Print the messages of a topic until Ctrl-C.

    TYPE is optional. If you give it, it must be the topic's type.
    """
    with connect(at) as graph:
        name = full_name(topic)
        if type_name:
            known = graph.type_of(name)
            if not is_type(type_name, known):
                fail(f"{name} carries {known}, not {type_name}")
        for _, message in itertools.islice(messages(graph, name), 1 if once else count):
            click.echo(style.text(_part(message, field) if field else message))


@command.command("hz", epilog=examples("kbot topic hz /odom", "kbot topic hz /scan --window 50 -n 3"))
@click.argument("topic")
@click.option(
    "-w",
    "--window",
    type=click.IntRange(2),
    default=1000,
    show_default=True,
    metavar="N",
    help="Number of latest messages to average over.",
)
@click.option("-n", "count", type=click.IntRange(1), metavar="N", help="Print N reports and exit.")
@at_option
def hz(topic: str, window: int, count: int | None, at: str) -> None:
    """Print a topic's publishing rate every second.

    The rate is measured in wall-clock time. Ctrl-C stops the command.
    """
    times: deque[float] = deque(maxlen=window)
    due, reports = 0.0, 0
    with connect(at) as graph:
        for _ in messages(graph, full_name(topic)):
            times.append(time.monotonic())
            due = due or times[0] + REPORT_SECONDS
            gaps = [after - before for before, after in pairwise(times)] if times[-1] >= due else []
            if not sum(gaps):
                continue
            click.echo(
                f"average rate: {len(gaps) / sum(gaps):.3f}\n\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s "
                f"std dev: {statistics.pstdev(gaps):.5f}s window: {len(times)}"
            )
            due, reports = times[-1] + REPORT_SECONDS, reports + 1
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
@click.option("-1", "--once", is_flag=True, help="Publish one message and exit.")
@click.option("-t", "--times", type=click.IntRange(1), metavar="N", help="Publish N messages and exit.")
@rate_option(1000.0, "Publishing rate in Hz (wall-clock time).")
@click.option("-w", "--wait-matching-subscriptions", type=int, expose_value=False, hidden=True)
@at_option
def pub(topic: str, words: tuple[str, ...], once: bool, times: int | None, rate: float, at: str) -> None:
    """Publish on a topic until Ctrl-C.

    KBot must subscribe to TOPIC: `kbot topic list -v` lists these topics. VALUES are the fields of the
    message in YAML, as one quoted argument. Fields that you leave out are zero or empty.
    """
    kind = words[0] if words and re.fullmatch(r"\w+(/msg)?/\w+", words[0]) else ""
    message = read_values(words[bool(kind) :], "{linear: {x: 0.2}}")
    with connect(at) as graph:
        name = full_name(topic)
        known = graph.type_of(name)
        due = time.monotonic()
        for number in itertools.count(1):
            if number > 1:
                graph.publish(name, message)
                graph.flush()
            else:
                graph.publish_and_wait(name, message, kind or known)
                click.echo(f"publishing on {name}: {to_line(message)}", err=True)
            if once or number == times:
                return
            due = max(due + 1.0 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))


def _part(message: object, field: str) -> Any:  # noqa: ANN401 - a field may have any type
    """The field `pose.pose.position` or `ranges[3]` of a message. Raises KbotError: it has no such field."""
    from kbot.text.suggest import did_you_mean  # only for an error: start-up time

    value: Any = message
    for name in re.findall(r"[^.\[\]]+", field):
        if isinstance(value, dict) and name in value:
            value = value[name]
        elif isinstance(value, list) and name.isdecimal() and int(name) < len(value):
            value = value[int(name)]
        elif isinstance(value, list):
            fail(f"{field}: the list has {len(value)} items, so '{name}' is not an index of it")
        else:
            names = list(value) if isinstance(value, dict) else []
            hint = did_you_mean(name, names) or f"the fields are {', '.join(names) or 'none'}"
            fail(f"{field}: there is no field '{name}': {hint}")
    return value
