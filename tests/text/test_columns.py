"""Tests the columns of tables for the terminal."""

from kbot.text.columns import aligned


def test_columns_are_as_wide_as_their_widest_cell() -> None:
    rows = [("name", "value", "unit"), ("a", "12.5", "m"), ("longer", "3", "")]
    assert aligned(rows, left=(0, 2)) == [
        "name    value  unit",
        "a        12.5  m",
        "longer      3",
    ]
    assert aligned(rows)[1] == "     a   12.5     m"


def test_a_table_without_rows_has_no_lines() -> None:
    assert aligned([]) == []
