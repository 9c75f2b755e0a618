"""Makes the plots that pages ask for in small steps, so that the server keeps responding."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from typing import TypeAlias

from kbot.render.plot import Curve, plot_svg
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.workbench.protocol import AskSeries, AskTrail, DrawPlot, FromServer, PlotDrawn, Refused, Series
from kbot.workbench.serving.hub import Client
from kbot.workbench.serving.past import Past
from kbot.workbench.timeline.series import Field, SeriesTable

Asked: TypeAlias = AskSeries | AskTrail | DrawPlot


class Plotting:
    """Answers each page's newest question; an older one that is not answered yet is given up."""

    def __init__(self, past: Past, complaints: Complaints) -> None:
        self._past, self._complaints = past, complaints
        self._answering: dict[tuple[int, str], asyncio.Task[None]] = {}

    def ask(self, client: Client, asked: Asked) -> None:
        """Raises KbotError: what is asked for does not fit together."""
        if not isinstance(asked, AskTrail):
            _check(asked)
        key = client.number, asked.type
        self._give_up(key)
        self._answering[key] = asyncio.create_task(self._answer(client, asked))

    def leave(self, client: Client) -> None:
        """The page is gone."""
        for key in [key for key in self._answering if key[0] == client.number]:
            self._give_up(key)

    def _give_up(self, key: tuple[int, str]) -> None:
        task = self._answering.pop(key, None)
        if task is not None:
            task.cancel()

    async def _answer(self, client: Client, asked: Asked) -> None:
        making = self._making(asked)
        try:
            while True:
                next(making)
                await asyncio.sleep(0)
        except StopIteration as done:
            client.put(done.value)
        except KbotError as error:
            client.put(Refused(str(error)))
        except Exception as error:  # noqa: BLE001 - one question that fails ends no others
            client.put(Refused(self._complaints.fault(asked.type, error)))

    def _making(self, asked: Asked) -> Generator[None, None, FromServer]:
        if isinstance(asked, AskTrail):
            return (yield from self._past.trail(asked.resets))
        fields = [Field.named(name) for name in asked.fields]
        return _answer_to(asked, (yield from self._past.series(fields, asked.start, asked.end)))


def _check(asked: AskSeries | DrawPlot) -> None:
    if asked.end < asked.start:
        raise KbotError(f"a plot goes from a moment to a later one, not from {asked.start} to {asked.end}")
    if isinstance(asked, DrawPlot) and len(asked.labels) != len(asked.fields):
        raise KbotError(f"{len(asked.fields)} fields have as many labels, not {len(asked.labels)}")


def _answer_to(asked: AskSeries | DrawPlot, table: SeriesTable) -> FromServer:
    columns = table.columns(len(asked.fields))
    if isinstance(asked, AskSeries):
        return Series(
            asked.number,
            asked.start,
            asked.end,
            table.is_thinned,
            tuple(table.at),
            tuple(table.time),
            columns,
        )
    curves = [Curve(label, values) for label, values in zip(asked.labels, columns, strict=True)]
    return PlotDrawn(plot_svg(table.time, curves, round(asked.width), round(asked.height), asked.theme))
