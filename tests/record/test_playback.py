"""Playing back a recording on a bus with other publishers."""

from pathlib import Path

import pytest

from kbot.messages import Bus, Clock, Odometry, String, Twist, Vector3
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.ros.nodes.playing import Playing
from kbot.ros.nodes.rosbag_play import BusPlayback
from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError, Origin, Source

ORIGIN = Origin(Source("a.launch", "<launch/>").whole())


@pytest.fixture(scope="module", params=["run.mcap", "run.bag", "run"])
def recording(request, tmp_path_factory) -> str:
    """Two seconds with a command of 0.1, 0.2, ... 2 m/s at 0, 0.1, ... 1.9 s."""
    path = str(tmp_path_factory.mktemp("recording") / request.param)
    sim = Simulation("kbot")
    sim.bus.advertise("/cmd_vel", Twist)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        for number in range(1, 21):
            sim.bus.publish("/cmd_vel", Twist(Vector3(number / 10), Vector3()))
            sim.run(0.1)
    return path


class Listener:
    def __init__(self, recording: str, topic: str = "/cmd_vel", **how: object) -> None:
        self.bus, self.clock, self.reports = Bus(), Clock(), list[str]()
        self.received: list[float] = []
        self.ended = 0
        more = {key: how.pop(key) for key in ("excluded", "handlers") if key in how}
        self.bus.subscribe(topic, Twist, lambda message: self.received.append(message.linear.x))
        playing = Playing((recording,), ORIGIN, **how)
        self.playback = BusPlayback(
            self.bus, self.clock, playing, self.reports.append, on_end=self._end, **more
        )  # fmt: skip

    def _end(self) -> None:
        self.ended += 1

    def run(self, seconds: float) -> list[float]:
        for _ in range(round(seconds * 100)):
            self.clock.advance_to(self.clock.nanoseconds + 10_000_000)
        return self.received


def speeds(first: int, last: int) -> list[float]:
    return pytest.approx([number / 10 for number in range(first, last + 1)])


def test_messages_are_published_at_their_time_until_the_end(recording: str) -> None:
    listener = Listener(recording)
    assert listener.run(0.955) == speeds(1, 10)
    assert listener.run(2.0) == speeds(1, 20)
    assert (listener.ended, listener.playback.is_over) == (1, True)


def test_rate_start_and_duration(recording: str) -> None:
    assert Listener(recording, rate=2.0).run(0.46) == speeds(1, 10)
    assert Listener(recording, start=1.05, seconds=0.5).run(3.0) == speeds(12, 16)


def test_loop_over_nothing_is_refused_at_the_player(recording: str) -> None:
    with pytest.raises(DescriptionError, match="cannot be played back in a loop") as raised:
        Listener(recording, seconds=0.0, loop=True)
    assert [d.origin for d in raised.value.diagnostics] == [ORIGIN]
    assert Listener(recording, seconds=0.0).run(0.2) is not None


def test_delay_is_wall_clock_time(recording: str) -> None:
    listener = Listener(recording, delay=0.5, rate=2.0)
    assert listener.run(0.45) == []
    assert listener.run(0.5) == speeds(1, 10)


def test_loop_starts_again(recording: str) -> None:
    listener = Listener(recording, loop=True, start=1.85)
    listener.run(1.0)
    assert len(listener.received) > 4
    assert set(listener.received) == {2.0}
    assert listener.ended == 0


def test_topics_are_selected_and_renamed(recording: str) -> None:
    listener = Listener(recording, "/again", topics=("/cmd_vel",), remaps={"/cmd_vel": "/again"})
    assert listener.run(2.5) == speeds(1, 20)
    assert "/odom" not in listener.bus.topics


def test_topic_with_another_publisher_is_left_out_and_reported(recording: str) -> None:
    listener = Listener(recording, excluded={"/odom", "/joint_states", "/tf"})
    assert {line.split()[0] for line in listener.reports} == {"/odom", "/joint_states", "/tf"}
    assert "/odom" not in listener.bus.topics


def test_topic_can_be_passed_to_a_handler(recording: str) -> None:
    received: list[Odometry] = []
    Listener(recording, handlers={"/odom": received.append}).run(0.5)
    assert received[0].child_frame_id == "base_footprint"


def test_topic_of_another_type_is_reported(recording: str) -> None:
    bus, reports = Bus(), list[str]()
    bus.subscribe("/cmd_vel", String, lambda message: None)
    BusPlayback(bus, Clock(), Playing((recording,), ORIGIN), reports.append)
    assert [line for line in reports if "/cmd_vel carries String, not Twist" in line]


def test_playback_continues_on_another_bus(recording: str) -> None:
    first, second = Listener(recording), Listener(recording)
    first.run(0.955)
    second.playback.resume_from(first.playback)
    assert second.run(2.0) == speeds(11, 20)


@pytest.mark.parametrize(
    ("how", "message"),
    [({"topics": ("/cmd_ve",)}, "/cmd_vel"), ({"start": 5.0}, "playback cannot start at 5 s")],
)
def test_playback_that_is_impossible_is_one_error(
    recording: str, how: dict[str, object], message: str
) -> None:
    with pytest.raises(KbotError, match=message):
        Listener(recording, **how)


@pytest.mark.parametrize(("content", "message"), [(b"", "not an MCAP file"), (b"text", "not an MCAP file")])
def test_unusable_recording_is_reported_at_its_player(tmp_path, content: bytes, message: str) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(DescriptionError, match=message) as raised:
        Listener(str(path))
    (found,) = raised.value.diagnostics
    assert (found.code, found.origin) == ("L059", ORIGIN)


@pytest.mark.parametrize(
    "recording", ["run.mcap"], indirect=True
)  # the other formats have their index at the end
def test_incomplete_recording_is_reported_and_played_to_its_end(recording: str, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(recording).read_bytes()[:-50])
    listener = Listener(str(cut))
    assert len(listener.reports) == 1
    assert listener.reports[0].startswith(f"{cut} is incomplete: it was not closed")
    assert listener.run(3.0) == speeds(1, 20)
