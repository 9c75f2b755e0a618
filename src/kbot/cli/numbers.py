"""Options that are numbers: within bounds, or several with commas between."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from kbot.cli.output import fail
from kbot.text.numbers import to_float

if TYPE_CHECKING:
    from click.types import OptionHelpExtra

    from kbot.kinematics import PlanarPose


class Within(click.FloatRange):
    """A number between two bounds. `nan` is rejected."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ANN401 - click's signature
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


class _WithoutRange(click.Option):
    """Its help does not show the range, which holds for every value that anybody writes."""

    def get_help_extra(self, ctx: click.Context) -> OptionHelpExtra:
        extra = super().get_help_extra(ctx)
        extra.pop("range", None)
        return extra


SECONDS = Within(0.0, 9.2e9)
"""Times that 64 bits of nanoseconds hold."""


def seconds_option(*names: str, **more: Any) -> Callable[[click.decorators.FC], click.decorators.FC]:  # noqa: ANN401 - click's own keywords
    """An option that is a time of a recording, in seconds."""
    return click.option(*names, cls=_WithoutRange, type=SECONDS, metavar="S", **more)


def rate_option(
    most: float, text: str, metavar: str = "HZ"
) -> Callable[[click.decorators.FC], click.decorators.FC]:
    """`-r` and `--rate`, from 0.01 to `most`, as `rate: float`."""
    return click.option(
        "-r", "--rate", type=Within(0.01, most), default=1.0, show_default=True, metavar=metavar, help=text
    )


def pose_of(option: str, text: str) -> PlanarPose:
    """`X,Y,YAW` in m, m and rad; anything else ends the program."""
    from kbot.kinematics import PlanarPose  # numpy: -h needs none

    x, y, yaw = _finite(option, text, 3, "x and y in m and yaw in rad, as in 1.5,0,1.57")
    return PlanarPose(x, y, yaw)


def speeds_of(option: str, text: str) -> tuple[float, float]:
    """`V,W` in m/s and rad/s; anything else ends the program."""
    linear, angular = _finite(option, text, 2, "forward m/s and turning rad/s, as in 0.2,0.5")
    return linear, angular


def _finite(option: str, text: str, count: int, meaning: str) -> list[float]:
    word = {2: "two", 3: "three"}[count]
    try:
        numbers = [to_float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        fail(f"{option} is {word} numbers, {meaning}; not '{text}'")
    if not all(map(math.isfinite, numbers)):
        fail(f"{option} is {word} finite numbers, not '{text}'")
    return numbers
