"""The command lines: verbs, arguments, options and exit statuses, from the commands that click runs."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

from kbot.cli import main

_EXIT_STATUS = re.compile(r"Exit status: (.*?)\.?\s*(?:\n\n|\Z)", re.DOTALL)


def commands() -> Iterator[tuple[str, click.Command]]:
    """All commands with the words that call them, in the order of the words."""
    yield from _below("kbot", click.Context(main.group, info_name="kbot"))


def _below(words: str, context: click.Context) -> Iterator[tuple[str, click.Command]]:
    command = context.command
    yield words, command
    if isinstance(command, click.Group):
        for name in sorted(command.list_commands(context)):
            child = command.get_command(context, name)
            assert child is not None
            yield from _below(f"{words} {name}", click.Context(child, info_name=name, parent=context))


def lines() -> Iterator[str]:
    """One line for each verb, argument, option and exit status."""
    for words, command in commands():
        yield f"{words}: {'verbs' if isinstance(command, click.Group) else 'verb'}"
        for parameter in command.params:
            if isinstance(parameter, click.Argument):
                yield f"{words}: argument {_value(parameter)}"
        options = (each for each in command.params if isinstance(each, click.Option) and not each.hidden)
        for option in sorted(options, key=lambda each: each.opts[-1]):
            yield f"{words} {' '.join(option.opts)}: {_option(option)}"
        text = main.__doc__ if words == "kbot" else command.help
        stated = _EXIT_STATUS.search(text or "")
        for status in re.split(r"[;,] (?=\d)", " ".join(stated[1].split())) if stated else ():
            yield f"{words}: exit status {status}"
    yield f"kbot: without a verb, {' '.join(('kbot', *main.DEMO))}"


def _option(option: click.Option) -> str:
    if option.is_flag:
        return "flag"
    repeated = ", repeated" if option.multiple else ""
    required = ", required" if option.required else ""
    default = option.show_default if isinstance(option.show_default, str) else option.default
    shown = isinstance(default, str | int | float) and not option.required
    return _value(option) + repeated + required + (f" = {default}" if shown else "")


def _value(parameter: click.Parameter) -> str:
    """What a parameter takes: its choices, or its metavar and the bounds of a number."""
    kind = parameter.type
    if isinstance(kind, click.Choice):
        return "|".join(map(str, kind.choices))
    bounds = f" {kind.min}..{kind.max}" if isinstance(kind, click.IntRange | click.FloatRange) else ""
    return f"{parameter.metavar or (parameter.name or '').upper()} ({kind.name}{bounds})"
