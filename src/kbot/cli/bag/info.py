"""What `kbot bag info` prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.text.json_text import parse_json

if TYPE_CHECKING:
    from kbot.record.reader import Summary

_WALL_CLOCK = 1e9
"""Seconds (September 2001) from which on a time is taken to be the wall's and not a simulation's."""
_MAKERS = {"kbot": "KBot", "mujoco": "MuJoCo", "python": "Python", "machine": "on"}

Rows = list[tuple[str, str]]


def bag_text(path: str, found: Summary) -> str:
    """A recording's size, span, topics and facts, a line each."""
    lines = [f"{path}: {found.kind}, {found.count} messages over {found.seconds:.3f} s"]
    rows: Rows = [("size", _size(path))]
    if found.start is not None and found.end is not None:
        rows.append(("time", f"{_time(found.start)} to {_time(found.end)}"))
    for name, values in found.notes.items():
        rows += _facts(name, values)
    wide = max(len(label) for label, _ in rows)
    lines += [f"  {label:<{wide}}  {value}" for label, value in rows]
    wide = max((len(name) for name in found.topics), default=0)
    lines += [
        f"  {name:<{wide}}  {topic.count:>8}  {topic.type_name}"
        for name, topic in sorted(found.topics.items())
    ]
    if found.broken:
        until = f" up to {found.end * 1e-9:.3f} s" if found.end is not None else ""
        lines.append(f"It is not whole: {found.broken}. The {found.count} messages{until} can be read.")
    return "\n".join(lines)


def _size(path: str) -> str:
    place = Path(path)
    files = [file for file in place.iterdir() if file.is_file()] if place.is_dir() else [place]
    size = float(sum(file.stat().st_size for file in files))
    for unit in ("bytes", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}" if unit != "bytes" else f"{size:.0f} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"


def _time(nanoseconds: int) -> str:
    seconds = nanoseconds * 1e-9
    if seconds < _WALL_CLOCK:
        return f"{seconds:.3f} s"
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC ({seconds:.3f} s)"


def _facts(name: str, values: Mapping[str, str]) -> Rows:
    """KBot's own in words, those of others as they stand."""
    if name in ("kbot", "kbot.cut"):
        return list(_run(values, is_part=name == "kbot.cut"))
    if name == "kbot.end":
        steps, time, state = (values.get(key, "?") for key in ("steps", "time", "state_sha256"))
        return [("end", f"after {steps} steps, at {_number(time)} s, in the state {state[:12]}")]
    return [(f"{name}.{key}" if name else key, " ".join(value.split())) for key, value in values.items()]


def _run(values: Mapping[str, str], *, is_part: bool) -> Iterator[tuple[str, str]]:
    name, namespace, prefix = _list(values, "naming", 3)
    robot = values.get("robot", "?")
    called = f", called {name}" if name and name != robot else ""
    beneath = f", its topics beneath /{namespace}" if namespace else ""
    framed = f", its frames from {prefix}" if prefix else ""
    yield "robot", robot + called + beneath + framed
    yield "world", values.get("world", "?")
    x, y, yaw = (_number(value) for value in _list(values, "start", 3))
    if x:
        yield "start", f"x {x} m, y {y} m, yaw {yaw} rad"
    step, contacts = _number(values.get("timestep", "?")), values.get("contacts", "?")
    yield "physics", f"steps of {step} s, contacts {contacts}, seed {values.get('seed', '?')}"
    if is_part:
        yield "part", "cut from a longer recording"
    elif values.get("first_step", "0") != "0":
        yield "begun", f"at step {values['first_step']} of the run"
    yield "made by", ", ".join(f"{maker} {values[key]}" for key, maker in _MAKERS.items() if key in values)
    transforms = values.get("static_transforms", "[]")
    if transforms != "[]":
        yield "static", f"{len(_list(values, 'static_transforms', 0))} transforms of the launch"


def _list(values: Mapping[str, str], key: str, length: int) -> list[str]:
    """What is written as JSON; of that length, and empty texts where it is not there."""
    try:
        found = parse_json(values.get(key, "[]"))
    except ValueError:
        found = []
    found = [str(item) for item in found] if isinstance(found, list) else []
    return found if not length or len(found) == length else [""] * length


def _number(text: str) -> str:
    try:
        return f"{float(text):g}"
    except ValueError:
        return text
