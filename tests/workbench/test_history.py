"""The messages of the last minutes: complete at every time, in bounded memory."""

import random

import pytest

from kbot.workbench.timeline import history
from kbot.workbench.timeline.history import History


def filled(seconds: int) -> History:
    past = History()
    past.pass_to(0.0)
    past.add("map", b"the map")
    for step in range(seconds * 50):
        past.pass_to(step / 50)
        past.add("state", f"state {step}")
        if step % 5 == 0:
            past.add("scan", f"scan {step}".encode())
    return past


def test_every_time_has_the_last_messages_until_then() -> None:
    past = filled(20)
    for step in (0, 1, 49, 50, 51, 123, 700, 998, 999):
        assert past.at(step / 50, ("state", "scan", "map", "nothing")) == {
            "state": f"state {step}",
            "scan": f"scan {step - step % 5}".encode(),
            "map": b"the map",
        }
    assert past.at(19.98, ("map",)) == {"map": b"the map"}


def test_later_messages_are_missing() -> None:
    past = filled(3)
    past.add("late", "late")
    assert past.at(1.0, ("late",)) == {}
    assert past.at(past.end, ("late",)) == {"late": "late"}


def test_only_the_last_minutes_are_kept_and_the_last_message_of_every_key() -> None:
    past = filled(400)
    assert past.end == pytest.approx(399.98)
    assert past.end - past.start == pytest.approx(history.KEPT_SECONDS, abs=2 * history.CHUNK_SECONDS)
    assert past.at(past.start, ("map", "state"))["map"] == b"the map"
    assert past.at(past.start + 0.001, ("state",)) == {"state": f"state {round(past.start * 50)}"}


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history, "MOST_BYTES", 1_000_000)
    noise = random.Random(1)
    past = History()
    for step in range(600):
        past.pass_to(step / 50)
        past.add("state", noise.randbytes(30_000))  # does not compress
    assert past.size < 1_000_000 + history.CHUNK_BYTES
    assert past.at(past.end, ("state",))


def test_large_frames_are_kept_less_often_than_they_arrive() -> None:
    past = History()
    image = bytes(1_000_000)
    for step in range(100):
        past.pass_to(step / 50)
        past.add_some("image", image + bytes([step]))
    assert past.at(1.98, ("image",))["image"][-1:] == b"\0"
    past.pass_to(2.1)
    past.add_some("image", image + b"x")
    assert past.at(2.1, ("image",))["image"][-1:] == b"x"


def test_ended_keys_have_no_message() -> None:
    past = filled(3)
    past.end_of("scan")
    past.pass_to(10.0)
    past.add("state", "much later")
    assert past.at(2.9, ("scan",)) == {"scan": b"scan 145"}
    assert past.at(10.0, ("scan", "state")) == {"state": "much later"}
    past.add_some("scan", b"anew")
    assert past.at(10.0, ("scan",)) == {"scan": b"anew"}


def test_the_timeline_counts_all_simulated_time() -> None:
    past = filled(3)
    past.pass_to(10.0)
    assert past.end == pytest.approx(10.0)
    past.set_clock()
    past.pass_to(300.0)
    assert past.end == pytest.approx(10.0)
    past.pass_to(300.5)
    assert past.end == pytest.approx(10.5)


def test_the_timeline_continues_over_a_reset() -> None:
    past = filled(5)
    past.pass_to(0.0)
    past.add("state", "anew")
    past.pass_to(0.5)
    past.add("state", "later")
    assert past.at(4.98, ("state",)) == {"state": "anew"}
    assert past.at(5.48, ("state",)) == {"state": "later"}
    assert past.at(4.9, ("state",)) == {"state": "state 245"}


def test_a_timeline_that_begins_late_has_the_simulated_time() -> None:
    """A server may send its first state when the simulation has run for a while."""
    past = History()
    assert past.pass_to(0.5) == 0.5
    assert past.pass_to(0.7) == pytest.approx(0.7)
