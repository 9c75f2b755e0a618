"""Replaces single values of a scenario, by the path of their key: `duration`, `steps.0.linear`.

A path has the keys that lead to a value in the YAML of the scenario, and the index in a list. The name of a
step's action or of an expectation can be left out: `steps.0.linear` is `steps.0.command.linear`.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from kbot.sim.injected_faults import FAULTS
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.actions import DriveWithPolicy, InjectFault, RunScript
from kbot.trials.expectations import Bound
from kbot.trials.scenario import Scenario, Step
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
    keys = path.split(".")
    if keys[0] in _OWN:
        instead = {"world": "world", "seeds": "seed"}.get(keys[0])
        hint = f". Use --set {instead}=…" if instead else ""
        raise KbotError(f"scenario.{keys[0]} cannot be replaced{hint}")
    try:
        found: Scenario = _replaced(scenario, Scenario, keys, value)
    except KbotError as error:
        raise KbotError(f"scenario.{path} = {value}: {error}") from None
    return found


def _replaced(owner: Any, hint: Any, keys: Sequence[str], value: KeyValue) -> Any:  # noqa: ANN401 - of any field
    """An object with another value at the end of a path. `hint` is the type of the object."""
    if not keys:
        return _converted(value, owner, hint)
    key, rest = keys[0], keys[1:]
    if dataclasses.is_dataclass(owner) and not isinstance(owner, type):
        return _replaced_field(owner, key, rest, value)
    if isinstance(owner, Mapping):
        if key not in owner:
            hint = suggest_or_list(key, map(str, owner)) if owner else "the scenario has none"
            raise KbotError(f"there is no '{key}': {hint}")
        inner = _replaced(owner[key], _item_hint(hint), rest, value)
        return {**owner, key: inner}
    if isinstance(owner, Sequence) and not isinstance(owner, str):
        if not (key.isascii() and key.isdecimal() and int(key) < len(owner)):
            raise KbotError(f"'{key}' is not the index of one of {len(owner)} items: the first is 0")
        items = list(owner)
        items[int(key)] = _replaced(items[int(key)], _item_hint(hint), rest, value)
        return tuple(items)
    raise KbotError(f"there is no '{key}': the scenario does not give a value that has parts")


def _replaced_field(owner: Any, key: str, rest: Sequence[str], value: KeyValue) -> Any:  # noqa: ANN401
    hints = typing.get_type_hints(type(owner))
    inner = _INNER.get(type(owner), "")
    if key in hints and key != inner and key != "place":
        return replace(owner, **{key: _replaced(getattr(owner, key), hints[key], rest, value)})
    if inner:
        # the name of the action may be given or left out
        child = getattr(owner, inner)
        path = rest if key == _name_of(child) and rest else (key, *rest)
        return replace(owner, **{inner: _replaced(child, type(child), path, value)})
    if key == _name_of(owner) and rest:
        return _replaced(owner, type(owner), rest, value)
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


def _converted(value: KeyValue, old: object, hint: Any) -> Any:  # noqa: ANN401 - of any field
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
