"""Installs and runs the pre-commit hooks with pre-commit, and runs the steps of the GitHub action."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
FAILS = ROOT / "tests" / "checks" / "fixtures" / "J107" / "fails.xacro"


def run(*words: str | Path, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a program without this Python environment, so that it cannot find the kbot under test."""
    own = str(Path(sys.executable).parent)
    path = os.pathsep.join(p for p in os.environ.get("PATH", "").split(os.pathsep) if p != own)
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV", "GIT_"))}
    environment = {**inherited, "PATH": path, **variables}
    return subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def git(*words: str | Path, cwd: Path) -> str:
    who = ("-c", "user.name=kbot", "-c", "user.email=kbot@localhost", "-c", "core.autocrlf=false")
    done = run("git", *who, *words, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository with one commit: the tracked files of this repository, with their current content."""
    if not shutil.which("git") or not (ROOT / ".git").exists():
        pytest.skip("this is no git repository")
    folder = tmp_path_factory.mktemp("published")
    for name in git("ls-files", "--cached", "--others", "--exclude-standard", "-z", cwd=ROOT).split("\0"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    git("init", "-q", cwd=folder)
    git("add", "--all", cwd=folder)
    git("commit", "-q", "-m", "all", cwd=folder)
    return folder


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which pre-commit keeps its environments."""
    return tmp_path_factory.mktemp("pre-commit")


@pytest.fixture
def repository(tmp_path: Path, published: Path) -> Path:
    """A user's repository: a robot with one finding, and a configuration that names KBot's repository."""
    rev = git("rev-parse", "HEAD", cwd=published).strip()
    hooks = [{"id": "kbot-check"}, {"id": "kbot-fix"}]
    config = {"repos": [{"repo": str(published), "rev": rev, "hooks": hooks}]}
    (tmp_path / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    shutil.copy(FAILS, tmp_path / "robot.xacro")
    (tmp_path / "notes.txt").write_text("not a robot\n")
    git("init", "-q", cwd=tmp_path)
    git("add", "--all", cwd=tmp_path)
    return tmp_path


def pre_commit(*words: str, cwd: Path, store: Path) -> subprocess.CompletedProcess[str]:
    return run(sys.executable, "-m", "pre_commit", *words, cwd=cwd, PRE_COMMIT_HOME=str(store))


def test_the_check_hook_is_installed_fails_on_a_finding_and_passes_without(
    repository: Path, store: Path
) -> None:
    words = ("run", "kbot-check", "--all-files")
    done = pre_commit(*words, cwd=repository, store=store)
    assert done.returncode == 1, done.stdout + done.stderr
    assert re.search(r"robot\.xacro:\d+:\d+: warning: .* \[J107\]", done.stdout)
    robot = repository / "robot.xacro"
    robot.write_text(robot.read_text("utf-8").replace('xyz="0 2 0"', 'xyz="0 1 0"'))
    git("add", "robot.xacro", cwd=repository)
    done = pre_commit(*words, cwd=repository, store=store)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_fix_hook_fixes_and_reports_it(repository: Path, store: Path) -> None:
    words = ("run", "kbot-fix", "--all-files")
    done = pre_commit(*words, cwd=repository, store=store)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "files were modified by this hook" in done.stdout
    assert 'xyz="0 1 0"' in (repository / "robot.xacro").read_text("utf-8")
    assert pre_commit(*words, cwd=repository, store=store).returncode == 0


def test_a_commit_without_a_robot_runs_no_hook(repository: Path, store: Path) -> None:
    done = pre_commit("run", "kbot-check", "--files", "notes.txt", cwd=repository, store=store)
    assert done.returncode == 0
    assert "no files to check" in done.stdout


def test_try_repo_takes_the_hooks(repository: Path, published: Path, store: Path) -> None:
    words = ("try-repo", str(published), "kbot-check", "--all-files")
    done = pre_commit(*words, cwd=repository, store=store)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "[J107]" in done.stdout


def test_the_steps_of_the_action_install_annotate_fail_and_drive(tmp_path: Path, published: Path) -> None:
    if not shutil.which("bash"):
        pytest.skip("there is no bash")
    action = yaml.safe_load((published / "action.yml").read_text("utf-8"))
    given = {
        **{f"inputs.{name}": str(entry["default"]) for name, entry in action["inputs"].items()},
        "inputs.sarif": "out.sarif",
        "steps.python.outputs.python-path": sys.executable,
    }
    folder = tmp_path / "workspace"
    folder.mkdir()
    shutil.copy(FAILS, folder / "robot.xacro")
    example = ROOT / "examples" / "drive_test"
    shutil.copy(example / "drive_straight.py", folder)
    workflow = yaml.safe_load((example / ".github/workflows/drive.yml").read_text("utf-8"))
    (ours,) = (s for s in workflow["jobs"]["drive"]["steps"] if s["uses"].startswith("OWNER/kbot@"))
    assert set(ours["with"]) <= set(action["inputs"])
    given |= {f"inputs.{name}": value for name, value in ours["with"].items() if name != "robot"}
    given["inputs.robot"] = "kbot"
    find, install, check, drive = action["runs"]["steps"]
    assert "inputs.script != ''" in drive["if"]
    assert find["uses"].startswith("actions/setup-python@")
    output = ""
    for step, status in ((install, 0), (check, 1), (drive, 0)):
        variables = {
            name: re.sub(r"\$\{\{ *(\S+) *\}\}", lambda m: given[m[1]], str(value))
            for name, value in step["env"].items()
        }
        runner = {"RUNNER_TEMP": str(tmp_path), "GITHUB_ACTION_PATH": str(published)}
        words = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"])
        done = run(*words, cwd=folder, **variables, **runner)
        assert done.returncode == status, done.stdout + done.stderr
        output += done.stdout
    assert "::warning file=robot.xacro,line=" in output
    assert '"distance_m"' in output
    assert (folder / "drive.png").read_bytes().startswith(b"\x89PNG")
    assert '"ruleId": "J107"' in (folder / "out.sarif").read_text("utf-8")
