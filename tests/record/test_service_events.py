"""Recordings of the events of services, whose definitions are those of the services."""

import struct
from pathlib import Path

import pytest

from kbot.record import Recording
from kbot.record.copy import copy_recording
from kbot.record.export import MessageTable
from kbot.text import KbotError

from .hostile import mcap_of

ASK = "int32 question\n---\nstring answer\n"
STAMP = struct.pack("<B3xiI", 0, 5, 6) + bytes(range(16)) + struct.pack("<4xq", 9)
"""ServiceEventInfo in CDR: the event "request sent", its time, the client and the number of the call."""
ASKED = b"\0\1\0\0" + STAMP + struct.pack("<IiI", 1, 42, 0)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return mcap_of(tmp_path / "a.mcap", {"test/srv/Ask_Event": ASK}, data=ASKED)


def test_an_event_has_the_request_or_the_response(recording: Path) -> None:
    (entry,) = Recording(str(recording)).entries()
    message = entry.message()
    assert (message.info.stamp.sec, message.info.sequence_number) == (5, 9)
    assert [request.question for request in message.request] == [42]
    assert message.response == []


@pytest.mark.parametrize("target", ["b.mcap", "b"])
def test_events_are_copied_with_their_definition(recording: Path, target: str) -> None:
    copy = recording.with_name(target)
    assert copy_recording(str(recording), str(copy)).left_out == {}
    assert MessageTable.of(str(copy), "/topic0").rows[0]["request.0.question"] == 42


def test_ros_1_has_no_events_so_they_are_left_out(recording: Path) -> None:
    copied = copy_recording(str(recording), str(recording.with_name("b.bag")))
    assert copied.left_out == {"/topic0": "ROS 1 has no events of services"}


def test_a_request_without_fields_takes_one_byte_in_ros_2(tmp_path: Path) -> None:
    data = b"\0\1\0\0" + STAMP + struct.pack("<IB3xI", 1, 0, 0)
    recording = mcap_of(tmp_path / "a.mcap", {"std_srvs/srv/Empty_Event": "---\n"}, data=data)
    (entry,) = Recording(str(recording)).entries()
    assert len(entry.message().request) == 1
    refused = mcap_of(tmp_path / "b.mcap", {"std_srvs/srv/Empty_Event": "---\n"}, data=data, encoding="ros1")
    (entry,) = Recording(str(refused)).entries()
    with pytest.raises(KbotError, match="a list of messages without fields, which ROS 1 cannot bound"):
        entry.message()


BASIC_TYPES = """\
bool bool_value
byte byte_value
char char_value
float32 float32_value
float64 float64_value
int8 int8_value
uint8 uint8_value
int16 int16_value
uint16 uint16_value
int32 int32_value
uint32 uint32_value
int64 int64_value
uint64 uint64_value
string string_value
"""


def test_the_hash_is_that_of_ros_2(tmp_path: Path) -> None:
    """ROS 2 wrote this hash into a test recording of rosbag2 with service events."""
    definition = f"{BASIC_TYPES}---\n{BASIC_TYPES}"
    recording = mcap_of(tmp_path / "a.mcap", {"test_msgs/srv/BasicTypes_Event": definition})
    (entry,) = Recording(str(recording)).entries()
    text, digest = entry.ros2_definition
    assert text == definition
    assert digest == "RIHS01_5b9988a4805a06ae22dff12903a774ccda710e9514926b826ffc884e3a9a982e"
