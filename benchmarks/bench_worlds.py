"""How many worlds and descriptions of gz-sim, libsdformat and a URDF data set KBot reads as their parsers do.

    python benchmarks/bench_worlds.py [--from FOLDER]

Each SDF file of the tests and examples of gz-sim and libsdformat, and each URDF file of a data set, is read
by KBot and by the parser: libsdformat 12 or urdfdom (`scripts/need_sdformat.sh` installs both, from Debian).
A file counts if KBot loads it, or if the parser rejects it too. Missing files that a world names are warnings
for KBot, so it loads more files than libsdformat. The table names the others with KBot's first error. Exit
status 1 if KBot fails with a traceback, or a share is below its limit.

`--from FOLDER` is that of `bench_robots.py`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from public_repositories import Source, fetch, shortened, without_folder

from kbot.model.load import load_robot
from kbot.text import DescriptionError, KbotError
from kbot.world import load_world

PEER = Path(__file__).parents[1] / "tests" / "peers" / "sdf_peer.cc"
"""Prints the number of libsdformat errors for a file."""
LIMIT = 60.0
"""Seconds after which a parser is stopped. Then it does not reject the file."""


@dataclass(frozen=True)
class Collection:
    """The files of a repository. At least the share `limit` of them must count."""

    source: Source
    folders: tuple[str, ...]
    suffix: str
    limit: float


COLLECTIONS = (
    Collection(
        Source("gazebosim/gz-sim", "93bbf3ed1bd25df32709fee40d6935bf36d2bac8"),
        ("test/worlds", "examples/worlds"),
        ".sdf",
        0.95,
    ),
    Collection(
        Source("gazebosim/sdformat", "2ace536244acf0b3f60367b54488381d1224ce30"), ("test",), ".sdf", 0.95
    ),
    Collection(
        Source("Daniella1/urdf_files_dataset", "81f4cdac42c3a51ba88833180db5bf3697988c87"),
        ("urdf_files",),
        ".urdf",
        0.98,
    ),
)


@dataclass(frozen=True)
class Reading:
    """How KBot read a file: its first error, or None, and whether it failed with a traceback."""

    file: str
    error: str | None = None
    has_failed: bool = False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--from", dest="folder", type=lambda path: Path(path).resolve(), metavar="FOLDER")
    folder = parser.parse_args().folder
    rows, others, failed = [], [], False
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        sdf_peer = _sdf_peer(scratch)
        for collection in COLLECTIONS:
            fetch(collection.source, scratch, folder)
            root = scratch / collection.source.folder
            files = sorted(
                str(file)
                for below in collection.folders
                for file in (root / below).rglob(f"*{collection.suffix}")
            )
            is_sdf = collection.suffix == ".sdf"
            readings = _read_all(files, load_world if is_sdf else _load_robot)
            refused = [reading for reading in readings if reading.error is not None]
            peer = partial(_rejects_sdf, sdf_peer) if is_sdf else _rejects_urdf
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                rejected = list(pool.map(peer, (reading.file for reading in refused)))
            wrong = [reading for reading, too in zip(refused, rejected, strict=True) if not too]
            share = 1.0 - len(wrong) / len(files)
            failed |= share < collection.limit or any(reading.has_failed for reading in readings)
            counts = (len(files), len(files) - len(refused), sum(rejected), f"{100 * share:.1f} %")
            rows.append(f"| {collection.source.repository} | {' | '.join(map(str, counts))} |")
            others += [
                f"| {collection.source.repository} {Path(reading.file).relative_to(root)} |"
                f" {shortened(without_folder(str(reading.error), scratch))} |"
                for reading in wrong
            ]
    print("| repository | files | loaded | rejected by both | counts |")
    print("| --- | ---: | ---: | ---: | ---: |")
    print("\n".join(rows))
    print("\n| file that only KBot rejects | error |\n| --- | --- |")
    print("\n".join(others))
    return int(failed)


def _read_all(files: Sequence[str], load: Callable[[str], object]) -> list[Reading]:
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(partial(_read, load), files, chunksize=4))


def _read(load: Callable[[str], object], file: str) -> Reading:
    try:
        load(file)
    except (DescriptionError, KbotError) as error:
        return Reading(file, str(error).splitlines()[0])
    except Exception:  # noqa: BLE001 - any exception is a bug to report
        return Reading(file, traceback.format_exc().splitlines()[-1], has_failed=True)
    return Reading(file)


def _load_robot(file: str) -> object:
    return load_robot(file).require()


def _sdf_peer(scratch: Path) -> str:
    """Compile the program that reads a file with libsdformat."""
    program = str(scratch / "peer")
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "sdformat12"], capture_output=True, text=True, check=True
    ).stdout.split()
    subprocess.run(["g++", "-std=c++17", str(PEER), "-o", program, *flags], check=True)
    return program


def _rejects_sdf(peer: str, file: str) -> bool:
    ran = _run([peer, "--", file])
    lines = ran.stdout.splitlines() if ran is not None else []
    return any(line.endswith(f"\t{file}") and not line.startswith("0\t") for line in lines)


def _rejects_urdf(file: str) -> bool:
    ran = _run(["check_urdf", file])
    return ran is not None and ran.returncode != 0


def _run(command: list[str]) -> subprocess.CompletedProcess[str] | None:
    """The finished parser. None if it takes too long."""
    try:
        return subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return None


if __name__ == "__main__":
    sys.exit(main())
