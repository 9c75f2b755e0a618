"""docs/architecture.md names only files and definitions that exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "kbot"
PAGE = re.sub(r"```.*?```", "", (ROOT / "docs" / "architecture.md").read_text("utf-8"), flags=re.DOTALL)
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
