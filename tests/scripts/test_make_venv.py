"""`make` chooses a Python for which the packages exist, and says which one to install if there is none.

The interpreters on PATH are scripts that answer as a Python of a version does.
"""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
NEWEST = PROJECT["tool"]["kbot"]["newest-python"]
BASE, TEST = (int(NEWEST[name].removeprefix("3.")) for name in ("base", "test"))
FAKE = """#!/bin/sh
case "$*" in
    *"sys.exit(sys.version_info < (3, 11))"*) [ {minor} -ge 11 ] ;;
    *"print(sys.version_info[1])"*) echo {minor} ;;
    *"import ensurepip, venv"*) ;;
    --version) echo "Python 3.{minor}.0" ;;
    "-m venv .venv") echo 3.{minor} > made ;;
    *) exit 9 ;;
esac
"""

pytestmark = pytest.mark.skipif(os.name == "nt", reason="make and sh are not used on Windows")


class Machine:
    """A clone, and a PATH with interpreters of our own."""

    def __init__(self, folder: Path) -> None:
        self.clone, self.programs = folder / "clone", folder / "bin"
        self.programs.mkdir()
        (self.clone / "scripts").mkdir(parents=True)
        for name in ("make_venv.sh", "need_wheels.sh"):
            shutil.copy(ROOT / "scripts" / name, self.clone / "scripts")
        shutil.copy(ROOT / "pyproject.toml", self.clone)
        for name in ("sh", "sed", "rm"):
            (self.programs / name).symlink_to(shutil.which(name))

    def install(self, name: str, minor: int) -> Path:
        program = self.programs / name
        program.write_text(FAKE.format(minor=minor))
        program.chmod(0o755)
        return program

    def run(self, *words: str, python: str = "") -> subprocess.CompletedProcess[str]:
        environment = {"PATH": str(self.programs), "PYTHON": python}
        return subprocess.run(
            ["sh", *words], cwd=self.clone, env=environment, capture_output=True, text=True, check=False
        )

    @property
    def made(self) -> str:
        """The version of the environment that was made."""
        file = self.clone / "made"
        return file.read_text().strip() if file.exists() else ""


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_a_python_without_wheels_for_the_tests_is_passed_over(machine: Machine) -> None:
    machine.install("python3", TEST + 1)
    machine.install(f"python3.{TEST}", TEST)
    done = machine.run("scripts/make_venv.sh")
    assert (done.returncode, machine.made) == (0, f"3.{TEST}"), done.stderr
    assert done.stdout == f"Creating .venv with Python 3.{TEST}.0\n"


def test_the_first_python_on_path_that_has_all_wheels_is_used(machine: Machine) -> None:
    machine.install("python3", 11)
    machine.install(f"python3.{TEST}", TEST)
    assert machine.run("scripts/make_venv.sh").returncode == 0
    assert machine.made == "3.11"


def test_kbot_runs_with_a_python_without_wheels_for_the_tests(machine: Machine) -> None:
    """A note names the Python that the tests need, and the tests refuse this one."""
    python = machine.install("python3", TEST + 1)
    done = machine.run("scripts/make_venv.sh")
    assert (done.returncode, machine.made) == (0, f"3.{TEST + 1}"), done.stderr
    assert f"Some packages that the extra 'test' needs have no wheel for Python 3.{TEST + 1}." in done.stdout
    assert f"Use Python 3.{TEST}." in done.stdout
    refused = machine.run("scripts/need_wheels.sh", "test", str(python))
    assert refused.returncode == 1
    assert f"Use Python 3.{TEST}." in refused.stderr
    assert machine.run("scripts/need_wheels.sh", "sweep", str(python)).returncode == 0


def test_a_python_without_wheels_for_kbot_is_refused(machine: Machine) -> None:
    machine.install("python3", BASE + 1)
    done = machine.run("scripts/make_venv.sh")
    assert (done.returncode, machine.made) == (1, "")
    missing = f"Some packages that KBot needs have no wheel for Python 3.{BASE + 1}. Use Python 3.{BASE}."
    assert missing in done.stderr


def test_an_old_python_is_refused(machine: Machine) -> None:
    machine.install("python3", 10)
    done = machine.run("scripts/make_venv.sh")
    assert (done.returncode, machine.made) == (1, "")
    assert done.stderr.startswith("KBot needs Python 3.11 or later, but none was found.")


def test_the_python_that_the_user_names_is_used_even_without_the_tests(machine: Machine) -> None:
    machine.install("python3", TEST)
    named = machine.install("my own", TEST + 1)
    done = machine.run("scripts/make_venv.sh", python=str(named))
    assert (done.returncode, machine.made) == (0, f"3.{TEST + 1}"), done.stderr


def test_make_test_checks_the_python_of_the_environment() -> None:
    """The environment may be older than the check, or made by hand."""
    rule = re.search(r"^\$\(tests\):.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert rule[1].splitlines()[0] == "\t@sh scripts/need_wheels.sh test $(python)"


def test_the_page_about_installing_names_the_same_versions() -> None:
    page = (DOCS / "how-to" / "install.md").read_text("utf-8")
    extras = {**PROJECT["project"]["optional-dependencies"], "base": ()}
    assert set(NEWEST) <= set(extras)
    assert f"Python 3.11 to {NEWEST['base']}" in page
    for extra in set(NEWEST) - {"base", "bench", "test"}:  # the last two are for contributors
        (row,) = re.findall(rf"^\| `{extra}` \|.*$", page, re.MULTILINE)
        assert f"up to Python {NEWEST[extra]}" in row
    assert f"py -{NEWEST['test']} -m venv" in (ROOT / "CONTRIBUTING.md").read_text("utf-8")
