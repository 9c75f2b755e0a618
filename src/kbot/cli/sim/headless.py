"""Headless runs of `kbot sim`: drive by a constant command or a script, then print a report."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from types import TracebackType
from typing import TYPE_CHECKING, TextIO

import click

from kbot.cli.output import print_json, report
from kbot.cli.progress import PATIENCE
from kbot.cli.sim.still_time import still_time_reported
from kbot.text.errors import Stopped
from kbot.text.files import write_bytes
from kbot.text.signals import INTERRUPTED
from kbot.text.terminal import for_progress

if TYPE_CHECKING:
    from kbot.sim import Simulation
    from kbot.sim.script import Script


INTERVAL = 0.2
"""Seconds between two updates of the progress line."""


class ProgressLine:
    """Shows simulated time and speed on stderr within the block. `wall` is the duration of the block."""

    def __init__(self, simulation: Simulation, seconds: float | None) -> None:
        """`seconds`: the duration of the run, None if it is unknown."""
        self._simulation, self._seconds = simulation, seconds
        self.wall = 0.0
        self._shown = False

    def __enter__(self) -> ProgressLine:
        self._begin = self._last = time.perf_counter()
        self._before = self._simulation.time
        self._timer = None
        if sys.stderr.isatty():
            self._timer = self._simulation.clock.every(10.0, self._look)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.wall = time.perf_counter() - self._begin
        if self._timer is not None:
            self._timer.cancel()
        if self._shown:
            for_progress(sys.stderr).write("\r\x1b[K")

    def _look(self) -> None:
        now = time.perf_counter()
        if now - self._begin < PATIENCE or now - self._last < INTERVAL:
            return
        self._last, self._shown = now, True
        done = self._simulation.time - self._before
        rate = done / (now - self._begin)
        share = f" {100 * done / self._seconds:3.0f} %" if self._seconds else ""
        terminal = for_progress(sys.stderr)
        terminal.write(f"\r\x1b[K{done:10.1f} s simulated{share}   {rate:.0f} times real time")
        terminal.flush()


class _Program:
    """A program without a page. A signal ends it."""

    def __init__(self) -> None:
        self.is_stopping = False
        self.interrupt: Callable[[], None] = lambda: None

    def stop(self) -> None:
        self.is_stopping = True
        self.interrupt()


def _run_script(
    script: Script,
    simulation: Simulation,
    stdout: TextIO | None,
    raise_error: Callable[[BaseException], None],
) -> bool:
    """Run a script. Returns whether Ctrl-C ended it.

    Raises:
        KbotError: the script failed.
        SystemExit: `kill` or a closed terminal ended it.
    """
    from kbot.sim.interruption import Interruption

    program = _Program()
    with Interruption(program, raise_error, patience=0.0) as interruption:
        try:
            script.run(simulation, stdout)
        except Stopped:
            pass
        finally:
            program.is_stopping = False
            interruption.stop_tracing()
    if interruption.ended_by not in (None, signal.SIGINT):
        raise SystemExit(128 + interruption.ended_by)
    return interruption.is_over


def run_headless(
    simulation: Simulation,
    seconds: float | None,
    script: str | None,
    as_json: bool,
    plot: str | None,
    in_real_time: bool,
    raise_error: Callable[[BaseException], None],
) -> int:
    """Run, print the report, and return the exit status.

    `seconds` None: run until Ctrl-C. `raise_error` raises an error where it does no harm to a recording.
    """
    from kbot.sim.report import Odometer, make_report
    from kbot.sim.script import Script
    from kbot.sim.script_errors import ScriptFailed

    program = None if script is None else Script(script)
    odometer = Odometer(simulation, keeps=plot is not None)
    failed: ScriptFailed | None = None
    interrupted = False
    with (
        ProgressLine(simulation, seconds if program is None else None) as progress,
        nullcontext() if program is None else still_time_reported(simulation, program.code),
    ):
        try:
            if in_real_time or seconds is None:
                from kbot.sim.real_time import run_in_real_time

                run_in_real_time(simulation, seconds)
            elif program is None:
                simulation.run(seconds)
            else:
                # with --json, stdout is one JSON object
                interrupted = _run_script(program, simulation, sys.stderr if as_json else None, raise_error)
        except ScriptFailed as failure:
            failed = failure
        except KeyboardInterrupt:  # the report covers the time until then
            interrupted = True
    odometer.close()
    result = make_report(simulation, odometer.distance, progress.wall)
    report(result.findings)
    if as_json:
        print_json({**result.to_json(), **({"failure": failed.to_json()} if failed else {})})
    else:
        click.echo(result.to_text())
    if failed is not None:
        sys.stderr.write(f"{failed}\n")
    elif program is not None and not (interrupted or simulation.stepping.was_called):
        sys.stderr.write(f"{program.code.made_no_step}\n")
    if interrupted:
        click.echo(f"interrupted at {simulation.time:.3f} s", err=True)
    if plot is not None:  # after the report, which is printed even if the picture cannot be written
        from kbot.render.path_plot import draw

        believed = [simulation.start @ pose for pose in odometer.odometry]
        title = f"{simulation.robot.name} in {simulation.world.name}, {simulation.time:.2f} s from above"
        write_bytes(plot, draw(odometer.truth, believed, simulation.world, title))
    if interrupted:
        return INTERRUPTED
    return 1 if failed is not None or (program is not None and program.has_failed_thread) else 0
