"""The pre-commit hooks, run by pre-commit itself, and the GitHub action's steps."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
FAILS = ROOT / "tests" / "checks" / "fixtures" / "J107" / "fails.xacro"
PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"


def run(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": PATH, "PRE_COMMIT_HOME": str(cwd / ".cache")}
    return subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A git repository with a robot of one finding and our hooks, run from where kbot is installed."""
    pytest.importorskip("pre_commit")
    if not shutil.which("git"):
        pytest.skip("there is no git")
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    for hook in hooks:
        hook["language"] = "system"
    config = {"repos": [{"repo": "local", "hooks": hooks}]}
    (tmp_path / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    shutil.copy(FAILS, tmp_path / "robot.xacro")
    (tmp_path / "notes.txt").write_text("not a robot\n")
    run("git", "init", "-q", cwd=tmp_path)
    run("git", "add", "robot.xacro", "notes.txt", ".pre-commit-config.yaml", cwd=tmp_path)
    return tmp_path


def test_the_check_hook_fails_on_a_finding_and_passes_without(repository: Path) -> None:
    words = (sys.executable, "-m", "pre_commit", "run", "kbot-check", "--all-files")
    done = run(*words, cwd=repository)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "[J107]" in done.stdout
    robot = repository / "robot.xacro"
    robot.write_text(robot.read_text("utf-8").replace('xyz="0 2 0"', 'xyz="0 1 0"'))
    run("git", "add", "robot.xacro", cwd=repository)
    assert run(*words, cwd=repository).returncode == 0


def test_the_fix_hook_mends_and_says_so(repository: Path) -> None:
    words = (sys.executable, "-m", "pre_commit", "run", "kbot-fix", "--all-files")
    done = run(*words, cwd=repository)
    assert done.returncode == 1
    assert "files were modified by this hook" in done.stdout
    assert run(*words, cwd=repository).returncode == 0


def test_the_action_annotates_and_fails(tmp_path: Path) -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    step = action["runs"]["steps"][1]
    assert set(step["env"]) == {"PATHS", "ARGUMENTS", "OPTIONS", "SARIF"}
    shutil.copy(FAILS, tmp_path / "robot.xacro")
    if not shutil.which("bash"):
        pytest.skip("there is no bash")
    environment = {
        **os.environ,
        "PATH": PATH,
        "PATHS": ".",
        "ARGUMENTS": "",
        "OPTIONS": "",
        "SARIF": "out.sarif",
    }
    done = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", step["run"]],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    assert "::warning file=robot.xacro,line=" in done.stdout
    assert '"ruleId": "J107"' in (tmp_path / "out.sarif").read_text("utf-8")
