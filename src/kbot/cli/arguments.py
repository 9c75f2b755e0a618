"""Options and arguments that verbs share: `name:=value` words, numbers and paths."""

from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kbot.cli.output import fail
from kbot.text.errors import KbotError
from kbot.text.notes import note
from kbot.text.numbers import to_float

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from click.types import OptionHelpExtra

    from kbot.kinematics import PlanarPose
    from kbot.workbench.address import Address
    from kbot.workbench.displays.display_file import DisplayFile
    from kbot.xacro.assignments import Assignments


def resolve_typed_names(file: str, values: Mapping[str, str], package_path: Sequence[str]) -> Assignments:
    """Resolve `name:=value` words for FILE, or for `kbot`. Prints a note for each overridden property.

    Raises:
        DescriptionError: a name is neither an argument nor a top-level property of the file.
    """
    from kbot.model.load import resolve_robot_path  # imported lazily, so that -h stays fast
    from kbot.xacro import Packages
    from kbot.xacro.assignments import resolve_names

    found = resolve_names(resolve_robot_path(file), values, Packages(package_path)).require()
    for text in found.notes:
        note(text)
    return found


class Within(click.FloatRange):
    """A number between two bounds. `nan` is rejected."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ANN401 - click's signature
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


class _WithoutRange(click.Option):
    """An option whose help omits the range, because every realistic value is within it."""

    def get_help_extra(self, ctx: click.Context) -> OptionHelpExtra:
        extra = super().get_help_extra(ctx)
        extra.pop("range", None)
        return extra


SECONDS = Within(0.0, 9.2e9)
"""Times in seconds that fit into 64 bits of nanoseconds (2**63 ns is 9.22e9 s)."""


def seconds_option(*names: str, **more: Any) -> Callable[[click.decorators.FC], click.decorators.FC]:  # noqa: ANN401 - click's own keywords
    """An option for a time in a recording, in seconds."""
    return click.option(*names, cls=_WithoutRange, type=SECONDS, metavar="S", **more)


def rate_option(
    most: float, text: str, metavar: str = "HZ"
) -> Callable[[click.decorators.FC], click.decorators.FC]:
    """`-r` and `--rate`, from 0.01 to `most`, as `rate: float`."""
    return click.option(
        "-r", "--rate", type=Within(0.01, most), default=1.0, show_default=True, metavar=metavar, help=text
    )


def pose_of(option: str, text: str) -> PlanarPose:
    """The pose that `X,Y,YAW` in m, m and rad means. Any other text ends the program."""
    from kbot.kinematics import PlanarPose  # numpy: -h needs none

    x, y, yaw = _finite(option, text, 3, "X,Y,YAW in m, m and rad, for example 1.5,0,1.57")
    return PlanarPose(x, y, yaw)


def goal_of(option: str, text: str) -> tuple[PlanarPose, bool]:
    """The goal that `X,Y` or `X,Y,YAW` in m, m and rad means, and whether it has a heading. Any other text
    ends the program."""
    from kbot.kinematics import PlanarPose  # numpy: -h needs none

    meaning = "X,Y in m, or X,Y,YAW in m, m and rad, for example 1.5,0 or 1.5,0,1.57"
    if text.count(",") == 1:
        x, y = _finite(option, text, 2, meaning)
        return PlanarPose(x, y), False
    x, y, yaw = _finite(option, text, 3, meaning)
    return PlanarPose(x, y, yaw), True


def limits_of(option: str, text: str) -> tuple[float, float]:
    """The highest speeds that `V,W` in m/s and rad/s means. Any other text ends the program."""
    linear, angular = _finite(option, text, 2, "V,W in m/s and rad/s, for example 0.5,2")
    if min(linear, angular) <= 0.0:
        fail(f"{option} takes two numbers above 0, not '{text}'")
    return linear, angular


def speeds_of(option: str, text: str) -> tuple[float, float, float]:
    """The speeds that `V,W` or `VX,VY,W` in m/s and rad/s means: forwards, turning, and to the left. Any
    other text ends the program."""
    meaning = "V,W in m/s and rad/s, for example 0.2,0.5, or VX,VY,W for a robot that drives sideways"
    if text.count(",") == 2:
        linear, lateral, angular = _finite(option, text, 3, meaning)
        return linear, angular, lateral
    linear, angular = _finite(option, text, 2, meaning)
    return linear, angular, 0.0


def _finite(option: str, text: str, count: int, meaning: str) -> list[float]:
    try:
        numbers = [to_float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        fail(f"{option} takes {meaning}, not '{text}'")
    if not all(map(math.isfinite, numbers)):
        fail(f"{option} takes finite numbers, not '{text}'")
    return numbers


_Function = TypeVar("_Function", bound=Callable[..., Any])
NO_FILE = "FILE is missing. 'kbot' means the robot that ships with KBot"
HOW_TO_RECORD = "to record a run, use kbot sim ROBOT --record FILE"
_NEARLY = re.compile(r"([A-Za-z_][\w.\-]*)\s*(=|:)(.*)", re.DOTALL)


def split_arguments(words: Iterable[str]) -> tuple[list[str], dict[str, str]]:
    """The files and the `name:=value` arguments of a command line. The last value of a name wins.

    `a:=b` is a path if it exists, so that one folder of a stranger does not change how the others are loaded.

    Raises:
        KbotError: a word is `name=value` instead of `name:=value`, or has no name.
    """
    files: list[str] = []
    arguments: dict[str, str] = {}
    for word in words:
        name, mark, value = word.partition(":=")
        nearly = _NEARLY.fullmatch(word)
        if mark and not os.path.exists(word):  # noqa: PTH110 - any text will do
            if not name.strip():
                raise KbotError(f"'{word}' has no name before ':='. Write name:=value")
            arguments[name.strip()] = value
        elif nearly and nearly[2] == "=" and not Path(word).exists():
            raise KbotError(f"'{word}' is not an argument. Write {nearly[1]}:={nearly[3]}")
        else:
            files.append(word)
    return files, arguments


def file_and_arguments(words: Iterable[str]) -> tuple[str, dict[str, str]]:
    """The FILE and the arguments of a command line that takes a single file.

    Raises:
        KbotError: no file, more than one, or a malformed argument.
    """
    files, arguments = split_arguments(words)
    if not files:
        raise KbotError(NO_FILE)
    if len(files) > 1:
        raise KbotError(f"expected one FILE, not {len(files)}: {' '.join(files)}")
    return files[0], arguments


def collect_options(name: str, kind: type[DataclassInstance]) -> Callable[[_Function], _Function]:
    """Collect the options named like fields of the dataclass `kind` into one object, the argument `name`."""

    def decorate(function: _Function) -> _Function:
        @functools.wraps(function)
        def with_object(*args: object, **values: object) -> object:
            own = {field.name: values.pop(field.name) for field in fields(kind)}
            return function(*args, **{name: kind(**own)}, **values)

        wrapped: Any = with_object
        result: _Function = wrapped
        return result

    return decorate


def package_path_option(function: _Function) -> _Function:
    """`--package-path DIR`, any number of times, as `package_path: tuple[str, ...]`."""
    return click.option(
        "--package-path",
        multiple=True,
        metavar="DIR",
        type=click.Path(exists=True, file_okay=False),
        help="Package, or folder of packages, to search first. Can be repeated.",
    )(function)


def jobs_option(function: _Function) -> _Function:
    """`-j N`, as `jobs: int | None`."""
    return click.option(
        "-j",
        "--jobs",
        type=click.IntRange(1, 256),
        metavar="N",
        show_default="one for each core",
        help="Trials that run at the same time.",
    )(function)


def json_option(function: _Function) -> _Function:
    """`--json`, as `as_json: bool`."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON.")(function)


def output_option(*names: str, metavar: str = "OUT") -> Callable[[_Function], _Function]:
    """`-o OUT`, as `output: str | None`. Without it, the verb prints its result."""
    return click.option(
        "-o", *names, "output", metavar=metavar, show_default="stdout", help="File to write the result to."
    )


def output_file(
    *suffixes: str,
) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """The callback of an option that names a file to write, with one of these suffixes.

    It rejects an unusable path before the run, which may take long.
    """

    def checked(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
        if value is None:
            return None
        path = Path(value)
        if suffixes and path.suffix.lower() not in suffixes:
            raise click.BadParameter(f"'{value}' does not end in {' or '.join(suffixes)}", ctx, param)
        if not path.parent.is_dir():
            reason = f"cannot write {value}: the folder {path.parent} does not exist"
            raise click.BadParameter(reason, ctx, param)
        return value

    return checked


def read_displays(path: str) -> DisplayFile:
    """Read a display configuration. Prints to stderr which parts of it the page cannot show.

    Raises:
        KbotError: the file is of another kind, unreadable, or malformed (with file:line).
    """
    from kbot.workbench.displays.display_file import DisplayFile  # imported lazily, so that -h stays fast

    displays = DisplayFile(path)
    for text in displays.notes:
        click.echo(f"{path}: {text}", err=True)
    return displays


def _displays(ctx: click.Context, param: click.Parameter, value: str | None) -> DisplayFile | None:
    return read_displays(value) if value else None


def config_option(function: _Function) -> _Function:
    """`--config FILE`, rviz's `-d` and `--display-config`, as `displays: DisplayFile | None`."""
    return click.option(
        "--config",
        "-d",
        "--display-config",
        "displays",
        callback=_displays,
        metavar="FILE",
        help="Display configuration, .kbot.yaml or .rviz. Saving in the page writes to this file.",
    )(function)


@dataclass(frozen=True, slots=True)
class PageOptions:
    """The address to serve the page on, and whether to open a browser. `port` None: the first free port."""

    host: str
    port: int | None
    browser: bool

    def bound(self, *, has_window: bool = True) -> AbstractContextManager[Address]:
        """Reserve the address within the block. Without `has_window`, no browser opens.

        Raises:
            KbotError: the port is in use, or the address does not belong to this machine.
        """
        from kbot.workbench.address import bound  # imported lazily, so that -h stays fast

        return bound(self.host, self.port, open_browser=self.browser and has_window)


def _limit_reading(ctx: click.Context, param: click.Parameter, seconds: float | None) -> None:
    if seconds is not None:
        from kbot.worker import PEER_READING, READING  # imported lazily, so that -h stays fast

        READING.limits = PEER_READING.limits = replace(READING.limits, seconds=seconds)


def page_options(function: _Function) -> _Function:
    """`--host`, `--port` and `--no-browser`, as one `page: PageOptions`, and `--limit-time`."""
    function = collect_options("page", PageOptions)(function)
    function = click.option(
        "--limit-time",
        type=Within(1.0, 86400.0),
        cls=_WithoutRange,
        callback=_limit_reading,
        expose_value=False,
        metavar="SECONDS",
        show_default="30",
        help="Most processor time for reading a changed file, an unsaved text or a model from a peer.",
    )(function)
    function = click.option(
        "--no-browser",
        "browser",
        flag_value=False,
        default=True,
        help="Print the address; do not open a browser.",
    )(function)
    function = click.option(
        "--port",
        type=click.IntRange(0, 65535),
        metavar="N",
        show_default="first free port from 8300",
        help="Port of the page. 0 selects any free port.",
    )(function)
    return click.option(
        "--host",
        default="127.0.0.1",
        show_default=True,
        metavar="ADDRESS",
        help="Address to serve the page on.",
    )(function)


def examples(*lines: str | tuple[str, str]) -> str:
    """An epilog for `click.command(epilog=…)` that shows command lines, some with a comment.

    All comments start in one column, after the longest command that has one.
    """
    width = max((len(line[0]) for line in lines if isinstance(line, tuple)), default=0)
    shown = (line if isinstance(line, str) else f"{line[0]:<{width}}  # {line[1]}" for line in lines)
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in shown)
