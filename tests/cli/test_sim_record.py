"""Tests `kbot sim --record`: a recorded run can be replayed, even if others watched the run."""

from pathlib import Path

import pytest

from kbot.cli.main import run
from kbot.record import Recording


def test_a_recorded_run_has_the_usual_report_and_replays_identically(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "sim",
        "kbot",
        "--headless",
        "--world",
        "maze:size=4,seed=2",
        "--cmd-vel",
        "0.3,0.4",
        "--duration",
        "3",
    ]
    path = str(tmp_path / "run.mcap")
    assert run(words) == 0
    free = capsys.readouterr().out.splitlines()[-1]
    assert run([*words, "--record", path]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-1] == free
    assert f"{path}: 905 messages recorded" in captured.err
    facts = Recording(path).summary().notes["kbot"]
    assert facts["world"] == "maze:size=4,seed=2"
    assert run(["bag", "replay", path]) == 0
    assert "751 messages are the same, bit for bit" in capsys.readouterr().out


def test_a_script_s_commands_are_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "drive.py").write_text(
        "def drive(sim):\n    for k in range(10):\n        sim.cmd_vel(0.05 * k, 0.1)\n        sim.step(33)\n"
    )
    path = str(tmp_path / "run.bag")
    assert run(["sim", "kbot", "--headless", "--script", str(tmp_path / "drive.py"), "--record", path]) == 0
    assert Recording(path).summary().topics["/kbot/commands"].count == 10
    assert run(["bag", "replay", path]) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--record-topic", "/odom"], "--record-topic needs --record"),
        (["--bridge-host", "0.0.0.0"], "--bridge-host needs a bridge"),
        (["--record", ""], "--record needs a file name"),
        (["--record", "run.txt"], "unknown recording format"),
        (
            ["--record", "run.mcap", "--record-topic", "/odmo"],
            "cannot record /odmo: there is no such topic: did you mean",
        ),
    ],
)
def test_impossible_recordings_are_errors(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["sim", "kbot", "--headless", *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
