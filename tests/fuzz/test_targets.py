"""Runs the targets of `fuzz/` with a few inputs, always the same. `fuzz/run.py` runs them for longer."""

import random
from importlib import import_module
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "fuzz"
INPUTS = 10


@pytest.mark.filterwarnings("ignore")  # edited files name wrong packages and have values without a meaning
@pytest.mark.parametrize("module", sorted(file.stem for file in FOLDER.glob("fuzz_*.py")))
def test_edited_files_and_messages_are_read_or_refused(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FOLDER))
    monkeypatch.chdir(tmp_path)
    choices = import_module("choices").Choices
    for name, target in import_module(module).TARGETS.items():
        noise = random.Random(name)
        for _ in range(INPUTS):
            data = bytes(noise.choices(range(noise.choice((128, 256))), k=600))  # half of them are ASCII
            target(choices(data))
