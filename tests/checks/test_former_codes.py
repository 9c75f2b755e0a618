"""A code that was merged into others keeps working wherever users write codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kbot.checks import Config, all_rules, check_file
from kbot.checks.baseline import without_known
from kbot.checks.former_codes import FORMER_CODES
from kbot.checks.registry import page
from kbot.cli.main import run

FIXTURES = Path(__file__).parent / "fixtures"
REPLACED = [("W145", "D131"), ("W146", "D107"), ("W146", "D108"), ("W146", "D109")]
"""As CHANGELOG.md has it: "D131 replaces W145; D107 to D109 replace W146"."""


@pytest.fixture(params=REPLACED, ids="-".join)
def codes(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    """A former code and its replacement, with a robot that has a finding of it in the working directory."""
    monkeypatch.chdir(tmp_path)
    former, code = request.param
    Path("robot.xacro").write_text((FIXTURES / code / "fails.xacro").read_text("utf-8"), "utf-8")
    return former, code


def found() -> set[str]:
    return {finding.code for finding in check_file("robot.xacro")}


def kbot(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    run(words)
    return capsys.readouterr().out


def test_every_former_code_leads_to_current_rules() -> None:
    rules = all_rules()
    names = {rule.name for rule in rules.values()}
    for code, former in FORMER_CODES.items():
        assert code not in rules
        assert former.name not in names
        assert set(former.codes) <= rules.keys()
    assert [(code, new) for code, former in FORMER_CODES.items() for new in former.codes] == REPLACED


def test_a_former_code_is_never_used_again() -> None:
    with pytest.raises(ValueError, match="W145 is now reported as D131"):
        page("W145", "another", "Another rule.")


def test_options_and_configurations(codes: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    former, code = codes
    assert code in found()
    assert f"[{code}]" not in kbot(capsys, "check", "robot.xacro", "--ignore", former, "-v")
    selected = json.loads(kbot(capsys, "check", "robot.xacro", "--select", former, "--json"))["findings"]
    assert code in {finding["code"] for finding in selected} <= set(FORMER_CODES[former].codes)
    for settings in (f'ignore = ["{former}"]', f'per-file-ignores = {{ "robot.*" = ["{former}"] }}'):
        Path("kbot.toml").write_text(f"[check]\n{settings}\n")
        assert code not in found()
    # the longest match decides, and a former code is a whole code
    Path("kbot.toml").write_text(f'[check]\nselect = ["{former}"]\nignore = ["{code[:3]}"]\n')
    assert code in found()


def test_a_prefix_means_only_current_codes() -> None:
    """Else `ignore = ["W"]`, for worlds, would hide an error of the drive."""
    assert Config(ignore=("W",)).wants("D131")
    assert Config(ignore=("W14",)).wants("D131")
    assert not Config(ignore=("W145",)).wants("D131")


def test_comments(codes: tuple[str, str]) -> None:
    former, code = codes
    text = Path("robot.xacro").read_text("utf-8")
    Path("robot.xacro").write_text(text.replace(f"expect: {code}", f"kbot: ignore[{former}]"), "utf-8")
    assert not found() & {code, "K001", "K002"}


def test_baselines(codes: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    """An entry of the former rule has its code and its message."""
    former, code = codes
    check = ("check", "robot.xacro", "--json", "--select", code)
    entry = {"code": former, "file": "robot.xacro", "message": "the former text", "count": 1}
    for entries, left in (([entry], 0), ([entry | {"file": "b"}], 1)):
        Path("known.json").write_text(json.dumps({"version": 1, "findings": entries}))
        findings = json.loads(kbot(capsys, *check, "--baseline", "known.json"))["findings"]
        assert len(findings) == left


def test_a_baseline_hides_as_many_findings_as_its_entry_counts(codes: tuple[str, str]) -> None:
    former, code = codes
    two = [finding for finding in check_file("robot.xacro") if finding.code == code] * 2
    assert len(two) == 2, "one cause is one finding"
    for count, left in ((1, 1), (2, 0)):
        entry = {"code": former, "file": "robot.xacro", "message": "the former text", "count": count}
        Path("known.json").write_text(json.dumps({"version": 1, "findings": [entry]}))
        assert len(without_known(two, "known.json")) == left


def test_sarif_names_the_former_code(codes: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    former, code = codes
    log = json.loads(kbot(capsys, "check", "robot.xacro", "--output-format", "sarif"))
    rules = {rule["id"]: rule for rule in log["runs"][0]["tool"]["driver"]["rules"]}
    assert rules[code]["deprecatedIds"] == [former]
    assert all(
        "deprecatedIds" not in rule for id, rule in rules.items() if id not in dict(map(reversed, REPLACED))
    )


@pytest.mark.parametrize("word", ["W145", "w145", "drive-joint-twice"])
def test_kbot_rule_prints_the_page_of_the_replacement(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["rule", word]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("D131 joint-named-twice (error")
    assert err == "note: W145 is now reported as D131\n"


def test_a_code_with_several_replacements(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["rule", "W146", "--json"]) == 0
    out, err = capsys.readouterr()
    rules = json.loads(out)["rules"]
    assert [rule["code"] for rule in rules] == ["D107", "D108", "D109"]
    assert all(rule["former_codes"] == ["W146"] for rule in rules)
    assert err == "note: W146 is now reported as D107, D108 or D109\n"


def test_a_code_without_a_replacement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """CHANGELOG.md: W142 was removed. A configuration that names it stays valid."""
    assert run(["rule", "W142"]) == 2
    assert capsys.readouterr().err == "error: W142 is no longer reported\n"
    monkeypatch.chdir(tmp_path)
    Path("kbot.toml").write_text('[check]\nignore = ["W142"]\n')
    Path("robot.xacro").write_text('<robot name="r"><link name="a"/></robot> <!-- kbot: ignore[W142] -->')
    assert {"K001"} <= found()
    assert "K002" not in found()


def test_links_to_the_pages_of_former_rules_still_lead_there() -> None:
    text = (Path(__file__).parents[2] / "docs" / "reference" / "rules.md").read_text("utf-8")
    for code, former in FORMER_CODES.items():
        assert f"\n### {code} {former.name}\n" in text
