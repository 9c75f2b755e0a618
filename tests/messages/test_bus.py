import pytest

from kbot.messages import Bus, Odometry, String, TFMessage, Twist
from kbot.messages.bus import absolute
from kbot.text import KbotError


def test_a_message_reaches_every_subscriber_in_order():
    bus, heard = Bus(), []
    bus.subscribe("chatter", String, lambda m: heard.append(("first", m.data)))
    bus.subscribe("/chatter", String, lambda m: heard.append(("second", m.data)))
    bus.advertise("/chatter", String).publish(String("hello"))
    assert heard == [("first", "hello"), ("second", "hello")]


def test_a_closed_subscription_hears_no_more():
    bus, heard = Bus(), []
    subscription = bus.subscribe("/a", String, heard.append)
    subscription.close()
    subscription.close()
    bus.publish("/a", String("x"))
    assert heard == []


def test_a_latched_topic_tells_its_last_message_to_who_comes_later():
    bus, heard = Bus(), []
    bus.advertise("/robot_description", String, latched=True).publish(String("<robot/>"))
    bus.subscribe("/robot_description", String, heard.append)
    assert heard == [String("<robot/>")]


def test_an_unlatched_topic_forgets():
    bus, heard = Bus(), []
    bus.advertise("/a", String).publish(String("gone"))
    bus.subscribe("/a", String, heard.append)
    assert heard == []


def test_one_topic_has_one_type():
    bus = Bus()
    publisher = bus.advertise("/odom", Odometry)
    with pytest.raises(KbotError, match="/odom carries Odometry, not Twist"):
        bus.subscribe("odom", Twist, print)
    with pytest.raises(KbotError, match="/odom carries Odometry, not Twist"):
        publisher.publish(Twist())


def test_is_heard_only_when_someone_listens():
    bus = Bus()
    publisher = bus.advertise("/a", String)
    assert not publisher.is_heard
    bus.subscribe("/a", String, print)
    assert publisher.is_heard


def test_the_rate_of_a_topic_is_that_of_all_who_speak_on_it():
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


def test_a_missing_topic_is_named_with_the_nearest():
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
    with pytest.raises(KbotError, match="no topic's name"):
        absolute(topic)


def test_a_topic_goes_with_the_last_who_speaks_on_it_or_hears_it():
    bus, heard = Bus(), []
    first, second = bus.advertise("/odom", Odometry), bus.advertise("/odom", Odometry)
    commands = bus.subscribe("/cmd_vel", Twist, print)
    bus.publish("/cmd_vel", Twist())
    bus.subscribe("/odom", Odometry, heard.append, looks_on=True)
    first.close()
    first.close()
    assert set(bus.topics) == {"/odom", "/cmd_vel"}
    second.close()
    commands.close()
    assert bus.topics == {}
    assert bus.inputs == set()
    with pytest.raises(KbotError, match="no topic /odom"):
        bus.require("/odom")
    bus.advertise("/cmd_vel", String)  # the name is free for another
    bus.advertise("/odom", Odometry).publish(Odometry())
    assert len(heard) == 1  # who looked on is still there


def test_what_was_said_last_goes_with_its_speaker():
    bus, heard = Bus(), []
    publisher = bus.advertise("/robot_description", String, latched=True)
    publisher.publish(String("<robot/>"))
    publisher.close()
    bus.subscribe("/robot_description", String, heard.append)
    assert heard == []
