"""Reports what a long operation is doing. The command line shows it; elsewhere it is ignored."""

from __future__ import annotations

from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_send: Callable[[str], None] = lambda _: None  # noqa: E731 - a def would be longer than its body


def working_on(what: str) -> None:
    """Report the step that begins, for example `splitting track.stl into convex pieces`."""
    _send(what)


@contextmanager
def progress_sent_to(receive: Callable[[str], None]) -> Iterator[None]:
    """Within the block, send the steps of all threads to `receive`."""
    global _send
    before, _send = _send, receive
    try:
        yield
    finally:
        _send = before
