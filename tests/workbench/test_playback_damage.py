"""Damaged recordings: readable parts are displayed, damaged ones are reported."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.workbench.protocol import Advance, Pause, Seek
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.series import Field

pytestmark = pytest.mark.usefixtures("keeps_up")

SPEED = 0.2


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six seconds straight ahead, in chunks of half a second."""
    sim = Simulation("kbot")
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    sim.cmd_vel(SPEED, 0.0)
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path))
    with pytest.MonkeyPatch.context() as patch:
        # a slow machine must not end a chunk earlier
        patch.setattr("kbot.record.recorder.FLUSH_SECONDS", float("inf"))
        for _ in range(12):
            sim.run(0.5)
            recorder.flush()
        recorder.close()
    return path


def spans(path: Path) -> list[tuple[int, int, int, int]]:
    """Return the offset, length, and first and last time of each chunk in the file."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return sorted(
        (c.chunk_start_offset, c.chunk_length, c.message_start_time, c.message_end_time)
        for c in summary.chunk_indexes
    )


def damaged(whole: Path, path: Path, *chunks: int) -> tuple[Path, float, float]:
    """Return a copy with inverted bytes in chunks, and in seconds the start of the damage and of the next
    readable chunk."""
    data = bytearray(whole.read_bytes())
    all_of_them = spans(whole)
    for chunk in chunks:
        offset, length, _, _ = all_of_them[chunk]
        for at in range(offset + length // 2, offset + length // 2 + 20):
            data[at] ^= 0xFF
    path.write_bytes(data)
    first = all_of_them[0][2]
    after = all_of_them[chunks[-1] + 1][2] if chunks[-1] + 1 < len(all_of_them) else all_of_them[-1][3]
    return path, (all_of_them[chunks[0]][2] - first) * 1e-9, (after - first) * 1e-9


def at(session: Session) -> float:
    timeline = session.timeline()
    assert timeline is not None
    return timeline.at


@pytest.mark.parametrize("chunks", [(6,), (5, 6)])
def test_a_seek_into_the_damage_displays_the_nearest_readable_time(
    whole: Path, tmp_path: Path, chunks: tuple[int, ...]
) -> None:
    path, start, end = damaged(whole, tmp_path / "bad.mcap", *chunks)
    session = played_session(str(path))
    words = rf"damaged from {start:.2f} s to {end:.2f} s\. The nearest readable time is"
    with pytest.raises(KbotError, match=rf"{words} {start:.2f} s"):
        session.handle(Seek(start + 0.1), 1)
    assert at(session) == pytest.approx(start, abs=1e-3)
    assert session.state().poses[0] == pytest.approx(SPEED * start, abs=0.05)
    with pytest.raises(KbotError, match=rf"{words} {end:.2f} s"):
        session.handle(Seek(end - 0.1), 1)
    assert at(session) == pytest.approx(end, abs=1e-3)
    assert session.state().poses[0] == pytest.approx(SPEED * end, abs=0.05)
    session.handle(Seek(end + 0.2), 1)  # also if the latest messages are in the damaged part
    assert session.state().poses[0] == pytest.approx(SPEED * (end + 0.2), abs=0.05)


def test_playback_skips_the_damage_and_reports_it(whole: Path, tmp_path: Path) -> None:
    path, start, end = damaged(whole, tmp_path / "bad.mcap", 6)
    session = played_session(str(path))
    session.handle(Seek(start - 0.05), 1)
    session.handle(Pause(paused=True), 1)
    with pytest.raises(KbotError, match="Playback continues after it"):
        session.handle(Advance(0.1), 1)
    assert at(session) == pytest.approx(end, abs=1e-3)
    session.handle(Advance(0.2), 1)
    assert at(session) == pytest.approx(end + 0.2, abs=1e-3)


def test_a_recording_without_its_robot_is_shown_without_it(whole: Path, tmp_path: Path) -> None:
    path, _, _ = damaged(whole, tmp_path / "bad.mcap", 0)
    assert "no readable /robot_description: only frames and sensors" in played_session(str(path)).note


def test_damage_at_the_end_keeps_the_rest_playable(whole: Path, tmp_path: Path) -> None:
    path, start, _ = damaged(whole, tmp_path / "bad.mcap", len(spans(whole)) - 1)
    session = played_session(str(path))
    with pytest.raises(KbotError, match="is damaged from"):
        session.handle(Seek(1e6), 1)
    assert at(session) == pytest.approx(start, abs=1e-3)
    session.handle(Pause(paused=False), 1)
    with pytest.raises(KbotError, match="That is its end"):
        session.advance(0.5)
    assert session.paused


def test_a_plot_skips_the_damage(whole: Path, tmp_path: Path) -> None:
    path, start, end = damaged(whole, tmp_path / "bad.mcap", 6)
    session = played_session(str(path))
    making = session.series([Field.named("/odom twist.twist.linear.x")], 0.0, 10.0)
    assert making is not None
    try:
        while True:
            next(making)
    except StopIteration as done:
        table = done.value
    assert table.at[-1] == pytest.approx(at_end(session), abs=0.03)
    known = {at: row[0] for at, row in zip(table.at, table.rows, strict=True)}
    assert {value for at, value in known.items() if start <= at < end} == {None}
    there = [value for at, value in known.items() if 2.0 < at < start or at > end + 0.03]
    assert np.allclose(np.array(there, float), SPEED, atol=0.02)


def at_end(session: Session) -> float:
    timeline = session.timeline()
    assert timeline is not None
    return timeline.end
