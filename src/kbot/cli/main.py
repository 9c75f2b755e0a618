"""Runs the verb that the user typed, and turns errors into messages and exit statuses.

Exit status: 0 success, 1 findings, 2 unusable input or arguments, 130 interrupted, 143 SIGTERM, 129 SIGHUP.
"""

from __future__ import annotations

import os
import sys
import threading
import warnings
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples
from kbot.cli.other_tools import OF_ROS_2, instead_of
from kbot.cli.output import report_error
from kbot.extensions import parts
from kbot.text.crash import report_thread_error
from kbot.text.errors import KbotError
from kbot.text.notes import notes_sent_to
from kbot.text.signals import INTERRUPTED, interrupted_by_all
from kbot.text.suggest import did_you_mean
from kbot.text.temporary import remove_left

if TYPE_CHECKING:
    from kbot.xacro.result import Expansion

DEMO = ("sim", "kbot")

VERBS = {
    "sim": ("kbot.cli.sim.command:command", "Simulate a robot and drive it in the browser."),
    "view": ("kbot.cli.view:command", "Show a robot in the browser and reload it when you save."),
    "check": ("kbot.cli.check:command", "Check a robot and report each problem at its source line."),
    "expand": ("kbot.cli.expand:command", "Expand a xacro file to URDF."),
    "where": ("kbot.cli.where:command", "Show the source lines behind a link, a joint or a property."),
    "export": ("kbot.cli.export:command", "Export a robot as a picture, web page, 3D model or tree drawing."),
    "info": ("kbot.cli.info:command", "Print links, joints, masses, drive geometry and size."),
    "try": ("kbot.cli.try_command:command", "Run scenarios that test a robot's behaviour."),
    "compare": ("kbot.cli.compare:command", "Compare how two robots behave, and find the edits behind it."),
    "sweep": ("kbot.cli.sweep:command", "Run scenarios with many values of a robot, and find the best."),
    "identify": ("kbot.cli.identify:command", "Estimate a robot's true wheel sizes from a log of a drive."),
    "new": ("kbot.cli.new:command", "Create a robot package."),
    "bag": ("kbot.cli.bag.command:command", "Inspect, cut, convert, play back or replay recordings."),
    "rule": ("kbot.cli.rule:command", "Explain a rule of kbot check and how to fix its findings."),
}
for _part in parts():
    VERBS |= _part.VERBS


class Verbs(click.Group):
    """The verbs by name. A verb's module is imported only when needed, so that `kbot --help` is fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        module, name = VERBS[cmd_name][0].split(":")
        command: click.Command = getattr(import_module(module), name)
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        own = {"-h", "--help", "--version"}
        if not args or (args[0].startswith("-") and args[0] not in own):
            args = [*DEMO, *args]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        word = args[0]
        if word in VERBS:
            return super().resolve_command(ctx, args)
        if instead := instead_of(args, VERBS):
            raise click.ClickException(f"'{word}' is not a verb of KBot: {instead}")
        hint: str = OF_ROS_2.get(word) or did_you_mean(word, VERBS, sides=False)
        if word == "kbot" or Path(word).is_file():
            hint = f"to show it, use kbot view {word}"
        more = f": {hint}" if hint else ". `kbot --help` lists the verbs."
        raise click.UsageError(f"unknown verb '{word}'{more}", ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl([(name, text) for name, (_, text) in VERBS.items()])


def _print_version(ctx: click.Context, _: click.Parameter, asked: bool) -> None:
    if asked and not ctx.resilient_parsing:
        from importlib.metadata import version  # slow to import

        click.echo(f"kbot {version('kbot')}")
        ctx.exit()


@click.group(
    cls=Verbs,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=examples(
        ("kbot", "drive KBot in the browser"),
        ("kbot view robot.xacro", "show a robot while you edit it"),
        ("kbot check robot.xacro", "report problems with their lines"),
        ("kbot expand robot.xacro -o robot.urdf", "expand xacro to URDF"),
        ("kbot sim robot.xacro --world maze", "drive your robot in a maze"),
        ("kbot launch my_robot display.launch", "run a launch file without ROS"),
    ),
    subcommand_metavar="VERB [ARGS]...",
)
@click.option(
    "--version",
    is_flag=True,
    callback=_print_version,
    expose_value=False,
    is_eager=True,
    help="Print the version and exit.",
)
def group() -> None:
    """Check, show, launch and simulate robot descriptions without ROS.

    Without a verb, kbot simulates the robot that ships with KBot, and you drive it in the browser.
    In place of a FILE, the word `kbot` means this robot.

    Run `kbot VERB --help` for the options of a verb and examples.
    """
    remove_left()
    click.get_current_context().call_on_close(remove_left)  # those of its workers that were killed


def main(words: Sequence[str] | None = None, expanded: tuple[Expansion, Sequence[str]] | None = None) -> None:
    """Run the command line and exit with its status.

    `expanded` is the expansion that `kbot.cli.start` already made for `kbot expand`, with its notes.
    """
    threading.excepthook = report_thread_error
    # what its libraries remark about a damaged image is not the user's concern: KBot reports the image
    warnings.filterwarnings("ignore", module=r"PIL\.")
    sys.exit(run(sys.argv[1:] if words is None else words, expanded))


def run(words: Sequence[str], expanded: tuple[Expansion, Sequence[str]] | None = None) -> int:
    """Run the command line and return its exit status. A verb may return one, or call `ctx.exit`."""
    if "_KBOT_COMPLETE" in os.environ:
        group.main(list(words), prog_name="kbot")
    with interrupted_by_all() as ending:
        status = _run(words, expanded)
    return 128 + ending.number if ending.number and status == INTERRUPTED else status


def _run(words: Sequence[str], expanded: tuple[Expansion, Sequence[str]] | None) -> int:
    try:
        with notes_sent_to(_print_note), group.make_context("kbot", list(words), obj=expanded) as context:
            status = group.invoke(context)
        sys.stdout.flush()
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except BrokenPipeError:
        return _end_at_closed_pipe()
    except (click.ClickException, KbotError, OSError) as error:
        with suppress(OSError):  # stderr may be full: the status still reports the error
            report_error(error)
        return 2
    except (KeyboardInterrupt, click.Abort):
        with suppress(OSError):  # the terminal was closed
            click.echo(err=True)
        return INTERRUPTED
    return status if isinstance(status, int) else 0


def _print_note(text: str) -> None:
    click.echo(f"note: {text}", err=True)


def _end_at_closed_pipe() -> int:
    """The reader closed the pipe (`kbot expand … | head`): end silently with the status 128 + SIGPIPE."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 141
