"""Ctrl-C, `kill` and a closed terminal end every run, whatever the user's program does."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kbot.model.load import SHIPPED_PACKAGE
from kbot.record import Recording

Start = Callable[..., subprocess.Popen[str]]
SOON = 60
"""Seconds. An ended run takes less than two, on an idle machine."""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise on Windows")


def started(program: subprocess.Popen[str], word: str) -> None:
    """Wait until a program prints a word."""
    assert program.stdout is not None
    line = program.stdout.readline()
    while word not in line:
        assert line, program.stderr and program.stderr.read()
        line = program.stdout.readline()


SCENARIO = "duration: 9\nrobot: kbot\nsteps: [{script: endless.py}]\n"
ENDLESS = "def drive(sim):\n    open('begun', 'w').close()\n    while True: pass\n"
REPORTS = {"r.xml", "r.md", "r.gif", "r.html"}
TRY = "try e.scenario.yaml --junit r.xml"
COMPARE = "compare HEAD: . --scenario e.scenario.yaml --markdown r.md --film r.gif"
SWEEP = "sweep kbot --set wheel_radius=0.03,0.04 --scenario e.scenario.yaml --out out --html r.html"


@pytest.mark.parametrize(
    ("words", "ending", "written", "reported"),
    [
        (TRY, "SIGTERM", {"r.xml"}, "0 passed"),
        (COMPARE, "SIGINT", set(), "interrupted: nothing was written to r.md, r.gif\n"),
        (COMPARE, "SIGTERM", set(), "interrupted: nothing was written to r.md, r.gif\n"),
        (COMPARE, "SIGHUP", set(), "interrupted: nothing was written to r.md, r.gif\n"),
        (SWEEP, "SIGTERM", set(), "interrupted: nothing was written to r.html\n"),
    ],
)
def test_an_ending_leaves_no_folder_and_names_the_reports_that_are_missing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    start_kbot: Start,
    words: str,
    ending: str,
    written: set[str],
    reported: str,
) -> None:
    work, scratch = tmp_path / "work", tmp_path / "scratch"
    scratch.mkdir()
    shutil.copytree(SHIPPED_PACKAGE, work, copy_function=shutil.copyfile)
    monkeypatch.chdir(work)
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    for git in (("init", "-q"), ("add", "."), (*identity, "commit", "-qm", "a")):
        subprocess.run(["git", *git], check=True)
    robot = work / "urdf" / "kbot.xacro"
    robot.write_text(robot.read_text().replace('default="0.035"', 'default="0.03"'))
    (work / "endless.py").write_text(ENDLESS)
    (work / "e.scenario.yaml").write_text(SCENARIO)
    program = start_kbot(*words.split(), "-j", "1", env={**os.environ, "TMPDIR": str(scratch)})
    while not (work / "begun").exists():
        assert program.poll() is None, program.stderr and program.stderr.read()
        time.sleep(0.05)
    number = signal.Signals[ending]
    program.send_signal(number)
    out, errors = program.communicate(timeout=SOON)
    assert program.returncode == 128 + number, errors
    assert reported in out + errors
    assert "Traceback" not in errors
    assert {path.name for path in work.iterdir()} & REPORTS == written
    assert list(scratch.glob("*/*")) == []


def test_a_discarded_ctrl_c_is_raised_again(tmp_path: Path) -> None:
    (tmp_path / "p.py").write_text(
        "import time\n"
        "from kbot.text.signals import raise_discarded_interruptions\n"
        "raise_discarded_interruptions()\n"
        "class Discards:\n"
        "    def __del__(self): raise KeyboardInterrupt\n"
        "Discards()\n"
        "time.sleep(600)\n"
    )
    ended = subprocess.run(
        [sys.executable, tmp_path / "p.py"], stderr=subprocess.PIPE, text=True, timeout=SOON, check=False
    )
    assert ended.returncode == -signal.SIGINT
    assert "Exception ignored" not in ended.stderr


CATCHES_ALL = [
    "try: sim.run(0.05)\n        except BaseException: pass",
    "try: time.sleep(100)\n        except: continue",
    "try: pass\n        finally: continue",
]


@pytest.mark.parametrize("body", CATCHES_ALL)
def test_ctrl_c_ends_a_script_that_catches_everything(tmp_path: Path, body: str, start_kbot: Start) -> None:
    script = tmp_path / "drive.py"
    script.write_text(
        "import time\ndef drive(sim):\n    print('begun', flush=True)\n    while True:\n        " + body
    )
    program = start_kbot("sim", "kbot", "--headless", "--script", script)
    started(program, "begun")
    program.send_signal(signal.SIGINT)
    _, err = program.communicate(timeout=SOON)
    assert program.returncode == 130
    assert "interrupted at" in err
    assert "Traceback" not in err


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_recording_is_complete_after_a_script_that_catches_everything(
    tmp_path: Path, ending: signal.Signals, start_kbot: Start
) -> None:
    script, record = tmp_path / "drive.py", tmp_path / "run.mcap"
    script.write_text(
        "def drive(sim):\n    sim.run(0.1)\n    print('begun', flush=True)\n    while True:\n        "
        + CATCHES_ALL[0]
    )
    program = start_kbot("sim", "kbot", "--headless", "--script", script, "--record", record)
    started(program, "begun")
    program.send_signal(ending)
    program.communicate(timeout=SOON)
    assert program.returncode == 128 + ending
    assert Recording(str(record)).summary().broken == ""


def test_kill_ends_a_script_in_the_background_of_a_shell_script(tmp_path: Path) -> None:
    """The shell lets such a program ignore Ctrl-C."""
    (tmp_path / "drive.py").write_text(
        "def drive(sim):\n    print('begun', flush=True)\n    while True:\n        " + CATCHES_ALL[0]
    )
    command = f"trap '' INT; exec {sys.executable} -m kbot sim kbot --headless --script drive.py"
    with subprocess.Popen(["sh", "-c", command], cwd=tmp_path, stdout=subprocess.PIPE, text=True) as program:
        try:
            started(program, "begun")
            program.send_signal(signal.SIGINT)
            with pytest.raises(subprocess.TimeoutExpired):
                program.wait(1.0)
            program.send_signal(signal.SIGTERM)
            assert program.wait(SOON) == 128 + signal.SIGTERM
        finally:
            program.kill()


@pytest.mark.parametrize("words", [["--headless"], ["--no-browser", "--port", "0"]])
def test_threads_that_a_script_left_do_not_delay_the_end(
    tmp_path: Path, words: list[str], start_kbot: Start
) -> None:
    script = tmp_path / "drive.py"
    script.write_text(
        "import threading, time\ndef drive(sim):\n"
        "    threading.Thread(target=time.sleep, args=(600,)).start()\n    print('begun', flush=True)\n"
        "    while True: sim.run(0.1)\n"
    )
    program = start_kbot("sim", "kbot", "--script", script, *words)
    started(program, "begun")
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=SOON)
    assert program.returncode == (130 if "--headless" in words else 0)


def test_a_script_cannot_keep_ctrl_c_from_ending_the_run_after_it(tmp_path: Path, start_kbot: Start) -> None:
    script = tmp_path / "drive.py"
    script.write_text(
        "import signal\ndef drive(sim):\n    signal.signal(signal.SIGINT, signal.SIG_IGN)\n    sim.run(0.1)\n"
    )
    program = start_kbot("sim", "kbot", "--script", script, "--no-browser", "--port", "0")
    started(program, "finished")
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=SOON)
    assert program.returncode == 0


@pytest.mark.parametrize("verb", ["view", "sim"])
def test_a_closed_terminal_ends_a_page_quietly(verb: str, start_kbot: Start) -> None:
    program = start_kbot(verb, "kbot", "--no-browser", "--port", "0")
    started(program, "http://")
    program.send_signal(signal.SIGHUP)
    _, err = program.communicate(timeout=SOON)
    assert (program.returncode, err) == (0, "")


def test_nohup_keeps_a_run_from_ending_with_its_terminal() -> None:
    command = ["nohup", sys.executable, "-m", "kbot", "view", "kbot", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as program:
        try:
            started(program, "http://")
            program.send_signal(signal.SIGHUP)
            with pytest.raises(subprocess.TimeoutExpired):
                program.wait(1.0)
        finally:
            program.kill()
