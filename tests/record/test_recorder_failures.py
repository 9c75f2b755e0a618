"""Recordings survive full disks, kills, and truncated or damaged files."""

import os
import random
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import textwrap
from pathlib import Path

import mcap.reader
import pytest

import kbot
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.text import KbotError


def test_full_disk_ends_the_recording_but_not_the_run(tmp_path: Path) -> None:
    """A limit on the file size simulates a full disk. It must not cut off the bytecode that Python caches
    (`-B`), which later processes would fail to load."""
    program = f"""
        import resource, signal
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
        import kbot
        from kbot.record import Feed, Recorder
        from kbot.sim import Simulation
        errors = []
        sim = Simulation(kbot.load("kbot"))
        feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
        options = dict(compress=False, on_failure=errors.append)
        recorder = Recorder(sim, feed, {str(tmp_path / "run.mcap")!r}, **options)
        sim.cmd_vel(0.3, 0.4)
        for _ in range(20):
            sim.run(0.5)
            recorder.flush()
        recorder.close()
        assert errors == [recorder.failure], errors
        print(sim.time, recorder.failure)
    """
    done = subprocess.run(
        [sys.executable, "-B", "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("10.0 ")
    assert "File too large; the recording ended at" in done.stdout
    kept = Recording(str(tmp_path / "run.mcap")).summary()
    assert kept.broken
    assert f"{kept.count} messages up to {kept.end * 1e-9:.2f} s can be read" in done.stdout
    assert kept.topics["/odom"].count >= 25


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
@pytest.mark.parametrize(
    ("bytes_free", "message"),
    [(4096, "cannot be written: disk I/O error"), (60_000, "the recording ended at")],
)
def test_full_disk_is_reported_for_sqlite_too(tmp_path: Path, bytes_free: int, message: str) -> None:
    """At the start of a recording, and later."""
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, ({bytes_free}, {bytes_free}))
        sys.exit(run(["sim", "kbot", "--headless", "--record", {str(tmp_path / "run")!r}]))
    """
    done = subprocess.run(
        [sys.executable, "-B", "-c", textwrap.dedent(program)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "run").exists() == (bytes_free == 60_000)


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "run"])
def test_failed_recording_does_not_block_the_next_one(tmp_path: Path, name: str) -> None:
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        words = ["sim", "kbot", "--headless", "--duration", "0.1", "--record", {str(tmp_path / name)!r}]
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        first = run(words)
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        print(first, run(words), file=sys.stderr)
    """
    with (tmp_path / "output").open("w") as out:
        done = subprocess.run(
            [sys.executable, "-B", "-c", textwrap.dedent(program)], stdout=out, stderr=subprocess.PIPE,
            text=True, check=True,
        )  # fmt: skip
    assert done.stderr.endswith("2 0\n"), done.stderr


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_sqlite_keeps_all_but_the_last_second_on_a_full_disk(tmp_path: Path) -> None:
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
        words = ["sim", "kbot", "--headless", "--duration", "60"]
        sys.exit(run([*words, "--record", {str(tmp_path / "run")!r}]))
    """
    done = subprocess.run(
        [sys.executable, "-B", "-c", textwrap.dedent(program)], capture_output=True, text=True, check=False
    )
    ended = float(done.stderr.split("the recording ended at ")[1].split(" s")[0])
    with sqlite3.connect(tmp_path / "run" / "run.db3") as base:
        (last,) = base.execute("SELECT max(timestamp) FROM messages").fetchone()
    assert ended > 2.0
    assert ended - 1.1 <= last * 1e-9 <= ended


def test_killed_run_is_readable_to_its_last_chunk(tmp_path: Path) -> None:
    program = f"""
        import os, kbot
        from kbot.record import Feed, Recorder
        from kbot.sim import Simulation
        sim = Simulation(kbot.load("kbot"))
        feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
        recorder = Recorder(sim, feed, {str(tmp_path / "run.mcap")!r})
        sim.cmd_vel(0.3, 0.4)
        sim.run(30.0)
        os.kill(os.getpid(), {signal.SIGKILL.value})
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=False)
    assert done.returncode == -signal.SIGKILL
    found = Recording(str(tmp_path / "run.mcap")).summary()
    assert "not closed" in found.broken
    assert found.notes["kbot"]["robot"] == "kbot"
    assert found.topics["/odom"].count > 1000


def test_truncated_file_is_read_to_its_end(runs: dict[str, Path], tmp_path: Path) -> None:
    """The file has two chunks: one with the description, one with the run."""
    data = runs["mcap"].read_bytes()
    whole = Recording(str(runs["mcap"])).summary().count
    counts = []
    for length in range(200, len(data), 997):
        (tmp_path / "cut.mcap").write_bytes(data[:length])
        found = Recording(str(tmp_path / "cut.mcap")).summary()
        assert found.broken
        counts.append(found.count)
    assert sorted(counts) == counts
    assert set(counts) == {0, 1, whole}


def test_wrong_byte_in_a_chunk_loses_only_that_chunk(runs: dict[str, Path], tmp_path: Path) -> None:
    """The first chunk has the description and the definitions of the types in the second one."""
    data = bytearray(runs["mcap"].read_bytes())
    with runs["mcap"].open("rb") as stream:
        first, second = (index for index in mcap.reader.make_reader(stream).get_summary().chunk_indexes)
    whole = Recording(str(runs["mcap"])).summary()
    file = tmp_path / "wrong.mcap"
    for index, count in ((first, whole.count - 1), (second, 1)):
        at = index.chunk_start_offset + index.chunk_length - 10
        data[at] ^= 1
        file.write_bytes(data)
        data[at] ^= 1
        found = Recording(str(file)).summary()
        assert found.broken == "1 of its 2 chunks are damaged and cannot be read"
        assert found.count == count
        assert found.notes == whole.notes


@pytest.mark.parametrize("length", [0, 3, 12])
def test_file_that_ends_in_its_first_bytes_is_not_a_recording(tmp_path: Path, length: int) -> None:
    (tmp_path / "cut.mcap").write_bytes((b"\x89MCAP0\r\n\x01" + bytes([90]) * 20)[:length])
    with pytest.raises(KbotError, match="is not an MCAP file: it ends before its first record"):
        Recording(str(tmp_path / "cut.mcap")).summary()


def test_bag_with_wrong_bytes_is_read_or_refused_with_an_error(tmp_path: Path, runs: dict[str, Path]) -> None:
    good = runs["bag"].read_bytes()
    dice, refused = random.Random(1), 0
    for _ in range(30):
        bad = bytearray(good)
        for _ in range(40):
            bad[dice.randrange(20, len(bad))] = dice.randrange(256)
        (tmp_path / "bad.bag").write_bytes(bad)
        try:
            Recording(str(tmp_path / "bad.bag")).summary()
        except KbotError as error:
            refused += "bad.bag cannot be read as a ROS 1 bag: " in str(error)
    assert refused > 20


def test_truncated_bag_is_distinguished_from_an_unclosed_one(tmp_path: Path, runs: dict[str, Path]) -> None:
    """`index_pos` in the bag's header is the offset of the index. It is 0 until the index is written."""
    whole = runs["bag"].read_bytes()
    at = whole.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(whole[at : at + 8], "little")
    file = tmp_path / "cut.bag"
    for data, message in (
        (whole[:9000], f"it ends after 9,000 bytes, before its index at {index:,}"),
        (whole[:at] + bytes(8) + whole[at + 8 :], f"it was not closed, so its {len(whole):,} bytes"),
    ):
        file.write_bytes(data)
        assert message in Recording(str(file)).summary().broken


@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "run"])
def test_file_removed_during_recording_is_reported(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "stick"
    folder.mkdir()
    sim = Simulation(kbot.load("kbot"))
    failures: list[KbotError] = []
    recorder = Recorder(
        sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(folder / name), on_failure=failures.append
    )
    sim.run(0.5)
    shutil.rmtree(folder)
    sim.run(0.5)
    recorder.close()
    assert sim.time == 1.0
    assert [recorder.failure] == failures
    assert "the recording ended at" in str(failures[0])
    assert str(failures[0]).endswith(f"no part of it can be read: {folder / name} does not exist")


def test_limit_of_open_files_is_reported(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    feed = Feed(sim.bus, lambda: 0)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        with pytest.raises(KbotError, match="Too many open files"):
            Recorder(sim, feed, str(tmp_path / "run.mcap"))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
