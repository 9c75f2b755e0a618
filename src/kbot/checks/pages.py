"""The pages of codes that are reported before any rule runs: files, XML, expansion, URDF, simulation.

Their texts are in pages.tsv, one line per code.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from kbot.checks.registry import page
from kbot.text import Severity

_TYPO = "safe: KBot corrects the name if it is a typo of exactly one known name."
_NAMES = ("U006", "U007", "U011", "X103", "X112", "X121", "X122", "X129")
_AUTOFIXES = {
    **dict.fromkeys(_NAMES, _TYPO),
    "X103": f"{_TYPO} If the name is an argument, unsafe: KBot defines a property with the argument's value.",
    "X112": f"{_TYPO} If the name is a property, unsafe: KBot writes `${{NAME}}`.",
    "P001": "safe: KBot joins a root tag that was closed too early, removes white space before `<?xml`, "
    "corrects a typo in a start tag or an end tag, and inserts a missing `>` or end tag.",
    "P007": "safe: KBot removes white space before `<?xml`.",
    "X104": "safe: KBot writes a property that is a text as a number or an expression: `0,035` as 0.035.",
    "X131": "safe: KBot separates parameters by spaces.",
    "U012": "safe: KBot writes the number without a decimal comma, unit or second minus sign, and adds a "
    "missing `${}` to an expression.",
    "K001": "safe: KBot removes the comment.",
}


def register_pages(table: Path, autofixes: Mapping[str, str]) -> None:
    """Register the pages of a table that has one line per code."""
    lines = table.read_text("utf-8").splitlines()
    for line in lines[1:]:
        code, name, severity, what, why, example, fix = line.split("\t")
        autofix = autofixes.get(code, "none.")
        text = f"{what}\n\nWhy: {why}\n\nExample: {example}\n\nFix: {fix}\n\nAutofix: {autofix}"
        page(code, name, text, Severity(severity))


register_pages(Path(__file__).with_suffix(".tsv"), _AUTOFIXES)
