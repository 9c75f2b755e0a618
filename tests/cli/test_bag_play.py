"""Tests `kbot bag play`: what it publishes, how, and to which peers."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from kbot.cli.bag.play import Pace
from kbot.cli.main import run
from kbot.record.player import Player


def test_play_reports_an_incomplete_recording(
    recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(recording).read_bytes()[:-50])
    assert run(["bag", "play", "-r", "100", recording, str(cut)]) == 0
    assert f"{cut} is incomplete: it was not closed" in capsys.readouterr().err
    assert run(["bag", "play", "-r", "100", recording]) == 0
    assert "incomplete" not in capsys.readouterr().err


def test_play_prints_what_it_publishes_and_to_which_peers(
    recording: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["bag", "play", recording, "-s", "1.5", "-u", "9", "-r", "100"]) == 0
    output = capsys.readouterr().err
    assert f"{recording}: 0.500 s, at 100 times its speed." in output
    assert "Commands such as kbot topic echo receive the messages. For other tools, add --ros1, " in output
    assert "Ctrl-C stops." in output
    assert run(["bag", "play", recording, "--rate", "100", "--rosbridge"]) == 0
    output = capsys.readouterr().err
    assert "Bridges: rosbridge. Commands such as kbot topic echo also receive the messages." in output


def test_play_accepts_the_options_of_rosbag_and_ros2_bag(
    recording: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seconds count from the first message, also in a recording in wall-clock time."""
    played: list[tuple[Player, Pace]] = []
    monkeypatch.setattr(
        "kbot.cli.bag.command.play_back", lambda player, _, pace: played.append((player, pace))
    )
    assert run(["bag", "play", "--topics", "/odom", "/tf", "-l", recording, "--clock", "-d", "2"]) == 0
    assert run(["bag", "play", recording, "--start-offset", "0.5", "--playback-duration", "1", "-p"]) == 0
    words = ["-m", "/odom:=/a", "--exclude-topics", "/tf", "joint_states", "--clock", "40", "-u", "1"]
    assert run(["bag", "play", recording, *words]) == 0
    assert run(["bag", "play", recording, "/odom:=a", "tf:=/b"]) == 0
    (first, pace), (second, paused), (third, _), (fourth, _) = played
    assert third.length == 1.0
    assert {"/a"} == {*third.bus.topics} - {"/kbot/poses"}
    assert {"/a", "/b", "/joint_states"} == {*fourth.bus.topics} - {"/kbot/poses"}
    assert ({*first.bus.topics}, pace) == ({"/odom", "/tf"}, Pace(1.0, 2.0, loop=True, paused=False))
    assert (second.length, paused.paused) == (1.0, True)
    assert second.seconds == pytest.approx(0.5)
    assert run(["bag", "play", recording, "-l", "-u", "0"]) == 2
    assert "nothing to repeat" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="there are no such terminals")
def test_space_resumes_a_paused_recording(recording: str) -> None:
    import pty

    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "kbot", "bag", "play", recording, "--pause", "-r", "100"]
    playing = subprocess.Popen(command, stdin=theirs, stderr=subprocess.PIPE, text=True)
    os.close(theirs)
    try:
        assert playing.stderr is not None
        output = "".join(playing.stderr.readline() for _ in range(3))
        assert "It is paused." in output
        assert "Space pauses" in output
        with pytest.raises(subprocess.TimeoutExpired):  # without pause it ends after 20 ms
            playing.wait(1)
        os.write(ours, b" ")
        assert playing.wait(60) == 0
    finally:
        playing.kill()
        playing.communicate()
        os.close(ours)


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
def test_ctrl_c_ends_playback_without_an_error(recording: str) -> None:
    command = [sys.executable, "-m", "kbot", "bag", "play", recording, "--loop"]
    playing = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert playing.stderr is not None
    assert playing.stderr.readline() == f"{recording}: 2.000 s, repeated.\n"
    assert playing.stderr.readline().startswith("Commands such as kbot topic echo ")
    assert playing.stderr.readline() == "Ctrl-C stops.\n"
    playing.send_signal(signal.SIGINT)
    _, rest = playing.communicate(timeout=60)
    assert (playing.returncode, rest) == (0, "")
