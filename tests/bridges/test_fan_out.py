"""FanOut: from the simulation's thread to the sinks of all peers."""

from functools import partial

from kbot.messages import types as msg
from kbot.messages.sensing import LaserScan
from kbot.record.feed import Packet
from kbot.ros.bridges.fan_out import Flush, Sink
from kbot.ros.bridges.loop import Batch, later, wait_for

from .conftest import Running, wait_until


def test_a_topic_is_opened_once_and_shared(running: Running) -> None:
    fan_out, first, second = running.link.fan_out, list[Packet](), list[Packet]()
    later(lambda: fan_out.subscribe("/odom", first.append))
    later(lambda: fan_out.subscribe("/odom", second.append))
    wait_until(lambda: len(first) > 3 and len(second) > 3)
    later(lambda: fan_out.unsubscribe("/odom", first.append))
    wait_until(lambda: len(second) > len(first) + 3)
    shared = {id(packet) for packet in first} & {id(packet) for packet in second}
    assert len(shared) > 2  # one encoding serves both
    later(lambda: fan_out.unsubscribe("/odom", second.append))


def test_a_late_subscriber_receives_the_latched_packet_at_once(running: Running) -> None:
    fan_out, first, late = running.link.fan_out, list[Packet](), list[Packet]()
    later(lambda: fan_out.subscribe("/robot_description", first.append))
    wait_until(lambda: first)
    later(lambda: fan_out.subscribe("/robot_description", late.append))
    wait_until(lambda: late)
    assert late == first
    for sink in (first.append, late.append):
        later(lambda sink=sink: fan_out.unsubscribe("/robot_description", sink))


def test_a_message_that_cannot_be_encoded_is_reported(running: Running) -> None:
    fan_out, encoded = running.link.fan_out, list[bytes]()

    def encode(packet: Packet) -> None:
        encoded.append(packet.cdr)

    running.stop()
    bus = running.simulation.bus
    talk = bus.advertise("/talk", msg.String)
    later(lambda: fan_out.subscribe("/talk", encode))
    wait_for(_flush_loop())
    running.simulation.run(0.1)
    talk.publish(msg.String("\ud800"))  # invalid Unicode, which no encoding has
    talk.publish(msg.String("hi"))
    running.simulation.run(0.1)
    wait_until(lambda: encoded)
    assert [data[8:] for data in encoded] == [b"hi\0"]
    assert ["/talk: a message cannot be sent" in text for text in running.reported] == [True]
    later(lambda: fan_out.unsubscribe("/talk", encode))


def test_a_batch_is_sent_once_per_flush() -> None:
    batches = list[list[int]]()
    batch = Batch(batches.append)
    for _ in range(2):
        for number in range(3):
            batch.add(number)
        batch.flush()
        batch.flush()
    assert batches == [[0, 1, 2], [0, 1, 2]]


def test_slow_peers_and_large_packets_come_last(running: Running) -> None:
    fan_out, events = running.link.fan_out, list[str]()
    running.stop()
    bus = running.simulation.bus
    scan, clock = bus.advertise("/scan", LaserScan), bus.advertise("/clock", msg.ClockMessage)

    def peer(name: str) -> tuple[Sink, Flush]:
        return (lambda packet: events.append(f"{name} {packet.topic}")), (
            lambda: events.append(f"{name} sent")
        )

    for name in ("last", "first", "second"):
        sink, flush = peer(name)
        for topic in ("/scan", "/clock"):
            later(partial(fan_out.subscribe, topic, sink, flush, slow=name == "last"))
    wait_for(_flush_loop())
    running.simulation.run(0.1)
    wait_for(_flush_loop())
    events.clear()
    scan.publish(LaserScan())
    clock.publish(msg.ClockMessage())
    running.simulation.step(1)
    wait_until(lambda: len(events) == 9)
    assert events[:4] == ["first /clock", "first /scan", "second /clock", "second /scan"]
    assert events[4:6] == ["first sent", "second sent"]
    assert events[6:] == ["last /clock", "last /scan", "last sent"]


async def _flush_loop() -> None:
    """Returns after all work that was put on the loop before."""
