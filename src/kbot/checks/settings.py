"""Reads the configuration of checks: `[tool.kbot.check]` in pyproject.toml, or `[check]` in kbot.toml.

[tool.kbot.check]
select = ["ALL"]                 # codes, or prefixes of codes
ignore = ["S101", "I"]
per-file-ignores = { "vendor/*.xacro" = ["ALL"] }
baseline = "kbot-baseline.json"
arguments = [{ robot = "small" }, { robot = "large", arm = "true" }]
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from kbot.checks.config import Config
from kbot.checks.former_codes import FORMER_CODES
from kbot.checks.registry import all_rules, near_rules
from kbot.text import KbotError
from kbot.text.files import read_text
from kbot.text.suggest import did_you_mean

_KEYS = ("select", "ignore", "per-file-ignores", "baseline", "arguments")


def with_selection(config: Config, select: tuple[str, ...], ignore: tuple[str, ...]) -> Config:
    """A configuration with the selection of the command line applied.

    Raises:
        KbotError: a word is not the beginning of any code.
    """
    check_codes((*select, *ignore))
    return replace(config, select=select or config.select, ignore=(*config.ignore, *ignore))


def check_codes(words: tuple[str, ...]) -> None:
    """Raise a KbotError for a word that is neither ALL, a former code, nor the beginning of a code."""
    rules = all_rules()
    for word in words:
        if word not in ("ALL", *FORMER_CODES) and not any(code.startswith(word) for code in rules):
            hint = near_rules(word, ["ALL"])
            raise KbotError(f"no rule has a code that starts with '{word}'" + (f": {hint}" if hint else ""))


def load_config(beside: str) -> Config:
    """Load the configuration for a file or folder, from the nearest kbot.toml or pyproject.toml that has one.

    Raises:
        KbotError: the file is not TOML, or has an unknown key or an invalid value.
    """
    start = Path(beside).absolute()
    for folder in (start, *start.parents):
        for name, path in (("kbot.toml", ("check",)), ("pyproject.toml", ("tool", "kbot", "check"))):
            file = folder / name
            if not file.is_file():
                continue
            table = _table(file, path)
            if table is not None:
                return _config(table, file)
    return Config()


def _table(file: Path, path: tuple[str, ...]) -> dict[str, object] | None:
    try:
        table: Any = tomllib.loads(read_text(file))  # Any: what TOML holds
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise KbotError(f"{file} is not valid TOML: {error}") from None
    for key in path:
        if not isinstance(table, dict) or key not in table:
            return None
        table = table[key]
    if not isinstance(table, dict):
        raise KbotError(f"{file}: [{'.'.join(path)}] must be a table")
    return table


def _config(table: dict[str, object], file: Path) -> Config:
    for key in table:
        if key not in _KEYS:
            hint = did_you_mean(key, _KEYS) or "one of " + ", ".join(_KEYS)
            raise KbotError(f"{file}: unknown key '{key}' in the check table: {hint}")
    per_file = table.get("per-file-ignores", {})
    arguments = table.get("arguments", [])
    if not isinstance(per_file, dict):
        raise KbotError(f"{file}: per-file-ignores must be a table of patterns and lists of codes")
    if not isinstance(arguments, list) or not all(isinstance(a, dict) for a in arguments):
        raise KbotError(f"{file}: arguments must be a list of tables")
    baseline = table.get("baseline")
    if baseline is not None and not isinstance(baseline, str):
        raise KbotError(f"{file}: baseline must be a file name")
    config = Config(
        _words(table.get("select", ["ALL"]), "select", file),
        _words(table.get("ignore", []), "ignore", file),
        {str(pattern): _words(codes, "per-file-ignores", file) for pattern, codes in per_file.items()},
        str(file.parent / baseline) if baseline else None,
        tuple({str(k): _text(v) for k, v in a.items()} for a in arguments),
        str(file.parent),
    )
    check_codes((*config.select, *config.ignore, *(w for c in config.per_file_ignores.values() for w in c)))
    return config


def _words(value: object, key: str, file: Path) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise KbotError(f"{file}: {key} must be a list of codes")
    return tuple(value)


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
