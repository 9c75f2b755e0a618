"""The public interface is that of the snapshot: a change of it is a deliberate edit."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import NamedTuple

import pytest

from . import FOLDER, KINDS, RENEW, python_names, text_of
from .running import CASES, PLAIN, QUERIES, verbs_with_json


@pytest.mark.parametrize("kind", KINDS)
def test_the_interface_is_that_of_the_snapshot(kind: str) -> None:
    file = FOLDER / f"{kind}.txt"
    before, now = file.read_text("utf-8").splitlines(), text_of(kind).splitlines()
    changes = [line for line in difflib.unified_diff(before, now, n=0, lineterm="") if line[0] in "+-"][2:]
    message = (
        f"the public interface has changed. If this is intended, run {RENEW}. The changes of {file.name}:"
    )
    assert not changes, "\n".join((message, *changes))


def test_every_json_is_in_the_snapshot() -> None:
    """If this fails: add command lines of the verb to tests/interface/running.py."""
    assert {*verbs_with_json()} == {*CASES, *QUERIES, *PLAIN}


@dataclass(frozen=True)
class Point:
    x: float
    y: float = 0.5

    def scaled(self, by: float, *, origin: Point | None = None) -> Point:
        raise NotImplementedError


class Pair(NamedTuple):
    first: int
    second: int = 2


class Base:
    def __init__(self, size: int) -> None:
        self.size, self._hidden = size, 0

    def __len__(self) -> int:
        return self.size


class Held(Base):
    @property
    def half(self) -> float:
        return self.size / 2

    def _internal(self) -> None: ...


def test_each_fact_of_a_class_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions, keywords, defaults, and the members of a base without a public name."""
    monkeypatch.setattr(python_names, "_is_kbot", lambda value: value.__module__ == __name__)
    homes = {Point: "p.Point", Pair: "p.Pair", Held: "p.Held"}
    assert [line for kind, name in homes.items() for line in python_names.facts_of(name, kind, homes)] == [
        "p.Point: dataclass",
        "p.Point.x: field 1 float",
        "p.Point.y: field 2 float = 0.5",
        "p.Point.scaled: method -> Point",
        "p.Point.scaled(by): 1 float",
        "p.Point.scaled(origin): keyword Point | None = None",
        "p.Pair: class of tuple",
        "p.Pair(first): 1 int",
        "p.Pair(second): 2 int = 2",
        "p.Held: class",
        "p.Held(size): 1 int",
        "p.Held.__len__: method -> int",
        "p.Held.half: property float",
        "p.Held.size: attribute int",
    ]
