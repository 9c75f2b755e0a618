"""The simulated clock and its timers."""

from contextlib import suppress

import pytest

from kbot.messages import Clock, Time
from kbot.messages.clock import NEVER
from kbot.text import KbotError

MS = 1_000_000


def test_timers_fire_once_per_period_in_order_of_creation():
    clock, calls = Clock(), []
    clock.every(50.0, lambda: calls.append(("odom", clock.nanoseconds // MS)))
    clock.every(50.0, lambda: calls.append(("joints", clock.nanoseconds // MS)))
    clock.every(25.0, lambda: calls.append(("slow", clock.nanoseconds // MS)))
    for ms in range(2, 41, 2):
        clock.advance_to(ms * MS)
    assert calls == [("odom", 20), ("joints", 20), ("odom", 40), ("joints", 40), ("slow", 40)]


def test_next_due_is_that_of_the_earliest_timer():
    clock = Clock()
    assert clock.next_due == NEVER
    clock.every(10.0, lambda: None)
    clock.every(50.0, lambda: None)
    assert clock.next_due == 20 * MS


def test_a_cancelled_timer_is_not_called():
    clock, calls = Clock(), []
    timer = clock.every(50.0, lambda: calls.append(1))
    timer.cancel()
    clock.advance_to(100 * MS)
    assert calls == []


def test_a_timer_may_cancel_itself():
    clock, calls = Clock(), []

    def once():
        calls.append(1)
        timer.cancel()

    timer = clock.every(50.0, once)
    clock.advance_to(100 * MS)
    assert calls == [1]


def test_set_does_not_call_timers():
    clock, calls = Clock(), []
    clock.every(50.0, lambda: calls.append(clock.nanoseconds))
    clock.advance_to(30 * MS)
    clock.set(0)
    clock.advance_to(20 * MS)
    assert calls == [30 * MS, 20 * MS]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf"), 1e-308])
def test_error_for_an_invalid_rate(rate):
    with pytest.raises(KbotError, match="rate"):
        Clock().every(rate, lambda: None)


def test_time_converts_nanoseconds_exactly():
    time = Time.from_nanoseconds(3_000_000_007)
    assert (time.sec, time.nanosec, time.nanoseconds) == (3, 7, 3_000_000_007)


def test_after_timers_calls_once_after_all_due_timers() -> None:
    clock, called = Clock(), list[str]()

    def due() -> None:
        called.append("due")
        if len(called) == 1:
            clock.after_timers(lambda: called.append("after"))

    clock.every(10.0, due)
    clock.advance_to(200_000_000)
    clock.advance_to(300_000_000)
    assert called == ["due", "due", "after", "due"]


def test_after_timers_callbacks_wait_for_advance_to() -> None:
    clock, called = Clock(), list[str]()

    def due() -> None:
        called.append("due")
        clock.after_timers(lambda: called.append("after"))

    clock.every(10.0, due)
    clock.run_timers(100_000_000)
    assert (clock.nanoseconds, called) == (100_000_000, ["due"])
    called.append("between")
    clock.advance_to(100_000_000)
    assert called == ["due", "between", "after"]


def test_an_exception_of_a_callback_does_not_shift_other_timers() -> None:
    clock, called = Clock(), []

    def fail() -> None:
        called.append(("fails", clock.nanoseconds))
        raise ValueError

    clock.every(1e9 / 10, fail)
    clock.every(1e9 / 25, lambda: called.append(("works", clock.nanoseconds)))
    for now in range(31):
        with suppress(ValueError):
            clock.advance_to(now)
    assert called == [("fails", 10), ("fails", 20), ("works", 25), ("fails", 30)]


@pytest.mark.parametrize(("to", "then"), [(0, 10), (44, 50), (500, 510)])
def test_a_callback_may_set_the_time_and_skipped_calls_are_dropped(to, then) -> None:
    clock, called = Clock(), []

    def jump() -> None:
        if clock.nanoseconds == 100:
            clock.set(to)

    clock.every(1e9 / 100, jump)
    clock.every(1e9 / 10, lambda: called.append(clock.nanoseconds))
    for now in range(101):
        clock.advance_to(now)
    assert (clock.nanoseconds, clock.next_due) == (to, then)
    assert called == list(range(10, 100, 10))
