"""What is lost when a run is killed (SIGKILL) at any moment.

    python benchmarks/bench_kills.py [COUNT]

Recordings of a simulation in real time are killed, and then read: the loss is the time of the kill minus the
time of the last message. `kbot check --fix` is killed while it rewrites a file: afterwards the file must be
the old or the new one, and the next run must leave nothing else in the folder.
"""

from __future__ import annotations

import os
import random
import signal
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import kbot
from kbot.cli.main import run as run_kbot
from kbot.record import Recording
from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import RunOutputs
from kbot.sim import Simulation
from kbot.sim.real_time import run_in_real_time
from kbot.text.files import SCRATCH_SECONDS

COUNT = 1000
AT_ONCE = 8
LONGEST = 3.0
"""Seconds of a recording before it is killed, at most."""
ENDINGS = ("mcap", "bag", "")
ROBOT = """<robot name="r">
  <link name="a"><visul><geometry><sphere radius="0.1"/></geometry></visul></link>
</robot>
"""
"""`check --fix` renames the tag."""


def child(work: Callable[[], None]) -> int:
    """Do some work in a forked process, which has imported everything already."""
    number = os.fork()
    if number == 0:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        try:
            work()
        finally:
            os._exit(0)
    return number


def kill(number: int) -> None:
    os.kill(number, signal.SIGKILL)
    os.waitpid(number, 0)


def losses(folder: Path, count: int) -> dict[str, list[float]]:
    """Seconds of simulated time that each killed recording lost, by format."""
    noise, found = random.Random(1), {ending: list[float]() for ending in ENDINGS}
    for first in range(0, count, AT_ONCE):
        running = []
        for index in range(first, min(first + AT_ONCE, count)):
            ending = ENDINGS[index % len(ENDINGS)]
            path = folder / (f"{index}.{ending}" if ending else f"{index}")
            reader, writer = os.pipe()

            def record(path: Path = path, writer: int = writer) -> None:
                simulation = Simulation(kbot.load("kbot"))
                outputs = RunOutputs(lambda text: None, RecordOptions(str(path)), None, ())
                outputs.join(simulation, "", "empty")
                simulation.clock.every(50.0, lambda: os.write(writer, b"%.2f\n" % simulation.time))
                run_in_real_time(simulation, None)

            number = child(record)
            os.close(writer)
            running.append((number, reader, path, ending))
        due = []
        for number, reader, path, ending in running:
            os.read(reader, 1)  # the recording has begun
            due.append((time.monotonic() + noise.random() * LONGEST, number, reader, path, ending))
        for when, number, reader, path, ending in sorted(due):
            time.sleep(max(0.0, when - time.monotonic()))
            kill(number)
            with os.fdopen(reader) as times:
                last = times.read().split("\n")[-2]
            end = Recording(str(path)).summary().end
            found[ending].append(float(last) - (end or 0) * 1e-9)
    return found


def fixes(folder: Path, count: int) -> Counter[str]:
    """What was in the file after each kill. Raises RuntimeError: a half file, or one that was left over."""
    noise, found = random.Random(2), Counter[str]()
    file = folder / "robot.urdf"

    def fix() -> None:
        run_kbot(["check", "--fix", str(file)])

    for work in (fix, lambda: os.waitpid(child(fix), 0)):  # the first run imports modules
        file.write_text(ROBOT)
        begun = time.monotonic()
        work()
    took = time.monotonic() - begun
    for _ in range(count):
        file.write_text(ROBOT)
        number = child(fix)
        time.sleep(noise.random() * took)
        kill(number)
        text = file.read_text()
        if text not in (ROBOT, ROBOT.replace("visul", "visual")):
            raise RuntimeError(f"a half file: {text!r}")
        found["old" if text == ROBOT else "new"] += 1
        left = [path for path in folder.iterdir() if path != file]
        found["scratch files"] += len(left)
        for path in left:  # as if the next run came a minute later
            os.utime(path, times=(0.0, time.time() - 2 * SCRATCH_SECONDS))
        file.write_text(ROBOT)
        fix()
        if (rest := [path.name for path in folder.iterdir()]) != [file.name]:
            raise RuntimeError(f"left over: {rest}")
    return found


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    with tempfile.TemporaryDirectory() as folder:
        lost = losses(Path(folder), count)
    print("| killed recordings | number | median loss (s) | largest loss (s) |")
    print("| --- | --- | --- | --- |")
    for ending, values in lost.items():
        name = f".{ending}" if ending else "rosbag2 folder"
        print(f"| {name} | {len(values)} | {statistics.median(values):.2f} | {max(values):.2f} |")
    with tempfile.TemporaryDirectory() as folder:
        sys.stdout.flush()
        kept = os.dup(1)
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        ended = fixes(Path(folder), count)
        sys.stdout.flush()
        os.dup2(kept, 1)
    print(
        f"\n{count} killed `kbot check --fix`: {ended['old']} left the old file, {ended['new']} the new one, "
        f"and {ended['scratch files']} a scratch file, which the next run removed. No file was incomplete."
    )
    return int(max(map(max, lost.values())) > 1.0)


if __name__ == "__main__":
    sys.exit(main())
