"""Registers the rule pages of launch file codes. pages.tsv has a line for each code."""

from pathlib import Path

from kbot.checks.pages import register_pages

_REMOVED = "safe: KBot removes the option."
_AUTOFIXES = {"L053": "safe: KBot writes the new name.", "L056": _REMOVED, "L057": _REMOVED}

register_pages(Path(__file__).with_suffix(".tsv"), _AUTOFIXES)
