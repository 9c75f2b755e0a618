"""A message is encoded once for any number of receivers."""

from kbot.messages import Bus
from kbot.messages import types as msg
from kbot.record.feed import Feed, Packet


def test_receivers_share_one_packet_and_its_bytes() -> None:
    bus, first, second = Bus(), [], []
    bus.advertise("/odom", msg.Odometry)
    feed = Feed(bus, lambda: 7)
    feed.open("/odom", first.append)
    feed.open("/odom", second.append)
    bus.publish("/odom", msg.Odometry())
    assert first == second
    assert first[0] is second[0]
    assert first[0].cdr is second[0].cdr
    assert (first[0].nanoseconds, first[0].type_name) == (7, "nav_msgs/msg/Odometry")


def test_no_message_is_created_without_receivers() -> None:
    bus, found = Bus(), []
    publisher = bus.advertise("/odom", msg.Odometry)
    feed = Feed(bus, lambda: 0)
    assert not publisher.has_subscribers
    feed.open("/odom", found.append)
    assert publisher.has_subscribers
    feed.close("/odom", found.append)
    assert not publisher.has_subscribers
    feed.close("/odom", found.append)


def test_second_receiver_gets_the_last_latched_message() -> None:
    bus = Bus()
    feed = Feed(bus, lambda: 0)
    bus.advertise("/tf_static", msg.TFMessage, latched=True).publish(msg.TFMessage())
    first: list[Packet] = []
    second: list[Packet] = []
    feed.open("/tf_static", first.append)
    feed.open("/tf_static", second.append)
    assert len(first) == len(second) == 1


def test_only_ros_types_are_offered() -> None:
    bus = Bus()
    bus.advertise("/odom", msg.Odometry)
    bus.advertise("/own", int)
    assert Feed(bus, lambda: 0).offered() == {"/odom": msg.Odometry}
