"""Values of properties and arguments that the page overrides without changing the file."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.xacro.written_values import value_of


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
