"""What a text of YAML holds, and one error for all that keeps it from being made."""

from __future__ import annotations

from typing import Any

NOT_MADE = ValueError, LookupError, TypeError, AttributeError, ArithmeticError
"""What PyYAML lets through where a text is not of its tag's kind, as in `!!int ''` and `2020-13-45`."""


def load_yaml(text: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Raises yaml.YAMLError: it is no YAML, or a value cannot be made of it."""
    import yaml

    try:
        return yaml.safe_load(text)
    except NOT_MADE as error:
        raise yaml.YAMLError(f"a value is not of its tag's kind: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("it is nested too deeply") from None
