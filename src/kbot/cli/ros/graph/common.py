"""Shared by the verbs that query a running KBot: options, the connection, YAML input and output."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kbot.cli.arguments import json_option
from kbot.cli.output import fail, print_json
from kbot.text.yaml import YamlError, load_yaml

if TYPE_CHECKING:
    from kbot.ros.graph.client import GraphClient  # imported lazily, so that -h stays fast

_Function = TypeVar("_Function", bound=Callable[..., Any])

_EXPONENT = re.compile(
    r"(?P<minus>[+-]?)(?P<mantissa>\d+(?:\.\d*)?|\.\d+)[eE](?P<sign>[+-]?)(?P<digits>\d+)", re.ASCII
)
"""A number with an exponent. YAML 1.1 reads it as a number only if it has a `.` and a signed exponent."""
QUIET_SECONDS = 1.0
"""Seconds without a message after which a note is printed."""
SHORTENED = 120
"""Items of a list that `echo` prints without --full-length. The number of the others is printed."""
SHORTENED_TEXT = 1 << 12
"""Characters of a string that `echo` prints without --full-length."""


def at_option(function: _Function) -> _Function:
    """Add `--at`, passed as `at: str`."""
    return click.option(
        "--at", default="", metavar="NUMBER", help="Process ID of the KBot to use, if several are running."
    )(function)


def listing_options(function: _Function) -> _Function:
    """Add the options of a list of names: `show_types: bool`, `count: bool`, `as_json: bool`, `at: str`."""
    types = click.option("-t", "--show-types", is_flag=True, help="Print each name with its type.")
    return types(count_option(json_option(at_option(function))))


def count_option(function: _Function) -> _Function:
    """Add `--count`, passed as `count: bool`."""
    return click.option("-c", "--count", is_flag=True, help="Print only the number of names.")(function)


def print_listing(types: Mapping[str, str], show_types: bool, as_json: bool, count: bool) -> None:
    """Print names and types in the form that `listing_options` select."""
    if count:
        click.echo(len(types))
        return
    if as_json:
        print_json(types)
        return
    for name, kind in types.items():
        click.echo(f"{name} [{kind}]" if show_types else name)


def is_type(word: str, kind: str) -> bool:
    """Whether `word` names the ROS 2 type `kind`, as ROS 2 or as ROS 1 writes it."""
    return word in (kind, re.sub("/(msg|srv)/", "/", kind))


def seconds(stamp: Mapping[str, int]) -> float:
    """A message's stamp in seconds."""
    return stamp["sec"] + stamp["nanosec"] * 1e-9


def read_values(words: tuple[str, ...], example: str) -> dict[str, Any]:
    """Parse VALUES, the fields of a message in YAML. Without words, the result is empty.

    Raises:
        KbotError: there are several words, or VALUES is not a mapping.
    """
    if len(words) > 1:
        fail(f"VALUES must be one argument. Quote it: '{' '.join(words)}'")
    values = read_word(words[0], "VALUES", f"'{example}'") if words else {}
    if not isinstance(values, dict | None):
        fail(f"VALUES must name the fields, as in '{example}'")
    return values or {}


def connect(at: str) -> GraphClient:
    """Connect to the running KBot, or to the one that `--at` selects.

    Raises:
        KbotError: no KBot runs, or several run and `at` selects none of them.
    """
    from kbot.ros.graph.client import GraphClient
    from kbot.ros.graph.presence import find

    return GraphClient(find(at))


def messages(graph: GraphClient, *topics: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Subscribe to topics and yield their messages, endlessly. After a second without one, print a note."""
    began = graph.nanoseconds()
    for topic in topics:
        graph.subscribe(topic, graph.type_of(topic))
    first = next(graph.receive(QUIET_SECONDS), None)
    if first is not None:
        yield first
    else:
        print_waiting_note(graph, began, *topics)
    yield from graph.receive()


def print_waiting_note(graph: GraphClient, began: int, *topics: str) -> None:
    """Print to stderr that no message has arrived since KBot's clock was at `began` nanoseconds."""
    is_paused = graph.nanoseconds() == began
    why = "KBot's time does not advance. Is it paused?" if is_paused else "no message has been published yet"
    click.echo(f"waiting for {' and '.join(topics)}: {why}", err=True)


def full_name(name: str) -> str:
    """The name with a leading slash: `odom` becomes `/odom`."""
    return name if name.startswith("/") else f"/{name}"


def read_word(text: str, what: str, example: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Parse a YAML value of the command line. Errors name it `what` and quote `example`.

    Raises:
        KbotError: it is not YAML, or it contains a number that YAML 1.1 reads as a string, such as 1e3.
    """
    import yaml

    value = read_values_text(text, what, example)
    try:
        events: list[Any] = list(yaml.parse(text, yaml.SafeLoader))
    except yaml.YAMLError:  # `load_yaml` read it with LibYAML, which also accepts `x?` in a list
        events = list(yaml.parse(text, yaml.CSafeLoader))
    for event in events:
        number = _EXPONENT.fullmatch(event.value) if isinstance(event, yaml.ScalarEvent) else None
        if number is not None and event.implicit[0] and isinstance(yaml.safe_load(event.value), str):
            whole, _, part = number["mantissa"].partition(".")
            better = (
                f"{number['minus']}{whole or '0'}.{part or '0'}e{number['sign'] or '+'}{number['digits']}"
            )
            fail(f"{what}: YAML 1.1 reads {event.value} as a string. Write {better}, or quote the string")
    return value


def read_values_text(text: str, what: str, example: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Parse YAML. Raises KbotError: it is not YAML, or no message or parameter can contain the value."""
    try:
        value = load_yaml(text)
    except YamlError as error:
        span = error.span
        place = f" (at character {len(span.source.data[: span.start].decode()) + 1})" if span.start else ""
        fail(f"{what} must be YAML, as in {example}: {error.problem}{place}")
    _check(value, what)
    return value


def _check(value: object, what: str) -> None:
    """Raises KbotError: no message or parameter can contain the value, or a part of it."""
    if isinstance(value, dict | list):
        parts = value.items() if isinstance(value, dict) else ((0, item) for item in value)
        for key, part in parts:
            if not isinstance(key, str | int | float | None):
                fail(f"{what}: {key} is not a field name")
            if isinstance(key, str) and ":" in key and part is None:
                name, _, rest = key.partition(":")
                fail(f"{what}: YAML needs a space after the colon. Write {name}: {rest}")
            _check(part, what)
    elif not isinstance(value, str | int | float | None):
        kind = type(value).__name__
        article = "an" if kind[0] in "aeiou" else "a"
        fail(f"{what}: {value} is {article} {kind}. Messages have no such type. Quote it if it is a string")


def to_yaml(value: object, *, full: bool = True, flow: bool = False) -> str:
    """YAML as `ros2 topic echo` prints it. Long lists are cut short unless `full`; `flow` is one line."""
    import yaml

    text: str = yaml.safe_dump(
        value if full else _shortened(value),
        sort_keys=False,
        allow_unicode=True,
        default_flow_style=flow,
        width=float("inf") if flow else None,
    )
    return text.removesuffix("...\n").rstrip("\n")


def to_line(value: object) -> str:
    """One line of JSON. NaN and infinity, which JSON lacks, become null."""
    return json.dumps(_finite(value), ensure_ascii=False, allow_nan=False)


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and value - value != 0.0 else value


def _shortened(value: object) -> object:
    if isinstance(value, dict):
        return {key: _shortened(item) for key, item in value.items()}
    if isinstance(value, list):
        more = len(value) - SHORTENED
        return [_shortened(item) for item in value[:SHORTENED]] + ([f"... {more} more"] if more > 0 else [])
    if isinstance(value, str) and len(value) > SHORTENED_TEXT:
        return value[:SHORTENED_TEXT] + "..."
    return value
