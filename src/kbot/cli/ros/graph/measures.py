"""`kbot topic hz`, `bw` and `delay`: how often a topic is said, how much it is, and how late."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import click

from kbot.cli.arguments import examples
from kbot.cli.output import fail
from kbot.cli.ros.graph.asking import ask, at_option, full_name, listen, seconds

REPORT_SECONDS = 1.0
CLOCK = "/clock"

Hear = Callable[[str, dict[str, Any]], None]
Report = Callable[[], str | None]
"""What is to be said of what was heard until now; None while that is too little."""


def _options(function: click.decorators.FC) -> click.decorators.FC:
    """`topic: str`, `window: int`, `count: int | None`, `at: str`."""
    count = click.option("-n", "count", type=click.IntRange(1), metavar="N", help="Print N reports and exit.")
    window = click.option(
        "-w",
        "--window",
        type=click.IntRange(2),
        default=1000,
        show_default=True,
        metavar="N",
        help="Number of latest messages to average over.",
    )
    return click.argument("topic")(window(count(at_option(function))))


@click.command("hz", epilog=examples("kbot topic hz /odom", "kbot topic hz /scan --window 50 -n 3"))
@_options
def hz(topic: str, window: int, count: int | None, at: str) -> None:
    """Print a topic's publishing rate every second.

    The rate is measured in wall-clock time. Ctrl-C stops it.
    """
    times: deque[float] = deque(maxlen=window)

    def report() -> str | None:
        gaps = [after - before for before, after in pairwise(times)]
        if not sum(gaps):
            return None
        return f"average rate: {len(gaps) / sum(gaps):.3f}\n\t{_spread(gaps)}s window: {len(times)}"

    with ask(at) as graph:
        heard = listen(graph, full_name(topic))
        _report_on(heard, lambda said, message: times.append(time.monotonic()), report, count)


@click.command("bw", epilog=examples("kbot topic bw /scan", "kbot topic bw /camera/image_raw -n 3"))
@_options
def bw(topic: str, window: int, count: int | None, at: str) -> None:
    """Print a topic's bandwidth every second.

    Messages are measured in CDR, the encoding that ROS 2 sends. Ctrl-C stops it.
    """
    from kbot.record.encodings.bytes import encode_cdr
    from kbot.record.encodings.plain import from_plain
    from kbot.record.encodings.types import known_type

    said: deque[tuple[float, int]] = deque(maxlen=window)

    def report() -> str | None:
        if len(said) < 2:
            return None
        elapsed = time.monotonic() - said[0][0]
        sizes = [size for _, size in said]
        mean, least, most = (_amount(size) for size in (statistics.fmean(sizes), min(sizes), max(sizes)))
        return (
            f"{_amount(sum(sizes) / elapsed)}/s from {len(sizes)} messages\n"
            f"\tMessage size mean: {mean} min: {least} max: {most}"
        )

    with ask(at) as graph:
        name = full_name(topic)
        kind = known_type(graph.type_of(name))
        if kind is None:
            fail(f"{name} is of a type that KBot does not know, so that its size is not known either")

        def hear(_: str, message: dict[str, Any]) -> None:
            said.append((time.monotonic(), len(encode_cdr(from_plain(message, kind)))))

        _report_on(listen(graph, name), hear, report, count)


@click.command("delay", epilog=examples("kbot topic delay /scan"))
@_options
def delay(topic: str, window: int, count: int | None, at: str) -> None:
    """Print a topic's delay every second.

    The delay is the time on /clock at arrival, minus the stamp of the message. Ctrl-C stops it.
    """
    delays: deque[float] = deque(maxlen=window)
    now = 0.0
    name = full_name(topic)

    def hear(said: str, message: dict[str, Any]) -> None:
        nonlocal now
        if said == CLOCK:
            now = seconds(message["clock"])
        if said == name:
            if not isinstance(message.get("header"), dict):
                fail(f"{name} has no header, and so no stamp")
            delays.append(now - seconds(message["header"]["stamp"]))

    def report() -> str | None:
        if not delays:
            return None
        return f"average delay: {statistics.fmean(delays):.3f}\n\t{_spread([*delays])}s window: {len(delays)}"

    with ask(at) as graph:
        _report_on(listen(graph, CLOCK, name), hear, report, count)


def _report_on(
    heard: Iterator[tuple[str, dict[str, Any]]], hear: Hear, report: Report, count: int | None
) -> None:
    reported, reports = 0.0, 0
    for topic, message in heard:
        hear(topic, message)
        now = time.monotonic()
        reported = reported or now
        text = report() if now - reported >= REPORT_SECONDS else None
        if text is not None:
            reported, reports = now, reports + 1
            click.echo(text)
            if reports == count:
                return


def _spread(values: list[float]) -> str:
    return f"min: {min(values):.3f}s max: {max(values):.3f}s std dev: {statistics.pstdev(values):.5f}"


def _amount(size: float) -> str:
    for unit in ("B", "KB"):
        if size < 1000.0:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.2f} {unit}"
        size /= 1000.0
    return f"{size:.2f} MB"
