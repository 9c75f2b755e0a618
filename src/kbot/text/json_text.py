"""Parses JSON from outside, with one type of error."""

from __future__ import annotations

import json
from typing import Any


def parse_json(text: str | bytes) -> Any:  # noqa: ANN401 - what JSON holds
    """Raises ValueError: it is not JSON, or is nested too deeply for Python's parser, which recurses."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
