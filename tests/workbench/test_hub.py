"""The pages that are connected, and what waits for them."""

import asyncio
import json

from kbot.workbench.protocol import Refused, SourceText, State, Timeline
from kbot.workbench.serving.hub import Client, Hub


def state(time: float) -> State:
    return State(1, time, False, 1.0, 1.0, (), (), (), (), (), (), (), (), 0, 0)


def timeline(end: float, live: bool) -> Timeline:
    return Timeline(0.0, end, 0.5, live, False, False, False, 1.0, (), None)


def sent_by(client: Client) -> list[dict[str, object]]:
    """What the page is sent before it would have to wait."""
    sent: list[dict[str, object]] = []

    async def keep(text: str) -> None:
        sent.append(json.loads(text))

    async def run() -> None:
        pump = asyncio.create_task(client.pump(keep))
        for _ in range(20):
            await asyncio.sleep(0)
        pump.cancel()

    asyncio.run(run())
    return sent


def test_a_slow_page_gets_the_newest_of_each_kind() -> None:
    client = Hub().join()
    for tick in range(10_000):
        client.put(state(tick / 50))
    client.put(Refused("no"))
    client.put(SourceText("a", "1", (), ()))
    client.put(SourceText("b", "1", (), ()))
    client.put(SourceText("a", "2", (), ()))
    sent = sent_by(client)
    assert [message["type"] for message in sent] == ["state", "refused", "source", "source"]
    assert sent[0]["time"] == 9_999 / 50
    assert {(m["file"], m["text"]) for m in sent[2:]} == {("a", "2"), ("b", "1")}


def test_time_that_goes_on_is_told_before_what_was_said_at_its_moment() -> None:
    """A page forgets what topics said when it comes to another moment."""
    client = Hub().join()
    client.put_timeline(timeline(end=1.0, live=False))
    client.put_topic("/plan", json.dumps({"type": "message"}))
    client.put_timeline(timeline(end=2.0, live=False))
    first, second = sent_by(client)
    assert (first["type"], first["end"], second["type"]) == ("timeline", 2.0, "message")
    client.put_topic("/plan", json.dumps({"type": "message"}))
    client.put_timeline(timeline(end=3.0, live=True))
    assert [message["type"] for message in sent_by(client)] == ["message", "timeline"]


def test_all_pages_are_told_until_they_leave() -> None:
    hub = Hub()
    first, second = hub.join(), hub.join()
    assert first.number != second.number
    hub.leave(first)
    hub.publish(state(1.0))
    assert sent_by(first) == []
    assert len(sent_by(second)) == 1
    assert len(hub) == 1


def test_a_page_that_answers_late_has_no_more_than_two_beats_under_way() -> None:
    client = Hub().join()
    got: list[dict[str, object]] = []

    async def run() -> None:
        async def take(text: str | bytes) -> None:
            got.append(json.loads(text))

        async def tell(start: int, rounds: int) -> None:
            for tick in range(start, start + rounds):
                client.put(state(tick))
                for _ in range(5):
                    await asyncio.sleep(0)

        def beats() -> int:
            return sum(message["type"] == "beat" for message in got)

        pump = asyncio.create_task(client.pump(take))
        await tell(0, 100)
        assert beats() == 25  # one that never answers is told all
        for _ in range(beats()):
            client.count_answer()
        await tell(100, 100)
        assert beats() == 27
        assert got[-2]["time"] == 107
        client.count_answer()
        await tell(200, 1)
        assert got[-1]["time"] == 200  # and all between is dropped
        await tell(201, 100)
        assert beats() == 28
        pump.cancel()

    asyncio.run(run())
