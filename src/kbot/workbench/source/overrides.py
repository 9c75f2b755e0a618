"""Values of properties and arguments that the page overrides without changing the file."""

from __future__ import annotations

from collections.abc import Mapping

TRUTHS = {"true": 1.0, "True": 1.0, "false": 0.0, "False": 0.0}
"""Words for true and false, which pages receive as 1 and 0."""


class Overrides:
    """Values of arguments and properties: those given on the command line, then those set in the page."""

    def __init__(
        self, arguments: Mapping[str, str] | None = None, properties: Mapping[str, str] | None = None
    ) -> None:
        self.given_properties = dict(properties or {})
        self._given = {
            **{("arg", name): text for name, text in (arguments or {}).items()},
            **{("property", name): text for name, text in self.given_properties.items()},
        }
        self._set: dict[tuple[str, str], str] = {}

    @property
    def arguments(self) -> dict[str, str]:
        return self._of("arg")

    @property
    def properties(self) -> dict[str, str]:
        return self._of("property")

    @property
    def changed(self) -> dict[tuple[str, str], str]:
        """The values set in the page, by kind and name."""
        return dict(self._set)

    def set(self, kind: str, name: str, text: str) -> None:
        self._set[kind, name] = text

    def clear(self) -> None:
        self._set.clear()

    def value(self, kind: str, name: str, written: float) -> float:
        """Return the displayed value of a number that is `written` in the file."""
        text = self._set.get((kind, name), self._given.get((kind, name)))
        value = None if text is None else value_of(text)
        return written if value is None else value

    def _of(self, kind: str) -> dict[str, str]:
        return {
            name: text for (of_kind, name), text in {**self._given, **self._set}.items() if of_kind == kind
        }


def value_of(text: str) -> float | None:
    """Return the number in a text, 1 or 0 for a word for true or false, and None for anything else."""
    try:
        value = TRUTHS[text] if text in TRUTHS else float(text)
    except ValueError:
        return None
    return value if abs(value) < 1e9 and "_" not in text else None


def number_text(value: float) -> str:
    """Return a number with at most nine digits, without an exponent for everyday magnitudes."""
    text = f"{value:.9g}"
    if "e" in text and 1e-6 <= abs(value) < 1e9:
        text = f"{value:.15f}".rstrip("0").rstrip(".")
    return text
