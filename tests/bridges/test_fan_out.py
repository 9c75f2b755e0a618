"""From the simulation's thread to the loop: opened once for all who want it, handed out to each."""

from functools import partial

from kbot.messages import types as msg
from kbot.messages.sensing import LaserScan
from kbot.record.feed import Packet
from kbot.ros.bridges.fan_out import Flush, Sink
from kbot.ros.bridges.loop import Batch, later, wait_for

from .conftest import Running, wait_until


def test_a_topic_is_opened_once_and_shared(running: Running) -> None:
    fan_out, first, second = running.link.fan_out, list[Packet](), list[Packet]()
    later(lambda: fan_out.want("/odom", first.append))
    later(lambda: fan_out.want("/odom", second.append))
    wait_until(lambda: len(first) > 3 and len(second) > 3)
    later(lambda: fan_out.leave("/odom", first.append))
    wait_until(lambda: len(second) > len(first) + 3)
    shared = {id(packet) for packet in first} & {id(packet) for packet in second}
    assert len(shared) > 2  # one encoding serves both
    later(lambda: fan_out.leave("/odom", second.append))


def test_who_comes_late_gets_what_is_latched_at_once(running: Running) -> None:
    fan_out, first, late = running.link.fan_out, list[Packet](), list[Packet]()
    later(lambda: fan_out.want("/robot_description", first.append))
    wait_until(lambda: first)
    later(lambda: fan_out.want("/robot_description", late.append))
    wait_until(lambda: late)
    assert late == first
    for sink in (first.append, late.append):
        later(lambda sink=sink: fan_out.leave("/robot_description", sink))


def test_a_message_that_cannot_be_sent_is_told_and_others_go_on(running: Running) -> None:
    fan_out, encoded = running.link.fan_out, list[bytes]()

    def encode(packet: Packet) -> None:
        encoded.append(packet.cdr)

    running.stop()
    bus = running.simulation.bus
    talk = bus.advertise("/talk", msg.String)
    later(lambda: fan_out.want("/talk", encode))
    wait_for(_nothing())
    running.simulation.run(0.1)
    talk.publish(msg.String(5))  # type: ignore[arg-type] - what a program may do
    talk.publish(msg.String("hi"))
    running.simulation.run(0.1)
    wait_until(lambda: encoded)
    assert [data[8:] for data in encoded] == [b"hi\0"]
    assert ["/talk: a message cannot be sent" in text for text in running.reported] == [True]
    later(lambda: fan_out.leave("/talk", encode))


def test_a_batch_is_handed_on_once_for_all_that_came_in_one_go() -> None:
    batches = list[list[int]]()
    batch = Batch(batches.append)
    for _ in range(2):
        for number in range(3):
            batch.add(number)
        batch.flush()
        batch.flush()
    assert batches == [[0, 1, 2], [0, 1, 2]]


def test_a_moment_is_given_to_all_and_then_sent_with_what_is_large_at_its_end(running: Running) -> None:
    fan_out, given = running.link.fan_out, list[str]()
    running.stop()
    bus = running.simulation.bus
    scan, clock = bus.advertise("/scan", LaserScan), bus.advertise("/clock", msg.ClockMessage)

    def peer(name: str) -> tuple[Sink, Flush]:
        return (lambda packet: given.append(f"{name} {packet.topic}")), (lambda: given.append(f"{name} sent"))

    for name in ("last", "first", "second"):
        sink, flush = peer(name)
        for topic in ("/scan", "/clock"):
            want = partial(fan_out.want, topic, sink, flush, late=name == "last")
            later(want)
    wait_for(_nothing())
    running.simulation.run(0.1)
    wait_for(_nothing())
    given.clear()
    scan.publish(LaserScan())
    clock.publish(msg.ClockMessage())
    running.simulation.step(1)
    wait_until(lambda: len(given) == 9)
    assert given[:4] == ["first /clock", "first /scan", "second /clock", "second /scan"]
    assert given[4:6] == ["first sent", "second sent"]
    assert given[6:] == ["last /clock", "last /scan", "last sent"]


async def _nothing() -> None:
    """Comes after all that was put on the loop before."""
