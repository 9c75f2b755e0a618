"""Access to a served session from a test. Only the thread of the simulation may use it."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from kbot.workbench.protocol import State
from kbot.workbench.session.session import Session

Answer = TypeVar("Answer")


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
