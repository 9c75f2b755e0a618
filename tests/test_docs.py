"""Tests that the docs name only files and definitions that exist, and that they list every built-in world."""

import re
from pathlib import Path

import click
import pytest

from kbot.cli.sim.command import command
from kbot.world import BUILDERS

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "kbot"
EXAMPLES = re.compile(r"mass|altimeter|nav-sat-fix|udp|unequal|U299")
"""Words in the paths of the examples in CONTRIBUTING.md, which do not exist."""


def text_of(name: str) -> str:
    """A document without its blocks of code."""
    return re.sub(r"```.*?```", "", (ROOT / name).read_text("utf-8"), flags=re.DOTALL)


PAGE = text_of("docs/explanation/architecture.md") + EXAMPLES.sub("EXAMPLE", text_of("CONTRIBUTING.md"))
PATHS = sorted(
    {
        word
        for word in re.findall(r"`([^`\s]+)`", PAGE)
        if re.search(r"/|\.(py|md|ts|toml|tsv)$", word) and not re.search(r"[A-Z]{4}|://|^/", word)
    }
)
DEFINITIONS = sorted(set(re.findall(r"`([\w.]+)` (?:in |\()`([\w/.]+\.py)`", PAGE)))


@pytest.mark.parametrize("path", PATHS)
def test_a_path_exists(path: str) -> None:
    assert any(list(folder.glob(path)) for folder in (SOURCE, ROOT))


@pytest.mark.parametrize(("name", "path"), DEFINITIONS)
def test_a_definition_is_in_its_file(name: str, path: str) -> None:
    last = name.rpartition(".")[2]
    text = (SOURCE / path).read_text("utf-8")
    assert re.search(rf"(def|class) {last}\b|^{last}\b|{last}:", text, re.MULTILINE)


@pytest.mark.parametrize("world", BUILDERS)
def test_help_and_docs_name_every_built_in_world(world: str) -> None:
    option = next(p for p in command.params if p.name == "world")
    assert isinstance(option, click.Option)
    assert re.search(rf"\b{world}\b", option.help or "")
    assert f"| `{world}` |" in (ROOT / "docs" / "reference" / "simulation.md").read_text("utf-8")
