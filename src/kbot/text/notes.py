"""Sends notes: single lines that a user must see although there is no error.

In a library call, a note is a Python warning. The command line prints each note once on stderr.
"""

from __future__ import annotations

from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def _warn(text: str) -> None:
    import warnings  # rarely needed: start-up time

    warnings.warn(text, UserWarning, stacklevel=3)


_send: Callable[[str], None] = _warn


def note(text: str) -> None:
    """Send a note to the user."""
    _send(text)


@contextmanager
def notes_sent_to(receive: Callable[[str], None]) -> Iterator[None]:
    """Within the block, send the notes of all threads to `receive`, each text once."""
    global _send
    before, known = _send, set[str]()

    def send(text: str) -> None:
        if text not in known:
            known.add(text)
            receive(text)

    _send = send
    try:
        yield
    finally:
        _send = before
