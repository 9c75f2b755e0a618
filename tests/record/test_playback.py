"""A recording said on a bus on which others speak too."""

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
        self.bus, self.clock, self.told = Bus(), Clock(), list[str]()
        self.heard: list[float] = []
        self.ended = 0
        more = {key: how.pop(key) for key in ("excluded", "handlers") if key in how}
        self.bus.subscribe(topic, Twist, lambda message: self.heard.append(message.linear.x))
        playing = Playing((recording,), ORIGIN, **how)
        self.playback = BusPlayback(
            self.bus, self.clock, playing, self.told.append, on_end=self._end, **more
        )  # fmt: skip

    def _end(self) -> None:
        self.ended += 1

    def run(self, seconds: float) -> list[float]:
        for _ in range(round(seconds * 100)):
            self.clock.advance_to(self.clock.nanoseconds + 10_000_000)
        return self.heard


def speeds(first: int, last: int) -> list[float]:
    return pytest.approx([number / 10 for number in range(first, last + 1)])


def test_messages_come_in_their_time_and_it_ends(recording: str) -> None:
    listener = Listener(recording)
    assert listener.run(0.955) == speeds(1, 10)
    assert listener.run(2.0) == speeds(1, 20)
    assert (listener.ended, listener.playback.is_over) == (1, True)


def test_rate_start_and_duration(recording: str) -> None:
    assert Listener(recording, rate=2.0).run(0.46) == speeds(1, 10)
    assert Listener(recording, start=1.05, seconds=0.5).run(3.0) == speeds(12, 16)


def test_what_leaves_nothing_to_loop_over_is_refused_at_the_player(recording: str) -> None:
    with pytest.raises(DescriptionError, match="cannot be played back in a loop") as raised:
        Listener(recording, seconds=0.0, loop=True)
    assert [d.origin for d in raised.value.diagnostics] == [ORIGIN]
    assert Listener(recording, seconds=0.0).run(0.2) is not None


def test_a_delay_is_of_the_wall_s_time(recording: str) -> None:
    listener = Listener(recording, delay=0.5, rate=2.0)
    assert listener.run(0.45) == []
    assert listener.run(0.5) == speeds(1, 10)


def test_a_loop_begins_anew(recording: str) -> None:
    listener = Listener(recording, loop=True, start=1.85)
    listener.run(1.0)
    assert len(listener.heard) > 4
    assert set(listener.heard) == {2.0}
    assert listener.ended == 0


def test_topics_are_chosen_and_renamed(recording: str) -> None:
    listener = Listener(recording, "/again", topics=("/cmd_vel",), remaps={"/cmd_vel": "/again"})
    assert listener.run(2.5) == speeds(1, 20)
    assert "/odom" not in listener.bus.topics


def test_what_others_say_is_left_to_them_and_told(recording: str) -> None:
    listener = Listener(recording, excluded={"/odom", "/joint_states", "/tf"})
    assert {line.split()[0] for line in listener.told} == {"/odom", "/joint_states", "/tf"}
    assert "/odom" not in listener.bus.topics


def test_a_topic_may_be_handed_on(recording: str) -> None:
    heard: list[Odometry] = []
    Listener(recording, handlers={"/odom": heard.append}).run(0.5)
    assert heard[0].child_frame_id == "base_footprint"


def test_a_topic_of_another_type_is_told_of(recording: str) -> None:
    bus, told = Bus(), list[str]()
    bus.subscribe("/cmd_vel", String, lambda message: None)
    BusPlayback(bus, Clock(), Playing((recording,), ORIGIN), told.append)
    assert [line for line in told if "/cmd_vel carries String, not Twist" in line]


def test_it_goes_on_on_another_bus(recording: str) -> None:
    first, second = Listener(recording), Listener(recording)
    first.run(0.955)
    second.playback.resume_from(first.playback)
    assert second.run(2.0) == speeds(11, 20)


@pytest.mark.parametrize(
    ("how", "message"),
    [({"topics": ("/cmd_ve",)}, "/cmd_vel"), ({"start": 5.0}, "cannot be played back from 5 s on")],
)
def test_what_cannot_be_said_is_one_sentence(recording: str, how: dict[str, object], message: str) -> None:
    with pytest.raises(KbotError, match=message):
        Listener(recording, **how)


@pytest.mark.parametrize(("content", "said"), [(b"", "not an MCAP file"), (b"text", "not an MCAP file")])
def test_a_recording_of_no_use_is_told_of_at_its_player(tmp_path, content: bytes, said: str) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(DescriptionError, match=said) as raised:
        Listener(str(path))
    (found,) = raised.value.diagnostics
    assert (found.code, found.origin) == ("L059", ORIGIN)


@pytest.mark.parametrize("recording", ["run.mcap"], indirect=True)  # the index of others is at their end
def test_what_is_not_whole_is_told_of_and_said_as_far_as_it_goes(recording: str, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(recording).read_bytes()[:-50])
    listener = Listener(str(cut))
    assert len(listener.told) == 1
    assert listener.told[0].startswith(f"{cut} is incomplete: it was not closed")
    assert listener.run(3.0) == speeds(1, 20)
