"""Recordings with wrong sizes or huge decompressed data give one error, in bounded time and memory."""

import os
import random
import re
import struct
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer

from kbot.cli.bag.command import bag_text
from kbot.messages import TFMessage, Transform, TransformStamped, Vector3
from kbot.record import Recording
from kbot.record import mcap_file as reader
from kbot.record.copy import copy_recording
from kbot.record.encodings.serialization import encode_cdr
from kbot.record.export import MessageTable
from kbot.record.index import open_index
from kbot.record.limits import LARGEST_PIECE, Allowance, Damaged, RecordingTooLarge, inflate
from kbot.record.mcap_records import Channel, ChunkIndex, Footer, Metadata, MetadataIndex, Opcode
from kbot.record.mcap_writer import McapWriter
from kbot.text import KbotError
from kbot.text.files import SCRATCH_SECONDS
from kbot.workbench.playback import recorded_run
from kbot.workbench.playback.recorded_run import RecordedRun

from .hostile import (
    BOMB,
    PACK,
    ROS1_WORD,
    TEXT,
    WORD,
    mcap_chunk,
    mcap_file,
    mcap_of,
    mcap_record,
    mcap_text,
    ros1_bag,
    ros1_connection,
    ros1_message,
    ros2_folder,
    zeros,
)

SEPARATOR = "=" * 80
CHATTER = ros1_connection(0, "/chatter", "std_msgs/String", "string data")
ENDLESS = struct.pack("<I", 0xFFFFFFFF) + bytes(100)
"""A list that states more entries than the message has bytes."""
POLYGON = "geometry_msgs/msg/Polygon"


def damaged(path: Path, data: bytes, chance: random.Random) -> None:
    """Write the data with one to four flipped bits."""
    wrong = bytearray(data)
    for _ in range(chance.randrange(1, 5)):
        wrong[chance.randrange(len(wrong))] ^= 1 << chance.randrange(8)
    path.write_bytes(wrong)


def read_all(path: Path) -> None:
    """Use everything that reads a recording. Raises KbotError."""
    found = Recording(str(path)).summary()
    for entry in Recording(str(path)).entries():
        entry.message()
    index = open_index(str(path))
    for topic in found.topics:
        index.newest(topic, index.end)
    list(index.between(list(found.topics), index.start - 1, index.end))
    index.close()


def error_of(use: Callable[[], object]) -> KbotError | None:
    try:
        use()
    except KbotError as error:
        return error
    return None


def refused(words: str, use: Callable[[], object]) -> None:
    """Assert that there is one error of one line with these words."""
    with pytest.raises(KbotError, match=words) as caught:
        use()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("verb", [("bag", "info"), ("view", "--no-browser")])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_chunk_of_a_gibibyte_is_refused(
    compression: str, verb: tuple[str, ...], tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    packed = zeros(compression, BOMB)
    file = mcap_file(tmp_path / "bomb.mcap", mcap_chunk(packed, compression, BOMB))
    result = measured_kbot(*verb, file)
    assert result.is_refusal(), result
    assert "bomb.mcap: the chunk at byte 33 is not read: it decompresses to more than" in result.err


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_large_chunk_of_a_bag_is_refused(
    compression: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    size = BOMB if compression == "lz4" else BOMB // 4  # compressing more would take too long for a test
    chunk = compression, zeros(compression, size), size, {0: 1}
    result = measured_kbot("bag", "info", ros1_bag(tmp_path / "bomb.bag", CHATTER, chunk))
    assert result.is_refusal(), result
    assert "bomb.bag: the chunk at byte" in result.err


@pytest.mark.parametrize("mode", ["file", "message"])
def test_folder_that_decompresses_to_gibibytes_is_refused(
    mode: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    packed = zeros("zstd", 2 * BOMB if mode == "file" else BOMB)
    folder = ros2_folder(tmp_path / "bomb", packed if mode == "message" else WORD, mode=mode)
    if mode == "file":
        (folder / "run.db3.zstd").write_bytes(packed)
    result = measured_kbot("bag", "info", folder)
    assert result.is_refusal(), result
    assert "bomb" in result.err


def test_many_allowed_chunks_are_refused_together(tmp_path: Path, measured_kbot: Callable[..., Any]) -> None:
    """40 chunks of 128 MiB, and one chunk with two million messages."""
    skipped = mcap_record(15 << 4, bytes((1 << 27) - 9))  # a record of an unknown kind
    large = mcap_file(tmp_path / "large.mcap", *[mcap_chunk(PACK["zstd"](skipped), "zstd", 1 << 27)] * 40)
    messages = mcap_record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + WORD) * 2_000_000
    many = mcap_file(tmp_path / "many.mcap", mcap_chunk(PACK["zstd"](messages), "zstd", len(messages)))
    for file in (large, many):
        result = measured_kbot("bag", "info", file)
        assert result.is_refusal(), result
        assert f"{file}: it decompresses to too much data for a file of" in result.err


def test_definition_with_six_gigabytes_of_code_is_refused(
    tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = mcap_of(tmp_path / "huge.mcap", {"a/msg/T": "string[100000000] a"})
    listed = measured_kbot("bag", "info", file)
    assert listed.is_bounded(), listed
    assert listed.status == 1
    assert "/topic0 cannot be read: the definition of a/msg/T cannot be used" in listed.out
    result = measured_kbot("bag", "export", file, "--topic", "/topic0")
    assert result.is_refusal(), result
    assert f"{file}: the definition of a/msg/T cannot be used" in result.err


def test_longest_accepted_definition_is_read_quickly(
    tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = mcap_of(tmp_path / "long.mcap", {"a/msg/T": "string[4900] a"})
    result = measured_kbot("bag", "export", file, "--topic", "/topic0")
    assert result.is_refusal(), result
    assert f"{file}: /topic0 at 0.000 s is not a a/msg/T" in result.err


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
@pytest.mark.parametrize(
    ("name", "definition", "words"),
    [
        ("a/msg/T", "float64 X=1e999", "line 1: '1e999' is not a value of float64"),
        ("a/msg/T", f"int32 X={'9' * 5000}", "is not a value of int32"),
        ("1a/msg/T", "int32 a", "'1a/msg/T' is not a valid type name"),
        ("a/msg/T", "T a", "a/msg/T contains itself"),
        ("a/msg/T", f"U a\n{SEPARATOR}\nMSG: a/U\nT b", "contains itself"),
        ("a/msg/T", f"U[999] a\n{SEPARATOR}\nMSG: a/U\nstring[999] b", "too large"),
        ("a/msg/T", 'int32 X=\'"""\'\nint32 y', "is not a value of int32"),
        ("a/msg/T", "int32 __init__", "is neither a field nor a constant"),
    ],
)
def test_messages_of_an_invalid_definition_are_left_out(
    name: str, definition: str, words: str, kind: str, tmp_path: Path
) -> None:
    if kind == "mcap":
        path = mcap_of(tmp_path / "a.mcap", {name: definition})
    elif kind == "bag":
        connection = ros1_connection(0, "/chatter", name.replace("/msg", ""), definition)
        message = ros1_message(0, 1, ROS1_WORD)
        path = ros1_bag(tmp_path / "a.bag", connection, ("none", message, len(message), {0: 1}))
    else:
        path = ros2_folder(tmp_path / "a", name=name, definition=definition)
    reason = f"the definition of {name} cannot be used: .*{words}"
    recording = Recording(str(path))
    (entry,) = recording.entries()
    refused(f"{path}: {reason}", entry.message)
    (unusable,) = recording.summary().unusable.values()
    copied = copy_recording(str(path), str(tmp_path / "copy.mcap"))
    (left_out,) = copied.left_out.values()
    assert re.match(reason, unusable)
    assert re.match(reason, left_out)
    assert copied.messages == 0
    assert open_index(str(path)).counts[entry.topic] == 1


def test_python_code_in_a_definition_is_not_run(tmp_path: Path) -> None:
    """rosbags generates Python code from a definition and runs it."""
    definition = 'string A=\'\'\'\nstring B=""" + print(1)\nstring C=\\\nstring class\nint32 None "a\n'
    path = mcap_of(tmp_path / "a.mcap", {"a/msg/T": definition}, data=b"\0\1\0\0\1\0\0\0" + bytes(8))
    (entry,) = Recording(str(path)).entries()
    message = entry.message()
    assert (message.A, message.B, message.C) == ("'''", '""" + print(1)', "\\")
    assert (message.class_, message.None_) == ("", 0)
    assert entry.ros2_definition[0].startswith("string A='''\nstring B=\"\"\" + print(1)\n")


def test_incomplete_type_is_refused_only_when_it_is_needed(tmp_path: Path) -> None:
    path = str(mcap_of(tmp_path / "a.mcap", {"a/msg/T": "b/U u"}))
    assert Recording(path).summary().topics["/topic0"].count == 1
    refused("the type b/msg/U is not defined", lambda: MessageTable.of(path, "/topic0"))
    for target in ("b.mcap", "b.bag"):
        copied = copy_recording(path, str(tmp_path / target))
        assert copied.left_out == {"/topic0": "the type b/msg/U is not defined"}


@pytest.mark.parametrize("target", ["copy.mcap", "copy.bag"])
@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_list_that_states_too_many_entries_ends_at_once(encoding: str, target: str, tmp_path: Path) -> None:
    """The bytes are copied unchanged if no conversion is needed."""
    data = ENDLESS if encoding == "ros1" else b"\0\1\0\0" + ENDLESS
    path = str(mcap_of(tmp_path / "a.mcap", {POLYGON: "Point32[] points"}, data=data, encoding=encoding))
    refused(f"/topic0 at 0.000 s is not a {POLYGON}", lambda: MessageTable.of(path, "/topic0"))
    if target.endswith("bag" if encoding == "cdr" else "mcap"):
        refused(
            f"a.mcap: /topic0 at 0.000 s is not a {POLYGON}",
            lambda: copy_recording(path, str(tmp_path / target)),
        )
    else:
        assert copy_recording(path, str(tmp_path / target)).messages == 1


def test_table_of_a_small_file_has_a_limited_number_of_columns(tmp_path: Path) -> None:
    message = mcap_record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + struct.pack("<III", 1 << 8, 0, 0))
    count = 2_000_000
    data = b"\0\1\0\0" + struct.pack("<IIII", 0, 0, count, 0) + bytes(8 * count)
    message = mcap_record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + data)
    schema = struct.pack("<H", 1) + mcap_text("std_msgs/msg/Float64MultiArray") + mcap_text("ros2msg")
    channel = struct.pack("<HH", 1, 1) + mcap_text("/a") + mcap_text("cdr") + bytes(4)
    path = mcap_file(
        tmp_path / "wide.mcap",
        mcap_record(3, schema + mcap_text("x")),
        mcap_record(4, channel),
        mcap_chunk(PACK["zstd"](message), "zstd", len(message)),
    )
    refused("wide.mcap: /a has too many values for a table", lambda: MessageTable.of(str(path), "/a"))


@pytest.mark.parametrize(
    ("script", "words"),
    [
        (
            "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE r(id) AS (SELECT 1 UNION ALL SELECT "
            "id + 1 FROM r) SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM r",
            "table messages is not a plain table",
        ),
        (
            "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS "
            "(zeroblob(200000000))); INSERT INTO messages(id, topic_id, timestamp) VALUES(1, 1, 1)",
            "table messages is not a plain table",
        ),
        ("DROP TABLE topics", "the tables 'topics' and 'messages' are missing"),
        ("UPDATE topics SET name = x'00'", "the name b"),
        ("UPDATE topics SET type = 5.5", "not the name of a type|of type '5.5'"),
        ("UPDATE message_definitions SET encoded_message_definition = x'00'", "or its definition b"),
        (
            "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE TABLE topics(\n\n' "
            "WHERE name = 'topics'",
            "malformed database schema",
        ),
        ("UPDATE messages SET data = 'text'", "contains str, not bytes"),
        ("UPDATE messages SET timestamp = -1", "the invalid time -1"),
    ],
)
def test_table_that_rosbag2_does_not_have_is_one_error(script: str, words: str, tmp_path: Path) -> None:
    folder = ros2_folder(tmp_path / "a", name="a/msg/T", definition="int32 a", script=script)
    if "5.5" in script:
        assert Recording(str(folder)).summary().topics["/chatter"].type_name == "5.5"
        return
    refused(f"{folder} cannot be read as rosbag2: .*{words}", lambda: Recording(str(folder)).summary())


def test_table_that_repeats_a_page_is_one_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each inner page of a table lists the same child page many times: three levels give 10^10 rows."""
    monkeypatch.setattr("kbot.record.bags.sqlite_file._FREE_STEPS", 1_000_000)
    monkeypatch.setattr("kbot.record.bags.sqlite_file._STEPS_OF_A_BYTE", 0)
    folder = ros2_folder(
        tmp_path / "a",
        script="WITH RECURSIVE r(n) AS (SELECT 2 UNION ALL SELECT n + 1 FROM r WHERE n < 100000) "
        f"INSERT INTO messages SELECT n, 1, n, x'{WORD.hex()}' FROM r",
    )
    file, size = folder / "run.db3", 4096
    data = file.read_bytes()
    pages = [bytearray(data[at : at + size]) for at in range(0, len(data), size)]
    inner, leaf = 5, 13  # page types of tables: https://www.sqlite.org/fileformat2.html
    root = max((page for page in pages if page[0] == inner), key=lambda page: page[3:5])
    leaves = [
        number for number, page in enumerate(pages) if page[0] == leaf and page[3] == 0 and page[4] > 50
    ]
    first, second, last = leaves[-3:]
    for number, child in ((pages.index(root), first), (first, second), (second, last)):
        page = bytearray(root)
        count = int.from_bytes(page[3:5], "big")
        cells = [int.from_bytes(page[12 + 2 * n : 14 + 2 * n], "big") for n in range(count)]
        for at in (8, *cells):
            page[at : at + 4] = (child + 1).to_bytes(4, "big")
        pages[number] = page
    file.write_bytes(b"".join(pages))
    refused("has more rows than", lambda: Recording(str(folder)).summary())
    (folder / "metadata.yaml").unlink()
    assert Recording(str(folder)).summary().broken


def test_row_that_does_not_fit_in_memory_is_one_error(tmp_path: Path) -> None:
    """Pages of 512 bytes, of which the 11th has a row of 2^63 bytes in the table of tables."""
    folder = ros2_folder(tmp_path / "a")
    data = bytearray(9005)
    for at, part in (
        (0, b"SQLite format 3"),
        (16, b"\2\0\0\0\0\x40\x20\x20"),
        (100, b"\5"),
        (111, b"\x0b"),
        (5120, b"\r\0\0\0\2\0\0\0\1\x4a"),
        (5450, b"\xff\xff\xff\xff\xff\xff\xff\xffid I"),
    ):
        data[at : at + len(part)] = part
    (folder / "run.db3").write_bytes(data)
    words = f"{folder} cannot be read as rosbag2: a row does not fit in memory"
    refused(words, lambda: Recording(str(folder)).summary())
    (folder / "metadata.yaml").unlink()
    assert "run.db3 cannot be read: " in Recording(str(folder)).summary().broken


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "nested more than 100 levels deep"),
        ("{a: " * 100_000, "nested more than 100 levels deep"),
        ("rosbag2_bagfile_information: &a [*a]", "not valid for rosbag2"),
        ("rosbag2_bagfile_information: {version: " + ":".join("1" * 100_000) + "}", "has version '1:1:1"),
        ("rosbag2_bagfile_information: {version: " + "9" * 5000 + "}", "has version '9999"),
        ("rosbag2_bagfile_information: !!python/object/apply:os.getcwd []", "not valid for rosbag2"),
        ("rosbag2_bagfile_information: [1, 2]", "not valid for rosbag2"),
        ("\0\1\2", "not valid for rosbag2"),
        ("just text", "not valid for rosbag2"),
        (
            "rosbag2_bagfile_information: {version: 5, storage_identifier: sqlite3, "
            "relative_file_paths: [../../etc/passwd]}",
            "passwd is missing",
        ),
        (
            "rosbag2_bagfile_information: {version: 5, storage_identifier: tape}",
            "unknown storage 'tape'",
        ),
        (
            "m0: &m0 {a: 1}\n"
            + "".join(f"m{n + 1}: &m{n + 1}\n  <<: [*m{n}, *m{n}]\n" for n in range(40))
            + "rosbag2_bagfile_information: *m40\n",
            "its aliases expand to too many values",
        ),
    ],
)
def test_invalid_metadata_is_one_error(text: str, words: str, tmp_path: Path) -> None:
    folder = ros2_folder(tmp_path / "a")
    (folder / "metadata.yaml").write_text(text)
    refused(f"{folder} cannot be read as rosbag2: .*{words}", lambda: Recording(str(folder)).summary())
    refused(f"{folder} cannot be read as rosbag2: .*{words}", lambda: open_index(str(folder)))


@pytest.mark.parametrize("mode", ["", "file", "message"])
def test_compressed_folder_is_read(mode: str, tmp_path: Path) -> None:
    folder = ros2_folder(tmp_path / "a", PACK["zstd"](WORD) if mode == "message" else WORD, mode=mode)
    (entry,) = Recording(str(folder)).entries()
    assert (entry.topic, entry.type_name, entry.message().data) == ("/chatter", TEXT, "a")
    index = open_index(str(folder))
    newest = index.newest("/chatter", 5)
    assert newest is not None
    assert newest.message().data == "a"
    assert (dict(index.counts), index.start, index.end) == ({"/chatter": 1}, 1, 1)
    index.close()


def test_folder_with_an_mcap_file_is_read(runs: dict[str, Path], tmp_path: Path) -> None:
    folder = ros2_folder(tmp_path / "a")
    (folder / "run.mcap").write_bytes(runs["mcap"].read_bytes())
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("sqlite3", "mcap").replace("run.db3", "a/run.mcap"))
    whole, found = Recording(str(runs["mcap"])).summary(), Recording(str(folder)).summary()
    assert (found.count, found.notes, found.kind) == (whole.count, whole.notes, "rosbag2")
    index = open_index(str(folder))
    newest = index.newest("/odom", 510_000_000)
    assert newest is not None
    assert newest.nanoseconds == 500_000_000
    assert index.notes == whole.notes
    index.close()


@pytest.mark.parametrize("length", [1 << 31, 1 << 62, (1 << 64) - 1])
@pytest.mark.parametrize("at", [1, 1 + 8 + 32])
def test_length_larger_than_the_file_loses_only_its_chunk(at: int, length: int, tmp_path: Path) -> None:
    """The length of a chunk's record, and that of the data in it."""
    chunk = bytearray(mcap_chunk(b"", "", 0))
    chunk[at : at + 8] = struct.pack("<Q", length)
    found = Recording(str(mcap_file(tmp_path / "a.mcap", bytes(chunk)))).summary()
    assert (found.count, "is lost" in found.broken) == (0, True)


@pytest.mark.parametrize(("target", "time"), [("copy", 1 << 63), ("copy.bag", 1 << 62)])
def test_time_out_of_range_of_the_new_format_is_one_error(target: str, time: int, tmp_path: Path) -> None:
    """SQLite has signed 64-bit times, and a ROS 1 bag has 32-bit seconds."""
    path = tmp_path / "late.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "test")
        channel = writer.register_channel(
            "/a", "cdr", writer.register_schema(TEXT, "ros2msg", b"string data")
        )
        writer.add_message(channel, time, WORD, time)
        writer.finish()
    refused(
        "late.mcap: /a at .* cannot be written in this format",
        lambda: copy_recording(str(path), str(tmp_path / target)),
    )
    assert not (tmp_path / target).exists()


def test_index_that_repeats_a_chunk_is_refused(tmp_path: Path) -> None:
    message = ros1_message(0, 1, ROS1_WORD)
    chunk = "none", message, len(message), {0: 1}
    path = ros1_bag(tmp_path / "twice.bag", CHATTER, chunk, repeated=2)
    refused("its index lists a chunk twice", lambda: Recording(str(path)).summary())
    assert Recording(str(ros1_bag(tmp_path / "once.bag", CHATTER, chunk))).summary().count == 1


def test_overlapping_chunks_of_a_bag_are_merged_by_time(tmp_path: Path) -> None:
    odd = b"".join(ros1_message(0, n, ROS1_WORD) for n in (9, 7, 5, 3))
    even = b"".join(ros1_message(0, n, ROS1_WORD) for n in (2, 4, 6, 8))
    chunks = [("none", data, len(data), {0: 4}) for data in (odd, even)]
    path = ros1_bag(tmp_path / "a.bag", CHATTER, *chunks)
    assert [entry.nanoseconds for entry in Recording(str(path)).entries()] == list(range(2, 10))


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_wrong_bits_are_read_or_refused_with_an_error(
    kind: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    """Flips bits in the first bytes, in the last bytes and everywhere, 1 s for each."""
    whole = Recording(str(runs[kind])).summary()
    folder = tmp_path / "run"
    if kind == "ros2":
        folder.mkdir()
        (folder / "metadata.yaml").write_bytes((runs[kind] / "metadata.yaml").read_bytes())
    source = runs[kind] / "run.db3" if kind == "ros2" else runs[kind]
    target = folder / "run.db3" if kind == "ros2" else tmp_path / runs[kind].name
    good, chance, refusals = source.read_bytes(), random.Random(7), 0
    for number in range(60):
        part = (good[:2000], good[-2000:], good)[number % 3]
        damaged(target, part, chance)
        wrong = target.read_bytes()
        target.write_bytes((wrong + good[2000:], good[:-2000] + wrong, wrong)[number % 3])
        error = error_of(lambda: read_all(folder if kind == "ros2" else target))
        refusals += error is not None
        assert "\n" not in str(error)
    assert whole.broken == ""
    assert refusals < 60


def test_wrong_bits_in_the_metadata_are_read_or_refused_with_an_error(tmp_path: Path) -> None:
    folder = ros2_folder(tmp_path / "run")
    good, chance = (folder / "metadata.yaml").read_bytes(), random.Random(3)
    for _ in range(200):
        damaged(folder / "metadata.yaml", good, chance)
        assert "\n" not in str(error_of(lambda: Recording(str(folder)).summary()))


@pytest.mark.parametrize("compression", PACK)
def test_stated_size_is_compared_with_the_data(compression: str) -> None:
    packed = PACK[compression](b"abcd" * 1000)
    assert inflate(packed, compression, 4000) == b"abcd" * 1000
    for wrong in (0, 3999, 4001, 1 << 62):
        with pytest.raises(ValueError, match=r"it decompresses to (more|fewer) than the .* bytes"):
            inflate(packed, compression, wrong)
    if compression not in ("", "none"):
        assert inflate(packed, compression) == b"abcd" * 1000
        for broken in (packed[:-10], b"\xff" + packed[1:], b""):
            with pytest.raises(ValueError):  # noqa: PT011 - each library's own words
                inflate(broken, compression, 4000)


def test_empty_frames_take_time_in_proportion_to_their_number() -> None:
    """If each of them copies the rest of the data, this takes longer than the tests may."""
    frames = PACK["zstd"](b"") * 300_000
    assert inflate(frames + PACK["zstd"](b"abcd"), "zstd", 4) == b"abcd"


def test_unknown_compression_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown compression 'rar'"):
        inflate(b"", "rar", 0)


def test_allowance_grows_with_the_file(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.write_bytes(bytes(1_000_000))
    allowance = Allowance(file)
    allowance.charge((2 << 30) + 1_900_000_000)  # 2 GiB plus 2000 times the size of the file
    with pytest.raises(
        RecordingTooLarge, match="it decompresses to too much data for a file of 1,000,000 bytes"
    ):
        allowance.charge(LARGEST_PIECE)


def test_many_invalid_definitions_are_refused_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chunk of 50 kB can hold 700 definitions of 240,000 characters, each of which takes 0.1 s."""
    monkeypatch.setattr("kbot.record.limits._FREE", 1 << 24)
    text = "uint8 a\n" * 5000
    schemas = (
        mcap_record(
            3, struct.pack("<H", n) + mcap_text(f"a/msg/T{n}") + mcap_text("ros2msg") + mcap_text(text)
        )
        for n in range(1, 40)
    )
    data = b"".join(schemas)
    path = mcap_file(tmp_path / "a.mcap", mcap_chunk(PACK["zstd"](data), "zstd", len(data)))
    refused("a.mcap: it decompresses to too much data", lambda: Recording(str(path)).summary())


@pytest.mark.parametrize("ending", ["mcap", "bag", "db3"])
def test_name_longer_than_ros_allows_is_refused(ending: str, tmp_path: Path) -> None:
    """Names are held in memory: 65,535 names of a megabyte are compressed to a few megabytes."""
    name = "/" + "a" * 255
    path = tmp_path / f"a.{ending}"
    if ending == "mcap":
        channel = struct.pack("<HH", 1, 1) + mcap_text(name) + mcap_text("cdr") + bytes(4)
        mcap_file(path, mcap_record(4, channel))
    elif ending == "bag":
        ros1_bag(path, ros1_connection(0, name, "std_msgs/String", "string data"))
    else:
        ros2_folder(path, script=f"UPDATE topics SET name = '{name}'")
    words = f"a.{ending}: the name '/a*'... of a topic or type has 256 characters"
    refused(words, lambda: Recording(str(path)).summary())


def test_journal_that_names_another_file_deletes_nothing(tmp_path: Path) -> None:
    """SQLite deletes the second journal that a journal names, whatever it is."""
    victim = tmp_path / "victim.txt"
    victim.write_text("precious")
    folder = ros2_folder(tmp_path / "a")
    (folder / "metadata.yaml").unlink()
    end, name = bytes.fromhex("d9d505f920a163d7"), bytes(victim)
    size = int.from_bytes((folder / "run.db3").read_bytes()[16:18], "big")
    head = end + struct.pack(">IIIII", 0, 0, 4, 512, size)
    locking_page = (1 << 30) // size + 1
    second = struct.pack(">I", locking_page) + name + struct.pack(">II", len(name), sum(name)) + end
    (folder / "run.db3-journal").write_bytes(head.ljust(512, b"\0") + second)
    assert "run.db3-journal names another file" in Recording(str(folder)).summary().broken
    assert victim.read_text() == "precious"


def test_killed_copy_leaves_no_half_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A killed run closes nothing and removes nothing: here the writer looks at the folder as it would be."""
    source, out = ros2_folder(tmp_path / "a"), tmp_path / "out"
    out.mkdir()
    found: list[list[str]] = []
    written = McapWriter.close

    def close(writer: McapWriter) -> None:
        found.append([path.name for path in out.iterdir()])
        written(writer)

    monkeypatch.setattr(McapWriter, "close", close)
    copy_recording(str(source), str(out / "b.mcap"))
    ((scratch,),) = found
    assert [path.name for path in out.iterdir()] == ["b.mcap"]
    left = out / scratch
    (left / "b.mcap").mkdir(parents=True)
    for path in (left / "b.mcap", left):
        os.utime(path, times=(0.0, time.time() - 2 * SCRATCH_SECONDS))
    (out / "b.mcap").unlink()
    copy_recording(str(source), str(out / "b.mcap"))
    assert [path.name for path in out.iterdir()] == ["b.mcap"]


EMPTY_PAIR = bytes(8)
"""A key and a value without characters."""


def channel_with(pairs: int) -> bytes:
    """The content of a channel whose metadata has empty pairs."""
    metadata = struct.pack("<I", pairs * len(EMPTY_PAIR)) + EMPTY_PAIR * pairs
    return struct.pack("<HH", 1, 0) + mcap_text("/a") + mcap_text("cdr") + metadata


def indexed(path: Path, *records: bytes, index: Callable[[int], bytes]) -> Path:
    """Write records with a summary. `index` returns it for the offset of the first record."""
    mcap_file(path, *records)
    data, footer = path.read_bytes(), len(Footer(0, 0, 0).encoded()) + 8
    begin = len(data) - footer - sum(map(len, records))
    end = Footer(len(data) - footer, 0, 0).encoded() + data[-8:]
    path.write_bytes(data[:-footer] + index(begin) + end)
    return path


def counted(monkeypatch: pytest.MonkeyPatch, name: str) -> list[object]:
    """Collect the arguments of each call of a function of the MCAP reader."""
    calls: list[object] = []
    called = getattr(reader, name)
    monkeypatch.setattr(reader, name, lambda *given: calls.append(given) or called(*given))
    return calls


def test_map_with_more_entries_than_channels_is_damaged() -> None:
    """The number of a channel has 16 bits."""
    assert Channel.read(channel_with(1 << 16)).metadata == {"": ""}
    with pytest.raises(ValueError, match="a map has more than 65,536 entries"):
        Channel.read(channel_with((1 << 16) + 1))


def test_many_large_maps_are_refused_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a limit, a chunk of 20 kB takes 40 s: it can hold 22 million pairs."""
    monkeypatch.setattr("kbot.record.limits._FREE", 1 << 24)
    data = mcap_record(4, channel_with(1000)) * 200
    path = mcap_file(tmp_path / "a.mcap", mcap_chunk(PACK["zstd"](data), "zstd", len(data)))
    refused("a.mcap: it decompresses to too much data", lambda: Recording(str(path)).summary())


@pytest.mark.parametrize("offset", [0, 9, 18, 9000, 1 << 63, (1 << 64) - 1])
def test_offset_of_another_record_is_not_searched_from(offset: int) -> None:
    class Counting(BytesIO):
        reads = 0

        def read(self, size: int | None = -1, /) -> bytes:
            self.reads += 1
            return super().read(size)

    stream = Counting(mcap_record(0x80, b"") * 1000 + Metadata("a", {}).encoded())
    if offset == 9000:
        assert reader.record_at(stream, offset, Opcode.METADATA) == Metadata("a", {})
        return
    with pytest.raises(Damaged, match=f"there is no metadata at byte {offset:,}"):
        reader.record_at(stream, offset, Opcode.METADATA)
    assert stream.reads <= 1


@pytest.mark.parametrize("is_broken", [False, True])
def test_metadata_that_the_index_repeats_is_read_once(
    is_broken: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    note, chunk = Metadata("a", {"b": "c"}).encoded(), mcap_chunk(b"", "", 5 if is_broken else 0)

    def index(at: int) -> bytes:
        chunk_index = ChunkIndex(0, 0, at, len(chunk), {}, 0, "", 0, 0).encoded()
        return chunk_index + MetadataIndex(at + len(chunk), len(note), "a").encoded() * 500

    path = indexed(tmp_path / "a.mcap", chunk, note, index=index)
    calls = counted(monkeypatch, "record_at")
    assert open_index(str(path)).notes == {"a": {"b": "c"}}
    assert Recording(str(path)).summary().notes == {"a": {"b": "c"}}
    assert len(calls) < 10


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_damaged_chunks_are_charged(
    compression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of them decompresses to one byte more than it states."""
    monkeypatch.setattr("kbot.record.limits._FREE", 1 << 24)
    monkeypatch.setattr("kbot.record.limits._RATIO", 0)
    size = 1 << 20
    chunk = mcap_chunk(zeros(compression, size), compression, size - 1)

    def index(at: int) -> bytes:
        places = range(at, at + 40 * len(chunk), len(chunk))
        return b"".join(
            ChunkIndex(0, 0, place, len(chunk), {}, 0, compression, 0, size).encoded() for place in places
        )

    path = indexed(tmp_path / "a.mcap", *[chunk] * 40, index=index)
    words = "a.mcap: it decompresses to too much data"
    refused(words, lambda: Recording(str(path)).summary())
    refused(words, lambda: open_index(str(path)).damage(0))


def test_damaged_chunks_are_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """30 damaged chunks, more than the reader keeps in memory, and one that can be read."""
    chunk, good = mcap_chunk(bytes(9), "", 8), mcap_chunk(b"", "", 0)

    def index(at: int) -> bytes:
        return b"".join(
            ChunkIndex(n, n, at + n * len(chunk), len(chunk), {}, 0, "", 0, 0).encoded() for n in range(31)
        )

    calls = counted(monkeypatch, "inflate")
    opened = open_index(str(indexed(tmp_path / "a.mcap", *[chunk] * 30, good, index=index)))
    for time_of_damage in (0, 15, 29, 0):
        assert opened.damage(time_of_damage) == (0, 30)
    assert opened.newest("/a", 30) is None
    assert len(calls) <= 31 + 2 * 4  # once each, and the good one again when the cache has dropped it


@pytest.mark.parametrize("compression", ["bz2", "none"])
def test_compression_that_mcap_does_not_have_is_not_read(
    compression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """https://mcap.dev/spec/registry lists zstd and lz4. Bags of ROS 1 have bz2 and none."""
    calls = counted(monkeypatch, "inflate")
    data = mcap_record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + WORD)
    path = mcap_file(tmp_path / "a.mcap", mcap_chunk(PACK[compression](data), compression, len(data)))
    assert Recording(str(path)).summary().broken
    assert calls == []


def test_large_frames_are_not_read_to_open_a_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four messages just below the limit of values take 20 s."""
    stamped = TransformStamped(child_frame_id="wheel", transform=Transform(Vector3(1.0, 0.0, 0.0)))
    data = encode_cdr(TFMessage((stamped,) * 20))
    path = mcap_of(tmp_path / "a.mcap", {"tf2_msgs/msg/TFMessage": ""}, data=data)
    opened = RecordedRun(str(path))
    assert [len(entry.data) for entry in opened.samples()] == [len(data)]
    (entry,) = opened.samples()
    assert isinstance(opened.read(entry), TFMessage)
    monkeypatch.setattr(recorded_run, "MOST_SAMPLED_BYTES", len(data) - 1)
    assert list(opened.samples()) == []
    assert opened.read(entry) is None
    monkeypatch.setattr(recorded_run, "decode_cdr", None)  # nothing is decoded
    assert '<link name="base_link"/>' in Path(RecordedRun(str(path)).description).read_text()


def test_frame_of_the_base_ends_the_search(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = encode_cdr(TFMessage((TransformStamped(child_frame_id="a/base_footprint"),)))
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "test")
        kind = writer.register_schema("tf2_msgs/msg/TFMessage", "ros2msg", b"")
        channel = writer.register_channel("/tf", "cdr", kind)
        for at in range(50):
            writer.add_message(channel, at, data, at)
        writer.finish()
    read: list[object] = []
    decode = recorded_run.decode_cdr
    monkeypatch.setattr(recorded_run, "decode_cdr", lambda *given: read.append(given) or decode(*given))
    assert 'name="a/base_footprint"' in Path(RecordedRun(str(path)).description).read_text()
    assert len(read) == 2  # for the frame, and for the clock of the stamps


def test_names_cannot_control_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    evil = "a\x1b[2J\x9b\n\u202eb"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "test")
        kind = writer.register_schema(evil, "ros2msg", b"string data")
        writer.add_message(writer.register_channel("/" + evil, "cdr", kind), 1, WORD, 1)
        writer.add_metadata(evil, {evil: evil})
        writer.finish()
    lines = bag_text(str(path), Recording(str(path)).summary()).split("\n")
    assert all(line.isprintable() for line in lines)
    assert any(r"/a\x1b[2J\x9b \u202eb" in line for line in lines)
