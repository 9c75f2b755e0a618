"""Builds sdist and wheel, installs the wheel into an empty environment, and uses it elsewhere."""

import json
import os
import re
import subprocess
import sys
import tarfile
import zipfile
from email import message_from_bytes
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(*command: str | Path, cwd: Path) -> str:
    """Run a program and return its output.

    Raises:
        AssertionError: the program failed. The error has its output.
    """
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{words}: {done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist and the wheel built from it."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    return folder


@pytest.fixture(scope="module")
def bare(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with only the wheel and its dependencies."""
    folder = tmp_path_factory.mktemp("bare")
    run(sys.executable, "-m", "venv", folder, cwd=folder)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    (wheel,) = built.glob("*.whl")
    run(programs / "python", "-m", "pip", "install", "-q", wheel, cwd=folder)
    return programs


def test_the_wheel_contains_the_page_the_robot_and_the_types(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for name in (
        "kbot/py.typed",
        "kbot/workbench/page/index.html",
        "kbot/robots/kbot_description/package.xml",
        "kbot/robots/kbot_description/urdf/kbot.xacro",
        "kbot/templates/robot/urdf/@NAME@.xacro.in",
    ):
        assert name in names
    assert {name.split("/")[0] for name in names} == {"kbot", f"kbot-{version('kbot')}.dist-info"}


def test_the_wheel_lists_the_npm_packages_in_its_page(built: Path) -> None:
    """The sdist has the list too, so the wheel needs no Node. The packages of build tools are not in it."""
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        bom = json.loads(archive.read(f"kbot-{version('kbot')}.dist-info/sboms/page.cdx.json"))
        assert "kbot/workbench/page/page.cdx.json" not in archive.namelist()
    assert bom["bomFormat"] == "CycloneDX"
    names = {f"{part.get('group', '')}/{part['name']}".strip("/") for part in bom["components"]}
    assert {"three", "uplot"} < {name.rpartition("/")[2] for name in names}
    assert not names & {"vite", "eslint", "typescript"}


def test_the_wheel_has_the_licences_of_all_that_is_in_it(built: Path) -> None:
    """Each package that npm installs for the page is in the file, or not in the page."""
    (wheel,) = built.glob("*.whl")
    info = f"kbot-{version('kbot')}.dist-info"
    with zipfile.ZipFile(wheel) as archive:
        metadata = message_from_bytes(archive.read(f"{info}/METADATA"))
        files = metadata.get_all("License-File")
        assert files == ["LICENSE", "src/kbot/workbench/page/third-party-licences.txt"]
        texts = [archive.read(f"{info}/licenses/{file}").decode() for file in files]
        assert texts[1] == archive.read("kbot/workbench/page/third-party-licences.txt").decode()
        bom = json.loads(archive.read(f"{info}/sboms/page.cdx.json"))
        page = b"".join(archive.read(name) for name in archive.namelist() if "/page/" in name)
    assert metadata["License-Expression"] == "Apache-2.0 AND MIT AND OFL-1.1"
    assert "Apache License" in texts[0]
    listed = dict(re.findall(r"^(\S+) (\d\S*) \(\S+\)$", texts[1], re.MULTILINE))
    installed = {part["purl"].partition("npm/")[2].replace("%40", "@") for part in bom["components"]}
    assert {f"{name}@{release}" for name, release in listed.items()} <= installed
    for name in listed:
        assert name in texts[1]
    assert len(listed) >= 20
    assert page.count(b"wOF2") == 2  # Inter and JetBrains Mono; the offline page has them as base64


def test_the_sdist_contains_the_sources_and_the_built_page(built: Path) -> None:
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for name in ("pyproject.toml", "hatch_build.py", "LICENSE", "web/package-lock.json"):
        assert name in names
    assert "src/kbot/workbench/page/index.html" in names
    assert not any("node_modules" in name or ".venv" in name for name in names)


def test_the_installed_command_works_anywhere(bare: Path, tmp_path: Path) -> None:
    kbot = bare / "kbot"
    assert run(kbot, "--version", cwd=tmp_path) == f"kbot {version('kbot')}\n"
    assert "<robot " in run(kbot, "expand", "kbot", cwd=tmp_path)
    words = ("sim", "kbot", "--headless", "--duration", "1", "--cmd-vel", "0.2,0", "--json")
    result = json.loads(run(kbot, *words, cwd=tmp_path))
    assert result["simulated_s"] == pytest.approx(1.0)
    assert 0.1 < result["pose"]["x"] < 0.2


INSTALL = "from kbot.text.extras import install_command; print(install_command('camera'))"


def test_the_command_for_an_extra_works_for_a_wheel_and_in_a_clone(bare: Path, tmp_path: Path) -> None:
    """`camera` is the smallest extra: PyOpenGL."""
    for python, folder in ((bare / "python", tmp_path), (sys.executable, ROOT)):
        command = run(python, "-c", INSTALL, cwd=folder)
        run("sh", "-c", f"{command.strip()} --quiet --dry-run", cwd=folder)
    (line,) = run(bare / "python", "-c", INSTALL, cwd=tmp_path).splitlines()
    run("sh", "-c", f"{line} --quiet", cwd=tmp_path)
    run(bare / "python", "-c", "import OpenGL", cwd=tmp_path)


def test_the_installation_is_small(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """5 % above its size of today, because the libraries have releases of their own."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    from bench_install_size import TARGET, sizes_of

    sizes = sizes_of(bare)
    sizes.pop("PyOpenGL", None)  # of an extra, which the test above installs
    assert {"kbot", "numpy", "mujoco-core"} < set(sizes)
    assert sum(size for _, size, _ in sizes.values()) < 1.05 * TARGET, sizes
