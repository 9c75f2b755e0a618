"""`kbot sim --script` with the page, without a browser: start, stop, save, errors and Ctrl-C."""

import json
import time
from pathlib import Path

import pytest

from kbot.cli.main import run as run_kbot
from kbot.record import Recording

from .conftest import until
from .scripted import needs_signals, running, scripted, watching

pytestmark = needs_signals

WAY = """
def drive(sim):
    sim.cmd_vel(0.2, 0.4)
    sim.run(0.35)
    sim.cmd_vel(0.3, -0.2)
    sim.step(77)
    print("end", sim.steps, sim.state_sha256())
"""


def script(folder: Path, text: str) -> Path:
    path = folder / "drive.py"
    path.write_text(text)
    return path


def test_the_page_and_a_headless_run_end_in_the_same_state(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = script(tmp_path, WAY)
    assert run_kbot(["sim", "kbot", "--headless", "--script", str(path), "--json"]) == 0
    out, err = capfd.readouterr()
    sha = json.loads(out)["state_sha256"]  # the print is not in it
    assert f"end 252 {sha}" in err
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: page.phase == "finished")
        assert run.printed(f"end 252 {sha}")
        page.send("set_speed", factor=10.0)
        page.send("run_program")
        until(lambda: "".join(run.out).count(sha) == 2)
        assert run.printed("drive.py finished at 0.50 s")
        assert run.interrupt() == 0
    assert run.err == []


@pytest.mark.parametrize(
    "loop",
    [
        "while True: pass",
        "while True: sim.run(0.1)",
        "import time; time.sleep(1e6)",
        "while True:\n        try: sim.run(0.1)\n        except: pass",
    ],
)
def test_an_endless_loop_is_stopped_by_a_page_and_by_ctrl_c(tmp_path: Path, loop: str) -> None:
    path = script(tmp_path, f"def drive(sim):\n    sim.run(0.1)\n    print('ready')\n    {loop}\n")
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: run.printed("ready"))
        page.send("stop")
        until(lambda: page.phase == "stopped")
        until(lambda: page.newest["state"]["paused"])
        page.send("run_program")
        until(lambda: "".join(run.out).count("ready") == 2)
        assert run.interrupt() == 0
    assert run.err == []


@pytest.mark.parametrize("before", ["sim.run(0.1)", "pass"])
def test_a_program_that_computes_is_reported_and_a_new_page_still_gets_the_scene(
    tmp_path: Path, before: str
) -> None:
    path = script(tmp_path, f"def drive(sim):\n    {before}\n    print('ready')\n    while True: pass\n")
    with scripted(path) as run:
        until(lambda: run.printed("ready"))
        began = time.monotonic()
        with watching(run.url) as page:
            until(lambda: page.newest.get("program", {}).get("note"))
            assert page.newest["scene"]["robot"] == "kbot"
            assert page.newest["state"]["poses"]
            until(lambda: "sim.run for 2 s" in page.newest["program"]["note"])
            assert time.monotonic() - began > 1.5
            assert page.newest["program"]["note"] == (
                "drive.py:4 is running, but has not called sim.run for 2 s: simulated time stands still"
            )
            page.send("reset")  # waits for a step, which never comes
            page.send("stop")
            until(lambda: page.phase == "stopped")
            assert run.interrupt() == 0


def test_a_program_that_runs_for_0_steps_is_reported(tmp_path: Path) -> None:
    path = script(tmp_path, "def drive(sim):\n    sim.run(0.1)\n    while True:\n        sim.step(0)\n")
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: "still for 2 s" in page.newest.get("program", {}).get("note", ""))
        assert page.newest["program"]["note"] == (
            "drive.py:4 calls sim.run for 0 steps: simulated time has stood still for 2 s"
        )
        page.send("stop")
        until(lambda: page.phase == "stopped")
        assert run.interrupt() == 0


def test_a_program_that_makes_single_steps_is_not_reported_as_still(tmp_path: Path) -> None:
    text = "import time\ndef drive(sim):\n    for _ in range(4): time.sleep(0.4), sim.step()\n"
    with scripted(script(tmp_path, text)) as run, watching(run.url) as page:
        notes = set[str]()
        until(lambda: notes.add(page.newest.get("program", {}).get("note", "")) or page.phase == "finished")
        assert notes == {""}
        assert run.interrupt() == 0


def test_a_program_that_never_steps_is_reported_at_its_end(tmp_path: Path) -> None:
    line = "drive.py ended at 0 s: it never called sim.run(seconds), so no time passed"
    path = script(tmp_path, "def drive(sim):\n    sim.cmd_vel(0.3, 0)\n")
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: page.phase == "finished")
        assert page.newest["program"]["note"] == line
        until(lambda: run.printed(f"{line}. Save it to start it again."))
        assert run.interrupt() == 0


def test_a_saved_script_or_module_starts_again_on_a_new_simulation(tmp_path: Path) -> None:
    helper = tmp_path / "helper.py"
    helper.write_text("NAME = 'first'\n")
    path = script(
        tmp_path,
        "import helper\ndef drive(sim):\n    print(helper.NAME, sim.steps)\n    while True: sim.run(0.1)\n",
    )
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: run.printed("first 0") and page.time > 0.2)
        helper.write_text("NAME = 'other'\n")
        until(lambda: run.printed("drive.py starts again.") and run.printed("other 0"))
        path.write_text("def drive(sim):\n    print('third', sim.steps)\n")
        until(lambda: run.printed("third 0") and page.phase == "finished")
        path.write_text("def drive(sim):\n    print('fourth', sim.steps)\n    sim.run(0.1)\n")
        until(lambda: run.printed("fourth 0") and page.phase == "finished")
        assert run.interrupt() == 0


def test_a_deleted_or_unreadable_script_is_reported_once_and_starts_when_it_is_saved(tmp_path: Path) -> None:
    text = "def drive(sim):\n    print('drives', sim.steps)\n    while True: sim.run(0.1)\n"
    path = script(tmp_path, text)
    with scripted(path) as run, watching(run.url) as page:
        assert run.printed("drive.py drives the robot, and starts again when you save it.  Ctrl-C")
        until(lambda: page.time > 0.1)
        path.unlink()
        until(lambda: page.phase == "failed" and run.err)
        assert page.newest["program"]["error"] == "drive.py was deleted or renamed"
        until(lambda: page.newest["state"]["paused"])
        path.write_bytes(b"\n# f\xfcr\n")
        until(lambda: len(run.err) == 2)
        assert run.err == [
            "error: drive.py was deleted or renamed\n",
            "error: drive.py is not UTF-8 text: byte 0xfc in line 2, at offset 4 (save it as UTF-8)\n",
        ]
        assert not run.printed("starts again.")
        path.write_text(text)
        until(lambda: "".join(run.out).count("drives 0") == 2 and page.phase == "running")
        until(lambda: not page.newest["state"]["paused"])
        assert run.interrupt() == 0


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("def drive(sim:\n    pass\n", "drive.py:1: not valid Python: '(' was never closed"),
        ("def drve(sim):\n    pass\n", "drive.py:1: the script has no function drive(sim) (did you mean"),
        ("def drive(sim):\n    sim.run(0.1)\n    1 / 0\n", "drive.py:3: ZeroDivisionError: division by zero"),
        (
            "def drive(sim):\n    x = 2\n    sim.run(0.1)\n    assert x > 3\n",
            "drive.py:4: assertion failed at 0.100 s: x > 3\n    x = 2",
        ),
        ("def drive(sim):\n    sim.cmd_vel('fast', 0)\n", "drive.py:2: "),
        ("import sys\ndef drive(sim):\n    sys.exit(3)\n", "drive.py:3: drive.py ended with sys.exit(3)"),
        ("def drive(sim):\n    raise SystemExit('too late')\n", "drive.py ended with sys.exit('too late')"),
    ],
)
def test_errors_are_reported_in_terminal_and_page_and_the_next_save_runs(
    tmp_path: Path, text: str, error: str
) -> None:
    path = script(tmp_path, text)
    with scripted(path) as run, watching(run.url) as page:
        until(lambda: page.phase == "failed")
        assert error in page.newest["program"]["error"]
        until(lambda: run.reported(error))
        path.write_text("def drive(sim):\n    sim.run(0.05)\n    print('fixed')\n")
        until(lambda: run.printed("fixed") and page.phase == "finished")
        assert page.newest["program"]["error"] == ""
        assert run.interrupt() == 0
    assert "Traceback" not in "".join(run.err)


def test_the_page_pauses_steps_and_resets_between_two_slices(tmp_path: Path) -> None:
    path = script(
        tmp_path,
        "def drive(sim):\n    print('run', sim.steps, sim.world.name)\n    while True: sim.run(100.0)\n",
    )
    with scripted(path, "--world", "empty") as run, watching(run.url) as page:
        until(lambda: page.time > 0.1)
        page.send("pause", paused=True)
        until(lambda: page.newest["state"]["paused"])
        before = page.time
        page.send("advance", seconds=0.1)
        until(lambda: page.time >= before + 0.1 - 1e-6)
        assert page.time <= before + 0.13  # the slice that had begun, and the last one
        page.send("pause", paused=False)
        page.send("drive", linear=0.2, angular=0.0)
        until(lambda: page.refused)
        assert page.refused == ["drive.py drives the robot. Press Space to stop it first"]
        page.send("reset")
        until(lambda: "".join(run.out).count("run 0 empty") == 2)
        page.send("set_world", world="boxes:count=3", seed=1)
        until(lambda: run.printed("run 0 boxes"))
        assert run.interrupt() == 0


def test_a_saved_description_starts_the_script_again_with_the_new_robot(tmp_path: Path) -> None:
    robot = tmp_path / "r.urdf"
    text = '<robot name="{}"><link name="base"/></robot>'
    robot.write_text(text.format("first"))
    path = script(
        tmp_path,
        "def drive(sim):\n    print('drives', sim.robot.name, sim.steps)\n    while True: sim.run(0.1)\n",
    )
    command = ("-m", "kbot", "sim", "r.urdf", "--script", path.name, "--no-browser", "--port", "0")
    with running(*command, cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: run.printed("drives first 0") and page.time > 0.1)
        robot.write_text(text.format("second"))
        until(lambda: run.printed("drives second 0"))
        assert run.interrupt() == 0


def test_each_run_is_recorded(tmp_path: Path) -> None:
    path = script(tmp_path, "def drive(sim):\n    sim.plot('a', 1.5)\n    sim.run(0.1)\n    print('hello')\n")
    with scripted(path, "--record", "run.mcap") as run, watching(run.url) as page:
        until(lambda: page.phase == "finished")
        page.send("run_program")
        until(lambda: "".join(run.out).count("finished") == 2)
        assert run.interrupt() == 0
    for name in ("run.mcap", "run-2.mcap"):
        topics = {entry.topic for entry in Recording(str(tmp_path / name)).entries()}
        assert {"/plot/a", "/log"} <= topics
