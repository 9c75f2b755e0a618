"""Expansion compared with the official `xacro` package: agreement, time in one process, time as a command.

    python benchmarks/bench_xacro.py [--only TEXT] [--repeat N]

Each corpus entry (KBOT_SHARED, or `shared` beside the repository) is expanded by both in turn, in one
process. The best of N runs counts. Cold: all caches are cleared before each run. Warm: parsed files and
compiled expressions are cached, as in every run after the first. Prints Markdown.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import math
import os
import subprocess
import sys
import tempfile
import time
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import xacro
from kbot.xacro import clear_cache, expand
from kbot.xacro.run import Run

SHARED = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared")


class Row(NamedTuple):
    """The best times of one entry, in seconds."""

    name: str
    official: float
    cold: float
    warm: float
    equal: bool


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    replace_ament()
    sys.path.insert(0, str(SHARED / "corpus"))
    with tempfile.TemporaryDirectory() as scratch:
        rows = [
            _measure(name, path, arguments, options.repeat)
            for name, path, arguments in _entries(options.only, Path(scratch))
        ]
        print(_table(rows))
        if not options.only:
            print(_commands(min(rows, key=lambda row: row.official)))
            print(_source_map_cost())


def replace_ament() -> None:
    """Replace the ROS library that `$(find …)` of the official package uses: PyPI does not have it."""

    def find(name: str) -> str:
        for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep):
            if (Path(prefix) / "share/ament_index/resource_index/packages" / name).is_file():
                return str(Path(prefix) / "share" / name)
        raise KeyError(name)

    package, module = types.ModuleType("ament_index_python"), types.ModuleType("ament_index_python.packages")
    module.get_package_share_directory = find  # type: ignore[attr-defined] - what the official package looks for
    sys.modules["ament_index_python"], sys.modules["ament_index_python.packages"] = package, module


def _entries(only: str, scratch: Path) -> Iterator[tuple[str, Path, dict[str, str]]]:
    import check  # type: ignore[import-not-found] - a module in the corpus folder

    own, every = check.packages()
    with (SHARED / "corpus/manifest.csv").open(newline="") as file:
        entries = [e for e in csv.DictReader(file) if only in f"{e['repo']}/{e['entry']}"]
    for entry in entries:
        repo = entry["repo"].replace("/", "+")
        prefix = scratch / repo
        if not prefix.exists():
            check.install(prefix, {**every, **own.get(repo, {})})
        os.environ["AMENT_PREFIX_PATH"] = str(prefix)
        os.environ["ROS_PACKAGE_PATH"] = str(prefix / "share")
        path = check.SOURCE / repo / entry["entry"]
        os.chdir(path.parent)
        words = [w.replace("/corpus", str(check.SOURCE)) for w in entry["args"].split(" ") if ":=" in w]
        arguments = dict(word.split(":=", 1) for word in words)
        yield f"{entry['repo']} {path.name} {' '.join(words)}".strip(), path, arguments


def _measure(name: str, path: Path, arguments: dict[str, str], repeat: int) -> Row:
    def official() -> str:
        document = xacro.process_file(str(path), mappings=dict(arguments))
        return str(document.toprettyxml(indent="  "))

    def ours() -> str:
        return expand(str(path), arguments).require().text

    best = [math.inf] * 3
    with contextlib.redirect_stderr(io.StringIO()):
        equal = official() == ours()
        for _ in range(repeat):
            clear_cache()
            for index, function in enumerate((ours, ours, official)):  # cold, warm, official
                best[index] = min(best[index], _seconds(function))
    return Row(name, best[2], best[0], best[1], equal)


def _seconds(function: Callable[[], object]) -> float:
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def _table(rows: list[Row]) -> str:
    heaviest = sorted(rows, key=lambda row: -row.official)[:10]
    lines = [
        f"{sum(row.equal for row in rows)} of {len(rows)} entries equal the official output byte for byte.",
        "",
        "| entry | official, ms | KBot cold, ms | speed-up cold | speed-up warm |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for row in heaviest:
        lines.append(
            f"| {row.name[:80]} | {row.official * 1e3:.1f} | {row.cold * 1e3:.1f} "
            f"| {row.official / row.cold:.1f} | {row.official / row.warm:.1f} |"
        )
    for title, some in (("the ten heaviest", heaviest), ("all", rows)):
        cold, warm = (_mean([r.official / t for r, t in _pairs(some, which)]) for which in ("cold", "warm"))
        lines.append(f"| geometric mean, {title} | | | **{cold:.1f}** | **{warm:.1f}** |")
    return "\n".join([*lines, ""])


def _pairs(rows: list[Row], which: str) -> list[tuple[Row, float]]:
    return [(row, getattr(row, which)) for row in rows]


def _mean(ratios: list[float]) -> float:
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def _commands(smallest: Row) -> str:
    """Compare both commands as whole processes on the smallest entry."""
    import check

    name = smallest.name.split(" ")[1]
    path = next(check.SOURCE.rglob(name))
    folder = Path(sys.executable).parent
    best: dict[str, float] = {}
    scratch = tempfile.TemporaryDirectory()
    # both with compiled modules, as after an installation
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": scratch.name}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    for _ in range(10):
        for command in (["xacro"], ["kbot", "expand"]):
            words = [str(folder / command[0]), *command[1:], str(path)]
            taken = _seconds(
                lambda words=words: subprocess.run(words, check=True, capture_output=True, env=environment)
            )
            best[command[0]] = min(best.get(command[0], math.inf), taken)
    scratch.cleanup()
    return (
        f"As a whole process on {name}: `xacro` {best['xacro'] * 1e3:.0f} ms, "
        f"`kbot expand` {best['kbot'] * 1e3:.0f} ms.\n"
    )


def _source_map_cost() -> str:
    """Compare the normal expansion with one that does not record the sources of values."""

    class Nothing(list[object]):
        def append(self, item: object) -> None:
            pass

    path = SHARED / "chapter/corrected/kbot_description/urdf/kbot.xacro"
    usual = Run.__init__

    def without(self: Run, *args: object, **named: object) -> None:
        usual(self, *args, **named)  # type: ignore[arg-type] - passed through unchanged
        self.used = Nothing()  # type: ignore[assignment] - a list that keeps nothing

    best = [math.inf, math.inf]
    for _ in range(200):
        for index, start in enumerate((usual, without)):
            Run.__init__ = start  # type: ignore[method-assign,assignment] - restored below
            best[index] = min(best[index], _seconds(lambda: expand(str(path)).text))
    Run.__init__ = usual  # type: ignore[method-assign] - restores the original
    share = 100 * (best[0] - best[1]) / best[0]
    return f"Recording the sources of each value takes {max(share, 0):.0f} % of a warm expansion.\n"


if __name__ == "__main__":
    main()
