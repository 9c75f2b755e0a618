"""Messages whose lists state too many entries, or give more objects than allowed."""

import struct

import pytest
from rosbags.serde import SerdeError

from kbot.messages.visualization import Polygon
from kbot.record.encodings.foreign_types import read_definition
from kbot.record.encodings.safe_store import safe_copy
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.types import ros1_types, ros2_types
from kbot.text import KbotError

POLYGON = "geometry_msgs/msg/Polygon"
HEAD = b"\0\1\0\0"


def points(count: int, *, stated: int | None = None) -> bytes:
    return struct.pack("<I", count if stated is None else stated) + bytes(12 * count)


@pytest.mark.parametrize("stated", [4, 1000, 0xFFFFFFFF])
def test_conversion_ends_with_the_message(stated: int) -> None:
    store = ros2_types()
    assert bytes(store.ros1_to_cdr(points(3), POLYGON)) == HEAD + points(3)
    assert bytes(store.cdr_to_ros1(HEAD + points(3), POLYGON)) == points(3)
    for convert, head in ((store.ros1_to_cdr, b""), (store.cdr_to_ros1, HEAD)):
        with pytest.raises((SerdeError, ValueError)):
            convert(head + points(3, stated=stated), POLYGON)


def test_type_used_in_a_list_later_is_bounded_from_then_on() -> None:
    """Its code was generated before any list used the type."""
    store = safe_copy(ros2_types())
    store.register(read_definition("int32 a", "own_msgs/msg/Part"))
    assert bytes(store.ros1_to_cdr(bytes(4), "own_msgs/msg/Part")) == HEAD + bytes(4)
    store.register(read_definition("Part[] parts", "own_msgs/msg/Whole"))
    with pytest.raises(SerdeError, match="ends before the end of a list"):
        store.ros1_to_cdr(struct.pack("<I", 0xFFFFFFFF) + bytes(4), "own_msgs/msg/Whole")


def test_objects_of_a_long_message_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.record.encodings.safe_store.LONG_MESSAGE", 100)
    monkeypatch.setattr("kbot.record.encodings.safe_store.MOST_OBJECTS", 10)
    assert len(decode_cdr(HEAD + points(9), Polygon).points) == 9
    with pytest.raises(KbotError, match="may have at most 10 values"):
        decode_cdr(HEAD + points(11), Polygon)
    for store, message in ((ros2_types(), HEAD + points(11)), (ros1_types(), points(11))):
        read = store.deserialize_cdr if message.startswith(HEAD) else store.deserialize_ros1
        with pytest.raises(SerdeError, match="may have at most 10 values"):
            read(message, POLYGON)


def test_long_lists_of_strings_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.record.encodings.safe_store.LONG_MESSAGE", 100)
    store = safe_copy(ros2_types())
    store.register(read_definition("string[] words", "own_msgs/msg/Words"))
    with pytest.raises(SerdeError, match="lists of strings has more than 100 bytes"):
        store.deserialize_cdr(HEAD + bytes(100), "own_msgs/msg/Words")


def test_converted_objects_are_counted() -> None:
    store = safe_copy(ros2_types())
    store.ros1_to_cdr(points(1000), POLYGON)
    assert store.converted_parts == 2000  # once to compute the size, once to write
