"""What the base installation brings is used, needed and listed in CONTRIBUTING.md."""

import re
import sys
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
DIRECT = [Requirement(line) for line in PROJECT["dependencies"]]
IMPORTED_AS = {
    "backports.zstd": "backports",
    "mujoco-core": "mujoco",
    "pillow": "PIL",
    "pycollada": "trimesh.exchange.dae",  # which imports collada
    "PyYAML": "yaml",
}
CODE = "\n".join(path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))


def listed(heading: str) -> set[str]:
    """The distributions in a table of the section "Dependencies"."""
    section = (
        (ROOT / "CONTRIBUTING.md")
        .read_text("utf-8")
        .partition("\n## Dependencies\n")[2]
        .partition("\n## ")[0]
    )
    table = section.partition(heading)[2].partition("\n\n")[0]
    rows = re.findall(r"^\| ([^|]+) \| [\d.]+ \|", table, re.MULTILINE)
    return {canonicalize_name(name) for row in rows for name in row.split(", ")}


def closure() -> set[str]:
    """All distributions that pip installs with KBot on this Python."""
    found: set[str] = set()
    waiting = list(DIRECT)
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name not in found and (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            found.add(name)
            waiting += map(Requirement, requires(requirement.name) or [])
    return found


@pytest.mark.parametrize("name", [each.name for each in DIRECT])
def test_a_dependency_is_imported(name: str) -> None:
    module = IMPORTED_AS.get(name, name.replace("-", "_"))
    assert re.search(rf"^\s*(import|from) {re.escape(module)}\b", CODE, re.MULTILINE)


def test_the_table_lists_what_pip_installs() -> None:
    only_before = {"backports-zstd": (3, 14), "typing-extensions": (3, 12)}
    expected = closure() | {name for name, version in only_before.items() if sys.version_info >= version}
    if sys.platform == "win32":
        expected -= {"colorama"}  # of click
    assert listed("\n| distribution | MB | what uses it |") - {"kbot"} == expected


def test_pip_installs_nothing_that_kbot_does_without() -> None:
    assert not closure() & listed("KBot does without these:\n\n| distribution | MB | in its place |")
