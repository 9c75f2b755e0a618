"""What verbs that query a running KBot share: how they find it, and read and print values."""

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
    from kbot.ros.graph.client import GraphClient  # lazy in this module: -h is fast

_Function = TypeVar("_Function", bound=Callable[..., Any])

_EXPONENT = re.compile(
    r"(?P<minus>[+-]?)(?P<mantissa>\d+(?:\.\d*)?|\.\d+)[eE](?P<sign>[+-]?)(?P<digits>\d+)", re.ASCII
)
QUIET_SECONDS = 1.0
SHORTENED = 120
"""Items of a list that `echo` prints; the rest is counted."""


def at_option(function: _Function) -> _Function:
    """`--at`, as `at: str`."""
    return click.option(
        "--at", default="", metavar="NUMBER", help="Process ID of the KBot to use, if several are running."
    )(function)


def listing_options(function: _Function) -> _Function:
    """Those of a list of names with types: `show_types: bool`, `count: bool`, `as_json: bool`, `at: str`."""
    types = click.option("-t", "--show-types", is_flag=True, help="Print each name with its type.")
    return types(count_option(json_option(at_option(function))))


def count_option(function: _Function) -> _Function:
    """`--count`, as `count: bool`."""
    return click.option("-c", "--count", is_flag=True, help="Print only the number of names.")(function)


def print_listing(types: Mapping[str, str], show_types: bool, as_json: bool, count: bool) -> None:
    """Names, as `listing_options` asks for them."""
    if count:
        click.echo(len(types))
        return
    if as_json:
        print_json(types)
        return
    for name, kind in types.items():
        click.echo(f"{name} [{kind}]" if show_types else name)


def is_type(word: str, kind: str) -> bool:
    """Whether a word means a type, as ROS 2 writes it or as ROS 1 does."""
    return word in (kind, re.sub("/(msg|srv)/", "/", kind))


def seconds(stamp: Mapping[str, int]) -> float:
    """Of a message's stamp."""
    return stamp["sec"] + stamp["nanosec"] * 1e-9


def read_values(words: tuple[str, ...], example: str) -> dict[str, Any]:
    """The fields of a message that a command line gives, in YAML; none where it gives no word. Raises
    KbotError: several words, or no fields by name."""
    if len(words) > 1:
        fail(f"VALUES are one word of YAML, quoted: '{' '.join(words)}'")
    values = read_word(words[0], "VALUES", f"'{example}'") if words else {}
    if not isinstance(values, dict | None):
        fail(f"VALUES are fields by name, as in '{example}'")
    return values or {}


def ask(at: str) -> GraphClient:
    """A conversation with the KBot that runs. Raises KbotError: none does, or several."""
    from kbot.ros.graph.client import GraphClient
    from kbot.ros.graph.presence import find

    return GraphClient(find(at))


def listen(graph: GraphClient, *topics: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """As `GraphClient.listen`, for good; after a second of silence stderr says what is waited for."""
    began = graph.nanoseconds()
    for topic in topics:
        graph.subscribe(topic, graph.type_of(topic))
    first = next(graph.heard(QUIET_SECONDS), None)
    if first is not None:
        yield first
    else:
        tell_of_silence(graph, began, *topics)
    yield from graph.heard()


def tell_of_silence(graph: GraphClient, began: int, *topics: str) -> None:
    """Say on stderr what is waited for since the KBot's clock said `began` nanoseconds."""
    is_paused = graph.nanoseconds() == began
    why = "time stands still there: is it paused?" if is_paused else "nobody says anything there yet"
    click.echo(f"waiting for {' and '.join(topics)}: {why}", err=True)


def full_name(name: str) -> str:
    """`odom` is `/odom`."""
    return name if name.startswith("/") else f"/{name}"


def read_word(text: str, what: str, example: str) -> Any:  # noqa: ANN401 - what YAML holds
    """A value as it is written on a command line, as `example` is. Raises KbotError: it is no YAML, or holds
    a number that YAML 1.1 takes for text."""
    import yaml

    value = read_values_text(text, what, example)
    try:
        events: list[Any] = list(yaml.parse(text, yaml.SafeLoader))
    except yaml.YAMLError:  # as for `x?` in a list, which only LibYAML reads
        events = list(yaml.parse(text, yaml.CSafeLoader))
    for event in events:
        number = _EXPONENT.fullmatch(event.value) if isinstance(event, yaml.ScalarEvent) else None
        if number is not None and event.implicit[0] and isinstance(yaml.safe_load(event.value), str):
            whole, _, part = number["mantissa"].partition(".")
            better = (
                f"{number['minus']}{whole or '0'}.{part or '0'}e{number['sign'] or '+'}{number['digits']}"
            )
            fail(f"{what}: {event.value} is text in YAML 1.1: write {better}, or quote it if it is text")
    return value


def read_values_text(text: str, what: str, example: str) -> Any:  # noqa: ANN401 - what YAML holds
    """What a text holds. Raises KbotError: it is no YAML, or nothing that a message or a parameter holds."""
    try:
        value = load_yaml(text)
    except YamlError as error:
        span = error.span
        place = f" (at character {len(span.source.data[: span.start].decode()) + 1})" if span.start else ""
        fail(f"{what} is to be YAML, as in {example}: {error.problem}{place}")
    _check(value, what)
    return value


def _check(value: object, what: str) -> None:
    """Raises KbotError: a value is, or holds, what is in no message."""
    if isinstance(value, dict | list):
        parts = value.items() if isinstance(value, dict) else ((0, item) for item in value)
        for key, part in parts:
            if not isinstance(key, str | int | float | None):
                fail(f"{what}: {key} is no name of a field")
            if isinstance(key, str) and ":" in key and part is None:
                name, _, rest = key.partition(":")
                fail(f"{what}: YAML wants a space after the colon: write {name}: {rest}")
            _check(part, what)
    elif not isinstance(value, str | int | float | None):
        kind = type(value).__name__
        article = "an" if kind[0] in "aeiou" else "a"
        fail(f"{what}: {value} is {article} {kind}, which no message holds: quote it if it is text")


def to_yaml(value: object, *, full: bool = True, flow: bool = False) -> str:
    """As `ros2 topic echo` prints it; long lists are cut short unless `full`, `flow` is all on one line."""
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
    """One line of JSON; numbers that it lacks are null."""
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
    if isinstance(value, str) and len(value) > 1 << 12:
        return value[: 1 << 12] + "..."
    return value
