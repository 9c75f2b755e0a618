"""Temporary files for texts that a launch file makes and other programs read."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache


def scratch_file(text: str, suffix: str) -> str:
    """The path of a new file with a text in it, which is there until the program ends."""
    with tempfile.NamedTemporaryFile(
        "w", suffix=suffix, dir=_folder(), delete=False, encoding="utf-8"
    ) as file:
        file.write(text)
    return file.name


@cache
def _folder() -> str:
    folder = tempfile.mkdtemp(prefix="kbot-launch-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
