"""Fetches public repositories at a commit and runs commands in them, for benchmarks."""

from __future__ import annotations

import argparse
import csv
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

ENVIRONMENT = {
    **os.environ,
    "KBOT_DEBUG": "1",  # prints the traceback of an internal error
    "GIT_LFS_SKIP_SMUDGE": "1",
    "GIT_TERMINAL_PROMPT": "0",  # a repository that is gone fails instead of asking for a password
}
INTERRUPTED = threading.Event()
"""Set by Ctrl-C, after which no job starts another command."""
REASON = 150
"""Characters of a reason."""


class Source(NamedTuple):
    """A repository on GitHub at a commit."""

    repository: str
    commit: str

    @property
    def folder(self) -> str:
        """The path of the checkout. No two repositories are in one folder, where KBot would find both."""
        return f"{self.repository.replace('/', '+')}+{self.commit[:8]}/{self.repository.split('/')[1]}"


@dataclass(frozen=True)
class PublicFile:
    """A row of a manifest: a file of a repository, its arguments, and the repositories that it needs."""

    name: str
    source: Source
    file: str
    arguments: Sequence[str]
    packages: Sequence[Source]


Row = TypeVar("Row", bound=PublicFile)


class NotFetched(Exception):
    """A repository is not fetched. The message is the reason."""


def read_manifest(manifest: Path) -> Iterator[tuple[PublicFile, dict[str, str]]]:
    """The rows of a manifest, and all their columns. `packages` are `OWNER/NAME@COMMIT …`."""
    with manifest.open(newline="") as file:
        for row in csv.DictReader(file, delimiter="\t"):
            source = Source(row["repository"], row["commit"])
            packages = [Source(*word.split("@")) for word in row["packages"].split()]
            yield PublicFile(row["name"], source, row["file"], row["arguments"].split(), packages), row


def chosen_by_user(description: str | None, rows: Sequence[Row]) -> tuple[list[Row], Path | None]:
    """The rows whose names are in the command line, or all, and the folder of `--from`."""
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument("--from", dest="folder", type=lambda path: Path(path).resolve(), metavar="FOLDER")
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    if unknown := sorted(set(options.names) - {row.name for row in rows}):
        parser.error(f"unknown name {', '.join(unknown)}")
    return [row for row in rows if not options.names or row.name in options.names], options.folder


def measure_all(measure: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """The results of the jobs, as many at once as there are processors. Ends the process after Ctrl-C."""
    pool = ThreadPoolExecutor(os.cpu_count())
    try:
        return list(pool.map(measure, jobs))
    except KeyboardInterrupt:
        INTERRUPTED.set()
        pool.shutdown(cancel_futures=True)
        sys.exit(130)


def fetch(source: Source, scratch: Path, folder: Path | None) -> None:
    """Check out a repository."""
    if folder is None:
        repository = scratch / "fetched.git"
        _git("init", "--quiet", "--bare", str(repository))
        address = f"https://github.com/{source.repository}"
        _git("fetch", "--quiet", "--depth=1", address, source.commit, repository=repository)
    else:
        named = folder / source.repository.replace("/", "+")
        repository = next((path for path in (named / "repo", named) if path.is_dir()), named)
        if (repository / ".git").is_dir():
            repository /= ".git"
    _git("read-tree", source.commit, repository=repository, index=scratch / "index")
    place = scratch / source.folder
    place.mkdir(parents=True)
    try:
        _git("checkout-index", "-a", repository=repository, index=scratch / "index", place=place)
    except NotFetched as error:
        if folder is None:
            raise
        # such a folder may lack large files, mostly pictures and meshes
        print(f"{source.repository} lacks files: {error}", file=sys.stderr)


def _git(
    *words: str, repository: Path | None = None, index: Path | None = None, place: Path | None = None
) -> None:
    """Run git, with the files of `place` as the working tree. Raises NotFetched with the reason."""
    options = [f"--git-dir={repository}"] if repository else []
    if place:
        options.append(f"--work-tree={place}")
    environment = {**ENVIRONMENT, **({"GIT_INDEX_FILE": str(index)} if index else {})}
    ran = run(["git", *options, *words], place, environment)
    if ran.returncode:
        lines = ran.stderr.strip().splitlines() or [f"git exit status {ran.returncode}"]
        raise NotFetched(next((line for line in lines if line.startswith(("error: ", "fatal: "))), lines[-1]))


def run(
    command: list[str], here: Path | None, environment: dict[str, str], limit: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder. Raises KeyboardInterrupt after Ctrl-C, which running commands get too."""
    ran = subprocess.run(
        command, cwd=here, env=environment, capture_output=True, text=True, errors="replace", timeout=limit
    )
    if INTERRUPTED.is_set() or ran.returncode in (-signal.SIGINT, 130):
        raise KeyboardInterrupt
    return ran


def without_folder(line: str, scratch: Path) -> str:
    """A line without the temporary folder at the start of a path, which is of no use to the reader."""
    return re.sub(rf"{re.escape(str(scratch))}/\S*/", "", line)


def shortened(line: str) -> str:
    """A line as long as a table can show. A vertical bar would end the cell."""
    line = line.replace("|", "\\|")
    return line if len(line) <= REASON else line[: REASON - 1] + "…"
