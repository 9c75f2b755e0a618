"""Replaces single values of a scenario by the path of their key: `duration`, `steps.0.linear`.

A path has the keys that lead to a value in the YAML of the scenario, and the index in a list. The name of a
step's action or of an expectation can be left out: `steps.0.linear` is `steps.0.command.linear`.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from kbot.sim.injected_faults import FAULTS
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.actions import DriveWithPolicy, InjectFault, RunScript
from kbot.trials.expectations import Bound, Check
from kbot.trials.formats import field_texts, unit_in
from kbot.trials.measures import find_measure
from kbot.trials.quantities import require_quantity
from kbot.trials.scenario import Range, Scenario, Step
from kbot.trials.schema import ACTIONS, EXPECTATIONS

KeyValue = int | float | str

_INNER = {Step: "action", InjectFault: "fault"}
"""Fields whose own keys are written beside those of their owner, or one level below."""
_NAMES = {kind: name for name, kind in {**ACTIONS, **EXPECTATIONS, **FAULTS}.items()} | {
    DriveWithPolicy: "policy",
    InjectFault: "fault",
    RunScript: "script",
}
_OWN = frozenset({"name", "robot", "seeds", "world"})
"""Keys of a scenario that cannot be replaced by a path: who runs it chooses the robot, the world and the
seeds."""


def with_keys(scenario: Scenario, values: Mapping[str, KeyValue]) -> Scenario:
    """A scenario with other values, by path.

    Raises:
        KbotError: there is no such key, or it does not accept the value.
    """
    for path, value in values.items():
        scenario = with_key(scenario, path, value)
    return scenario


def with_key(scenario: Scenario, path: str, value: KeyValue) -> Scenario:
    """A scenario with another value. Raises KbotError as `with_keys` does."""
    first = path.partition(".")[0]
    if first in _OWN:
        instead = {"world": "world", "seeds": "seed"}.get(first)
        hint = f". Use --set {instead}=…" if instead else ""
        raise KbotError(f"scenario.{first} cannot be replaced{hint}")
    try:
        parts = _parts(scenario, path.split("."))
        found = _converted(value, parts[-1].value, parts[-1].hint)
        for part in reversed(parts):
            found = part.with_value(found)
    except KbotError as error:
        raise KbotError(f"scenario.{path} = {value}: {error}") from None
    replaced: Scenario = found
    return replaced


def unit_of_key(scenario: Scenario, path: str) -> str:
    """The unit of a value by its path. Empty if it does not have one. Raises KbotError: a key is unknown."""
    unit = ""
    for part in _parts(scenario, path.split(".")):
        is_bound = part.key in ("min", "max")
        if isinstance(part.owner, Bound) and is_bound:
            unit = find_measure(part.owner.measure).unit
        elif isinstance(part.owner, Check) and is_bound:
            unit = part.owner.unit
        elif isinstance(part.value, Range):
            unit = require_quantity(part.key).unit
        elif dataclasses.is_dataclass(part.owner) and not isinstance(part.owner, Range):
            unit = unit_in(field_texts(type(part.owner)).get(part.key, ""))
    return unit


@dataclass(frozen=True)
class _Part:
    """A key of a path, after the names that can be left out are resolved.

    owner  the dataclass, mapping or sequence that has the key
    key    its field, key or index
    value  what it has there
    hint   the type of the value
    """

    owner: Any
    key: str
    value: Any
    hint: Any

    def with_value(self, value: Any) -> Any:  # noqa: ANN401 - a field can have any type
        """The owner with another value."""
        if dataclasses.is_dataclass(self.owner) and not isinstance(self.owner, type):
            return replace(self.owner, **{self.key: value})
        if isinstance(self.owner, Mapping):
            return {**self.owner, self.key: value}
        index = int(self.key)
        return (*self.owner[:index], value, *self.owner[index + 1 :])


def _parts(scenario: Scenario, keys: Sequence[str]) -> list[_Part]:
    """The parts of a path, from the scenario on. Raises KbotError: a key is unknown."""
    owner: Any = scenario
    hint: Any = Scenario
    found: list[_Part] = []
    while keys:
        part, keys = _part(owner, hint, keys[0], keys[1:])
        if part is not None:
            found.append(part)
            owner, hint = part.value, part.hint
    return found


def _part(owner: Any, hint: Any, key: str, rest: Sequence[str]) -> tuple[_Part | None, Sequence[str]]:  # noqa: ANN401 - a field can have any type
    """The part of a key, and the keys that follow. None if the key is only the name of its owner."""
    if dataclasses.is_dataclass(owner) and not isinstance(owner, type):
        return _field(owner, key, rest)
    if isinstance(owner, Mapping):
        if key not in owner:
            known = suggest_or_list(key, map(str, owner)) if owner else "the scenario has none"
            raise KbotError(f"there is no '{key}': {known}")
        return _Part(owner, key, owner[key], _item_hint(hint)), rest
    if isinstance(owner, Sequence) and not isinstance(owner, str):
        if not (key.isascii() and key.isdecimal() and int(key) < len(owner)):
            raise KbotError(f"'{key}' is not the index of one of {len(owner)} items: the first is 0")
        return _Part(owner, key, owner[int(key)], _item_hint(hint)), rest
    raise KbotError(f"there is no '{key}': the scenario does not give a value that has parts")


def _field(owner: Any, key: str, rest: Sequence[str]) -> tuple[_Part | None, Sequence[str]]:  # noqa: ANN401 - any dataclass of a scenario
    hints = typing.get_type_hints(type(owner))
    inner = _INNER.get(type(owner), "")
    if key in hints and key != inner and key != "place":
        return _Part(owner, key, getattr(owner, key), hints[key]), rest
    if inner:
        # the name of the action may be given or left out
        child = getattr(owner, inner)
        return _Part(owner, inner, child, type(child)), rest if key == _name_of(child) and rest else (
            key,
            *rest,
        )
    if key == _name_of(owner) and rest:
        return None, rest
    known = [name for name in hints if name not in ("place", *_OWN)]
    raise KbotError(f"there is no '{key}': {suggest_or_list(key, known)}")


def _name_of(part: object) -> str:
    """The name under which an action, fault or expectation is written."""
    return part.measure if isinstance(part, Bound) else _NAMES.get(type(part), "")


def _item_hint(hint: Any) -> Any:  # noqa: ANN401 - a type hint
    arguments = typing.get_args(hint)
    return (
        arguments[-1] if arguments and arguments[-1] is not Ellipsis else arguments[0] if arguments else Any
    )


def _converted(value: KeyValue, old: object, hint: Any) -> Any:  # noqa: ANN401 - a field can have any type
    """A value with the type of its field."""
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        kinds = [each for each in typing.get_args(hint) if each is not types.NoneType]
        hint = kinds[0] if len(kinds) == 1 else type(old)
    if hint is bool:
        if value not in ("true", "false"):
            raise KbotError("expected true or false")
        return value == "true"
    if hint is int:
        if not isinstance(value, int):
            raise KbotError("expected an integer")
        return value
    if hint is float:
        if isinstance(value, str):
            raise KbotError("expected a number")
        return float(value)
    if hint is str:
        return str(value)
    if dataclasses.is_dataclass(hint):
        names = ", ".join(each.name for each in dataclasses.fields(hint) if each.name != "place")
        raise KbotError(f"it has parts. Add the key of one of them: {names}")
    raise KbotError("it is not a single value. Add the key or the index of one of its values")
