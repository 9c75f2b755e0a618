"""Finds out whether a launch file is for ROS 1 or ROS 2."""

from __future__ import annotations

import re

from kbot.text import DescriptionError, read_source

_WORDS_OF_2 = re.compile(
    r"\$\((var|find-pkg-share|find-pkg-prefix|command|exec-in-pkg|find-exec)\b"
    r"|<node\b[^<>]*\bexec\s*=|<(let|executable|set_parameter|set_env|set_remap|push[_-]ros[_-]namespace)\b"
)


def is_ros_2(path: str, text: str | None = None) -> bool:
    """Whether a launch file is for ROS 2: by its name, or by words that ROS 1 does not have.

    `text` is the content of the file. If it is None, the file is read.
    """
    if path.endswith((".py", ".yaml", ".yml")):
        return True
    try:
        return bool(_WORDS_OF_2.search(read_source(path).text if text is None else text))
    except DescriptionError:
        return False
