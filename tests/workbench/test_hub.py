"""The connected pages, and the messages that wait for them."""

import asyncio
import json

from kbot.workbench.protocol import Notice, Refused, SourceText, State, Timeline
from kbot.workbench.serving.hub import MAX_NOTICES, Client, Hub


def state(time: float) -> State:
    return State(1, time, False, 1.0, 1.0, (), (), (), (), (), (), (), (), 0, 0)


def timeline(end: float, live: bool) -> Timeline:
    return Timeline(0.0, end, 0.5, live, False, False, False, 1.0, (), None)


def sent_by(client: Client) -> list[dict[str, object]]:
    """Return what the page is sent before it would have to wait."""
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


def test_a_slow_page_receives_the_newest_message_of_each_kind() -> None:
    client = Hub().join()
    for tick in range(10_000):
        client.put(state(tick / 50))
    client.put(Refused("no"))
    client.put(SourceText("a", "1", (), (), ""))
    client.put(SourceText("b", "1", (), (), ""))
    client.put(SourceText("a", "2", (), (), ""))
    sent = sent_by(client)
    assert [message["type"] for message in sent] == ["state", "refused", "source", "source"]
    assert sent[0]["time"] == 9_999 / 50
    assert {(m["file"], m["text"]) for m in sent[2:]} == {("a", "2"), ("b", "1")}


def test_no_notice_replaces_another_one() -> None:
    client = Hub().join()
    for _ in range(2):
        client.put(Refused("first"))
        client.put(Refused("second"))
        client.put(Notice("third"))
    texts = [message.get("reason") or message["text"] for message in sent_by(client)]
    assert texts == ["first", "second", "third"]


def test_only_the_newest_notices_wait_for_a_slow_page() -> None:
    client = Hub().join()
    for number in range(10 * MAX_NOTICES):
        client.put(Refused(f"{number}."))
    assert [message["reason"] for message in sent_by(client)] == [f"{n}." for n in range(450, 500)]


def test_the_timeline_is_sent_before_the_messages_of_its_time() -> None:
    """A page forgets the messages of topics when it displays another time."""
    client = Hub().join()
    client.put_timeline(timeline(end=1.0, live=False))
    client.put_topic("/plan", json.dumps({"type": "message"}))
    client.put_timeline(timeline(end=2.0, live=False))
    first, second = sent_by(client)
    assert (first["type"], first["end"], second["type"]) == ("timeline", 2.0, "message")
    client.put_topic("/plan", json.dumps({"type": "message"}))
    client.put_timeline(timeline(end=3.0, live=True))
    assert [message["type"] for message in sent_by(client)] == ["message", "timeline"]


def test_all_pages_receive_messages_until_they_disconnect() -> None:
    hub = Hub()
    first, second = hub.join(), hub.join()
    assert first.number != second.number
    hub.leave(first)
    hub.publish(state(1.0))
    assert sent_by(first) == []
    assert len(sent_by(second)) == 1
    assert len(hub) == 1


def test_a_slow_page_has_at_most_two_unanswered_beats() -> None:
    client = Hub().join()
    got: list[dict[str, object]] = []

    async def run() -> None:
        async def take(text: str | bytes) -> None:
            got.append(json.loads(text))

        async def publish(start: int, rounds: int) -> None:
            for tick in range(start, start + rounds):
                client.put(state(tick))
                for _ in range(5):
                    await asyncio.sleep(0)

        def beats() -> int:
            return sum(message["type"] == "beat" for message in got)

        pump = asyncio.create_task(client.pump(take))
        await publish(0, 100)
        assert beats() == 25  # a page that never answers is sent everything
        for _ in range(beats()):
            client.count_answer()
        await publish(100, 100)
        assert beats() == 27
        assert got[-2]["time"] == 107
        client.count_answer()
        await publish(200, 1)
        assert got[-1]["time"] == 200  # everything in between is dropped
        await publish(201, 100)
        assert beats() == 28
        pump.cancel()

    asyncio.run(run())
