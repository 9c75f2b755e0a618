"""Run every benchmark and write what they print to benchmarks/README.md.

    make benchmarks                         all of them
    python benchmarks/run.py drive xacro    some of them; the rest of the page stays

Each benchmark is a script of its own, `bench_NAME.py`; its docstring says what it measures, beside what.
Exit status 1 when one of them failed.
"""

from __future__ import annotations

import ast
import platform
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE / "README.md"
HEAD = """# What KBot costs, and how true it drives

Written by `make benchmarks`. Times are ratios to a peer measured in the same run, on the machine named
below each heading; figures of motion do not depend on the machine.
"""


def main(names: list[str]) -> int:
    scripts = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    unknown = [name for name in names if name not in scripts]
    if unknown:
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(scripts)}", file=sys.stderr)
        return 2
    made, failed = {}, []
    for name in names or scripts:
        print(f"{name} ...", file=sys.stderr)
        ran = subprocess.run([sys.executable, str(scripts[name])], stdout=subprocess.PIPE, text=True)
        print(ran.stdout)
        if ran.returncode:
            failed.append(name)
        made[name] = _section(scripts[name], ran.stdout, ran.returncode)
    sections = _read_page() | made
    PAGE.write_text(HEAD + "".join(sections[name] for name in scripts if name in sections))
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def _section(script: Path, output: str, status: int) -> str:
    doc = ast.get_docstring(ast.parse(script.read_text())) or ""
    title, _, rest = doc.partition("\n")
    said = [part for part in rest.strip().split("\n\n") if not part.lstrip().startswith("python ")]
    machine = f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"
    body = output.strip() if "\n|" in output else f"```text\n{output.strip()}\n```"
    end = f"\n\nExit status {status}." if status else ""
    parts = [f"## {script.stem.removeprefix('bench_')}: {title.rstrip('.')}", *said[:1], f"*{machine}*", body]
    return "\n" + "\n\n".join(parts) + end + "\n"


def _read_page() -> dict[str, str]:
    if not PAGE.exists():
        return {}
    parts = re.split(r"(?m)^(?=## )", PAGE.read_text())[1:]
    return {part[3:].split(":")[0]: "\n" + part.rstrip() + "\n" for part in parts}


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
