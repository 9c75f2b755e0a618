"""YAML values with their line numbers, for errors in display files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from kbot.text import KbotError, Source
from kbot.text.yaml import PLAIN, Keys, YamlDocument, YamlError, read_yaml

MOST_VALUES = 50_000
"""Values in a settings file. An alias counts as the values that it refers to."""


@dataclass(frozen=True, slots=True)
class Marked:
    """A value with its file and line. The values of mappings and lists are marked too."""

    value: Any
    file: str
    line: int

    def error(self, text: str) -> KbotError:
        return KbotError(f"{self.file}:{self.line}: {text}")

    @property
    def fields(self) -> dict[str, Marked]:
        """The fields of a mapping. Raises KbotError if the value is not a mapping."""
        if not isinstance(self.value, dict):
            raise self.error(f"expected a mapping, not {self.shown}")
        return self.value

    def at(self, label: str) -> Marked | None:
        """Return the field of a label. `A/B` is the field `B` of the field `A`."""
        found: Marked | None = self
        for part in label.split("/"):
            found = found.value.get(part) if found is not None and isinstance(found.value, dict) else None
        return found

    @property
    def items(self) -> list[Marked]:
        """The items of a list. Raises KbotError if the value is not a list."""
        if not isinstance(self.value, list):
            raise self.error(f"expected a list, not {self.shown}")
        return self.value

    @property
    def shown(self) -> str:
        """The value as errors quote it."""
        if isinstance(self.value, dict | list):
            return "a mapping" if isinstance(self.value, dict) else "a list"
        return (
            "nothing" if self.value is None else json.dumps(self.value, ensure_ascii=False, default=str)[:60]
        )

    @property
    def plain(self) -> Any:  # noqa: ANN401 - what YAML holds
        """The value without marks."""
        if isinstance(self.value, dict):
            return {name: entry.plain for name, entry in self.value.items()}
        return [entry.plain for entry in self.value] if isinstance(self.value, list) else self.value


def read_marked(text: str, file: str) -> Marked:
    """Return the document of a text.

    Raises:
        KbotError: malformed YAML, or more than MOST_VALUES values; with the line.
    """
    try:
        document = read_yaml(Source(file, text), PLAIN, MOST_VALUES)
    except YamlError as error:
        raise KbotError(f"{file}:{error.span.line}: not YAML: {error.problem}") from None
    return _marked(document, document.data, ())


def _marked(document: YamlDocument, value: object, keys: Keys) -> Marked:
    place = document.place(*keys)
    line = place.value.line if place else 1
    if isinstance(value, dict):
        value = {str(key): _marked(document, part, (*keys, str(key))) for key, part in value.items()}
    elif isinstance(value, list):
        value = [_marked(document, part, (*keys, str(number))) for number, part in enumerate(value)]
    return Marked(value, document.source.path, line)
