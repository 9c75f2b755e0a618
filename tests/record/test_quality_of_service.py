"""The quality of service (QoS) of topics in recordings: a player needs it to latch topics."""

from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.rosbag2.metadata import parse_qos

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import String
from kbot.navigation.goals.topics import NavigationTopics
from kbot.record import Feed, Recorder
from kbot.record.copy import copy_recording
from kbot.record.encodings.quality import is_latched, recorded_qos
from kbot.record.encodings.serialization import encode_cdr
from kbot.record.index import open_index
from kbot.record.player import Player
from kbot.record.reader import Recording
from kbot.sim import Simulation
from kbot.tf.robot_state_publisher import RobotStatePublisher

FOREVER = {"sec": 9223372036, "nsec": 854775807}  # RMW_DURATION_INFINITE of rmw/types.h


def profile(*, depth: int, durability: int, reliability: int = 1) -> dict:
    """A profile with the numbers of rmw/types.h, in the layout of rosbag2."""
    return {
        "history": 1,  # keep last
        "depth": depth,
        "reliability": reliability,  # 1 reliable, 2 best effort
        "durability": durability,  # 1 transient local, 2 volatile
        "deadline": FOREVER,
        "lifespan": FOREVER,
        "liveliness": 1,  # automatic
        "liveliness_lease_duration": FOREVER,
        "avoid_ros_namespace_conventions": False,
    }


LATCHED, VOLATILE = profile(depth=1, durability=1), profile(depth=10, durability=2)
EXPECTED = {
    "/tf_static": LATCHED,
    "/robot_description": LATCHED,
    "/map": LATCHED,
    "/plan": LATCHED,
    "/navigation_status": LATCHED,
    "/odom": VOLATILE,
    "/joint_states": VOLATILE,
    "/clock": VOLATILE,
}


def record(path: Path) -> str:
    sim = Simulation(kbot.load("kbot"))
    RobotStatePublisher(sim.robot, sim.bus, sim.clock, description="<robot/>")
    navigation = NavigationTopics(sim)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path)):
        navigation.go(PlanarPose(0.5, 0.0, 0.0))
        sim.run(0.5)
    navigation.close()
    return str(path)


@pytest.fixture(scope="module")
def mcap(tmp_path_factory: pytest.TempPathFactory) -> str:
    return record(tmp_path_factory.mktemp("recording") / "run.mcap")


def of_mcap(path: str) -> dict[str, str]:
    """The text of each topic."""
    with Path(path).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    return {channel.topic: channel.metadata["offered_qos_profiles"] for channel in summary.channels.values()}


def known(texts: dict[str, str]) -> dict[str, list[dict]]:
    return {topic: yaml.safe_load(text) for topic, text in texts.items() if topic in EXPECTED}


def test_a_recording_has_the_qos_of_each_topic(mcap: str) -> None:
    texts = of_mcap(mcap)
    found = known(texts)
    assert found == {topic: [EXPECTED[topic]] for topic in found}
    assert found.keys() == EXPECTED.keys()
    for text in texts.values():  # the rosbags library is the referee
        (qos,) = parse_qos(text)
        assert qos.reliability is QosReliability.RELIABLE


@pytest.mark.parametrize("through", ["run.mcap", "rosbag2", "run.bag"])
def test_conversions_keep_it(tmp_path: Path, mcap: str, through: str) -> None:
    converted, back = str(tmp_path / through), str(tmp_path / "back.mcap")
    copy_recording(mcap, converted)
    copy_recording(converted, back)
    expected = {topic: text for topic, text in of_mcap(mcap).items() if topic in EXPECTED}
    assert {topic: text for topic, text in of_mcap(back).items() if topic in EXPECTED} == expected
    latched = {topic for topic, text in expected.items() if yaml.safe_load(text) == [LATCHED]}
    index = open_index(converted)
    assert set(index.latched) & EXPECTED.keys() == latched
    index.close()
    if through == "run.bag":
        with Reader1(converted) as reader:
            found = {c.topic for c in reader.connections if c.ext.latching}
    elif through == "rosbag2":
        with Reader2(converted) as reader:
            found = {
                c.topic
                for c in reader.connections
                if [q.durability for q in c.ext.offered_qos_profiles] == [QosDurability.TRANSIENT_LOCAL]
            }
    else:
        return
    assert found & EXPECTED.keys() == latched


def test_a_cut_keeps_it(tmp_path: Path, mcap: str) -> None:
    cut = str(tmp_path / "cut.mcap")
    copy_recording(mcap, cut, start=0.2, end=0.4, topics=("/tf_static", "/odom"))
    assert known(of_mcap(cut)) == {"/tf_static": [LATCHED], "/odom": [VOLATILE]}


NAMES = """- history: keep_last
  depth: 5
  reliability: best_effort
  durability: volatile
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 2147483647, nsec: 4294967295}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
"""As rosbag2 writes it from Jazzy on, with the infinite time of Foxy's Fast DDS."""


def write_foreign(path: Path, texts: dict[str, str | None]) -> str:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        for number, (topic, text) in enumerate(texts.items()):
            metadata = {} if text is None else {"offered_qos_profiles": text}
            channel = writer.register_channel(topic, "cdr", schema, metadata)
            writer.add_message(channel, number + 1, encode_cdr(String(topic)), number + 1)
        writer.finish()
    return str(path)


def test_the_qos_of_other_recorders_is_kept_as_numbers(tmp_path: Path) -> None:
    latched = yaml.safe_dump([LATCHED, VOLATILE])
    source = write_foreign(tmp_path / "in.mcap", {"/scan": NAMES, "/two_publishers": latched})
    for target in ("out.mcap", "out_folder"):
        copy_recording(source, str(tmp_path / target))
    found = {topic: yaml.safe_load(text) for topic, text in of_mcap(str(tmp_path / "out.mcap")).items()}
    assert found == {
        "/scan": [profile(depth=5, durability=2, reliability=2)],
        "/two_publishers": [LATCHED, VOLATILE],
    }
    with Reader2(tmp_path / "out_folder") as reader:
        (scan,) = (c for c in reader.connections if c.topic == "/scan")
    assert [qos.reliability for qos in scan.ext.offered_qos_profiles] == [QosReliability.BEST_EFFORT]


@pytest.mark.parametrize(
    "text",
    [None, "", "[", "- 1", "{}", "- {history: 1}", "'- {history: [}'", "x" * 100_000, "- depth: !!int x"],
)
def test_without_a_readable_qos_the_usual_topics_are_latched(tmp_path: Path, text: str | None) -> None:
    source = write_foreign(tmp_path / "in.mcap", {"/tf_static": text, "/scan": text})
    copy_recording(source, str(tmp_path / "out.mcap"))
    found = {topic: yaml.safe_load(text) for topic, text in of_mcap(str(tmp_path / "out.mcap")).items()}
    assert found == {"/tf_static": [LATCHED], "/scan": [VOLATILE]}


def test_playback_latches_the_topics_that_were_latched(tmp_path: Path) -> None:
    latched = yaml.safe_dump([LATCHED])
    source = write_foreign(tmp_path / "in.mcap", {"/notice": latched, "/chatter": yaml.safe_dump([VOLATILE])})
    topics = Recording(source).summary().topics
    assert (topics["/notice"].is_latched, topics["/chatter"].is_latched) == (True, False)
    player = Player(source)
    player.advance(1.0)
    late: list[String] = []
    for topic in ("/notice", "/chatter"):
        player.bus.subscribe(topic, String, late.append)
    assert [message.data for message in late] == ["/notice"]


def test_numbers_out_of_range_are_not_copied() -> None:
    text = yaml.safe_dump([{**LATCHED, "depth": [1, 2]}])
    assert yaml.safe_load(recorded_qos("/x", text)) == [VOLATILE]
    assert not is_latched(yaml.safe_dump([{**LATCHED, "deadline": {"sec": -1, "nsec": 0}}]))
