"""Run a script on the main thread while the page shows it, again after each save."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from kbot.sim import Simulation
from kbot.sim.interruption import Interruption
from kbot.sim.script import Script
from kbot.text import KbotError
from kbot.text.errors import Stopped
from kbot.workbench.address import Address
from kbot.workbench.driving.driving import Driving
from kbot.workbench.driving.program import Program
from kbot.workbench.driving.turns import WAITING_SECONDS
from kbot.workbench.protocol import ProgramPhase
from kbot.workbench.serve import print_at_once, served_at
from kbot.workbench.session.session import Session


def serve_script(
    session: Session, script: Script, address: Address, raise_error: Callable[[BaseException], None]
) -> None:
    """Serve a simulated session until Ctrl-C, and let a script drive it.

    The script starts again, on a new simulation, when it is saved or a page asks for it. `raise_error` raises
    an error where it does no harm, as `RunOutputs.interrupt`.
    """
    _ScriptLoop(session, script, raise_error).serve(address)


class _ScriptLoop:
    def __init__(
        self, session: Session, script: Script, raise_error: Callable[[BaseException], None]
    ) -> None:
        self._session, self._script = session, script
        self._program = Program(script.code, session.turns, session, can_start=True)
        self._program.files = lambda: script.files
        session.program = self._program
        self._interruption = Interruption(self._program, raise_error)
        self._used: object = None
        """The run that the script has used."""

    def serve(self, address: Address) -> None:
        session, program = self._session, self._program
        session.turns.take()
        with self._interruption, served_at(session, address):
            try:
                name = session.scene.robot or session.shown.file
                print_at_once(f"{name} is at  {address.url}\n{self._welcome()}\n")
                self._run()
                while not self._interruption.is_over:
                    if program.wants_start:
                        self._run_again()
                    else:
                        session.turns.lend(WAITING_SECONDS)
                print_at_once("\n")
            finally:
                session.turns.leave()  # the server needs it to end

    def _welcome(self) -> str:
        start = "starts when the page opens" if self._session.waits_for_page else "drives the robot"
        again = "and starts again when you save it"
        return f"{self._program.name} {start}, {again}.  Ctrl-C here stops KBot."

    def _run_again(self) -> None:
        program = self._program
        try:
            self._script.read()
        except KbotError as error:
            self._session.paused = True
            is_gone = not Path(self._script.path).exists()
            problem = f"{program.name} was deleted or renamed" if is_gone else str(error)
            program.fail(problem)
            _report(f"error: {problem}")
        else:
            print_at_once(f"{program.name} starts again.\n")
            self._run()

    def _run(self) -> None:
        session, program = self._session, self._program
        program.prepare()
        try:
            driving = self._fresh_run()
        except KbotError as error:
            program.fail(str(error))
            _report(f"error: {error}")
            return
        if driving is None:
            return
        self._used, simulation = driving, driving.simulation
        if not (program.was_interrupted or session.waits_for_page):
            session.paused = False
        session.state()  # kept for a page that opens while the script computes and has made no step
        program.begin(simulation)
        phase, problem = self._outcome(simulation)
        self._interruption.stop_tracing()
        _stop_robots(simulation)
        if not program.wants_start:
            # nothing that the script left behind, such as timers, may drive the robot on
            session.paused = True
        is_unused = phase == "finished" and not simulation.stepping.was_called
        note = program.code.made_no_step if is_unused else ""
        program.finish(simulation, phase, problem, note)
        if problem:
            _report(f"error: {problem}")
        if not (program.wants_start or self._interruption.is_over):
            end = note or f"{program.name} {phase} at {simulation.time:.2f} s"
            print_at_once(f"{end}. Save it to start it again.\n")

    def _outcome(self, simulation: Simulation) -> tuple[ProgramPhase, str]:
        """Run the script. Returns how it ended, and its error."""
        try:
            self._script.run(simulation)
        except (Stopped, KeyboardInterrupt):
            return "stopped", ""
        except KbotError as error:
            return "failed", str(error)
        finally:
            self._interruption.listen()
        return "finished", ""

    def _fresh_run(self) -> Driving | None:
        """Return a run that nothing has used yet. None if the user ends KBot meanwhile."""
        session = self._session
        run = session.run
        if run is self._used or not isinstance(run, Driving) or run.simulation.steps > 0:
            self._do_on_server(session.renew)
            run = session.run
        return run if isinstance(run, Driving) and not self._interruption.is_over else None

    def _do_on_server(self, work: Callable[[], None]) -> None:
        """Do something on the server's thread, which owns the pages. Raises its KbotError."""
        done, errors = threading.Event(), list[KbotError]()

        def carry_out() -> None:
            try:
                work()
            except KbotError as error:
                errors.append(error)
            finally:
                done.set()

        self._session.requests.append(carry_out)
        while not (done.is_set() or self._interruption.is_over):
            self._session.turns.lend(WAITING_SECONDS)
        if errors:
            raise errors[0]


def _stop_robots(simulation: Simulation) -> None:
    for robot in simulation.robots.values():
        if robot.can_drive:
            with suppress(KbotError):  # the run has diverged
                robot.cmd_vel(0.0, 0.0)


def _report(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()
