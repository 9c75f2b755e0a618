"""Run a command as this process's only child and write what it used: `measure_process.py REPORT WORD…`.

The child is measured from here, because Linux starts a child's peak memory at that of the process
that forks it, and the test runner's own is large.
"""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

CPU_S = 10
"""CPU time in which a verb must have answered a hostile file."""

DATA_BYTES = 4 << 30
"""Where the system stops a child that fails the test anyway, before it takes the machine's memory."""


def limit_child() -> None:
    """Set the child's limits; the hard one is a second later, for a child that ignores SIGXCPU."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_DATA, (DATA_BYTES, DATA_BYTES))


def main() -> None:
    report, *words = sys.argv[1:]
    child = subprocess.Popen(words, preexec_fn=limit_child)
    _, status, usage = os.wait4(child.pid, 0)
    unit = 1 if sys.platform == "darwin" else 1024
    measured = {
        "status": os.waitstatus_to_exitcode(status),
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_bytes": usage.ru_maxrss * unit,
    }
    Path(report).write_text(json.dumps(measured), encoding="utf-8")


if __name__ == "__main__":
    main()
