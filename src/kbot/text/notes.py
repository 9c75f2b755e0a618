"""Notes: single lines that a user must see although nothing is wrong.

A library call gives a note as a Python warning. The command line prints it on stderr, each text once.
"""

from __future__ import annotations

from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def _warn(text: str) -> None:
    import warnings  # not for every start of the program

    warnings.warn(text, UserWarning, stacklevel=3)


_send: Callable[[str], None] = _warn


def note(text: str) -> None:
    """Send a note to the user."""
    _send(text)


@contextmanager
def notes_sent_to(receive: Callable[[str], None]) -> Iterator[None]:
    """Send the notes of this process, of all its threads, to `receive`; each text once."""
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
