"""Records of MCAP files, encoded and read as the library of MCAP's authors does."""

import re
from dataclasses import fields
from io import BytesIO

import mcap.opcode
import mcap.records
import pytest
from mcap.data_stream import ReadDataStream, RecordBuilder

from kbot.record.mcap_records import (
    HEAD,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Opcode,
    Schema,
    Statistics,
    SummaryOffset,
)

BIG = 2**64 - 1
RECORDS = (
    Header("ros2", "kbot ünï"),
    Footer(1, 2, 2**32 - 1),
    Schema(65535, "a_msgs/msg/A", "ros2msg", b"int8 a\n"),
    Channel(1, 2, "/a", "cdr", {"offered_qos_profiles": "- ä", "": ""}),
    Message(3, 2**32 - 1, BIG, 4, b"\0\1data"),
    Chunk(1, BIG, 3, 4, "zstd", b"packed"),
    MessageIndex(1, [(5, 0), (5, 9), (BIG, 18)]),
    ChunkIndex(1, 2, 3, BIG, {1: 10, 2: BIG}, 6, "", 7, 8),
    Statistics(1, 2, 3, 4, 5, 6, 7, 8, {1: 2, 65535: BIG}),
    Metadata("kbot", {"robot": "a b", "seed": "1"}),
    MetadataIndex(1, BIG, "kbot"),
    SummaryOffset(8, 1, 2),
    DataEnd(7),
)


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
def test_a_record_is_encoded_and_read_as_by_the_library(record: McapRecord) -> None:
    peer = getattr(mcap.records, type(record).__name__)
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    builder = RecordBuilder()
    peer(**values).write(builder)
    data = builder.end()
    assert record.encoded() == data
    content = data[HEAD.size :]
    assert type(record).read(content) == record
    more = (len(content),) if isinstance(record, Message) else ()
    assert vars(peer.read(ReadDataStream(BytesIO(content)), *more)) == values


def test_the_opcodes_are_those_of_the_library() -> None:
    assert all(mcap.opcode.Opcode[kind.name] == kind for kind in Opcode)
    assert {kind.OPCODE for kind in McapRecord.__subclasses__()} == {*Opcode}


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
def test_a_record_that_is_cut_off_is_an_error(record: McapRecord) -> None:
    content = record.encoded()[HEAD.size :]
    least = 22 if isinstance(record, Message) else len(content)  # the data of a message has any length
    for end in range(least):
        with pytest.raises(ValueError, match=re.escape("bytes, but only")):
            type(record).read(content[:end])


def test_a_later_version_may_add_fields() -> None:
    record = MetadataIndex(1, 2, "kbot")
    assert MetadataIndex.read(record.encoded()[HEAD.size :] + b"more") == record
