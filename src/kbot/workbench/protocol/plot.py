"""Numbers against time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kbot.workbench.protocol.values import Fields, Range


@dataclass(frozen=True, slots=True)
class AskSeries:
    """Say how numbers went from `start` to `end` seconds along the timeline; `number` comes back with the
    answer. A field is `/topic path.to.it`, or `state path.to.it` of the State, whose positions go by
    joint."""

    number: Annotated[float, Range(0, 1e15)]
    fields: Fields
    start: Annotated[float, Range(0, 1e12)]
    end: Annotated[float, Range(0, 1e12)]
    type: Literal["ask_series"] = "ask_series"


@dataclass(frozen=True, slots=True)
class DrawPlot:
    """Draw the same as SVG, of so many pixels; `labels` are the names of the fields."""

    fields: Fields
    labels: Fields
    start: Annotated[float, Range(0, 1e12)]
    end: Annotated[float, Range(0, 1e12)]
    theme: Literal["dark", "light"]
    width: Annotated[float, Range(100, 8192)]
    height: Annotated[float, Range(100, 8192)]
    type: Literal["draw_plot"] = "draw_plot"


@dataclass(frozen=True, slots=True)
class Series:
    """What was at moments `at` along the timeline, which were `time` by the simulation's clock: a list of
    values for each field, null where there was none yet. Of more moments than a picture has columns every
    second, third and so on is given."""

    number: float
    start: float
    end: float
    is_thinned: bool
    at: tuple[float, ...]
    time: tuple[float, ...]
    values: tuple[tuple[float | None, ...], ...]
    type: Literal["series"] = "series"


@dataclass(frozen=True, slots=True)
class PlotDrawn:
    """A plot as SVG, for the browser to keep."""

    svg: str
    type: Literal["plot_drawn"] = "plot_drawn"
