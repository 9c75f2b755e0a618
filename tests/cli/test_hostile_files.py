"""Every verb answers a hostile file within 10 s of CPU time and 1 GB of memory."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

VERBS = {
    "expand": ("expand", "FILE"),
    "where": ("where", "FILE", "base_link"),
    "info": ("info", "FILE"),
    "export": ("export", "FILE", "--to", "svg", "-o", "-"),
    "check": ("check", "FILE"),
    "view": ("view", "FILE", "--no-browser"),
    "sim headless": ("sim", "FILE", "--headless", "--duration", "0.1"),
}

H = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'


@pytest.mark.parametrize("verb", VERBS)
def test_a_file_that_is_not_a_robot_is_refusal(
    verb: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(f'{H}<link name="${{1 +}}"/></robot>')
    result = measured_kbot(*(str(file) if word == "FILE" else word for word in VERBS[verb]))
    assert result.is_refusal(), result
