"""Tests random documents: KBot and the official package have the same result, or both have an error.

KBOT_DIFFERENTIAL_EXAMPLES is the number of documents. The nightly run uses 20,000.
"""

import os

import pytest
from hypothesis import HealthCheck, given, settings
from xacro_documents import documents
from xacro_official import expand_text as official_text

from kbot.xacro import expand_text

EXAMPLES = int(os.environ.get("KBOT_DIFFERENTIAL_EXAMPLES", "500"))
SIZES = ("4", "-0.5")
"""The values of the documents' only argument."""
REFUSED = {"X190", "X191", "X199"}
"""Codes of what is refused for safety: the only errors that the official package need not have."""


@pytest.mark.parametrize("size", SIZES)
@settings(
    max_examples=EXAMPLES // len(SIZES),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    print_blob=True,
)
@given(text=documents)
def test_same_as_official(text: str, size: str) -> None:
    arguments = {"size": size}
    official = official_text(text, arguments)
    ours = expand_text(text, arguments=arguments)
    errors = [d for d in ours.diagnostics if d.is_error]
    if errors and {d.code for d in errors} <= REFUSED:
        return
    assert (ours.plain_text if ours.ok else None) == official, "\n".join(map(str, errors))
