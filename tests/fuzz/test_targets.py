"""Runs the targets of `fuzz/` with a few inputs, always the same. `fuzz/run.py` runs them for longer."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "fuzz"


@pytest.mark.parametrize("module", sorted(file.stem for file in FOLDER.glob("fuzz_*.py")))
def test_edited_files_and_messages_are_read_or_refused(module: str, tmp_path: Path) -> None:
    # targets replace limits and calls in their process, so it is not the process of the other tests
    command = [sys.executable, str(FOLDER / "run.py"), "--few", module]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
