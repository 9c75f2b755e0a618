"""How `kbot topic echo` prints a message, with the options of `ros2 topic echo`."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from typing import Any

import click

from kbot.cli.arguments import json_option
from kbot.cli.ros.graph.asking import to_line, to_yaml

_KINDS = {int: "integers", float: "numbers", bool: "booleans", str: "texts", dict: "messages"}


@dataclass(frozen=True, slots=True)
class Style:
    """`full` prints long lists and texts whole, `no_arr` and `no_str` say only how long they are."""

    as_json: bool = False
    csv: bool = False
    flow_style: bool = False
    full: bool = False
    no_arr: bool = False
    no_str: bool = False

    def text(self, value: object) -> str:
        """What is printed of a value, with the line between messages."""
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
    """`style: Style`."""

    @wraps(function)
    def styled(*, as_json: bool, as_csv: bool, **others: Any) -> Any:  # noqa: ANN401 - what click gives and takes
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
