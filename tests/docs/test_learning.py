"""What the page on learning claims: its tables are those of the code, and its blocks run."""

from __future__ import annotations

import sys

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
def test_blocks_run(block: str) -> None:
    exec(compile("import gymnasium, kbot\n" + block, str(PAGE), "exec"), {})
