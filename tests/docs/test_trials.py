"""What the page on trials claims: its tables are those of the code, and its scenarios pass."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from kbot.trials import Scenario, run_trial
from kbot.trials.scenario_file import read_scenarios

from .pages import DOCS, blocks

sys.path.insert(0, str(DOCS))

from scenario_tables import PAGE, with_tables


def test_the_tables_are_those_of_the_code() -> None:
    """If this fails: python docs/scenario_tables.py."""
    page = PAGE.read_text("utf-8")
    assert with_tables(page) == page


def scenarios(folder: Path) -> list[Scenario]:
    """The scenarios in the page's blocks."""
    page = PAGE.read_text("utf-8")
    texts = [(".yaml", text) for text in blocks(page, "yaml") if "duration:" in text]
    texts += [(".py", text) for text in blocks(page, "python") if "Scenario(" in text]
    (controller,) = (text for text in blocks(page, "python") if "kbot.Node(" in text)
    (folder / "to_a_metre.py").write_text(controller, "utf-8")
    found = []
    for number, (suffix, text) in enumerate(texts):
        path = folder / f"block{number}{suffix}"
        path.write_text(text, "utf-8")
        found += read_scenarios(str(path))
    return found


def test_its_scenarios_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # an example writes a report
    found = scenarios(tmp_path)
    assert len(found) == 6
    for scenario in found:
        for seed in scenario.seeds:
            result = run_trial(scenario, seed)
            assert result.passed, f"{scenario.name}: {result.reason}"


def test_the_change_in_the_first_example_fails_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first = blocks(PAGE.read_text("utf-8"), "yaml")[0]
    Path("drive.scenario.yaml").write_text(first.replace("linear: 0.2", "linear: 0.3"), "utf-8")
    (scenario,) = read_scenarios("drive.scenario.yaml")
    result = run_trial(scenario)
    assert result.reason is not None
    assert f"✗ drive  {result.reason}\n" in PAGE.read_text("utf-8")
    assert result.failed_at is not None
    assert f"drive-seed0.mcap --at {result.failed_at - 1.0:.1f}\n" in PAGE.read_text("utf-8")
