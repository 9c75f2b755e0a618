"""The interface by which a running launch uses the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import RunOutputs
from kbot.ros.peer_options import PeerOptions
from kbot.text import Diagnostic
from kbot.tf.static_transforms import StaticTransform


class Terminal(Protocol):
    """The user's terminal, and the outputs of a run."""

    def note(self, text: str) -> None:
        """Print a sentence."""

    def report(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Print diagnostics."""

    def loading(self, what: str) -> AbstractContextManager[None]:
        """Show within the block that something is loading."""

    def keys(self, press: Callable[[str], None]) -> AbstractContextManager[None]:
        """Pass each key to `press` within the block."""

    def outputs(
        self, record: RecordOptions, peers: PeerOptions, transforms: Sequence[StaticTransform]
    ) -> AbstractContextManager[RunOutputs]:
        """Record a run and connect it to peers within the block. Signals end the run in order."""
