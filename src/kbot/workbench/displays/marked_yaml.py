"""YAML values that know their line, for display files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from kbot.text import KbotError, Source
from kbot.text.yaml import PLAIN, Keys, YamlDocument, YamlError, read_yaml

MOST_VALUES = 50_000
"""Of settings, with each alias counted as what it stands for."""


@dataclass(frozen=True, slots=True)
class Marked:
    """A value and where it stands; of a mapping and a list the values are marked too."""

    value: Any
    file: str
    line: int

    def error(self, text: str) -> KbotError:
        return KbotError(f"{self.file}:{self.line}: {text}")

    @property
    def fields(self) -> dict[str, Marked]:
        """Raises KbotError: it is no mapping."""
        if not isinstance(self.value, dict):
            raise self.error(f"fields by name are expected here, not {self.said}")
        return self.value

    def at(self, label: str) -> Marked | None:
        """A field by its label, `A/B` being the field `B` of the field `A`."""
        found: Marked | None = self
        for part in label.split("/"):
            found = found.value.get(part) if found is not None and isinstance(found.value, dict) else None
        return found

    @property
    def items(self) -> list[Marked]:
        """Raises KbotError: it is no list."""
        if not isinstance(self.value, list):
            raise self.error(f"a list is expected here, not {self.said}")
        return self.value

    @property
    def said(self) -> str:
        """The value in an error's words."""
        if isinstance(self.value, dict | list):
            return "fields" if isinstance(self.value, dict) else "a list"
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
    """The document of a text.

    Raises:
        KbotError: it is not YAML, or it has more values than settings have; with the line.
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
