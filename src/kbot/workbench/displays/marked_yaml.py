"""YAML whose every value knows the line it is written on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from kbot.text import KbotError
from kbot.text.yaml_text import NOT_MADE, TOO_LARGE, safe_loader

MOST_VALUES = 50_000


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


def read_yaml(text: str, file: str) -> Marked:
    """The document of a text.

    Raises:
        KbotError: it is no YAML, or more of it than settings have; with the line.
    """
    import yaml

    try:
        node = yaml.compose(text, Loader=safe_loader())
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{file}:{mark.line + 1}" if mark else file
        raise KbotError(f"{where}: no YAML: {error.problem or error.context}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise KbotError(f"{file}: no YAML: {str(error).splitlines()[0]}") from None
    if node is None:
        return Marked(None, file, 1)
    return _Maker(file).make(node)


class _Maker:
    def __init__(self, file: str) -> None:
        import yaml

        self._file, self._count, self._yaml = file, 0, yaml
        self._constructor = safe_loader()("")
        self._open: list[Any] = []

    def make(self, node: Any) -> Marked:  # noqa: ANN401 - nodes of PyYAML have no common type
        line = node.start_mark.line + 1
        self._count += 1
        if self._count > MOST_VALUES or len(self._open) > 100 or node in self._open:
            raise self._error(node, "more or deeper than any settings are")
        self._open.append(node)
        try:
            return Marked(self._value(node), self._file, line)
        finally:
            self._open.pop()

    def _value(self, node: Any) -> Any:  # noqa: ANN401 - what YAML holds
        if isinstance(node, self._yaml.MappingNode):
            return {str(self.make(key).plain): self.make(value) for key, value in node.value}
        if isinstance(node, self._yaml.SequenceNode):
            return [self.make(item) for item in node.value]
        try:
            value = self._constructor.construct_object(node)
        except (self._yaml.YAMLError, *NOT_MADE) as error:
            if getattr(error, "problem", None) == TOO_LARGE:
                raise self._error(node, TOO_LARGE) from None
            said, kind = json.dumps(node.value, ensure_ascii=False)[:60], node.tag.rpartition(":")[2]
            raise self._error(node, f"{said} is no {kind}") from None
        return value

    def _error(self, node: Any, text: str) -> KbotError:  # noqa: ANN401 - PyYAML has no types
        return KbotError(f"{self._file}:{node.start_mark.line + 1}: {text}")
