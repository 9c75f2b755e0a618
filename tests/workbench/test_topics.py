"""Topics that pages subscribe to and publish."""

import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Header, Quaternion, String, TFMessage, Twist, Vector3
from kbot.messages import Transform as TransformMessage
from kbot.messages.log import ERROR
from kbot.messages.program_topics import DRAWN, PLOTTED, PRINTED
from kbot.messages.sensing import LaserScan, Range
from kbot.messages.types import TransformStamped
from kbot.record.feed import Packet
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.tf.foreign_frames import ForeignFrames
from kbot.tf.state_publishers import StatePublishers
from kbot.workbench.protocol import Drive, SetWorld
from kbot.workbench.serve import open_session
from kbot.workbench.topics.relay import TopicRelay, encode_packet

from .conftest import until

pytestmark = pytest.mark.usefixtures("keeps_up")

LIDAR = {"lidar": "true"}


def read(frame: str | bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return a frame's header and arrays, decoded only by the description of `payload`."""
    if isinstance(frame, str):
        return json.loads(frame), {}
    (length,) = struct.unpack_from("<I", frame)
    header = json.loads(frame[4 : 4 + length])
    arrays = {
        name: np.frombuffer(frame, kind, count, 4 + length + at)
        for name, (kind, at, count) in header["arrays"].items()
    }
    return header, arrays


def test_large_arrays_are_sent_as_binary() -> None:
    ranges = np.array([1.5, np.inf, -np.inf], np.float32)
    frame = encode_packet(Packet("/scan", LaserScan(Header(), 0.25, ranges=ranges), 1_500_000_000))
    header, arrays = read(frame)
    assert header["topic"] == "/scan"
    assert header["kind"] == "sensor_msgs/msg/LaserScan"
    assert header["time"] == 1.5
    assert header["message"]["angle_min"] == 0.25
    assert arrays["ranges"].tolist() == ranges.tolist()
    assert arrays["intensities"].size == 0


def test_small_messages_are_json() -> None:
    header, arrays = read(encode_packet(Packet("/front", Range(range=float("inf")), 0)))
    assert arrays == {}
    assert header["message"]["range"] is None


def test_only_subscribed_topics_are_sent() -> None:
    bus = Bus()
    relay = TopicRelay(bus, lambda: 0)
    publisher = bus.advertise("/scan", LaserScan)
    assert not publisher.has_subscribers
    relay.subscribe("/scan", 1)
    relay.subscribe("/scan", 2)
    assert publisher.has_subscribers
    relay.leave(1)
    assert publisher.has_subscribers
    relay.unsubscribe("/scan", 2)
    assert not publisher.has_subscribers


def test_pages_receive_the_newest_of_many_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.workbench.topics.relay.MOST_RATE", 1e-3)  # too soon on a busy machine too
    bus = Bus()
    relay = TopicRelay(bus, lambda: 0)
    relay.subscribe("/front", 1)  # before the topic exists
    assert relay.news() == []
    front = bus.advertise("/front", Range)
    assert relay.news() == []
    for distance in (1.0, 2.0, 3.0):
        front.publish(Range(range=distance))
    ((topic, frame, pages),) = relay.news()
    assert (topic, pages) == ("/front", {1})
    assert read(frame)[0]["message"]["range"] == 3.0
    front.publish(Range(range=4.0))
    assert relay.news() == []
    ((_, frame, _),) = relay.news(is_last=True)
    assert read(frame)[0]["message"]["range"] == 4.0
    again = relay.subscribe("/front", 2)
    assert again is not None
    assert read(again)[0]["message"]["range"] == 4.0


def test_subscriptions_continue_in_another_world() -> None:
    session = open_session("kbot", simulate=True, world="boxes", arguments=LIDAR)
    session.topics.subscribe("/scan", 1)
    session.handle(SetWorld("empty", 0), 1)
    for _ in range(5):
        session.advance(0.1)
    ((_, frame, _),) = session.topics.news()
    header, arrays = read(frame)
    assert header["message"]["header"]["frame_id"] == "lidar_link"
    assert arrays["ranges"].size == 360


def test_the_list_has_types_rates_and_inputs() -> None:
    session = open_session("kbot", simulate=True, arguments=LIDAR)
    session.topics.subscribe("/scan", 1)
    for _ in range(20):
        session.advance(0.1)
    topics = {topic.name: topic for topic in session.topics.topics().topics}
    assert topics["/scan"].kind == "sensor_msgs/msg/LaserScan"
    assert topics["/scan"].rate == pytest.approx(20.0, rel=0.02)  # as in its description
    assert topics["/odom"].rate == 50.0  # without subscribers: the declared rate
    assert topics["/plan"].rate is None  # published when there is a plan
    assert topics["/cmd_vel"].is_input
    assert not topics["/odom"].is_input


def test_rates_are_correct_without_subscribers() -> None:
    """The declared rates without subscribers equal the measured ones with a subscriber."""
    session = open_session("kbot", simulate=True, arguments={**LIDAR, "camera": "true"})
    StatePublishers(session._motion._sim)
    for _ in range(5):
        session.advance(0.1)
    reported = {entry.name: entry.rate for entry in session.topics.topics().topics if entry.rate is not None}
    assert {"/clock", "/odom", "/tf", "/joint_states", "/scan"} <= reported.keys()
    small = [name for name in reported if "image" not in name and "camera" not in name]
    for name in small:
        session.topics.subscribe(name, 1)
    for _ in range(30):
        session.advance(0.1)
    counted = {entry.name: entry.rate for entry in session.topics.topics().topics if entry.name in small}
    for name in small:
        assert counted[name] == pytest.approx(reported[name], rel=0.03), name


def test_a_silent_topic_has_no_rate() -> None:
    session = open_session("kbot", simulate=True)
    session.topics.bus.mute("odom")
    assert {entry.name: entry.rate for entry in session.topics.topics().topics}["/odom"] is None


def test_earlier_messages_are_marked_as_latched() -> None:
    bus = Bus()
    relay = TopicRelay(bus, lambda: 0)
    status = bus.advertise("/status", String, latched=True)
    status.publish(String("long ago"))
    first = relay.subscribe("/status", 1)
    assert first is not None
    assert (read(first)[0]["message"]["data"], read(first)[0]["is_latched"]) == ("long ago", True)
    assert [read(frame)[0]["is_latched"] for _, frame, _ in relay.news()] == [True]
    status.publish(String("now"))
    ((_, frame, _),) = until(relay.news)  # not earlier, because the rate for a page is limited
    assert (read(frame)[0]["message"]["data"], read(frame)[0]["is_latched"]) == ("now", False)
    second = relay.subscribe("/status", 2)
    assert second is not None
    assert (read(second)[0]["message"]["data"], read(second)[0]["is_latched"]) == ("now", True)


def test_sliders_publish_joint_states_and_transforms() -> None:
    session = open_session("kbot", simulate=False)
    session.topics.subscribe("/joint_states", 1)
    session.topics.subscribe("/tf", 1)
    session.topics.subscribe("/tf_static", 1)
    session.advance(0.15)
    received = {topic: read(frame)[0]["message"] for topic, frame, _ in session.topics.news()}
    assert set(received["/joint_states"]["name"]) == {"left_wheel_joint", "right_wheel_joint"}
    moving, fixed = (
        {t["child_frame_id"] for t in received[topic]["transforms"]} for topic in ("/tf", "/tf_static")
    )
    assert moving == {"left_wheel", "right_wheel"}
    assert moving | fixed == {link.name for link in session.scene.links if link.parent}


def test_a_page_publishes_only_on_allowed_topics() -> None:
    bus, received = Bus(), []
    relay = TopicRelay(bus, lambda: 0)
    bus.subscribe("/cmd_vel", Twist, received.append)
    bus.subscribe("/secret", Twist, received.append)
    bus.advertise("/robot/cmd_vel", Twist)
    relay.publish("/cmd_vel", "geometry_msgs/msg/Twist", {"linear": {"x": 0.5}})
    assert received == [Twist(Vector3(0.5))]
    for topic, kind, message, expected in (
        ("/secret", "geometry_msgs/msg/Twist", {}, "may not publish on /secret"),
        ("/robot/cmd_vel", "geometry_msgs/msg/Twist", {}, "/robot/cmd_vel has no subscriber"),
        ("/cmd_vel", "std_msgs/msg/String", {}, "carries geometry_msgs/msg/Twist"),
        ("/cmd_vel", "geometry_msgs/msg/Twist", {"linea": {}}, "did you mean 'linear'"),
        ("/cmd_vel", "geometry_msgs/msg/Twist", {"linear": {"x": "1"}}, "a number is expected"),
        ("//", "geometry_msgs/msg/Twist", {}, "is not a topic name"),
    ):
        with pytest.raises(KbotError) as caught:
            relay.publish(topic, kind, message)
        assert expected in str(caught.value)
    assert len(received) == 1


def stamped(parent: str, child: str, x: float, yaw: float = 0.0) -> TransformStamped:
    turned = Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw)).quaternion_xyzw
    return TransformStamped(Header(frame_id=parent), child, TransformMessage(Vector3(x), Quaternion(*turned)))


def test_frames_are_connected_from_either_end() -> None:
    bus = Bus()
    tf = bus.advertise("/tf", TFMessage)
    frames = ForeignFrames(bus)
    base = Transform.from_xyz_rpy((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert set(frames.poses({"base": base}, {})) == {
        "map"
    }  # it equals the world, because no transform places it
    tf.publish(TFMessage((stamped("map", "dock", 7.0),)))
    assert frames.poses({"base": base}, {})["dock"][1].translation[0] == 7.0
    frames.forget()
    tf.publish(
        TFMessage((stamped("map", "odom", 2.0), stamped("odom", "base", 4.0), stamped("base", "tag", 0.5)))
    )
    found = frames.poses({"base": base}, {})
    assert {name: (parent, pose.translation[0]) for name, (parent, pose) in found.items()} == {
        "odom": ("map", -3.0),
        "map": ("world", -5.0),
        "tag": ("base", 1.5),
    }


def test_the_odometry_frame_is_where_the_wheels_started() -> None:
    session = open_session("kbot", simulate=True)
    session.handle(Drive(0.2, 0.5), 1)
    for _ in range(4):
        session.advance(0.1)
    state = session.state()
    assert [name for name, _ in state.frames] == ["odom", "map"]
    assert abs(state.odometry[0]) > 0.02
    # wheels hardly slip on a plane, so the odometry frame stays at the start pose
    assert np.linalg.norm(state.frame_poses[:2]) < 0.002


def test_pages_receive_all_printed_lines_since_the_first() -> None:
    sim = Simulation("kbot")
    relay = TopicRelay(sim.bus, lambda: sim.clock.nanoseconds)
    sim.printed.add("first")
    sim.step(500)
    sim.printed.add("second")
    relay.subscribe("/log", 1)
    ((topic, frame, _),) = relay.news()
    header, _ = read(frame)
    assert (topic, header["kind"], header["message"]["first"]) == ("/log", "rcl_interfaces/msg/Log", 0)
    lines = header["message"]["lines"]
    assert [(line["stamp"]["sec"], line["msg"]) for line in lines] == [(0, "first"), (1, "second")]
    for number in range(150):
        sim.printed.add(f"line {number}")
    newest = relay.newest("/log")
    assert newest is not None
    message = read(newest)[0]["message"]
    assert (message["first"], len(message["lines"])) == (52, 100)
    other = Simulation("kbot")
    relay.attach(other.bus)
    other.printed.add("another run")
    again = relay.newest("/log")
    assert again is not None
    assert read(again)[0]["message"]["first"] == 0
    assert read(again)[0]["message"]["run"] != message["run"]


def test_what_a_program_plots_is_kept_before_a_page_subscribes() -> None:
    sim = Simulation("kbot")
    relay = TopicRelay(sim.bus, lambda: sim.clock.nanoseconds)
    sim.plot("speed", 1.0)
    (kept,) = relay.news()
    assert kept[0] == "/plot/speed"
    relay.subscribe("/plot/speed", 1)
    relay.leave(1)
    sim.plot("speed", 2.0)
    assert relay.newest("/plot/speed") is not None


def test_the_page_knows_the_topics_of_programs() -> None:
    text = (Path(__file__).parents[2] / "web" / "src" / "program-topics.ts").read_text()
    constants = dict(re.findall(r"export const (\w+) = (.+);", text))
    expected = {"PRINTED": PRINTED, "DRAWN": DRAWN, "PLOTTED": PLOTTED, "ERROR": ERROR}
    assert {name: json.loads(value) for name, value in constants.items()} == expected
