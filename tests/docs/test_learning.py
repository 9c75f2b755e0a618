"""What the page on learning claims: its tables are those of the code, and its blocks run."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from .pages import DOCS, blocks

sys.path.insert(0, str(DOCS))

from learning_tables import PAGE, with_tables

BLOCKS = blocks(PAGE.read_text("utf-8"), "python")


def test_the_tables_are_those_of_the_code() -> None:
    """If this fails: python docs/learning_tables.py."""
    page = PAGE.read_text("utf-8")
    assert with_tables(page) == page


@pytest.mark.parametrize("block", BLOCKS)
def test_blocks_run(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "barn").mkdir()
    world = {"rows": ["#" * 30, "#" + "." * 28 + "#", "#" * 30], "path": [[-2.25, 3.0], [-2.25, 13.0]]}
    (tmp_path / "barn" / "worlds.json").write_text(json.dumps({"7": world}))
    monkeypatch.chdir(tmp_path)
    exec(compile("import gymnasium, kbot\n" + block, str(PAGE), "exec"), {})
