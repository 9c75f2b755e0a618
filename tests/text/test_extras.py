"""The command that installs an extra, from a clone and for an installed wheel."""

import os
import shlex
import shutil
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from kbot.text import extras
from kbot.text.extras import install_command, needs_extra

ROOT = Path(__file__).parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="reads the command as sh does")


@pytest.fixture
def of_wheel(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if KBot was installed from a wheel with these requirements, as hatchling writes them."""
    lines = [
        "click>=8.1",
        "optuna>=5.0; extra == 'sweep'",
        "pyarrow>=16; extra == 'sweep'",
        "ray[client]>=2.40; (python_version < '3.15') and extra == 'ray'",
    ]
    monkeypatch.setattr(extras, "_clone", lambda: None)
    monkeypatch.setattr(extras, "requires", lambda name: lines)


@pytest.fixture
def python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The Python of an environment that is not active."""
    monkeypatch.setattr(sys, "executable", str(tmp_path / ".venv" / "bin" / "python"))
    return Path(sys.executable)


@pytest.mark.parametrize("extra", EXTRAS)
def test_in_a_clone_it_installs_the_clone_again(
    extra: str, python: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [".venv/bin/python", "-m", "pip", "install", "-e", f"{ROOT}[{extra}]"]
    assert shlex.split(install_command(extra)) == words
    monkeypatch.chdir(ROOT)
    assert install_command(extra) == f"{python} -m pip install -e '.[{extra}]'"


def test_of_an_active_environment_it_names_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: sys.executable)
    assert install_command("sweep").startswith("python -m pip install ")


def test_an_environment_of_uv_has_no_pip(python: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    monkeypatch.chdir(ROOT)
    assert install_command("sweep") == f"uv pip install --python {python} -e '.[sweep]'"


@pytest.mark.usefixtures("of_wheel")
def test_for_a_wheel_it_names_the_requirements(python: Path) -> None:
    """No index has KBot, and the file of the wheel may be gone."""
    assert install_command("sweep") == f"{python} -m pip install 'optuna>=5.0' 'pyarrow>=16'"
    *_, ray = shlex.split(install_command("ray"))
    assert Requirement(ray) == Requirement("ray[client]>=2.40; python_version < '3.15'")


@pytest.mark.usefixtures("of_wheel")
def test_an_unknown_extra_is_a_mistake_in_kbot() -> None:
    with pytest.raises(ValueError, match="'sweeps'"):
        install_command("sweeps")


def test_another_project_around_the_environment_is_no_clone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with `pip install --target vendor`."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "my_robot"\n')
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "vendor" / "kbot" / "text" / "extras.py"))
    assert "-e" not in shlex.split(install_command("sweep"))


def test_an_error_names_what_needs_the_extra() -> None:
    text = needs_extra("ROS 2", "ros2")
    assert text == f"ROS 2 needs the extra 'ros2'. Install it with: {install_command('ros2')}"
