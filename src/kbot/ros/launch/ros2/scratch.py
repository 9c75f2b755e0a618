"""Writes texts that a launch file makes to temporary files, so that they can be read by their path."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache


def scratch_file(text: str, suffix: str) -> str:
    """Write a text to a new file and return its path. The file is deleted when KBot exits."""
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
