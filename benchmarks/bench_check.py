"""`kbot check` over real robots: findings per rule, and what checking costs beside expanding.

    python benchmarks/bench_check.py [--corpus DIR] [--report FILE] [--list CODE] [--only TEXT]

The corpus is the folder of reference data's `corpus` (its `check.py` lays the packages out). It has no
mesh files, so that mesh-missing (G101) and package-not-found for meshes say nothing and are left out.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import os
import statistics
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kbot.checks import Config, all_rules, check_file, check_text
from kbot.checks.runner import examine, findings
from kbot.text import Diagnostic, read_source
from kbot.xacro import Packages, clear_cache, expand_text

LEFT_OUT = ("G101",)


def corpus_module(folder: Path) -> Any:  # noqa: ANN401
    spec = importlib.util.spec_from_file_location("corpus_check", folder / "check.py")
    if spec is None or spec.loader is None:
        sys.exit(f"{folder} has no check.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def entries(folder: Path, only: str) -> list[dict[str, str]]:
    with (folder / "manifest.csv").open(newline="") as file:
        return [e for e in csv.DictReader(file) if only in f"{e['repo']}/{e['entry']}"]


def best(function: Callable[[], object], repeats: int = 5) -> float:
    """Least processor time of a few runs, in seconds: other work on the machine does not count."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def measure(path: str, arguments: dict[str, str]) -> tuple[float, float]:
    """Seconds to expand an entry from its text, and to check it once it is expanded (reader and rules)."""
    source, packages, config = read_source(path), Packages().beside(path), Config()

    def expanded() -> object:
        clear_cache()
        return expand_text(source.text, path, arguments, packages=packages)

    def checked() -> object:
        clear_cache()
        return findings(examine(source, arguments, packages, config))

    expanding = best(expanded)
    return expanding, best(checked) - expanding


def keystroke(path: str, arguments: dict[str, str]) -> float:
    """Seconds from a one-character edit of an unsaved text to its findings, included files being known."""
    text, packages, config = read_source(path).text, Packages().beside(path), Config()
    check_text(text, path, arguments, packages, config)
    at = text.rindex("</robot>")
    edits = iter(range(100))

    def typed() -> object:
        edited = text[:at] + " " * (next(edits) + 1) + text[at:]
        return check_text(edited, path, arguments, packages, config)

    return best(typed)


def run(
    corpus: Path, only: str
) -> tuple[list[tuple[str, Diagnostic]], list[tuple[str, float, float, float]]]:
    module = corpus_module(corpus)
    own, every = module.PACKAGES
    found: list[tuple[str, Diagnostic]] = []
    times: list[tuple[str, float, float, float]] = []
    with tempfile.TemporaryDirectory() as scratch:
        prefixes: dict[str, Path] = {}
        for entry in entries(corpus, only):
            repo = entry["repo"].replace("/", "+")
            if repo not in prefixes:
                prefixes[repo] = Path(scratch) / repo
                module.install(prefixes[repo], {**every, **own.get(repo, {})})
            os.environ["AMENT_PREFIX_PATH"] = str(prefixes[repo])
            os.environ["ROS_PACKAGE_PATH"] = str(prefixes[repo] / "share")
            path = corpus / "src" / repo / entry["entry"]
            os.chdir(path.parent)
            words = [w.replace("/corpus", str(corpus / "src")) for w in entry["args"].split(" ") if ":=" in w]
            arguments = dict(w.split(":=", 1) for w in words)
            name = f"{entry['repo']}/{entry['entry']} {entry['args']}".strip()
            found += [(name, d) for d in check_file(str(path), arguments, config=Config())]
            times.append((name, *measure(str(path), arguments), keystroke(str(path), arguments)))
    return [(n, d) for n, d in found if d.code not in LEFT_OUT], times


def report(found: list[tuple[str, Diagnostic]], times: list[tuple[str, float, float, float]]) -> str:
    robots: dict[str, set[str]] = defaultdict(set)
    for name, diagnostic in found:
        robots[diagnostic.code].add(name)
    counts = Counter(d.code for _, d in found)
    severities = {d.code: str(d.severity) for _, d in found}
    rules = all_rules()
    ratios = sorted(checking / expanding for _, expanding, checking, _ in times)
    lines = [
        "# Findings over the corpus",
        "",
        f"{len(times)} entry points of 30 public repositories; {sum(counts.values())} findings, "
        f"{sum(1 for _, d in found if d.severity == 'error')} of them errors and "
        f"{sum(1 for _, d in found if d.severity == 'warning')} warnings. "
        "The corpus has no mesh files: G101 is left out.",
        "",
        "| code | rule | severity | findings | robots |",
        "| --- | --- | --- | ---: | ---: |",
    ]
    for code in sorted(counts):
        rule = rules.get(code)
        lines.append(
            f"| {code} | {rule.name if rule else ''} | {severities[code]} "
            f"| {counts[code]} | {len(robots[code])} |"
        )
    slow = sum(c > e for _, e, c, _ in times)
    typed = max(times, key=lambda t: t[3])
    lines += [
        "",
        f"Checking (reader and rules) costs {statistics.median(ratios):.2f} of the expansion of the same "
        f"file in the median, {ratios[-1]:.2f} at most, and more than the expansion for {slow} of "
        f"{len(times)}.",
        "",
        f"From a one-character edit of an unsaved text to its findings: {typed[3] * 1e3:.0f} ms at most "
        f"({typed[0]}).",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    shared = os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared"
    parser.add_argument("--corpus", type=Path, default=Path(shared) / "corpus")
    parser.add_argument("--report", type=Path, help="write the table there")
    parser.add_argument("--list", default="", help="print the findings whose code starts with this")
    parser.add_argument("--only", default="", help="only entries whose name contains this")
    options = parser.parse_args()
    target = options.report.absolute() if options.report else None
    found, times = run(options.corpus.absolute(), options.only)
    for name, diagnostic in found:
        if options.list and diagnostic.code.startswith(options.list):
            place = diagnostic.origin.span if diagnostic.origin else ""
            print(f"{name}\n    {place}: {diagnostic.severity}: {diagnostic.message} [{diagnostic.code}]")
    text = report(found, times)
    print(text)
    for name, expanding, checking, typed in sorted(times, key=lambda t: -t[2] / t[1])[:12]:
        print(f"{checking / expanding:6.2f}  {expanding * 1e3:8.2f} ms  {typed * 1e3:8.2f} ms  {name}")
    if target:
        target.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
