"""The folder of a sweep: what it runs, the journal, and the table."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kbot.sweep.designs import Method
from kbot.sweep.journal import Journal
from kbot.sweep.plan import SCHEMA, Plan
from kbot.text import KbotError
from kbot.text.files import read_text, write_text
from kbot.text.json_text import parse_json

PLAN, JOURNAL, TABLE, LOCK = "sweep.json", "runs.jsonl", "results.parquet", ".lock"
FILES = (PLAN, JOURNAL, TABLE, LOCK)
_OPTIONS = {
    "schema": "the version of its files is",
    "robot": "its robot is",
    "dimensions": "it varies",
    "scenarios": "its scenarios are",
    "method": "its method is",
    "objectives": "its objectives are",
    "designs": "the number of its designs is",
    "inputs": "the files of the robot or of the scenario have",
}
"""How the sentence about a difference begins, for each key of the file `sweep.json`."""


@contextmanager
def opened_folder(out: str, plan: Plan) -> Iterator[Journal]:
    """Open a sweep's folder, or create it, and keep other processes out of it within the block.

    Raises:
        KbotError: it has another sweep, another process uses it, or it cannot be written.
    """
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise KbotError(f"--out takes a folder, and {out} is a file") from None
    except OSError as error:
        raise KbotError(f"the folder {out} cannot be created: {error.strerror}") from None
    _require_regular_files(folder)
    with _locked(folder):
        described, finished, table = folder / PLAN, folder / JOURNAL, folder / TABLE
        before = None
        if described.exists():
            before = _read_plan(described)
            _require_same(out, before, plan)
        else:
            for path in (finished, table):
                if path.exists():
                    raise KbotError(
                        f"{out} has {path.name}, but not {PLAN}. Choose another folder with --out"
                    )
        if before != plan.to_json():
            text = json.dumps(plan.to_json(), indent=2, ensure_ascii=False)
            write_text(described, text + "\n")
        try:
            with Journal(finished, plan) as journal:
                yield journal
        finally:
            if finished.exists() and not finished.stat().st_size:
                # nothing ran: another sweep can use the folder
                described.unlink()
                finished.unlink()
                table.unlink(missing_ok=True)


def _require_regular_files(folder: Path) -> None:
    """Raises KbotError: one is a link, which changes a file elsewhere, or a pipe, which may never end."""
    for name in FILES:
        try:
            mode = (folder / name).lstat().st_mode
        except OSError:  # most often missing; else its opening reports why
            continue
        if not stat.S_ISREG(mode):
            kind = "a link" if stat.S_ISLNK(mode) else "not a regular file"
            raise KbotError(f"{folder / name} is {kind}. Choose another folder with --out")


def _read_plan(path: Path) -> dict[str, Any]:
    try:
        found = parse_json(read_text(path))
    except ValueError as error:
        raise KbotError(f"{path} is not the description of a sweep: {error}") from None
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        raise KbotError(f"{path} is not the description of a sweep that this version of KBot can continue")
    return found


def _require_same(out: str, before: Mapping[str, Any], plan: Plan) -> None:
    """Raises KbotError: a sweep cannot be continued with other settings."""
    now = plan.to_json()
    for key, value in now.items():
        if key in before and type(before[key]) is not type(value):
            raise KbotError(f"{out}/{PLAN} is not the description of a sweep: its '{key}' has the wrong type")
    may_grow = plan.method is not Method.LHS
    # only an optimisation depends on its objectives
    fixed = [key for key in now if key != "objectives" or plan.method is Method.OPTIMIZE]
    differing = [key for key in fixed if before.get(key) != now[key]]
    if differing == ["designs"] and may_grow and now["designs"] > before.get("designs", 0):
        return
    if not differing:
        return
    key = differing[0]
    if key == "versions":
        raise KbotError(_other_versions(out, before.get(key, {}), now[key]))
    old, new = _shown(before.get(key)), _shown(now[key])
    what = "changed since it began" if key == "inputs" else f"{old}, not {new}"
    raise KbotError(
        f"{out} has another sweep: {_OPTIONS[key]} {what}. "
        "Choose another folder with --out, or delete this one"
    )


def _other_versions(out: str, before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """The error about programs that had other versions when the sweep began."""
    changed = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    old, new = (
        " and ".join(f"{name} {each.get(name, 'of an unknown version')}" for name in changed)
        for each in (before, now)
    )
    return (
        f"{out} was begun with {old}. Now it would run with {new}, which may give other results. "
        "Install the earlier version, or choose another folder with --out"
    )


def _shown(value: object) -> str:
    if isinstance(value, list):
        return "; ".join(map(str, value)) or "none"
    return str(value)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold a lock that the system releases when the process ends, however it ends."""
    path = folder / LOCK
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise KbotError(f"{folder} cannot be written: {error.strerror}") from None
    try:
        try:
            _lock(file)
        except BlockingIOError:
            why = f"another process runs the sweep in {folder}. Wait until it finishes, or stop it"
            raise KbotError(why) from None
        yield
    finally:
        os.close(file)


def _lock(file: int) -> None:
    """Raises BlockingIOError: another process has the lock."""
    try:
        import fcntl
    except ModuleNotFoundError:  # Windows
        import msvcrt

        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]  # Windows only
        except OSError:
            raise BlockingIOError from None
        return
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
