"""Adds the options of pictures to verbs: size, camera direction, background and theme."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kbot.cli.output import fail
from kbot.text.numbers import to_float

if TYPE_CHECKING:
    from kbot.render.look import Look
    from kbot.render.palette import Theme

_Function = TypeVar("_Function", bound=Callable[..., Any])  # Any: each verb has its own parameters


def size_option(default: str) -> Callable[[_Function], _Function]:
    """`--size`, as `size: str`."""
    return click.option(
        "--size", default=default, show_default=True, metavar="WxH", help="Image size in pixels."
    )


def parse_size(size: str) -> tuple[int, int]:
    """Width and height in pixels.

    Raises:
        KbotError: the text is not a size, or it is too large to draw.
    """
    from kbot.render.look import MOST_PIXELS  # imported lazily, so that -h stays fast

    try:
        width, height = (int(word) for word in size.lower().split("x"))
    except ValueError:
        fail(f"--size takes WxH in pixels, for example 1280x720, not '{size}'")
    if not (1 <= width <= MOST_PIXELS and 1 <= height <= MOST_PIXELS):
        fail(f"--size {size}: width and height must be 1 to {MOST_PIXELS} pixels")
    return width, height


def look_options(function: _Function) -> _Function:
    """`--size`, `--from`, `--transparent` and `--theme`, as one `look: Look`."""

    @functools.wraps(function)
    def with_look(
        *args: object, size: str, side: str, transparent: bool, theme: Theme, **others: object
    ) -> object:
        return function(*args, look=_parse_look(size, side, transparent, theme), **others)

    wrapped: Any = with_look
    for option in (
        click.option(
            "--theme",
            type=click.Choice(["dark", "light"]),
            default="dark",
            show_default=True,
            help="Colour theme.",
        ),
        click.option("--transparent", is_flag=True, help="Transparent background."),
        click.option(
            "--from",
            "side",
            default="215,28",
            show_default=True,
            metavar="AZ,EL",
            help="Camera direction as azimuth,elevation in degrees. 0,0 looks at the front, 90,0 at the left "
            "side, 0,90 from above.",
        ),
        size_option("1280x720"),
    ):
        wrapped = option(wrapped)
    result: _Function = wrapped
    return result


def _parse_look(size: str, side: str, transparent: bool, theme: Theme) -> Look:
    from kbot.render.look import Look

    width, height = parse_size(size)
    try:
        azimuth, elevation = (to_float(word) for word in side.split(","))
    except ValueError:
        fail(f"--from takes AZ,EL in degrees, for example 215,28, not '{side}'")
    return Look(width, height, azimuth, elevation, transparent, theme)
