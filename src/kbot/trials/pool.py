"""Runs many trials in parallel processes.

Each process is a `Worker`, which a thread of this process drives. A trial that exceeds its limits, or ends
its process, is one failed result, and the other trials continue.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Generic, TypeVar

from kbot.model import RobotModel
from kbot.sim.script_errors import Explanations
from kbot.sim.user_code import UserCode
from kbot.text import KbotError
from kbot.trials.actions import RunScript
from kbot.trials.errors import first_error, one_line, sentence
from kbot.trials.films import run_filmed
from kbot.trials.python_file import read_python_scenarios
from kbot.trials.results import TrialResult
from kbot.trials.scenario import RobotSource, Scenario
from kbot.trials.scenario_keys import with_keys
from kbot.trials.trial import load_source, run_trial
from kbot.trials.watchdog import watchdog
from kbot.worker import LimitExceeded, ProcessEnded, Worker, WorkerLimits
from kbot.worker.child import Surroundings
from kbot.worker.cores import available_cores

A = TypeVar("A")
T = TypeVar("T")

LOADING_SECONDS = 30.0
"""Processor time that a trial may take to load the robot and the world: as much as any other file."""
SECONDS_PER_SECOND = 2.0
"""Processor time that a trial may take for each simulated second: half of the speed of real time."""
FILM_SECONDS = 120.0
"""Processor time to draw a film, which takes long without a graphics card."""
GRACE_SECONDS = 5.0
"""Processor time until the process is killed, after its watchdog has tried to stop the user's program. It
includes the start of the process."""
ATTEMPTS = 3
"""How often a call is tried whose process was killed, which is rarely the fault of the call."""
WAKE_SECONDS = 0.2
"""Windows delivers Ctrl-C only between two waits."""
_ROBOTS_KEPT = 4
"""Robots that a process keeps. Most runs try one robot."""


def time_limit(scenario: Scenario) -> float:
    """The processor time in seconds that a run of a scenario may take."""
    return LOADING_SECONDS + SECONDS_PER_SECOND * scenario.duration


@dataclass(frozen=True)
class Task:
    """One trial to run in a pool.

    scenario         what to run. That of a Python file is without its steps and expectations, which may be
                     functions that cannot be sent to another process
    seed             of the simulation
    python_file      the Python file from which the process loads the scenario again
    index            which of the file's scenarios it is
    with_all_values  whether to compute all measures
    with_trace       whether to keep the trace
    with_film        whether to keep the trace and a film of the end
    record           the file to record the run to
    robot            as it was typed, if a battery is tried
    error            why the trial cannot run
    keys             values that replace those of the scenario, by the path of their key
    """

    scenario: Scenario
    seed: int = 0
    python_file: str = ""
    index: int = 0
    with_all_values: bool = False
    with_trace: bool = False
    with_film: bool = False
    record: str = ""
    robot: str = ""
    error: str = ""
    keys: Mapping[str, int | float | str] = field(default_factory=dict)

    def limit(self, of_run: float | None = None) -> float:
        """The processor time in seconds that the trial may take, with its film.

        `of_run` is that of the trial without a film. By default it follows from the duration.
        """
        return (of_run or time_limit(self._timed())) + (FILM_SECONDS if self.with_film else 0.0)

    def _timed(self) -> Scenario:
        """The scenario with the duration that runs."""
        with suppress(KbotError):  # the run reports a wrong value
            return with_keys(self.scenario, {key: self.keys[key] for key in self.keys if key == "duration"})
        return self.scenario


@dataclass(frozen=True, slots=True)
class Outcome(Generic[T]):
    """What a call in a pool returned, or the exception that it raised."""

    value: T | None = None
    error: Exception | None = None


class Pool:
    """Processes that work in parallel. They start with the first work and stay until the pool is closed."""

    def __init__(self, jobs: int | None = None) -> None:
        """`jobs` is the number of processes; by default one for each core that this process may use."""
        self.jobs = jobs or available_cores()
        self.interrupted = False
        """Whether Ctrl-C ended the work."""
        self._workers: list[Worker] = []

    def __enter__(self) -> Pool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end_workers()

    def calls(self, work: Callable[[A], T]) -> Calls[A, T]:
        """Begin calls of a module's function. End them before the next ones begin."""
        return Calls(self, work)

    def map(
        self,
        work: Callable[[A], T],
        items: Sequence[A],
        seconds: Callable[[A], float],
        on_done: Callable[[int, Outcome[T]], None] = lambda index, outcome: None,
    ) -> list[Outcome[T] | None]:
        """Call a module's function for each item. Returns the outcomes in the order of the items.

        `seconds` is the processor time that a call may take. `on_done` is called in this thread, in the order
        in which the calls end. Ctrl-C ends the processes at once: the outcomes of unfinished calls are None.
        """
        outcomes: list[Outcome[T] | None] = [None] * len(items)
        with suppress(KeyboardInterrupt), self.calls(work) as calls:
            for index, item in enumerate(items):
                calls.submit(index, item, seconds(item))
            for _ in items:
                index, outcome = calls.wait()
                outcomes[index] = outcome
                on_done(index, outcome)
        return outcomes

    def worker(self, number: int) -> Worker:
        """One of the workers, which starts its process with its first call."""
        while len(self._workers) <= number:
            self._workers.append(Worker())
        return self._workers[number]

    def end_workers(self) -> None:
        """End all processes. Later calls start new ones."""
        for worker in self._workers:
            worker.end()


class Calls(Generic[A, T]):
    """Calls of one function in the processes of a pool. Each worker is driven by a thread of this process."""

    def __init__(self, pool: Pool, work: Callable[[A], T]) -> None:
        self._pool, self._work = pool, work
        self._surroundings = Surroundings.of_this_process()
        self._waiting: queue.SimpleQueue[tuple[int, A, float] | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[tuple[int, Outcome[T]]] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._open = 0
        """The number of calls that have begun or wait, and whose outcome is not known."""
        self._stop = threading.Event()

    def __enter__(self) -> Calls[A, T]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the calls. Those that have not ended, as after Ctrl-C, end with their processes."""
        self._stop.set()
        for _ in self._threads:
            self._waiting.put(None)
        if isinstance(error, KeyboardInterrupt):
            self._pool.interrupted = True
        while self._open and any(thread.is_alive() for thread in self._threads):
            self._pool.end_workers()  # a thread may just be starting its process
            for thread in self._threads:
                thread.join(WAKE_SECONDS)

    def submit(self, key: int, item: A, seconds: float) -> None:
        """Call the function for an item as soon as a process is free. Does not wait.

        `seconds` is the processor time that the call may take.
        """
        self._waiting.put((key, item, seconds))
        self._open += 1
        if len(self._threads) < min(self._pool.jobs, self._open):
            worker = self._pool.worker(len(self._threads))
            thread = threading.Thread(target=self._drive, args=(worker,), daemon=True)
            self._threads.append(thread)
            thread.start()

    def wait(self) -> tuple[int, Outcome[T]]:
        """Wait for the end of the call that ends first. Returns its key and its outcome."""
        while True:
            with suppress(queue.Empty):
                found = self._done.get(timeout=WAKE_SECONDS)
                self._open -= 1
                return found

    def _drive(self, worker: Worker) -> None:
        while (call := self._waiting.get()) is not None and not self._stop.is_set():
            key, item, seconds = call
            worker.limits, worker.surroundings = WorkerLimits(seconds), self._surroundings
            outcome: Outcome[T] = Outcome()
            for _ in range(ATTEMPTS):
                try:
                    outcome = Outcome(worker.call(self._work, item))
                except Exception as error:  # noqa: BLE001 - reported as the item's
                    outcome = Outcome(error=error)
                if not isinstance(outcome.error, ProcessEnded) or not outcome.error.was_killed:
                    break
                if self._stop.is_set():
                    break
            if not self._stop.is_set():
                self._done.put((key, outcome))


def run_tasks(
    pool: Pool,
    tasks: Sequence[Task],
    on_result: Callable[[int, TrialResult], None] = lambda index, result: None,
    limit: float | None = None,
) -> list[TrialResult | None]:
    """Run trials. Returns their results in the order of the tasks; after Ctrl-C, None for unfinished ones.

    `limit` replaces the processor time in seconds that each trial may take. A film may take longer.
    """
    results: list[TrialResult | None] = [
        TrialResult(task.scenario.name, task.seed, error=task.error) if task.error else None for task in tasks
    ]
    runnable = [index for index, task in enumerate(tasks) if not task.error]

    def keep(number: int, outcome: Outcome[TrialResult]) -> None:
        index = runnable[number]
        result = results[index] = result_of(limited[number], outcome)
        on_result(index, result)

    limited = [(tasks[index], tasks[index].limit(limit)) for index in runnable]
    pool.map(run_task, limited, seconds_of, keep)
    return results


LimitedTask = tuple[Task, float]
"""A trial, and the processor time in seconds that the user's code may take."""


def seconds_of(item: LimitedTask) -> float:
    """The processor time in seconds after which the process of a trial is killed."""
    return item[1] + GRACE_SECONDS


def result_of(item: LimitedTask, outcome: Outcome[TrialResult]) -> TrialResult:
    """The result of a trial that ran in a pool. One without a result of its own failed."""
    if outcome.value is not None:
        return outcome.value
    task, limit = item
    return TrialResult(task.scenario.name, task.seed, error=_why(outcome.error, limit))


def run_task(item: LimitedTask) -> TrialResult:
    """Run a trial in this process."""
    task, limit = item
    try:
        with watchdog(_programs(task), limit):
            return _run(task)
    except KbotError as error:
        return TrialResult(task.scenario.name, task.seed, error=first_error(error))
    except (Exception, KeyboardInterrupt) as error:  # of the user's program: Ctrl-C does not arrive here
        programs = _programs(task)
        if not programs:
            raise
        explained = Explanations(programs[0]).explained(error, 0.0)
        return TrialResult(task.scenario.name, task.seed, error=one_line(str(explained).partition("\n")[0]))


def _run(task: Task) -> TrialResult:
    scenario = task.scenario
    if task.python_file:
        written = read_python_scenarios(task.python_file)[task.index]
        scenario = replace(written, robot=scenario.robot, world=scenario.world)
    scenario = with_keys(scenario, task.keys)
    robot = load_once(scenario.robot) if scenario.robot is not None else None
    if task.with_film:
        return run_filmed(
            scenario, task.seed, robot, with_all_values=task.with_all_values, record=task.record
        )
    return run_trial(
        scenario,
        task.seed,
        robot,
        with_all_values=task.with_all_values,
        with_trace=task.with_trace,
        record=task.record,
    )


def _programs(task: Task) -> list[UserCode]:
    """The user's programs that run in the process of a trial."""
    scripts = [step.action.script for step in task.scenario.steps if isinstance(step.action, RunScript)]
    files = [task.python_file, *(script for script in scripts if isinstance(script, str))]
    return [UserCode(file) for file in files if file]


def _why(error: Exception | None, limit: float) -> str:
    """Why a trial has no result of its own."""
    if isinstance(error, LimitExceeded) and error.is_late:
        return f"the trial took longer than {limit:g} s and was stopped. --limit-time raises the limit"
    return sentence(error, "the trial")


def load_once(source: RobotSource) -> RobotModel:
    """The robot of a source, which this process keeps for the next trial."""
    key = repr(source)
    if key not in _kept:
        while len(_kept) >= _ROBOTS_KEPT:
            del _kept[next(iter(_kept))]
        _kept[key] = load_source(source)
    return _kept[key]


_kept: dict[str, RobotModel] = {}
