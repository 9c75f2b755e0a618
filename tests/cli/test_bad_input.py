"""Gives wrong input to every verb: it prints one clear message without a traceback, and exits correctly."""

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

VERBS = {
    "expand": ("expand", "FILE"),
    "where": ("where", "FILE", "base_link"),
    "info": ("info", "FILE"),
    "identify": ("identify", "log.csv", "FILE"),
    "export": ("export", "FILE", "--to", "glb", "-o", "-"),
    "check": ("check", "FILE"),
    "view": ("view", "FILE", "--no-browser"),
    "sim": ("sim", "FILE", "--no-browser"),
    "sim headless": ("sim", "FILE", "--headless", "--duration", "0.1"),
    "launch": ("launch", "FILE", "--no-browser"),
}

TEXTS = {
    "data.yaml": "wheels: [left, right]\n",
    "empty.xacro": "",
    "blank.xacro": " \n\n",
    "words.xacro": "this is no robot\n",
    "truncated.xacro": '<robot name="r">\n  <link name="a">\n    <visual><geom',
    "unclosed.xacro": '<robot name="r">\n  <link name="a">\n</robot>\n',
    "html.xml": "<html><body/></html>\n",
}

NOT_REFUSED = {("expand", "html.xml"), ("where", "html.xml")}
"""xacro expands whatever XML it is given."""

SHOWN_WITH_ERRORS = {"empty.xacro", "blank.xacro", "words.xacro", "truncated.xacro", "unclosed.xacro"}
"""Files that may become a robot: their page opens and shows the errors. See test_view.py."""

BOX = """<robot name="box"><link name="base_link">
  <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  <visual><geometry>{geometry}</geometry></visual>
  <collision><geometry>{geometry}</geometry></collision>
</link></robot>
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with files that are not robots. Its name is longer than a terminal's line."""
    folder = tmp_path_factory.mktemp("a_folder_with_a_very_long_name_" * 4)
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    (folder / "image.png").write_bytes(png())
    (folder / "latin1.xacro").write_bytes('<robot name="Räder"/>'.encode("latin-1"))
    (folder / "utf16.xacro").write_bytes('<robot name="r"/>'.encode("utf-16")[:-1])
    (folder / "folder.xacro").mkdir()
    (folder / "box.urdf").write_text(BOX.format(geometry='<box size="0.2 0.2 0.2"/>'))
    (folder / "misssing.stl").write_text("another\n")
    (folder / "mesh.urdf").write_text(BOX.format(geometry='<mesh filename="missing.stl"/>'))
    return folder


def png() -> bytes:
    """A picture with one pixel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(4))) + chunk(b"IEND", b"")


def assert_one_clear_message(done: Any, *parts: str) -> None:
    output = done.out + done.err
    lines = output.splitlines()
    assert "Traceback" not in output, output
    assert sum("error: " in line for line in lines) == 1, output
    assert len(lines) <= 8, output
    assert "\x1b" not in output
    first = next(line for line in lines if "error: " in line)
    assert all(part in first for part in parts), output


@pytest.mark.parametrize("verb", VERBS)
def test_a_file_that_is_not_a_robot_is_rejected_with_one_message(
    verb: str, files: Path, run_kbot: Callable[..., Any]
) -> None:
    names = [*TEXTS, "missing.xacro", "image.png", "latin1.xacro", "utf16.xacro", "folder.xacro"]
    names = [name for name in names if (verb, name) not in NOT_REFUSED]
    if verb in ("view", "sim"):
        names = [name for name in names if name not in SHOWN_WITH_ERRORS]
    for name in names:
        words = [str(files / name) if word == "FILE" else word for word in VERBS[verb]]
        done = run_kbot(*words, cwd=files)
        if name == "truncated.xacro":  # `python -m kbot` prints the same and exits with the same status
            command = [sys.executable, "-m", "kbot", *words]
            alone = subprocess.run(command, cwd=files, capture_output=True, encoding="utf-8", timeout=60)
            assert (alone.returncode, alone.stdout, alone.stderr) == (done.status, done.out, done.err)
        assert_one_clear_message(done, name)
        # for `check`, a robot with an error is a finding
        finding = verb == "check" and name == "html.xml"
        assert done.status == (1 if finding else 2), (name, done)
        if verb != "check":
            assert done.out == ""


@pytest.mark.parametrize("verb", ["expand", "info", "check", "view", "sim", "launch"])
def test_one_equals_sign_instead_of_colon_and_equals_sign(
    verb: str, files: Path, run_kbot: Callable[..., Any]
) -> None:
    done = run_kbot(verb, "kbot", "wheel_radius=0.04", cwd=files)
    assert done.status == 2
    assert_one_clear_message(done, "wheel_radius:=0.04")


@pytest.mark.parametrize("verb", ["expand", "info", "check", "view", "sim", "launch"])
def test_no_file(verb: str, files: Path, run_kbot: Callable[..., Any]) -> None:
    done = run_kbot(verb, cwd=files)
    assert done.status == 2
    assert_one_clear_message(done)


@pytest.mark.parametrize("verb", ["view", "sim"])
def test_a_port_in_use(verb: str, files: Path, run_kbot: Callable[..., Any]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = run_kbot(verb, "kbot", "--no-browser", "--port", port, cwd=files)
    assert done.status == 2
    assert_one_clear_message(done, port, "in use")


@pytest.mark.parametrize(
    "value", ["nan,0", "0,inf", "-inf,0", "1", "1,2,3,4", "a,b", "", "\uff11,0", "1_0,0"]
)
def test_commands_that_are_not_two_or_three_finite_numbers(
    value: str, files: Path, run_kbot: Callable[..., Any]
) -> None:
    done = run_kbot("sim", "kbot", "--headless", f"--cmd-vel={value}", cwd=files)
    assert done.status == 2
    assert_one_clear_message(done, "--cmd-vel")


@pytest.mark.parametrize(
    "words",
    [
        ("sim", "kbot", "--headless", "--duration", "nan"),
        ("sim", "kbot", "--headless", "--duration=-1"),
        ("sim", "kbot", "--headless", "--duration", "soon"),
        ("sim", "kbot", "--headless", "--world", "boxs"),
        ("sim", "kbot", "--duration", "1"),
        ("view", "kbot", "--port", "70000"),
        ("view", "kbot", "--host", "no.such.host.invalid", "--no-browser"),
        ("expand", "kbot", "-o", "folder.xacro"),
        ("expand", "kbot", "--package-path", "no_such_folder"),
        ("info", "kbot", "kbot"),
        ("launch", "no_such_package", "a.launch"),
        ("launch", "kbot_description", "kbot_bas_rviz.launch"),
        ("launch", "missing.launch.py"),
        ("launch", "missing.launch.py", "--trust"),
        ("where", "kbot"),
        ("where", "kbot", "no_such_link"),
        ("sim", "kbot", "--headless", "--record", "no/such/folder/a.mcap"),
        ("bag", "info", "missing.mcap"),
        ("bag", "info", "image.png"),
        ("bag", "info", "folder.xacro"),
        ("bag", "play", "missing.mcap"),
        ("bag", "export", "missing.mcap", "--topic", "/odom"),
        ("topic", "list", "--at", "1"),
        ("node", "info", "/kbot", "--at", "1"),
        ("service", "call", "/gazebo/pause_physics", "--at", "1"),
        ("param", "load", "missing.yaml"),
        ("tf", "tree", "--at", "1"),
        ("rule", "X999"),
        ("chekc", "kbot"),
    ],
    ids=" ".join,
)
def test_impossible_arguments_are_rejected(
    words: tuple[str, ...], files: Path, run_kbot: Callable[..., Any]
) -> None:
    done = run_kbot(*words, cwd=files)
    assert done.status == 2
    assert done.out == ""
    assert_one_clear_message(done)


def test_a_missing_mesh_is_reported_and_the_robot_is_used(files: Path, run_kbot: Callable[..., Any]) -> None:
    robot = str(files / "mesh.urdf")
    checked = run_kbot("check", robot, cwd=files)
    assert checked.status == 1
    assert "missing.stl" in checked.out
    warning = (
        "mesh.urdf:3:21: warning: base_link: the visual's mesh missing.stl does not exist (2 places) [G101]"
    )
    informed = run_kbot("info", robot, cwd=files)
    assert informed.status == 0
    assert warning in informed.err
    assert "did you mean 'misssing.stl'?" in informed.err
    assert informed.out.startswith("box: 1 link")
    simulated = run_kbot("sim", robot, "--headless", "--duration", "0.1", cwd=files)
    assert simulated.status == 0
    assert warning in simulated.err
    assert "Traceback" not in simulated.err


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
@pytest.mark.parametrize("verb", ["view", "sim"])
def test_a_missing_mesh_is_reported_when_the_robot_is_shown(
    verb: str, files: Path, start_kbot: Callable[..., subprocess.Popen[str]]
) -> None:
    process = start_kbot(verb, files / "mesh.urdf", "--no-browser", "--port", "0")
    assert process.stdout is not None
    assert "http://127.0.0.1:" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert "mesh.urdf:3:21: warning: base_link: the visual's mesh missing.stl does not exist" in err


def test_non_positive_sizes_are_reported_besides_the_figures(
    files: Path, run_kbot: Callable[..., Any]
) -> None:
    done = run_kbot("info", "kbot", "wheel_radius:=-1", cwd=files)
    assert done.status == 1
    assert "kbot.xacro" in done.err
    assert "[G107]" in done.err
    assert "radius -1" in done.err
    assert run_kbot("info", "kbot", cwd=files).err == ""


@pytest.mark.parametrize(("radius", "code"), [("9e8", "W113"), ("1e30", "U012")])
def test_far_too_large_sizes_are_not_simulated(
    files: Path, radius: str, code: str, run_kbot: Callable[..., Any]
) -> None:
    done = run_kbot("sim", "kbot", f"wheel_radius:={radius}", "--headless", cwd=files)
    assert done.status == 2
    assert f"[{code}]" in done.err


def test_a_robot_without_wheels_is_simulated_with_the_reason_why_it_cannot_drive(
    files: Path, run_kbot: Callable[..., Any]
) -> None:
    robot = str(files / "box.urdf")
    assert run_kbot("sim", robot, "--headless", "--duration", "0.1", cwd=files).status == 0
    done = run_kbot("sim", robot, "--headless", "--cmd-vel", "0.2,0", cwd=files)
    assert done.status == 2
    assert_one_clear_message(done, "cannot drive")


@pytest.mark.skipif(os.name == "nt", reason="a shell of POSIX is called")
@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("check box.urdf >&-", 0),
        ("check mesh.urdf >&- 2>&-", 1),
        ("expand box.urdf >&-", 0),
        ("info gone.urdf 2>&-", 2),
        ("info box.urdf <&- >&-", 0),
    ],
)
def test_closed_streams(words: str, status: int, files: Path) -> None:
    done = subprocess.run(
        ["/bin/sh", "-c", f"'{sys.executable}' -m kbot {words}"],
        cwd=files,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == status, done
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
@pytest.mark.parametrize(
    "interrupt",
    [
        "raise KeyboardInterrupt",
        "raise ImportError('initialization failed') from KeyboardInterrupt()",  # as pybind11 does
    ],
)
def test_ctrl_c_while_modules_are_imported(interrupt: str, files: Path) -> None:
    interrupted = (
        "import builtins, sys\n"
        "from kbot.cli.start import main\n"
        "whole = builtins.__import__\n"
        "def interrupting(name, *rest, **more):\n"
        f"    if name == 'click': {interrupt}\n"
        "    return whole(name, *rest, **more)\n"
        "builtins.__import__ = interrupting\n"
        "sys.argv = ['kbot', 'info', 'box.urdf']\n"
        "main()\n"
    )
    command = [sys.executable, "-c", interrupted]
    done = subprocess.run(command, cwd=files, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
def test_ctrl_c_in_a_run_without_a_page_reports_what_was_simulated(
    files: Path, run_kbot: Callable[..., Any]
) -> None:
    (files / "drive.py").write_text(
        "import os, signal\n"
        "def drive(sim):\n"
        "    sim.cmd_vel(0.2, 0.0)\n"
        "    sim.run(2.0)\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    sim.run(1e6)\n"
    )
    words = ("--headless", "--script", "drive.py", "--json", "--plot", "way.png")
    done = run_kbot("sim", "kbot", *words, cwd=files)
    assert done.status == 130
    assert 2.0 <= json.loads(done.out)["simulated_s"] < 1e6
    assert "interrupted at" in done.err
    assert "Traceback" not in done.err
    assert (files / "way.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
@pytest.mark.parametrize("verb", ["view", "sim"])
def test_ctrl_c_ends_a_served_page_quietly(
    verb: str, files: Path, start_kbot: Callable[..., subprocess.Popen[str]]
) -> None:
    process = start_kbot(verb, files / "box.urdf", "--no-browser", "--port", "0")
    assert process.stdout is not None
    line = process.stdout.readline()
    assert "http://127.0.0.1:" in line
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "Traceback" not in out + err
