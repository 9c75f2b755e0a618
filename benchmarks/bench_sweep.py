"""Parallel efficiency, bookkeeping, memory and interruptions of `kbot sweep`.

    python benchmarks/bench_sweep.py [efficiency] [memory] [kills]

The efficiency compares a sweep in two processes with two independent processes. Each of these loads half of
the same designs, one after the other, and runs the same scenario with them. Both start from nothing, and
both compute all measures. The efficiency is the time of the independent processes divided by that of the
sweep, for the best of several rounds in turn, in wall-clock time and in processor time. Bookkeeping is the
share of the process that plans, records and writes the table in the processor time of the sweep. Memory is
that of this process while it runs 10,000 short runs. The kills are SIGKILL, at random times, to the whole
command or to one of its workers. After the command itself was killed, the same command runs again. The
table at the end is compared with that of an undisturbed sweep.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

from kbot.sweep.designs import Method
from kbot.sweep.folder import JOURNAL, TABLE
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.processes import Processes
from kbot.sweep.runner import opened_sweep
from kbot.trials.pool import Pool, run_task

PROCESSES = 2
DESIGNS, ROUNDS = 300, 3
"""Designs of the sweep, and rounds of the comparison."""
SHORT_RUNS, FIRST = 10_000, 500
"""Runs of the long sweep, and how many of them are finished before its memory is measured first."""
KILLS, KILLS_OF_SWEEP, KILLED_DESIGNS = 20, 5, 150
"""Kills in all and of each sweep, and the designs of each killed sweep."""
LATEST = 6.0
"""Seconds after the start of a command, at most, until it or a worker is killed."""
SCENARIO = """duration: {duration}
steps:
  - command: {{linear: 0.2, angular: 0.3}}
expect:
  - max_tilt: {{max: 0.2}}
"""
RADII = "wheel_radius=0.02:0.05"


def request(folder: Path, duration: float, runs: int, method: Method = Method.RANDOM) -> Request:
    scenario = folder / f"drive-{duration:g}.scenario.yaml"
    scenario.write_text(SCENARIO.format(duration=duration))
    return Request(
        robot="kbot",
        dimensions=[RADII, "caster_wheel_radius=0.01:0.012"],
        scenarios=[str(scenario)],
        objectives=["energy"],
        method=method,
        runs=runs,
    )


def main(names: list[str]) -> int:
    parts: dict[str, Callable[[Path], bool]] = {
        "efficiency": print_efficiency,
        "memory": print_memory,
        "kills": print_kills,
    }
    if names[:1] == ["--alone"]:
        run_alone(Path(names[1]), int(names[2]))
        return 0
    passed = []
    for name in names or parts:
        with tempfile.TemporaryDirectory() as folder:
            passed.append(parts[name](Path(folder)))
        sys.stdout.flush()
    return 0 if all(passed) else 1


def run_alone(folder: Path, half: int) -> None:
    """Run every second design in this process, without a pool."""
    asked = request(folder, 6.0, DESIGNS)
    with Pool(1) as pool:  # reads the robot in another process, as the sweep does
        plan = prepare(asked, pool)
    from kbot.sweep.search import designs_of

    designs = designs_of(plan.method, plan.space, plan.designs, plan.objectives)
    for run in range(half, plan.runs, PROCESSES):
        task = plan.task(run, designs.values(run))
        run_task((task, task.limit))


def print_efficiency(folder: Path) -> bool:
    alone, swept = [], []
    for number in range(ROUNDS):
        alone.append(spent(lambda: run_independent(folder)))
        command = sweep_command(request(folder, 6.0, DESIGNS), folder / str(number))
        swept.append(spent(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL)))  # noqa: B023 - called at once
    by_clock, by_processor = (
        min(of_alone) / min(of_swept)
        for of_alone, of_swept in zip(zip(*alone, strict=True), zip(*swept, strict=True), strict=True)
    )
    print(
        f"parallel efficiency: {by_clock:.3f} in wall-clock time, which other programs disturb, and ", end=""
    )
    print(f"{by_processor:.3f} in processor time   (target: 0.95)")
    return min(by_clock, by_processor) >= 0.95


def run_independent(folder: Path) -> None:
    words = [sys.executable, __file__, "--alone", str(folder)]
    # in sessions of their own, as the processes of the pool: Linux divides a busy machine between sessions
    running = [subprocess.Popen([*words, str(half)], start_new_session=True) for half in range(PROCESSES)]
    for process in running:
        process.wait()


def sweep_command(asked: Request, out: Path) -> list[str]:
    words = [sys.executable, "-m", "kbot", "sweep", asked.robot, "--out", str(out), "-j", str(PROCESSES)]
    words += [word for each in asked.dimensions for word in ("--set", each)]
    words += [word for each in asked.scenarios for word in ("--scenario", each)]
    words += [word for each in asked.objectives for word in ("--objective", each)]
    return [*words, "--method", str(asked.method), "--runs", str(asked.runs), "--yes"]


def spent(work: Callable[[], object]) -> tuple[float, float]:
    """The wall-clock time of some work, and the processor time of the processes that it started, in s."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    work()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - begun, seconds


def print_memory(folder: Path) -> bool:
    """Run a long sweep in this process, and measure the memory and the processor time of its bookkeeping."""
    own = psutil.Process()
    memory: list[int] = []
    workers: list[int] = []

    with Pool(PROCESSES) as pool:
        plan = prepare(request(folder, 1.0, SHORT_RUNS), pool)

        def measure() -> None:
            count = sweep.journal.count
            if count in (FIRST, SHORT_RUNS):
                memory.append(own.memory_info().rss)
                workers.append(sum(child.memory_info().rss for child in workers_of(own)))

        with opened_sweep(plan, str(folder / "sweep")) as sweep, Processes(pool) as executor:
            before, theirs = processor_seconds(own), sum(map(processor_seconds, workers_of(own)))
            sweep.run(executor, measure)
            spent = processor_seconds(own) - before
            theirs = sum(map(processor_seconds, workers_of(own))) - theirs
    share = spent / (spent + theirs)
    first, last = (size / 1e6 for size in memory)
    grown = [size / PROCESSES / 1e6 for size in workers]
    print(f"memory after {FIRST} and {SHORT_RUNS} runs: {first:.0f} and {last:.0f} MB, of a worker: ", end="")
    print(f"{grown[0]:.0f} and {grown[1]:.0f} MB")
    print(
        f"bookkeeping: {100 * share:.1f} % of the processor time of {SHORT_RUNS} runs of "
        f"{1000 * theirs / SHORT_RUNS:.0f} ms   (limit: 5 %)"
    )
    return share < 0.05 and last < 1.1 * first


def processor_seconds(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


def workers_of(process: psutil.Process) -> list[psutil.Process]:
    """Without the guard, which ends what is left of a killed KBot."""
    return [each for each in process.children() if "kbot.worker.child" in " ".join(each.cmdline())]


def print_kills(folder: Path) -> bool:
    noise = random.Random(1)
    killed: Counter[str] = Counter()
    equal = sweeps = 0
    while sum(killed.values()) < KILLS:
        method = Method.OPTIMIZE if sweeps % 2 else Method.LHS
        asked = request(folder, 6.0, KILLED_DESIGNS, method)
        whole, broken = folder / f"whole-{method}", folder / f"broken-{sweeps}"
        if not whole.exists():
            subprocess.run(sweep_command(asked, whole), check=True, stdout=subprocess.DEVNULL)
        most = sum(killed.values()) + KILLS_OF_SWEEP
        while not is_complete(sweep_command(asked, broken), noise, killed, most):
            pass
        sweeps += 1
        lines = (broken / JOURNAL).read_text().splitlines()
        is_equal = (broken / TABLE).read_bytes() == (whole / TABLE).read_bytes()
        equal += is_equal and len(lines) == KILLED_DESIGNS
        shutil.rmtree(broken)
    counts = ", ".join(f"{count} of {name}" for name, count in sorted(killed.items()))
    print(
        f"{sum(killed.values())} kills ({counts}) in {sweeps} sweeps of {KILLED_DESIGNS} designs: "
        f"{equal} of {sweeps} tables are equal to the undisturbed one, byte for byte"
    )
    return equal == sweeps


def is_complete(command: list[str], noise: random.Random, killed: Counter[str], most: int) -> bool:
    """Run the command, and kill it or one of its workers at random times, until there were `most` kills.

    Returns whether it completed.
    """
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while sum(killed.values()) < most:
        with suppress(subprocess.TimeoutExpired):
            process.wait(noise.uniform(0.5, LATEST))
        if process.poll() is not None:
            break
        workers = workers_of(psutil.Process(process.pid))
        if workers and noise.random() < 0.5:
            with suppress(ProcessLookupError):
                os.kill(noise.choice(workers).pid, signal.SIGKILL)
                killed["a worker"] += 1
            continue
        process.kill()
        killed["the command"] += 1
        break
    _, errors = process.communicate()
    if process.returncode not in (0, -signal.SIGKILL):
        raise RuntimeError(f"status {process.returncode}: {errors.decode()}")
    return process.returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
