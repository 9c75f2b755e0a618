"""What fuzzing finds in the readers of files and the protocols of sockets.

    python benchmarks/bench_fuzz.py [SECONDS] [NAME…]

Each target edits real files or messages for ten minutes of processor time, guided by the code that they reach
(atheris). Inputs and processor time are those of all runs; a run counts only its own findings. A finding is
an unexpected exception, a crash, or an input that takes more than 10 s of processor time or 2 GB of memory.
Exit status 1 if there is one.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

RUNNER = Path(__file__).parents[1] / "fuzz" / "run.py"

if __name__ == "__main__":
    sys.exit(subprocess.run([sys.executable, str(RUNNER), *sys.argv[1:]], check=False).returncode)
