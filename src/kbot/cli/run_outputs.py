"""Adds the options of recordings and peers to verbs, and runs verbs with them."""

from __future__ import annotations

import functools
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import click

from kbot.cli.output import fail, print_note
from kbot.extensions import parts
from kbot.record.record_options import RecordOptions
from kbot.text.signals import ending_signals

if TYPE_CHECKING:
    from kbot.record.run_outputs import Peers, RunOutputs
    from kbot.tf.static_transforms import StaticTransform

_Function = TypeVar("_Function", bound=Callable[..., Any])  # Any: each verb has its own parameters


class PeerRequest(Protocol):
    """The peers that the user requested. `is_live`: the run must keep wall-clock time for them."""

    @property
    def is_live(self) -> bool: ...

    def describe(self) -> str: ...

    def open(self, report: Callable[[str], None]) -> Peers: ...


def peer_options(function: _Function) -> _Function:
    """Add the options of peers, passed to the verb as `peers: PeerRequest | None`.

    `peers` is None if no installed part of KBot provides peers.
    """
    module = _peers_module()
    if module is not None:
        decorated: _Function = module.peer_options(function)
        return decorated

    @functools.wraps(function)
    def without_peers(*args: object, **others: object) -> object:
        return function(*args, peers=None, **others)

    wrapped: Any = without_peers
    result: _Function = wrapped
    return result


def record_options(function: _Function) -> _Function:
    """Add the options of recordings, passed to the verb as `record: RecordOptions`."""

    @functools.wraps(function)
    def with_record(
        *args: object, record: str | None, record_topics: tuple[str, ...], **others: object
    ) -> object:
        if record_topics and record is None:
            fail("--record-topic needs --record FILE")
        if record == "":
            fail("--record needs a file name")
        return function(*args, record=RecordOptions(record or "", record_topics), **others)

    wrapped: Any = with_record
    wrapped = click.option(
        "--record-topic",
        "record_topics",
        multiple=True,
        metavar="NAME",
        show_default="all topics",
        help="Topic to record. Can be repeated.",
    )(wrapped)
    wrapped = click.option(
        "--record",
        metavar="FILE",
        help="File to record the run to: .mcap, .bag (ROS 1), or a rosbag2 folder if FILE has no suffix.",
    )(wrapped)
    result: _Function = wrapped
    return result


@contextmanager
def run_outputs(
    record: RecordOptions | None = None,
    peers: PeerRequest | None = None,
    transforms: Sequence[StaticTransform] = (),
    *,
    served: bool = False,
) -> Iterator[RunOutputs]:
    """Record the run and connect it to peers within the block.

    Ctrl-C, SIGTERM and a closed terminal end the program cleanly. `served`: the run keeps wall-clock time, so
    that `kbot topic` can query it even if the user requested no peer.

    Raises:
        KbotError: the recording cannot be created, or a bridge cannot be opened.
        Exit: with status 2 after the block, if the recording ended early. The reason is already printed.
    """
    from kbot.record.run_outputs import RunOutputs  # slow to import: numpy and mcap

    if served and peers is None and (module := _peers_module()) is not None:
        peers = module.DEFAULT
    opened = peers.open(print_note) if peers is not None and (served or peers.is_live) else None
    outputs = RunOutputs(print_note, record, opened, transforms)
    try:
        with _ended_by_signals(outputs):
            yield outputs
    finally:
        outputs.close()
    if outputs.failure is not None:
        raise click.exceptions.Exit(2)


def _peers_module() -> ModuleType | None:
    return next((import_module(part.PEERS) for part in parts()), None)


@contextmanager
def _ended_by_signals(outputs: RunOutputs) -> Iterator[None]:
    def end(number: int, frame: object) -> None:
        outputs.interrupt(KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number))

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, end) for number in ending_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
