"""Recordings in which KBot's own topics carry other messages."""

from pathlib import Path

import pytest

from kbot.messages import Header, String
from kbot.messages.sensing import Imu
from kbot.record.feed import Packet
from kbot.record.formats import NOTES_TOPIC
from kbot.record.player import Player
from kbot.record.reader import Recording
from kbot.record.recorder import COMMANDS_TOPIC, DESCRIPTION_TOPIC
from kbot.record.replay import replay
from kbot.record.writer import open_writer
from kbot.text import KbotError


def with_message(source: Path, target: Path, topic: str, message: object) -> str:
    """The recording with one more message at its end."""
    recording = Recording(str(source))
    writer = open_writer(str(target))
    for name, values in recording.summary().notes.items():
        writer.annotate(name, values)
    for entry in recording.entries():
        writer.write(entry)
    writer.write(Packet(topic, message, 10**9))
    writer.close()
    return str(target)


@pytest.mark.parametrize("ending", [".mcap", ".bag", ""])
@pytest.mark.parametrize(
    ("message", "words"),
    [
        (Imu(Header()), "carries sensor_msgs/msg/Imu, not std_msgs/msg/String"),
        (String("no JSON"), "was not written by KBot"),
        (String("[1]"), "was not written by KBot"),
        (String("[" * 100_000), "was not written by KBot"),
    ],
)
def test_invalid_notes_are_one_error(
    message: object, words: str, ending: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    path = with_message(runs["mcap"], tmp_path / f"run{ending}", NOTES_TOPIC, message)
    with pytest.raises(KbotError, match=rf"{NOTES_TOPIC} at .*{words}"):
        Recording(path).summary()


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (Imu(Header()), "carries sensor_msgs/msg/Imu, not std_msgs/msg/String"),
        (String("{}"), "is not a valid command record"),
        (String('{"do": "reset", "step": "soon"}'), "is not a valid command record"),
        (String('{"do": "restore", "step": 1}'), "is not a valid command record"),
    ],
)
def test_invalid_commands_are_one_error(
    message: object, words: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    path = with_message(runs["mcap"], tmp_path / "run.mcap", COMMANDS_TOPIC, message)
    with pytest.raises(KbotError, match=rf"{COMMANDS_TOPIC} at .*{words}"):
        replay(path)


def test_description_that_is_not_text_is_ignored(tmp_path: Path) -> None:
    path = str(tmp_path / "run.mcap")
    writer = open_writer(path)
    writer.write(Packet(DESCRIPTION_TOPIC, Imu(Header()), 1))
    writer.write(Packet(DESCRIPTION_TOPIC, String("<robot/>"), 2))
    writer.close()
    assert Player(path).description == "<robot/>"
