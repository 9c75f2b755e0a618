"""How KBot and its extras are installed. No package index has KBot, and each clone has its own address."""

import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from kbot.templates.package import TEMPLATE

from .pages import DOCS, ROOT, blocks

FOLDERS = ("docs", "examples", "src/kbot", "web/src", ".github", ".ci", "scripts", "benchmarks", "fuzz")
FILES = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "action.yml", "Makefile", "hatch_build.py")
TEXTS = {".md", ".py", ".sh", ".ts", ".yml", ".yaml", ".toml", ".in", ".ipynb", ""}
PLACEHOLDERS = re.compile(r"OWNER/kbot|URL-OF|(?<![\w./])kbot\[[a-z]|pip install '?\"?kbot\b(?!-)")
"""Names of repositories and packages that do not exist. `./kbot[camera]` is a path."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
FOR_CONTRIBUTORS = {"bench", "docs", "test"}
WORKFLOWS = (
    TEMPLATE / ".github" / "workflows" / "robot.yml",
    ROOT / "examples" / "drive_test" / ".github" / "workflows" / "drive.yml",
)


def texts() -> Iterator[Path]:
    yield from (ROOT / name for name in FILES)
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file() and path.suffix in TEXTS and "page" not in path.parts:
                yield path


def test_no_text_names_a_package_or_a_repository_that_does_not_exist() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in texts()
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if PLACEHOLDERS.search(line)
    ]
    assert found == []


def test_the_page_lists_every_extra_for_users() -> None:
    page = (DOCS / "how-to" / "install.md").read_text("utf-8")
    assert (
        set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE))
        == {*PROJECT["optional-dependencies"]} - FOR_CONTRIBUTORS
    )


def test_commands_of_pip_name_extras_and_the_version_that_exist() -> None:
    count = 0
    for path in texts():
        text = path.read_text("utf-8")
        for named in re.findall(r"(?:[ '\"]\.|/kbot|\.whl)\[([a-z0-9,]+)\]", text):
            assert {*named.split(",")} <= {*PROJECT["optional-dependencies"]}, path
            count += 1
        for version in re.findall(r"kbot-([\d.]+)-py3", text):
            assert version == PROJECT["version"], path
    assert count > 5


def test_commands_for_windows_work_in_powershell_5() -> None:
    """It has no `&&`, and no `source`."""
    found = [
        block
        for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS.rglob("*.md"))
        for block in blocks(path.read_text("utf-8"), "bat")
    ]
    assert len(found) >= 3
    for block in found:
        assert not re.search(r"&&|\|\||\bsource\b|'", block), block
    assert "[test]" not in (ROOT / "README.md").read_text("utf-8")


def steps(workflow: Path) -> list[dict[str, Any]]:
    (job,) = yaml.safe_load(workflow.read_text("utf-8"))["jobs"].values()
    found: list[dict[str, Any]] = job["steps"]
    return found


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_clones_kbot_from_the_address_that_the_user_sets(workflow: Path, tmp_path: Path) -> None:
    if not shutil.which("bash") or not shutil.which("git"):
        pytest.skip("there is no bash or no git")
    used = [step["uses"] for step in steps(workflow) if "uses" in step]
    assert all(name == "./.kbot" or name.startswith("actions/") for name in used)
    (get,) = (step for step in steps(workflow) if step.get("name") == "Get KBot")
    assert get["env"] == {"KBOT_URL": "${{ vars.KBOT_URL }}"}

    def run(address: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "KBOT_URL": address}
        words = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", get["run"])
        return subprocess.run(
            words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    unset = run("")  # GitHub gives a variable that is not set as an empty text
    assert unset.returncode != 0
    assert "KBOT_URL: is not set. See the first lines of this workflow" in unset.stderr
    assert "KBOT_URL" in "".join(workflow.read_text("utf-8").splitlines(keepends=True)[:5])
    clone = tmp_path / "kbot"
    clone.mkdir()
    (clone / "action.yml").write_text("name: kbot check\n")
    who = ("-c", "user.name=kbot", "-c", "user.email=kbot@localhost")
    for words in (("init", "-q"), ("add", "--all"), ("commit", "-q", "-m", "all")):
        subprocess.run(("git", *who, *words), cwd=clone, check=True)
    done = run(clone.as_uri())
    assert done.returncode == 0, done.stderr
    assert (tmp_path / ".kbot" / "action.yml").is_file()
