"""Accessibility of a page, as axe-core reports it."""

from pathlib import Path
from typing import Any

import pytest

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"

# axe-core works half as long if it reports only violations.
RUN = "within => axe.run(document.querySelector(within), {resultTypes: ['violations']})"


def violations(page: Any, within: str = "html") -> list[tuple[str, str, str]]:
    """Impact, rule and first element of each violation in the first element that matches a selector."""
    # the page's packages are absent if the page was built elsewhere, as in an sdist
    if not AXE.is_file():
        pytest.skip("axe-core is not installed (npm ci in web/ installs it)")
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate(RUN, within)["violations"]
    return [(violation["impact"], violation["id"], violation["nodes"][0]["html"]) for violation in found]
