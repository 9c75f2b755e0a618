"""Values that the page shows in place of those that are written."""

from __future__ import annotations

from collections.abc import Mapping


class Overrides:
    """Arguments (given on the command line, then set in the page) and properties (set in the page)."""

    def __init__(self, given: Mapping[str, str] | None = None) -> None:
        self._given = dict(given or {})
        self._set: dict[tuple[str, str], float] = {}

    @property
    def arguments(self) -> dict[str, str]:
        return {**self._given, **{n: number_text(v) for (kind, n), v in self._set.items() if kind == "arg"}}

    @property
    def properties(self) -> dict[str, str]:
        return {n: number_text(v) for (kind, n), v in self._set.items() if kind == "property"}

    @property
    def changed(self) -> dict[tuple[str, str], float]:
        """What was set in the page, by kind and name."""
        return dict(self._set)

    def set(self, kind: str, name: str, value: float) -> None:
        self._set[kind, name] = value

    def clear(self) -> None:
        self._set.clear()

    def value(self, kind: str, name: str, written: float) -> float:
        """What the picture shows for a number that is `written`."""
        if (kind, name) in self._set:
            return self._set[kind, name]
        try:
            return float(self._given[name]) if kind == "arg" and name in self._given else written
        except ValueError:
            return written


def number_text(value: float) -> str:
    """A number as one writes it: nine digits at most, no exponent where it is of everyday size."""
    text = f"{value:.9g}"
    if "e" in text and 1e-6 <= abs(value) < 1e9:
        text = f"{value:.15f}".rstrip("0").rstrip(".")
    return text
