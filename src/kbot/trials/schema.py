"""The format of scenarios in YAML, made from the dataclasses, and its JSON Schema."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.injected_faults import FAULTS
from kbot.text.suggest import suggest_or_list
from kbot.trials import actions, expectations
from kbot.trials.formats import (
    KEY_MISSING,
    KEY_UNKNOWN,
    NAME_UNKNOWN,
    VALUE_WRONG,
    WRONG,
    AsWritten,
    Entry,
    FileName,
    Format,
    ListOf,
    MapOf,
    Place,
    Record,
    Schema,
    Shared,
    Text,
    record,
    summary_of,
)
from kbot.trials.measures import FAMILIES, is_measure, measure_names, measures
from kbot.trials.places import find_file, find_policy, find_regular_file, find_robot, find_world
from kbot.trials.quantities import QUANTITIES
from kbot.trials.scenario import LARGEST_SEED, Program, Range, RobotSource, Scenario, Step

SCHEMA_ADDRESS = "http://json-schema.org/draft-07/schema#"
"""The version of JSON Schema that the YAML plugins of editors support."""


@dataclass(frozen=True, slots=True)
class Seeds:
    """A list of seeds, or their number: 3 means 0, 1 and 2."""

    label: str = "a list of integers, or how many seeds"

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        if isinstance(value, int) and not isinstance(value, bool):
            return range(value) if value > 0 else at.expected("at least 1", value)
        if not isinstance(value, list):
            return at.expected(self.label, value)
        wrong = [index for index, seed in enumerate(value) if not _is_seed(seed)]
        for index in wrong:
            (at / index).expected(f"integers from 0 to {LARGEST_SEED}", value[index])
        return WRONG if wrong else tuple(value)

    def schema(self) -> Schema:
        seeds = {
            "type": "array",
            "items": {"type": "integer", "minimum": 0, "maximum": LARGEST_SEED},
            "minItems": 1,
        }
        return {"anyOf": [{"type": "integer", "minimum": 1}, seeds]}


@dataclass(frozen=True, slots=True)
class FaultFormat:
    """A fault, with its kind and its duration."""

    kinds: Mapping[str, Record]
    duration: Entry
    label: str = "a mapping with kind"

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        if not isinstance(value, dict):
            return at.expected(self.label, value)
        rest = dict(value)
        kind, duration = rest.pop("kind", None), rest.pop("duration", None)
        if kind is None:
            return at.error(
                KEY_MISSING, f"'kind' is missing. Choose from {', '.join(self.kinds)}", at_key=True
            )
        if kind not in self.kinds:
            return (at / "kind").error(
                NAME_UNKNOWN, f"unknown fault '{kind}'", suggest_or_list(str(kind), self.kinds)
            )
        fault = self.kinds[kind].read(rest, at)
        seconds = self.duration.format.read(duration, at / "duration")
        return WRONG if WRONG in (fault, seconds) else actions.InjectFault(fault, seconds)

    def schema(self) -> Schema:
        variants = []
        for name, kind in self.kinds.items():
            each = kind.schema()
            own = {"kind": {"const": name, "description": kind.summary}, "duration": self.duration.schema()}
            properties = {**own, **{key: entry.schema() for key, entry in kind.entries.items()}}
            required = ["kind", *(key for key, entry in kind.entries.items() if entry.is_required)]
            variants.append({**each, "type": "object", "properties": properties, "required": required})
        return {"oneOf": variants}


@dataclass(frozen=True, slots=True)
class StepFormat:
    """A step: `at`, `when`, and one action under its name."""

    times: Record
    actions: Mapping[str, Format]
    label: str = "a mapping with at or when, and one action"

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        if not isinstance(value, dict):
            return at.expected(self.label, value)
        names = [name for name in value if name in self.actions]
        times: dict[Any, object] = {}
        is_fine = True
        for key, each in value.items():
            if key in self.times.entries:
                times[key] = each
            elif key not in self.actions:
                owner = next((name for name in names if str(key) in _keys(self.actions[name])), "")
                hint = (
                    f"it is a key of '{owner}': indent it further"
                    if owner
                    else suggest_or_list(str(key), [*self.actions, *self.times.entries])
                )
                (at / key).error(KEY_UNKNOWN, f"unknown key '{key}'", hint, at_key=True)
                is_fine = False
        if is_fine and len(names) != 1:
            found = f"not {len(names)}: {', '.join(names)}" if names else f"one of {', '.join(self.actions)}"
            code = KEY_MISSING if not names else VALUE_WRONG
            at.error(code, f"a step needs one action, {found}", at_key=True)
            is_fine = False
        begun = [self.actions[name].read(value[name], at / name) for name in names]
        found_times = self.times.read_entries(times, at)
        if not is_fine or WRONG in begun or WRONG in found_times.values():
            return WRONG
        place = str(at.document.span(*at.keys))
        return self.times.made({"action": begun[0], "place": place, **found_times}, at)

    def schema(self) -> Schema:
        found = self.times.schema()
        properties = {key: entry.schema() for key, entry in self.times.entries.items()}
        properties |= {name: each.schema() for name, each in self.actions.items()}
        one = [{"required": [name]} for name in self.actions]
        return {**found, "type": "object", "properties": properties, "oneOf": one}


@dataclass(frozen=True, slots=True)
class ExpectationFormat:
    """An expectation under its name, or bounds under the name of a measure."""

    kinds: Mapping[str, Record]
    bounds: Record
    label: str = "the name of an expectation or measure, with its settings"

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        if isinstance(value, str):
            settings, name, inner = None, value, at
        elif isinstance(value, dict) and len(value) == 1:
            ((key, settings),) = value.items()
            name, inner = str(key), at / key
        elif isinstance(value, dict) and value:
            return at.error(
                VALUE_WRONG,
                f"an item of 'expect' needs one name, not {len(value)}: {', '.join(map(str, value))}",
                "begin each expectation with '- ', and indent its settings further",
            )
        else:
            return at.expected(self.label, value)
        if name in self.kinds:
            return self.kinds[name].read(settings, inner)
        if not is_measure(name):
            known = [*self.kinds, *measure_names()]
            what = f"unknown expectation or measure '{name}'"
            return inner.error(NAME_UNKNOWN, what, suggest_or_list(name, known), at_key=True)
        found = self.bounds.read_entries(settings if isinstance(settings, dict) else {}, inner)
        if isinstance(settings, dict) or settings is None:
            return WRONG if WRONG in found.values() else self.bounds.made({"measure": name, **found}, inner)
        return inner.expected(self.bounds.label, settings)

    def schema(self) -> Schema:
        bare = [name for name, kind in self.kinds.items() if kind.may_be_empty]
        properties: dict[str, object] = {name: kind.schema() for name, kind in self.kinds.items()}
        for measure in measures().values():
            properties[measure.name] = self._bound(_with_unit(measure.description, measure.unit))
        patterns = {
            f"^{family.name}/.+$": self._bound(_with_unit(family.description, family.unit))
            for family in FAMILIES.values()
        }
        one = {
            "type": "object",
            "properties": properties,
            "patternProperties": patterns,
            "additionalProperties": False,
            "minProperties": 1,
            "maxProperties": 1,
        }
        return {"anyOf": [{"enum": bare}, one]}

    def _bound(self, description: str) -> Schema:
        return {"description": description, "allOf": [{"$ref": "#/definitions/bounds"}]}


ACTIONS: Mapping[str, type] = {
    "command": actions.Command,
    "goal": actions.Goal,
    "joint_command": actions.JointCommand,
    "push": actions.Push,
    "add_object": actions.AddObject,
    "move_object": actions.MoveObject,
    "remove_object": actions.RemoveObject,
}
"""Actions whose settings in YAML are the fields of their class. `policy`, `script` and `fault` are made in
`action_formats`."""
EXPECTATIONS: Mapping[str, type] = {
    "reaches": expectations.Reaches,
    "passes_through": expectations.PassesThrough,
    "never_touches": expectations.NeverTouches,
    "stays_upright": expectations.StaysUpright,
    "settles": expectations.Settles,
}


@cache
def scenario_format() -> Record:
    """The format of a scenario."""
    robot = record(
        RobotSource, {"file": FileName(find_robot), "packages": ListOf(FileName(find_file))}, short="file"
    )
    program = record(
        Program, {"file": FileName(find_regular_file), "arguments": ListOf(AsWritten())}, short="file"
    )
    times = record(Step, {"when": _condition()}, without=["action", "place"])
    expectation = ExpectationFormat({name: record(kind) for name, kind in EXPECTATIONS.items()}, _bounds())
    found = record(
        Scenario,
        {
            "robot": robot,
            "world": FileName(find_world, "the name of a world or of its file"),
            "start": record(PlanarPose),
            "seeds": Seeds(),
            "until": _condition(),
            "steps": ListOf(StepFormat(times, action_formats())),
            "programs": ListOf(program),
            "expect": ListOf(expectation),
        },
    )
    # the file's name is the default
    name = Entry(Text(), "name of the scenario; by default that of the file", "")
    return Record(Scenario, {**found.entries, "name": name}, "A scenario of kbot try.")


def _condition() -> Shared:
    names = {name: _with_unit(each.description, each.unit) for name, each in QUANTITIES.items()}
    return Shared("condition", MapOf(Shared("range", record(Range)), names, "quantity"))


def _bounds() -> Record:
    return record(expectations.Bound, without=["measure"])


def action_formats() -> dict[str, Format]:
    """The formats of the actions by their names."""
    formats: dict[str, Format] = {name: record(kind) for name, kind in ACTIONS.items()}
    formats["policy"] = record(actions.DriveWithPolicy, {"file": FileName(find_policy)})
    script = Entry(FileName(find_regular_file), summary_of(actions.RunScript))
    formats["script"] = Record(actions.RunScript, {"script": script}, script.description, "script")
    kinds = {name: record(kind) for name, kind in FAULTS.items()}
    formats["fault"] = FaultFormat(kinds, record(actions.InjectFault, {"fault": Text()}).entries["duration"])
    return formats


def json_schema() -> Schema:
    """The JSON Schema of a document of a scenario file."""
    condition = _condition().inner
    return {
        "$schema": SCHEMA_ADDRESS,
        "title": "Scenario of KBot",
        **scenario_format().schema(),
        "definitions": {
            "bounds": {**_bounds().schema(), "type": "object", "minProperties": 1},
            "condition": condition.schema(),
            "range": record(Range).schema(),
        },
    }


def _keys(action: Format) -> Container[str]:
    return action.entries if isinstance(action, Record) else ()


def _is_seed(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= LARGEST_SEED


def _with_unit(text: str, unit: str) -> str:
    return f"{text}, in {unit}" if unit else text
