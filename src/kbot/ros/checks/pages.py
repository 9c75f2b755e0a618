"""Registers the rule pages of launch file codes. pages.tsv has a line for each code."""

from pathlib import Path

from kbot.checks.pages import register_pages

register_pages(Path(__file__).with_suffix(".tsv"), {"L053": "safe: KBot writes the new name."})
