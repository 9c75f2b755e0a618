"""Text of strangers cannot control the terminal."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kbot.sim.printed_lines import PrintStream
from kbot.text.terminal import TerminalStream, for_progress


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("\x1b[2J\x9b2J\x07", "\\x1b[2J\\x9b2J\\x07"),  # ECMA-48: ESC [ and 0x9b both begin a sequence
        ("\x1b]0;title\x07", "\\x1b]0;title\\x07"),
        ("\u202egnp.exe\u2066", "\\u202egnp.exe\\u2066"),
        (
            "\x1b[1;31merror:\x1b[0m \x1b[34m|\x1b[0m\tÄ 中 👩\u200d🔧\r\n",
            "\x1b[1;31merror:\x1b[0m \x1b[34m|\x1b[0m\tÄ 中 👩\u200d🔧\r\n",
        ),
        # a name that would overwrite its own line or the one above, and a concealed one
        ("a\r\x1b[Kb\x1b[1A\x1b[2K\x1b[8m", "a\\r\\x1b[Kb\\x1b[1A\\x1b[2K\\x1b[8m"),
    ],
)
def test_only_colors_reach_the_terminal(text: str, written: str) -> None:
    plain = io.StringIO()
    stream = TerminalStream(plain)
    assert stream.write(text) == len(text)
    stream.writelines([text])
    assert plain.getvalue() == written * 2


def test_a_progress_line_may_move_the_cursor() -> None:
    plain = io.StringIO()
    for_progress(TerminalStream(plain)).write("\r\x1b[2K\x1b[1A\x1b[?25l\x9b2J")  # type: ignore[arg-type]
    assert plain.getvalue() == "\r\x1b[2K\x1b[1A\x1b[?25l\\x9b2J"
    assert for_progress(plain) is plain


def test_the_users_program_may_control_the_terminal() -> None:
    plain = io.StringIO()

    class Lines:
        def add(self, line: str) -> None: ...

    PrintStream(TerminalStream(plain), Lines()).write("\x1b[2J\n")  # type: ignore[arg-type]
    assert plain.getvalue() == "\x1b[2J\n"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_every_verb_filters_what_it_prints_to_a_terminal(tmp_path: Path) -> None:
    name = "\x9b2J"
    (tmp_path / "robot.urdf").write_text(f'<robot name="r"><link name="{name}"/></robot>', encoding="utf-8")
    (tmp_path / "a.launch").write_text(
        f'<launch><node pkg="p" type="t" name="{name}"/></launch>', encoding="utf-8"
    )
    for words in (["info", "robot.urdf"], ["launch", "a.launch", "--nodes"], ["expand", "robot.urdf"]):
        ours, theirs = os.openpty()
        command = [sys.executable, "-m", "kbot", *words]
        with subprocess.Popen(command, cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs) as process:
            os.close(theirs)
            printed = b""
            while process.poll() is None or printed == b"":
                try:
                    printed += os.read(ours, 1 << 16)
                except OSError:  # EIO: the program has ended
                    break
        os.close(ours)
        assert process.returncode in (0, 1), words
        assert "\\x9b2J" in printed.decode(), words
        assert name not in printed.decode(), words
