from contextlib import suppress

import pytest

from kbot.messages import Clock, Time
from kbot.messages.clock import NEVER
from kbot.text import KbotError

MS = 1_000_000


def test_timers_fire_once_a_period_in_the_order_they_were_made():
    clock, calls = Clock(), []
    clock.every(50.0, lambda: calls.append(("odom", clock.nanoseconds // MS)))
    clock.every(50.0, lambda: calls.append(("joints", clock.nanoseconds // MS)))
    clock.every(25.0, lambda: calls.append(("slow", clock.nanoseconds // MS)))
    for ms in range(2, 41, 2):
        clock.advance_to(ms * MS)
    assert calls == [("odom", 20), ("joints", 20), ("odom", 40), ("joints", 40), ("slow", 40)]


def test_next_due_is_the_soonest_timer():
    clock = Clock()
    assert clock.next_due == NEVER
    clock.every(10.0, lambda: None)
    clock.every(50.0, lambda: None)
    assert clock.next_due == 20 * MS


def test_a_cancelled_timer_is_silent():
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


def test_set_jumps_without_calling():
    clock, calls = Clock(), []
    clock.every(50.0, lambda: calls.append(clock.nanoseconds))
    clock.advance_to(30 * MS)
    clock.set(0)
    clock.advance_to(20 * MS)
    assert calls == [30 * MS, 20 * MS]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf"), 1e-308])
def test_a_rate_that_is_none_is_refused(rate):
    with pytest.raises(KbotError, match="rate"):
        Clock().every(rate, lambda: None)


def test_time_is_split_and_joined_exactly():
    time = Time.from_nanoseconds(3_000_000_007)
    assert (time.sec, time.nanosec, time.nanoseconds) == (3, 7, 3_000_000_007)


def test_afterwards_is_once_and_after_all_that_was_due() -> None:
    clock, called = Clock(), list[str]()

    def due() -> None:
        called.append("due")
        if len(called) == 1:
            clock.afterwards(lambda: called.append("afterwards"))

    clock.every(10.0, due)
    clock.advance_to(200_000_000)
    clock.advance_to(300_000_000)
    assert called == ["due", "due", "afterwards", "due"]


def test_a_moment_that_has_begun_goes_on_until_time_has_advanced_to_it() -> None:
    clock, called = Clock(), list[str]()

    def due() -> None:
        called.append("due")
        clock.afterwards(lambda: called.append("afterwards"))

    clock.every(10.0, due)
    clock.begin_moment(100_000_000)
    assert (clock.nanoseconds, called) == (100_000_000, ["due"])
    called.append("more")
    clock.advance_to(100_000_000)
    assert called == ["due", "more", "afterwards"]


def test_what_a_callback_raises_calls_no_other_timer_sooner_or_later() -> None:
    clock, called = Clock(), []

    def fail() -> None:
        called.append(("fails", clock.nanoseconds))
        raise ValueError

    clock.every(1e9 / 10, fail)
    clock.every(1e9 / 25, lambda: called.append(("goes on", clock.nanoseconds)))
    for now in range(31):
        with suppress(ValueError):
            clock.advance_to(now)
    assert called == [("fails", 10), ("fails", 20), ("goes on", 25), ("fails", 30)]


@pytest.mark.parametrize(("to", "then"), [(0, 10), (44, 50), (500, 510)])
def test_a_callback_may_set_the_time_and_what_was_jumped_over_is_not_called(to, then) -> None:
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
