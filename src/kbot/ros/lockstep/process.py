"""The process of a program in a trial, and the errors about its exit."""

from __future__ import annotations

import os
import re
import signal
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from subprocess import TimeoutExpired

from kbot.extensions import ProgramFailed, TrialProgram
from kbot.ros.lockstep.channel import VARIABLE
from kbot.ros.lockstep.follower import DUMP_SIGNAL
from kbot.sim.user_code import UserCode, shown_path
from kbot.text.temporary import TemporaryFolder
from kbot.worker import children

END_SECONDS = 2.0
"""Seconds that a program has to exit at the end of a run. Then it is killed."""
DUMP_SECONDS = 0.5
"""Seconds to wait for the traceback of a program that hangs."""
READ_BYTES = 1 << 16
"""Bytes at the end of a program's errors that are read."""
_FRAME = re.compile(r'^ *File "(?P<file>.+)", line (?P<line>\d+)')
_ERROR = re.compile(r"^(?P<name>[A-Za-z_][\w.]*)(?:: (?P<text>.*))?$")
_UNUSED = ("KBOT_AT", VARIABLE, "ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE", "ROS_DOMAIN_ID")
"""Variables that would connect the program to something else."""


class ProgramProcess:
    """A running program. What it writes to stderr is kept, to explain its errors."""

    def __init__(self, program: TrialProgram, environment: Mapping[str, str]) -> None:
        """Raises ProgramFailed: it cannot be started."""
        self.program = program
        self._code = UserCode(program.file)
        is_python = program.file.endswith(".py")
        command = [sys.executable, program.file] if is_python else [program.file]
        kept = {name: value for name, value in os.environ.items() if name not in _UNUSED}
        # a set of texts has the same order in each run only with a fixed seed of hashes
        kept |= {"PYTHONHASHSEED": "0", "PYTHONUNBUFFERED": "1"}
        self._folder = TemporaryFolder("program")
        self._errors = self._folder.path / "errors"
        try:
            with self._errors.open("wb") as errors:
                self._process = children.start(
                    [*command, *program.arguments],
                    environment={**kept, **environment},
                    stderr=errors,
                )
        except OSError as error:
            self._folder.remove()
            raise ProgramFailed(f"{program.file} cannot be started: {error.strerror or error}") from None

    @property
    def has_exited(self) -> bool:
        return self._process.poll() is not None

    def exit_status(self, seconds: float) -> int | None:
        """Wait at most some seconds until it exits. None if it still runs."""
        try:
            return self._process.wait(seconds)
        except TimeoutExpired:
            return None

    def failure(self, when: str) -> ProgramFailed:
        """The error about a program that has exited, with the place in the user's code."""
        status = self._process.wait()
        how = f"exited with status {status}"
        if status < 0:
            with suppress(ValueError):
                how = f"was ended by {signal.Signals(-status).name}"
        place, reason = self._explanation()
        detail = f": {reason}" if reason else ""
        return ProgramFailed(f"{place}{self._name(place)} {how} {when}{detail}")

    def timeout(self, what: str) -> ProgramFailed:
        """The error about a program that does not answer, with the line that it runs, and its end."""
        place = ""
        if DUMP_SIGNAL is not None and not self.has_exited:
            before = len(self._read_errors())
            self._process.send_signal(DUMP_SIGNAL)
            end = time.monotonic() + DUMP_SECONDS
            while not place and time.monotonic() < end and not self.has_exited:
                time.sleep(0.02)
                # the innermost call comes first
                place = self._place(self._read_errors()[before:].splitlines(), innermost=0)
        return ProgramFailed(f"{place}{self._name(place)} {what}")

    def _name(self, place: str) -> str:
        """The program's name in an error, with its folder unless the error begins with a place."""
        return self._code.name if place else shown_path(self.program.file)

    def close(self) -> None:
        """End it, and the processes that it started. One in lockstep knows that the run is over."""
        if not self.program.lockstep:
            self._process.terminate()
        self.exit_status(END_SECONDS)
        self._process.end()
        self._folder.remove()

    def _read_errors(self) -> str:
        return self._errors.read_bytes()[-READ_BYTES:].decode(errors="replace")

    def _explanation(self) -> tuple[str, str]:
        """The place of the error in the user's code as `FILE:LINE: `, and the error in one line."""
        lines = self._read_errors().rstrip().splitlines()
        if not lines:
            return "", ""
        starts = [i for i, line in enumerate(lines) if line.startswith("Traceback (most recent call last)")]
        if not starts and not lines[-1].startswith("SyntaxError"):  # one of the file itself has no traceback
            return "", lines[-1].strip()
        trace = lines[starts[-1] + 1 :] if starts else lines
        errors = [found for line in trace if not line.startswith(" ") and (found := _ERROR.match(line))]
        if not errors:
            return self._place(trace, innermost=-1), lines[-1].strip()
        name, text = errors[0]["name"].rpartition(".")[2], errors[0]["text"] or ""
        reason = text if name == "KbotError" else f"{name}: {text}".removesuffix(": ")
        return self._place(trace, innermost=-1), reason

    def _place(self, lines: list[str], innermost: int) -> str:
        """The innermost line of the user's code in a traceback, as `FILE:LINE: `; empty without one."""
        frames = [found for line in lines if (found := _FRAME.match(line)) and self._code.has(found["file"])]
        return f"{shown_path(frames[innermost]['file'])}:{frames[innermost]['line']}: " if frames else ""
