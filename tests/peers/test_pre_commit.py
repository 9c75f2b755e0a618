"""Installs and runs the pre-commit hooks with pre-commit, and runs the steps of the GitHub action."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

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


FILM = "https://github.com/me/my_robot/actions/runs/1/artifacts/2"
"""Where GitHub keeps the film that a step uploads."""


class Action:
    """Runs the steps of action.yml as GitHub does. KBot is installed once."""

    def __init__(self, published: Path, temp: Path) -> None:
        text = yaml.safe_load((published / "action.yml").read_text("utf-8"))
        self.steps = {step["name"]: step for step in text["runs"]["steps"]}
        self.inputs = {name: str(entry["default"]) for name, entry in text["inputs"].items()}
        self._published, self._temp = published, temp
        assert self.steps["Find a Python"]["uses"].startswith("actions/setup-python@")
        done = self.run("Install kbot", temp)
        assert done.returncode == 0, done.stdout + done.stderr

    def run(
        self, name: str, folder: Path, github: Mapping[str, str] = MappingProxyType({}), **inputs: str
    ) -> subprocess.CompletedProcess[str]:
        """Run a step in a folder. `github` has values of GitHub's context, and variables in capitals."""
        assert set(inputs) <= set(self.inputs)
        values = {f"inputs.{key}": value for key, value in (self.inputs | inputs).items()}
        values |= {f"github.{key}": value for key, value in github.items()}
        values["steps.python.outputs.python-path"] = sys.executable
        values["steps.film.outputs.artifact-url"] = FILM
        step = self.steps[name]
        variables = {
            key: re.sub(r"\$\{\{ *(\S+) *\}\}", lambda m: values[m[1]], str(value))
            for key, value in step["env"].items()
        }
        variables |= {key: value for key, value in github.items() if key.isupper()}
        runner = {"RUNNER_TEMP": str(self._temp), "GITHUB_ACTION_PATH": str(self._published)}
        words = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"])
        return run(*words, cwd=folder, **variables, **runner)

    def kbot(self, *words: str, cwd: Path) -> None:
        done = run(self._temp / "kbot" / "bin" / "kbot", *words, cwd=cwd)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def action(published: Path, tmp_path_factory: pytest.TempPathFactory) -> Action:
    if not shutil.which("bash"):
        pytest.skip("there is no bash")
    return Action(published, tmp_path_factory.mktemp("runner"))


def inputs_of(workflow: Path) -> dict[str, str]:
    """What a workflow gives to KBot's action."""
    (job,) = yaml.safe_load(workflow.read_text("utf-8"))["jobs"].values()
    (ours,) = (step for step in job["steps"] if step.get("uses") == "./.kbot")
    found: dict[str, str] = ours["with"]
    return found


def test_the_steps_of_the_action_annotate_fail_and_drive(tmp_path: Path, action: Action) -> None:
    folder = tmp_path / "workspace"
    folder.mkdir()
    shutil.copy(FAILS, folder / "robot.xacro")
    example = ROOT / "examples" / "drive_test"
    shutil.copy(example / "drive_straight.py", folder)
    inputs = inputs_of(example / ".github/workflows/drive.yml") | {"robot": "kbot"}
    checked = action.run("Check", folder, **inputs, sarif="out.sarif")
    assert checked.returncode == 1, checked.stdout + checked.stderr
    assert "::warning file=robot.xacro,line=" in checked.stdout
    assert '"ruleId": "J107"' in (folder / "out.sarif").read_text("utf-8")
    assert "inputs.script != ''" in action.steps["Drive"]["if"]
    driven = action.run("Drive", folder, **inputs)
    assert driven.returncode == 0, driven.stdout + driven.stderr
    assert '"distance_m"' in driven.stdout
    assert (folder / "drive.png").read_bytes().startswith(b"\x89PNG")


def test_the_action_refuses_a_bad_change_of_a_new_package_and_accepts_a_good_one(
    tmp_path: Path, action: Action, published: Path
) -> None:
    """In a repository with a package from `kbot new` and its workflow, which clones KBot into it."""
    action.kbot("new", "my_robot", cwd=tmp_path)
    package = tmp_path / "my_robot"
    inputs = inputs_of(package / ".github" / "workflows" / "robot.yml")
    git("init", "-q", cwd=package)
    git("add", "--all", cwd=package)
    git("commit", "-q", "-m", "all", cwd=package)
    git("clone", "-q", published, package / ".kbot", cwd=package)

    def statuses() -> dict[str, int]:
        steps = {"Check": inputs, "Test": inputs, "Try": {"trials": "test"}}
        done = {name: action.run(name, package, **given) for name, given in steps.items()}
        texts.update({name: step.stdout + step.stderr for name, step in done.items()})
        return {name: step.returncode for name, step in done.items()}

    texts: dict[str, str] = {}
    assert statuses() == {"Check": 0, "Test": 0, "Try": 0}, texts
    macros = package / "urdf" / "macros.xacro"
    wheel = '<cylinder radius="${wheel_radius}"'
    wrong = "<cylinder radius=\"${wheel_radius*(1.1 if name == 'left_wheel' else 1)}\""
    macros.write_text(macros.read_text("utf-8").replace(wheel, wrong), "utf-8")
    assert statuses() == {"Check": 1, "Test": 1, "Try": 1}, texts
    (_, line) = (at for at, text in enumerate(macros.read_text("utf-8").splitlines(), 1) if wrong in text)
    assert re.search(rf"macros\.xacro:{line}:\d+", texts["Test"])
    assert "distance_to_target is" in texts["Try"]
    results = package / "kbot-results"
    assert {"tests.xml", "tests.html", "trials.xml", "trials.html"} <= {f.name for f in results.iterdir()}
    assert [*results.glob("tests/*.mcap")]
    assert [*results.glob("trials/*.mcap")]
    git("checkout", "-q", ".", cwd=package)
    robot = package / "urdf" / "my_robot.xacro"
    robot.write_text(robot.read_text("utf-8").replace("${500*length", "${700*length"), "utf-8")
    assert statuses() == {"Check": 0, "Test": 0, "Try": 0}, texts


def test_the_action_posts_how_a_pull_request_changes_the_behaviour(
    tmp_path: Path, action: Action, published: Path
) -> None:
    """`origin` is a repository on this machine, and a program that notes its arguments replaces `gh`."""
    package, origin, programs = (tmp_path / name for name in ("my_robot", "origin", "programs"))
    action.kbot("new", "my_robot", cwd=tmp_path)
    git("init", "-q", "--bare", origin, cwd=tmp_path)
    git("init", "-q", cwd=package)
    git("remote", "add", "origin", origin, cwd=package)
    git("add", "--all", cwd=package)
    git("commit", "-q", "-m", "all", cwd=package)
    git("push", "-q", "origin", "HEAD:main", cwd=package)
    git("clone", "-q", published, package / ".kbot", cwd=package)
    programs.mkdir()
    (programs / "gh").write_text('#!/bin/sh\necho "$@" > gh.txt\ncat "$5" >> gh.txt\n')
    (programs / "gh").chmod(0o755)
    github = {
        "base_ref": "main",
        "event.pull_request.number": "7",
        "repository": "me/my_robot",
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"),
        "GITHUB_OUTPUT": str(tmp_path / "outputs"),
    }
    assert "github.base_ref != ''" in action.steps["Compare"]["if"]

    drive = package / "urdf" / "drive.xacro"
    drive.write_text("<!-- the plugin -->\n".join(drive.read_text("utf-8").split("\n", 1)), "utf-8")
    done = action.run("Compare", package, github, compare=".", token="secret")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not (tmp_path / "outputs").exists()

    text = drive.read_text("utf-8").replace(
        "<wheelSeparation>${separation}", "<wheelSeparation>${1.1*separation}"
    )
    drive.write_text(text, "utf-8")
    line = text.partition("1.1*")[0].count("\n") + 1
    done = action.run("Compare", package, github, compare="urdf/my_robot.xacro", token="secret")
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "outputs").read_text("utf-8") == "changed=true\n"
    upload = action.steps["Upload the film"]
    assert upload["uses"].startswith("actions/upload-artifact@")
    assert upload["with"]["path"] == "${{ inputs.results }}/compare.webp"
    posted = action.run("Post", package, github, token="secret")
    assert posted.returncode == 0, posted.stdout + posted.stderr
    command, comment = (package / "gh.txt").read_text("utf-8").split("\n", 1)
    assert command == "pr comment 7 --body-file kbot-results/compare.md"
    assert f"urdf/drive.xacro:{line}:" in comment
    assert comment.endswith(f"[Film: before and after]({FILM})\n")
    assert comment in (tmp_path / "summary.md").read_text("utf-8")
    assert "secret" not in done.stdout + done.stderr + posted.stdout + posted.stderr + comment

    drive.write_text(text.replace("</robot>", ""), "utf-8")
    assert action.run("Compare", package, github, compare=".").returncode == 2
    done = action.run("Compare", package, github, compare="urdf/other.xacro")
    assert (done.returncode, done.stdout) == (
        0,
        "urdf/other.xacro is not in main: there is nothing to compare\n",
    )
