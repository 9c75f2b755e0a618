"""Size of an installation: of KBot's wheel and of everything that pip installs with it.

    python benchmarks/bench_install_size.py

The wheel is built and installed into a new virtual environment. The table has the files of each distribution,
as pip lists them in RECORD: all of them, and the bytecode among them, which pip compiles. A file counts with
its bytes, not with the blocks of the disk. pip itself is not counted. The last line is the size with
`pip install --no-compile` after a first run, for which Python has compiled only what KBot imports.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from bench_first_hour import build_wheel, make_environment, pip_install

TARGET = 180e6
"""Bytes of all distributions, with bytecode."""
LIST = """
import json
import sysconfig
from importlib.metadata import distributions
from pathlib import Path

found = {}
for each in distributions():
    files = [Path(file.locate()) for file in each.files]
    sizes = {file: file.stat().st_size for file in files if file.is_file()}
    bytecode = sum(size for file, size in sizes.items() if file.suffix == ".pyc")
    found[each.name] = each.version, sum(sizes.values()), bytecode
folder = Path(sysconfig.get_path("purelib"))
everything = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
print(json.dumps([found, everything]))
"""
"""Prints the version, bytes and bytes of bytecode of each distribution, then the bytes of their folder."""


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        wheel = str(build_wheel(Path(folder)))
        compiled, bare = (make_environment(Path(folder) / name) for name in ("compiled", "bare"))
        before = _listed(bare)[1]
        pip_install(compiled, wheel)
        sizes = sizes_of(compiled)
        pip_install(bare, "--no-compile", wheel)
        drive = [str(bare / "kbot"), "sim", "kbot", "--headless", "--duration", "1"]
        subprocess.run(drive, check=True, stdout=subprocess.DEVNULL)
        first_run = _listed(bare)[1] - before
    print(f"{'distribution':24}{'version':>12}{'MB':>8}{'bytecode':>10}")
    for name, (version, size, bytecode) in sorted(sizes.items(), key=lambda item: -item[1][1]):
        print(f"{name:24}{version:>12}{size / 1e6:8.1f}{bytecode / 1e6:10.1f}")
    total = sum(size for _, size, _ in sizes.values())
    print(f"{'all':36}{total / 1e6:8.1f}   (target: {TARGET / 1e6:g})")
    print(f"{'--no-compile, after a first run':36}{first_run / 1e6:8.1f}")
    if total > TARGET:
        sys.exit(1)


def sizes_of(programs: Path) -> dict[str, tuple[str, int, int]]:
    """The version, the bytes and the bytes of bytecode of each distribution that pip installed."""
    return {name: sizes for name, sizes in _listed(programs)[0].items() if name not in ("pip", "setuptools")}


def _listed(programs: Path) -> tuple[dict[str, tuple[str, int, int]], int]:
    done = subprocess.run([str(programs / "python"), "-c", LIST], capture_output=True, check=True)
    found: tuple[dict[str, tuple[str, int, int]], int] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    main()
