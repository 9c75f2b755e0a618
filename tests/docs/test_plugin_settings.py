"""What the page on settings of plugins claims: its tables are those of the code."""

from __future__ import annotations

import sys

from .pages import DOCS

sys.path.insert(0, str(DOCS))

from plugin_tables import PAGE, with_tables


def test_the_tables_are_those_of_the_code() -> None:
    """If this fails: python docs/plugin_tables.py."""
    page = PAGE.read_text("utf-8")
    assert with_tables(page) == page
