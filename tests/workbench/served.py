"""A served session, and access to it from a test. Only the thread of the simulation may use it."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar
from urllib.parse import urlsplit

from kbot.text import KbotError
from kbot.workbench.protocol import State
from kbot.workbench.serve import serving
from kbot.workbench.session.session import Session

Answer = TypeVar("Answer")

last_port = 0
"""The port of the last session of `served`, 0 before the first one."""


@contextmanager
def served(session: Session) -> Iterator[str]:
    """Serve a session at the address of the last one, if it is free.

    Chromium compiles the scripts of the page only once for each address, which is a quarter of the time to
    load the page. A page that stays open at the end connects to the next session.
    """
    global last_port
    with ExitStack() as stack:
        try:
            address = stack.enter_context(serving(session, port=last_port))
        except KbotError:  # another program uses the port
            address = stack.enter_context(serving(session))
        last_port = urlsplit(address).port or 0
        yield address


def run_between_steps(session: Session, question: Callable[[], Answer], changes: bool = False) -> Answer:
    """Run a function between two steps, on the thread of the simulation. With `changes` pages receive the new
    state."""
    answer: Future[Answer] = Future()
    advance = session.advance

    def ask_first(wall_seconds: float) -> bool:
        session.advance = advance  # it was for one step
        try:
            answer.set_result(question())
        except Exception as error:  # noqa: BLE001 - raised in the test
            answer.set_exception(error)
        return advance(wall_seconds) or changes

    session.advance = ask_first
    return answer.result(60.0)


def state_of(session: Session) -> State:
    """Return the state of a served session."""
    return run_between_steps(session, session.state)


class Speaker:
    """Publishes on the thread of the simulation, between two steps."""

    def __init__(self, session: Session) -> None:
        self._session, self._bus = session, session.topics.bus

    def publish(self, topic: str, message: object) -> None:
        run_between_steps(self._session, lambda: self._bus.publish(topic, message), changes=True)


def collect(session: Session, topic: str, kind: type) -> list[Any]:
    """Collect the messages of a topic from now on."""
    received: list[Any] = []
    run_between_steps(session, lambda: session.topics.bus.subscribe(topic, kind, received.append))
    return received


def do(session: Session, what: Callable[[Any], None]) -> None:
    """Run a function on the mover, between two of its steps."""
    run_between_steps(session, lambda: what(session._motion), changes=True)
