"""The reference pages that the site generates: verbs from their help, worlds, sensors and the Python API from
their docstrings."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

import kbot.sensors
from kbot.cli.main import VERBS, group
from kbot.sensors import Spec
from kbot.world import BUILDERS, parameters

NAMES = {
    "Robots and worlds": [
        "load",
        "Robot",
        "DescriptionError",
        "DescriptionWarning",
        "KbotError",
        "Diagnostic",
    ],
    "Simulation": ["Simulation", "World", "load_world", "Transform", "PlanarPose", "Node"],
}
"""Names of the package kbot, by section."""
PACKAGES = ("kbot.sensors", "kbot.navigation", "kbot.learn", "kbot.checks")
"""Packages whose public names are all listed."""


def verbs(_: Path) -> str:
    """The help of each verb, and of the verbs below it."""
    parts = ["# Verbs\n", "The help of each verb, as `kbot VERB --help` prints it.\n"]
    for name in VERBS:
        for words, command in _below([name], click.Context(group, info_name="kbot")):
            heading = "##" if len(words) == 1 else "###"
            parts += [f"{heading} kbot {' '.join(words)}\n", f"```text\n{command.rstrip()}\n```\n"]
    return "\n".join(parts)


def _below(words: list[str], parent: click.Context) -> Iterator[tuple[list[str], str]]:
    assert isinstance(parent.command, click.Group)
    command = parent.command.get_command(parent, words[-1])
    assert command is not None
    context = click.Context(command, info_name=words[-1], parent=parent, max_content_width=100)
    yield words, command.get_help(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            yield from _below([*words, name], context)


def worlds(_: Path) -> str:
    """Each built-in world with its picture, its text and its parameters."""
    parts = [
        "# Worlds\n",
        "Name a world and its parameters with `--world`: `kbot sim kbot --world maze:size=4,seed=2`. Lengths"
        " are in metres. [SDF files and maps](simulation.md#worlds) are worlds too.\n",
    ]
    for name, builder in BUILDERS.items():
        parts += [f"## {name}\n", f"{inspect.getdoc(builder)}\n", f"![The world {name}](images/{name}.png)\n"]
        rows = "".join(f"| `{key}` | {value} |\n" for key, value in parameters(name).items())
        parts.append(f"| parameter | default |\n| --- | --- |\n{rows}")
    return "\n".join(parts)


def sensors(_: Path) -> str:
    """Each sensor with its text and its settings."""
    common = [field.name for field in dataclasses.fields(Spec)]
    parts = [
        "# Sensors\n",
        '`sim.add_sensor(Lidar(link="base_link"))` mounts a sensor. `latest` is its newest reading.'
        " [Sensors and navigation](navigation.md#sensors) describes how a description declares sensors."
        " All sensors have these settings:\n",
        _settings(Spec, common),
        f"{_markdown(inspect.getdoc(Spec) or '')}\n",
    ]
    for name in kbot.sensors.__all__:
        kind = getattr(kbot.sensors, name)
        if isinstance(kind, type) and issubclass(kind, Spec) and kind is not Spec:
            own = [f.name for f in dataclasses.fields(kind) if f.name not in common or f.name == "rate"]
            parts += [f"## {name}\n", f"{_markdown(inspect.getdoc(kind) or '')}\n", _settings(kind, own)]
    return "\n".join(parts)


def _settings(kind: type[Any], names: list[str]) -> str:
    rows = []
    for field in dataclasses.fields(kind):
        if field.name in names and field.name != "origin":
            default = field.default
            text = "(required)" if default is dataclasses.MISSING else f"`{_short(default)}`"
            rows.append(f"| `{field.name}` | {text} |\n")
    return "| setting | default |\n| --- | --- |\n" + "".join(rows)


def _short(value: object) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else repr(value)
    return text.partition("(")[0] + "(…)" if len(text) > 40 else text


def _markdown(text: str) -> str:
    """Escape the asterisks of a docstring for Markdown."""
    return text.replace("*", r"\*")


def api(_: Path) -> str:
    """Directives of autodoc for the public names."""
    parts = [
        "# Python API\n",
        "The public classes and functions, from their docstrings. [Python](python.md) has examples.\n",
    ]
    for section, names in NAMES.items():
        parts += [f"## {section}\n", *(_directive("kbot", name) for name in names)]
    for package in PACKAGES:
        module = __import__(package, fromlist=["__all__"])
        parts += [f"## {package}\n", *(_directive(package, name) for name in module.__all__)]
    return "\n".join(parts)


def _directive(module: str, name: str) -> str:
    target = getattr(__import__(module, fromlist=[name]), name)
    if not (inspect.isclass(target) or inspect.isfunction(target)):
        return f"`{module}.{name}`\n"
    kind = "autofunction" if inspect.isfunction(target) else "autoclass"
    members = "" if kind == "autofunction" else "\n   :members:"
    return f"```{{eval-rst}}\n.. {kind}:: {module}.{name}{members}\n```\n"


PAGES: dict[str, Callable[[Path], str]] = {
    "reference/verbs.md": verbs,
    "reference/worlds.md": worlds,
    "reference/sensors.md": sensors,
    "reference/api.md": api,
}
"""The pages below `docs`, and the functions that write them."""
