"""Which launch files of public robots run in KBot.

    python benchmarks/bench_launches.py [--from FOLDER] [NAME…]

Each launch file of `launches.tsv` is fetched at its commit into a temporary folder, with the repositories
that its packages depend on, and run with `kbot launch`. It runs if KBot serves its page within 60 s, is still
serving it 5 s later, and ends with Ctrl-C without a traceback. For each other one, the table has the reason
that KBot reports. Most warnings name nodes that are not run. Exit status 1 if a command fails with a
traceback, or a repository is not fetched.

`--from FOLDER` is that of `bench_robots.py`.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from public_repositories import (
    ENVIRONMENT,
    INTERRUPTED,
    NotFetched,
    PublicFile,
    chosen_by_user,
    fetch,
    measure_all,
    read_manifest,
    shortened,
    without_folder,
)

MANIFEST = Path(__file__).with_name("launches.tsv")
START, STAY = 60.0, 5.0
"""Seconds to the page, and seconds that the launch then runs."""
END = 30.0
"""Seconds to the end after Ctrl-C."""
SERVING = "is at  http://"
"""In the line that `kbot launch` prints when its page can be opened."""
PERIOD = 0.2
"""Seconds between two checks of the output."""


@dataclass
class Result:
    """What KBot reports on one launch file."""

    launch: PublicFile
    runs: bool = False
    warnings: int = 0
    reason: str = ""
    """The first error of a launch file that does not run."""
    failures: list[str] = field(default_factory=list)
    """A traceback, and repositories that were not fetched."""


def main() -> int:
    launches, folder = chosen_by_user(__doc__, [file for file, _ in read_manifest(MANIFEST)])
    results = measure_all(lambda launch: _measure(launch, folder), launches)
    print("\n".join(_table(results)))
    return int(any(result.failures for result in results))


def _measure(launch: PublicFile, folder: Path | None) -> Result:
    result = Result(launch)
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        try:
            for source in (launch.source, *launch.packages):
                fetch(source, scratch, folder)
        except NotFetched as error:
            result.failures.append(f"not fetched: {error}")
        else:
            _run(result, scratch)
    print(f"{launch.name}: {'runs' if result.runs else result.reason or result.failures}", file=sys.stderr)
    return result


def _run(result: Result, scratch: Path) -> None:
    """Run a launch file until Ctrl-C, which it gets some seconds after its page is served."""
    launch = result.launch
    words = ["launch", launch.file, *launch.arguments, "--trust", "--no-browser", "--port=0"]
    words += [f"--package-path={scratch / package.folder}" for package in launch.packages]
    output, errors = scratch / "output", scratch / "errors"
    with output.open("w") as to, errors.open("w") as errors_to:
        kbot = subprocess.Popen(
            [sys.executable, "-m", "kbot", *words],
            cwd=scratch / launch.source.folder,
            env={**ENVIRONMENT, "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.DEVNULL,
            stdout=to,
            stderr=errors_to,
            start_new_session=True,  # Ctrl-C in this terminal ends the benchmark, and the benchmark ends KBot
        )
        try:
            serves = _wait(kbot, START, output)
            result.runs = serves and not _wait(kbot, STAY) and kbot.poll() is None
        finally:
            kbot.send_signal(signal.SIGINT)
            if not _wait(kbot, END):
                kbot.kill()
    printed = errors.read_text(errors="replace")
    result.warnings = len(re.findall(r"^\S+: warning: ", printed, re.MULTILINE))
    if "Traceback (most recent call last)" in printed:
        result.failures.append(printed.strip().splitlines()[-1])
        result.runs = False
    elif not result.runs:
        result.reason = shortened(without_folder(_reason(printed), scratch))


def _wait(kbot: subprocess.Popen[bytes], limit: float, output: Path | None = None) -> bool:
    """Wait for the page in the output, or without an output for the end. Return whether it came."""
    end = time.monotonic() + limit
    while time.monotonic() < end and not INTERRUPTED.is_set():
        has_ended = kbot.poll() is not None
        if output is not None and SERVING in output.read_text(errors="replace"):
            return True
        if has_ended:
            return output is None
        time.sleep(PERIOD)
    return False


def _reason(printed: str) -> str:
    """The first error that has a file and line, otherwise the last warning that has one, otherwise the last
    line."""
    lines = printed.strip().splitlines()
    errors = [line for line in lines if re.match(r"\S+: error: ", line)]
    warnings = [line for line in lines if re.match(r"\S+: warning: ", line)]
    last = lines[-1] if lines else f"no page within {START:g} s"
    return next(iter((*errors, *reversed(warnings), last)))


def _table(results: Iterable[Result]) -> Iterator[str]:
    yield "| robot | launch file | runs | warnings | result |"
    yield "| --- | --- | --- | ---: | --- |"
    runs = 0
    for result in results:
        launch = result.launch
        where = f"{launch.source.repository} {Path(launch.file).name}"
        text = "; ".join(result.failures) or result.reason
        yield f"| {launch.name} | {where} | {'yes' if result.runs else 'no'} | {result.warnings} | {text} |"
        runs += result.runs
    yield ""
    yield f"{runs} launch files run."


if __name__ == "__main__":
    sys.exit(main())
