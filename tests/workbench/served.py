"""A session that is served, from a test: it is for the thread alone that the simulation runs in."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from kbot.workbench.protocol import State
from kbot.workbench.session.session import Session

Answer = TypeVar("Answer")


def asked(session: Session, question: Callable[[], Answer], changes: bool = False) -> Answer:
    """Ask between two steps, where the simulation runs: a served session is for that thread alone. Pages
    are told where it `changes` something."""
    answer: Future[Answer] = Future()
    advance = session.advance

    def ask_first(wall_seconds: float) -> bool:
        session.advance = advance  # it was for one step
        try:
            answer.set_result(question())
        except Exception as error:  # noqa: BLE001 - raised where it was asked
            answer.set_exception(error)
        return advance(wall_seconds) or changes

    session.advance = ask_first
    return answer.result(60.0)


def state_of(session: Session) -> State:
    """How things stand in a session that is served."""
    return asked(session, session.state)


class Speaker:
    """Publishes where the simulation runs, between two steps: a bus is for that thread alone."""

    def __init__(self, session: Session) -> None:
        self._session, self._bus = session, session.topics.bus

    def publish(self, topic: str, message: object) -> None:
        asked(self._session, lambda: self._bus.publish(topic, message), changes=True)


def hear(session: Session, topic: str, kind: type) -> list[Any]:
    """What is said on a topic from now on; subscribed to where the simulation runs."""
    heard: list[Any] = []
    asked(session, lambda: session.topics.bus.subscribe(topic, kind, heard.append))
    return heard


def do(session: Session, what: Callable[[Any], None]) -> None:
    """Act on what moves the robot, between two steps of it."""
    asked(session, lambda: what(session._motion), changes=True)
