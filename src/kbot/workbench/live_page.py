"""The page of `sim.serve()`: show a simulation live while the user's own program drives it."""

from __future__ import annotations

import atexit
import linecache
import reprlib
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import NoReturn

from kbot.model import RobotModel
from kbot.sim import Simulation
from kbot.sim.printed_lines import PrintStream
from kbot.sim.script_errors import Explanations
from kbot.sim.user_code import UserCode
from kbot.text import KbotError
from kbot.text.signals import INTERRUPTED, signal_main_thread
from kbot.workbench.address import bound, can_open_browser
from kbot.workbench.driving.driving import Driving, RunSetup
from kbot.workbench.driving.program import Program
from kbot.workbench.driving.turns import WAITING_SECONDS
from kbot.workbench.driving.world_actions import SPAWNABLE
from kbot.workbench.notebook import LoadedReader, reading_of
from kbot.workbench.serve import print_at_once, served_at
from kbot.workbench.session.driven_session import limits, reason_not_driving
from kbot.workbench.session.offers import Offers
from kbot.workbench.session.session import Session

PATIENCE_SECONDS = 10.0
"""Seconds that `serve` waits for the page when it opens a browser, so that the page shows the run from its
start."""
PAGE = "kbot.live_page"
"""The key of a simulation's page in `Simulation.mounted`."""


class LivePage:
    """A page that shows a simulation. `url` is its address. The end of a `with` block closes it.

    The simulation's steps keep real time, and the page's speed and pause, until the page is closed. The page
    answers while the simulation steps, and in `wait`.
    """

    def __init__(self, simulation: Simulation, host: str, port: int | None, *, opens_browser: bool) -> None:
        """Serve at an address, on a thread of its own. `port` None takes the first free port from 8300.

        Raises:
            KbotError: the simulation is already served, or the address is in use.
        """
        if PAGE in simulation.mounted:
            raise KbotError(f"this simulation is already served at {simulation.mounted[PAGE].url}")
        if simulation.stepping.pace is not None:
            raise KbotError("this simulation is already shown in the page of kbot sim. Remove sim.serve()")
        self._simulation = simulation
        self._error: BaseException | None = None
        opens_browser = opens_browser and can_open_browser()
        session = self._session = _session(simulation)
        code = UserCode(sys.argv[0])
        linecache.getlines(code.path)  # errors quote the file as it is now
        self._explanations = Explanations(code)
        self._program = session.program = _CallingProgram(code, session.turns, session)
        session.waits_for_page = opens_browser
        self._turns, self._open = session.turns, ExitStack()
        with self._open:
            address = self._open.enter_context(bound(host, port, open_browser=opens_browser))
            self._turns.take()
            self._open.callback(self._turns.leave)
            session.state()  # kept for a page that opens while the program computes and has made no step
            self._program.begin(simulation)
            self._open.callback(self._program.finish, simulation, "finished")
            serving = ExitStack()
            serving.enter_context(served_at(session, address))
            # the server needs the simulation to end
            self._open.callback(self._end, serving)
            self.url = address.url
            simulation.mounted[PAGE] = self
            self._open.callback(simulation.mounted.pop, PAGE, None)
            print_at_once(f"{simulation.robot.name} is at  {self.url}\n")
            self._open.enter_context(_published_prints(simulation))
            self._closing = self._open.pop_all()
        self._is_closed = False
        atexit.register(self.close)
        self._hook_before = sys.excepthook
        is_at_prompt = hasattr(sys, "ps1") or sys.flags.interactive
        if not is_at_prompt:  # where an error does not end the program
            sys.excepthook = self._end_program
        end = time.monotonic() + PATIENCE_SECONDS
        try:
            while session.waits_for_page and time.monotonic() < end:
                self._turns.lend(WAITING_SECONDS)
        except KeyboardInterrupt as error:
            self._leave(error)
            raise

    def wait(self) -> None:
        """Serve until Ctrl-C, while the simulation runs on in real time. The page's keys drive it.

        Timers and callbacks that the program added to the simulation continue to run.
        """
        if self._is_closed:
            return
        self._program.finish(self._simulation, "finished")
        try:
            while True:
                self._turns.lend(WAITING_SECONDS)
        except KeyboardInterrupt:
            print_at_once("\n")
        finally:
            self._program.begin(self._simulation)

    def close(self) -> None:
        """Close the page. The simulation then steps as fast as possible again."""
        self._close(None)

    def __enter__(self) -> LivePage:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._leave(error)

    def __repr__(self) -> str:
        return f"<page of {self._simulation.robot.name} at {self.url}>"

    def _leave(self, error: BaseException | None) -> None:
        """Close the page because of an error that the program may still catch, or at the end of its block."""
        is_hooked = sys.excepthook == self._end_program
        self._close(error)
        if is_hooked and isinstance(error, KeyboardInterrupt):
            sys.excepthook = self._end_program  # reports it if nothing catches it

    def _close(self, error: BaseException | None) -> None:
        """Close the page, which then shows the error that ended the program, if one did."""
        if self._is_closed:
            return
        self._is_closed, self._error = True, error
        atexit.unregister(self.close)
        self._unhook()
        self._closing.close()

    def _unhook(self) -> None:
        if sys.excepthook == self._end_program:
            sys.excepthook = self._hook_before

    def _end_program(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        """Close the page after an error that the program did not catch, and report the error."""
        self._close(error)
        self._unhook()
        is_last = not isinstance(getattr(self._hook_before, "__self__", None), LivePage)
        if not (is_last and isinstance(error, KeyboardInterrupt)):
            self._hook_before(kind, error, trace)
            return
        after_ctrl_c = "\n" if sys.stderr.isatty() else ""
        sys.stderr.write(f"{after_ctrl_c}{self._program.name} was stopped\n")
        sys.exit(INTERRUPTED)

    def _end(self, serving: ExitStack) -> None:
        simulation, error = self._simulation, self._error
        simulation.draw.publish()
        # the page must not drive on until the connections are closed
        self._session.paused = True
        if error is None or isinstance(error, SystemExit):
            self._program.finish(simulation, "finished")
        elif isinstance(error, KeyboardInterrupt):
            self._program.finish(simulation, "stopped")
        else:
            explained = self._explanations.explained(error, simulation.time)
            explained.publish(simulation.printed)
            self._program.finish(simulation, "failed", str(explained))
        self._turns.leave()
        serving.close()
        self._turns.take()


@contextmanager
def _published_prints(simulation: Simulation) -> Iterator[None]:
    """Publish what the program prints, unless it redirects its output elsewhere."""
    before, printed = sys.stdout, PrintStream(sys.stdout, simulation.printed)
    sys.stdout = printed
    try:
        yield
    finally:
        printed.end()
        if sys.stdout is printed:
            sys.stdout = before


def serve(simulation: Simulation, *, browser: bool, host: str, port: int | None) -> LivePage:
    """Show a simulation in a page. See `Simulation.serve`."""
    if not isinstance(browser, bool):
        raise KbotError(f"browser must be True or False, not {reprlib.repr(browser)}")
    if not isinstance(host, str):
        raise KbotError(f"host must be an address such as '127.0.0.1', not {reprlib.repr(host)}")
    if port is not None and (not isinstance(port, int) or isinstance(port, bool)):
        raise KbotError(f"port must be a number from 0 to 65535 or None, not {reprlib.repr(port)}")
    return LivePage(simulation, host, port, opens_browser=browser)


class _CallingProgram(Program):
    """The program that called `serve`. A page stops it as Ctrl-C does."""

    def _end(self) -> None:
        if not self.is_running:
            return  # in `wait`, only Ctrl-C ends it
        if self.is_lending or threading.get_ident() == self._thread:
            self._is_ending = True  # raised at the end of the slice
        elif self._thread == threading.main_thread().ident:
            signal_main_thread()
        else:
            self._is_ending = True

    def _stop(self) -> NoReturn:
        self._is_ending = False
        raise KeyboardInterrupt


class _ServedDriving(Driving):
    """A simulation that a program made, so that pages cannot replace it."""

    def renewed(self, robot: RobotModel) -> NoReturn:
        raise KbotError("the program made this simulation, so only the program can start it again")

    def enter(self, world: str, seed: int) -> NoReturn:
        raise KbotError("the program made this simulation, so only the program can choose the world")


def _session(simulation: Simulation) -> Session:
    naming = simulation.robots.first.naming
    world = simulation.world
    setup = RunSetup(
        world,
        world.name,
        world.name,
        simulation.seed,
        simulation.contacts,
        lambda simulation: None,
        simulation.start,
        naming,
    )
    return Session(
        LoadedReader(reading_of(simulation.robot)),
        "sim",
        lambda robot: _ServedDriving(robot, setup, simulation),
        world,
        Offers(reason_not_driving, limits, things=SPAWNABLE),
    )
