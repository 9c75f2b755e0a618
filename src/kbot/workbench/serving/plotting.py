"""Make the plots that pages request in small steps, so that the server keeps responding."""

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

Request: TypeAlias = AskSeries | AskTrail | DrawPlot


class Plotting:
    """Answers each page's newest request. A newer request of the same type cancels an unanswered one."""

    def __init__(self, past: Past, complaints: Complaints) -> None:
        self._past, self._complaints = past, complaints
        self._answering: dict[tuple[int, str], asyncio.Task[None]] = {}

    def request_plot(self, client: Client, request: Request) -> None:
        """Start a request. Raises KbotError if its fields are inconsistent."""
        if not isinstance(request, AskTrail):
            _check(request)
        key = client.number, request.type
        self._cancel(key)
        self._answering[key] = asyncio.create_task(self._answer(client, request))

    def leave(self, client: Client) -> None:
        """Cancel the requests of a page that has disconnected."""
        for key in [key for key in self._answering if key[0] == client.number]:
            self._cancel(key)

    def _cancel(self, key: tuple[int, str]) -> None:
        task = self._answering.pop(key, None)
        if task is not None:
            task.cancel()

    async def _answer(self, client: Client, request: Request) -> None:
        making = self._making(request)
        try:
            while True:
                next(making)
                await asyncio.sleep(0)
        except StopIteration as done:
            client.put(done.value)
        except KbotError as error:
            client.put(Refused(str(error)))
        except Exception as error:  # noqa: BLE001 - a failing request does not end others
            client.put(Refused(self._complaints.fault(request.type, error)))

    def _making(self, request: Request) -> Generator[None, None, FromServer]:
        if isinstance(request, AskTrail):
            return (yield from self._past.trail(request.resets, request.after))
        fields = [Field.named(name) for name in request.fields]
        return _answer_to(request, (yield from self._past.series(fields, request.start, request.end)))


def _check(request: AskSeries | DrawPlot) -> None:
    if request.end < request.start:
        raise KbotError(f"the end of a plot must be after its start, not {request.start} to {request.end}")
    if isinstance(request, DrawPlot) and len(request.labels) != len(request.fields):
        raise KbotError(
            f"{len(request.fields)} fields need {len(request.fields)} labels, not {len(request.labels)}"
        )


def _answer_to(request: AskSeries | DrawPlot, table: SeriesTable) -> FromServer:
    columns = table.columns(len(request.fields))
    if isinstance(request, AskSeries):
        return Series(
            request.number,
            request.start,
            request.end,
            table.is_thinned,
            tuple(table.at),
            tuple(table.time),
            columns,
        )
    curves = [Curve(label, values) for label, values in zip(request.labels, columns, strict=True)]
    return PlotDrawn(plot_svg(table.time, curves, round(request.width), round(request.height), request.theme))
