"""`kbot check` answers a hostile file within its bounds, and its work grows no faster than the file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

H = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'

MALFORMED = {
    "a long name before many blanks": f"{H}<p{'a' * 1_200}{' ' * 1_200}/ $ </robot>",
    "many beginnings of a value": f"{H}<p {'a= ' * 100_000}</robot>",
    "many lone ampersands": f"{H}<p a='{'&' * 300_000}'/></robot>",
    "a tag that does not end": f"{H}<p {' ' * 300_000}a='<",
}


@pytest.mark.parametrize("what", MALFORMED)
def test_what_is_not_well_formed_is_reported_at_once(
    what: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    (tmp_path / "robot.xacro").write_text(MALFORMED[what])
    result = measured_kbot("check", "robot.xacro")
    assert result.is_bounded(), result
    assert result.status == 2
    assert "not well-formed XML" in result.out
