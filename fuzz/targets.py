"""All targets: the functions that fuzzing calls, by name."""

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from choices import Choices

Target = Callable[[Choices], None]
"""Raises an exception if it finds an error. It may write files into the working directory."""


def load_targets() -> Iterator[tuple[str, str, Target]]:
    """The name, module and function of each target in the `fuzz_*.py` of this folder."""
    for file in sorted(Path(__file__).parent.glob("fuzz_*.py")):
        for name, target in import_module(file.stem).TARGETS.items():
            yield name, file.stem, target
