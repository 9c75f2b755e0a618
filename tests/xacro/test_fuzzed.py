"""Tests inputs that fuzzing found: each one ends, with errors if it has any."""

from pathlib import Path

import pytest

from kbot.text.render import render_text, to_json
from kbot.xacro import Limits, expand_text

FILES = sorted((Path(__file__).parent / "fuzzed").iterdir())


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_found_by_fuzzing(file: Path) -> None:
    text = file.read_bytes().decode("utf-8", "surrogatepass")
    expansion = expand_text(text, "fuzz.xacro", {"x": "1"}, limits=Limits(steps=20_000, nodes=3_000))
    assert expansion.ok or expansion.diagnostics
    for diagnostic in expansion.diagnostics:
        assert to_json(diagnostic)["code"]
    render_text(expansion.diagnostics)
