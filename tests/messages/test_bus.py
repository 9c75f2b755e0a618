"""The bus: typed topics within one process."""

import pytest

from kbot.messages import Bus, Odometry, String, TFMessage, Twist
from kbot.messages.bus import absolute
from kbot.text import KbotError


def test_a_message_reaches_every_subscriber_in_order():
    bus, received = Bus(), []
    bus.subscribe("chatter", String, lambda m: received.append(("first", m.data)))
    bus.subscribe("/chatter", String, lambda m: received.append(("second", m.data)))
    bus.advertise("/chatter", String).publish(String("hello"))
    assert received == [("first", "hello"), ("second", "hello")]


def test_a_closed_subscription_receives_nothing():
    bus, received = Bus(), []
    subscription = bus.subscribe("/a", String, received.append)
    subscription.close()
    subscription.close()
    bus.publish("/a", String("x"))
    assert received == []


def test_a_late_subscriber_receives_the_latched_message():
    bus, received = Bus(), []
    bus.advertise("/robot_description", String, latched=True).publish(String("<robot/>"))
    bus.subscribe("/robot_description", String, received.append)
    assert received == [String("<robot/>")]


def test_a_late_subscriber_receives_nothing_without_latching():
    bus, received = Bus(), []
    bus.advertise("/a", String).publish(String("earlier"))
    bus.subscribe("/a", String, received.append)
    assert received == []


def test_one_topic_has_one_type():
    bus = Bus()
    publisher = bus.advertise("/odom", Odometry)
    with pytest.raises(KbotError, match="/odom carries Odometry, not Twist"):
        bus.subscribe("odom", Twist, print)
    with pytest.raises(KbotError, match="/odom carries Odometry, not Twist"):
        publisher.publish(Twist())


def test_has_subscribers():
    bus = Bus()
    publisher = bus.advertise("/a", String)
    assert not publisher.has_subscribers
    bus.subscribe("/a", String, print)
    assert publisher.has_subscribers


def test_the_rate_of_a_topic_is_the_sum_of_its_publishers():
    bus = Bus()
    first, second = bus.advertise("/tf", TFMessage, rate=50.0), bus.advertise("tf", TFMessage, rate=20.0)
    assert bus.rate("/tf") == 70.0
    bus.mute("/tf")
    assert bus.rate("/tf") == 0.0
    bus.mute("/tf", False)
    second.close()
    first.rate = 10.0
    assert bus.rate("tf") == 10.0
    bus.publish("/cmd_vel", Twist())
    assert bus.rate("/cmd_vel") == bus.rate("/nowhere") == 0.0


def test_error_for_an_unknown_topic_suggests_the_nearest():
    bus = Bus()
    bus.advertise("/odom", Odometry)
    with pytest.raises(KbotError, match="did you mean '/odom'"):
        bus.require("/odon")


@pytest.mark.parametrize(
    ("topic", "namespace", "full"),
    [("odom", "", "/odom"), ("odom", "a", "/a/odom"), ("/odom", "a", "/odom"), ("x", "/a/b/", "/a/b/x")],
)
def test_names_are_made_absolute(topic, namespace, full):
    assert absolute(topic, namespace) == full


@pytest.mark.parametrize("topic", ["", "/", "a//b", "/a/"])
def test_a_name_with_an_empty_part_is_refused(topic):
    with pytest.raises(KbotError, match="is not a topic name"):
        absolute(topic)


def test_a_topic_ends_with_its_last_publisher_and_active_subscriber():
    bus, received = Bus(), []
    first, second = bus.advertise("/odom", Odometry), bus.advertise("/odom", Odometry)
    commands = bus.subscribe("/cmd_vel", Twist, print)
    bus.publish("/cmd_vel", Twist())
    bus.subscribe("/odom", Odometry, received.append, passive=True)
    first.close()
    first.close()
    assert set(bus.topics) == {"/odom", "/cmd_vel"}
    second.close()
    commands.close()
    assert bus.topics == {}
    assert bus.inputs == set()
    with pytest.raises(KbotError, match="no topic /odom"):
        bus.require("/odom")
    bus.advertise("/cmd_vel", String)  # the name is free for another type
    bus.advertise("/odom", Odometry).publish(Odometry())
    assert len(received) == 1  # the passive subscription still works


def test_the_latched_message_is_dropped_with_its_publisher():
    bus, received = Bus(), []
    publisher = bus.advertise("/robot_description", String, latched=True)
    publisher.publish(String("<robot/>"))
    publisher.close()
    bus.subscribe("/robot_description", String, received.append)
    assert received == []
