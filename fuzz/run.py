"""Fuzz the readers of files and the protocols of sockets, guided by the code that an input reaches.

    pip install atheris
    python fuzz/run.py [SECONDS] [NAME…]    fuzz all targets, or some; SECONDS of processor time for each
    python fuzz/run.py FILE…                run findings again, with their tracebacks
    python fuzz/run.py --few MODULE         run the targets of a module with a few fixed inputs, without atheris

The targets are in `fuzz_*.py`. They edit files of the project and of the reference data (KBOT_SHARED). Prints
a table with the number of inputs and of different findings. Exit status 1 if there are findings. An input and
the traceback of each are in build/fuzz/NAME/findings. The next run begins with the inputs that reached new
code before, and adds its inputs and processor time to those of all runs. As many targets run at once as there
are processors.

A finding is an unexpected exception, an input that takes too long or too much memory, or a crash.
"""

import contextlib
import hashlib
import json
import os
import random
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from choices import Choices
from edits import ROOT
from targets import load_targets

SECONDS = 600.0
FEW = 10
MOST_CPU_S = 10.0
"""Processor time for one input, which docs/reference/limits.md states for a file."""
RESTART_S = 5.0
"""Processor time that a crash costs: a new process imports everything again."""
MOST_WALL_S = 120
MOST_MB = 2048
LONGEST_INPUT = 4096
BUILD = ROOT / "build" / "fuzz"
PACKAGES = ["kbot", "trimesh", "collada", "mcap", "rosbags", "xmlrpc", "yaml"]
"""Whose code guides the fuzzer."""


def main(words: list[str]) -> int:
    found = list(load_targets())
    if files := [Path(word).resolve() for word in words if Path(word).is_file()]:
        functions = {name: target for name, _, target in found}
        for file in files:
            with empty_folder() as here, contextlib.chdir(here):
                functions[file.parents[1].name](Choices(file.read_bytes()))
        return 0
    seconds = float(words.pop(0)) if words and words[0].replace(".", "").isdecimal() else SECONDS
    known = {name: module for name, module, _ in found}
    if unknown := [name for name in words if name not in known]:
        print(f"unknown target {', '.join(unknown)}; known are {', '.join(known)}", file=sys.stderr)
        return 2
    if find_spec("atheris") is None:
        print("atheris is not installed: pip install atheris", file=sys.stderr)
        return 2
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    print("| target | inputs | processor time (s) | new findings |")
    print("| --- | ---: | ---: | ---: |", flush=True)
    total = 0
    pool = ThreadPoolExecutor(processors)
    for line, count in pool.map(lambda name: row(name, known[name], seconds), words or known):
        print(line, flush=True)
        total += count
    return 1 if total else 0


@contextlib.contextmanager
def empty_folder() -> Iterator[Path]:
    """A folder without siblings, among which KBot would search for packages."""
    with TemporaryDirectory() as outer:
        here = Path(outer) / "here"
        here.mkdir()
        yield here


def row(name: str, module: str, seconds: float) -> tuple[str, int]:
    """Fuzz a target in its own processes. Returns its row of the table and the number of new findings."""
    folder = BUILD / name
    findings, progress = folder / "findings", folder / "progress.json"
    for part in (findings, folder / "corpus"):
        part.mkdir(parents=True, exist_ok=True)
    for old in findings.iterdir():
        old.unlink()
    inputs, used = 0, 0.0
    while used < seconds:
        progress.unlink(missing_ok=True)
        command = [sys.executable, __file__, "--one", module, name, str(seconds - used)]
        with empty_folder() as here, (folder / "log.txt").open("w") as log:
            status = subprocess.run(command, cwd=here, stdout=log, stderr=log, check=False).returncode
        if not progress.exists():
            raise SystemExit(f"{name} did not start: see {folder / 'log.txt'}")
        counts = json.loads(progress.read_text())
        inputs, used = inputs + counts["inputs"], used + counts["seconds"]
        if status == 0:
            break
        used += RESTART_S
    found = sum(file.suffix != ".txt" for file in findings.iterdir())
    total = folder / "total.json"
    if total.exists():
        before = json.loads(total.read_text())
        inputs, used = inputs + before["inputs"], used + before["seconds"]
    total.write_text(json.dumps({"inputs": inputs, "seconds": used}))
    return f"| {name} | {inputs} | {used:.0f} | {found} |", found


def fuzz(module: str, name: str, seconds: float) -> None:
    """Fuzz a target in this process, which ends when the processor time is used up."""
    import atheris

    folder = BUILD / name
    hook = atheris.instrument_imports(include=PACKAGES)
    hook.__enter__()  # never left: some modules are imported when they are first used
    target = import_module(module).TARGETS[name]
    inputs, begun, written = 0, time.process_time(), 0.0

    def one_input(data: bytes) -> None:
        nonlocal inputs, written
        inputs += 1
        start = time.process_time()
        try:
            target(Choices(data))
            if time.process_time() - start > MOST_CPU_S:
                raise TimeoutError(f"an input took {time.process_time() - start:.1f} s")
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 - any exception is a finding, SystemExit too
            keep(folder / "findings", data, error)
        used = time.process_time() - begun
        if used > written + 1.0 or used > seconds or inputs == 1:
            written = used
            (folder / "progress.json").write_text(json.dumps({"inputs": inputs, "seconds": max(used, 0.1)}))
        if used > seconds:
            os._exit(0)  # libFuzzer has no limit of processor time

    options = (
        *(
            f"-timeout={MOST_WALL_S}",
            f"-report_slow_units={MOST_WALL_S}",
            f"-rss_limit_mb={MOST_MB}",
            f"-max_len={LONGEST_INPUT}",
        ),
        *(f"-artifact_prefix={folder / 'findings'}/", "-len_control=0", str(folder / "corpus")),
    )
    atheris.Setup([sys.argv[0], *options], one_input)
    atheris.Fuzz()


def few(module: str) -> None:
    """Run the targets of a module in this process, with the same inputs in each run."""
    for name, target in import_module(module).TARGETS.items():
        noise = random.Random(name)
        for _ in range(FEW):
            data = bytes(noise.choices(range(noise.choice((128, 256))), k=600))  # half of them are ASCII
            target(Choices(data))


def keep(folder: Path, data: bytes, error: BaseException) -> None:
    """Keep the first input for each kind of exception and place in the code."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{type(error).__name__} {Path(frame.filename).name} {frame.lineno}"
    file = folder / hashlib.sha256(place.encode()).hexdigest()[:12]
    if not file.exists():
        file.write_bytes(data)
        file.with_suffix(".txt").write_text("".join(traceback.format_exception(error)), errors="replace")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        fuzz(sys.argv[2], sys.argv[3], float(sys.argv[4]))
    elif sys.argv[1:2] == ["--few"]:
        few(sys.argv[2])
    else:
        try:
            sys.exit(main(sys.argv[1:]))
        except KeyboardInterrupt:
            os._exit(130)  # without the targets that wait
