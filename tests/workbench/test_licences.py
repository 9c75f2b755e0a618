"""The licences of the packages in the page: in a file that the server sends, and in exported pages."""

import importlib.util
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from kbot.cli.main import run
from kbot.workbench.built_page import FOLDER, LICENCES, load_page

ROOT = Path(__file__).parents[2]
WEB = ROOT / "web"
TEXT = (FOLDER / LICENCES).read_text("utf-8")
RULE = re.compile(r"^-{80}$", re.MULTILINE)
LISTED = re.compile(r"^(\S+) (\d\S*) \((\S+)\)$", re.MULTILINE)
"""A package, its version and the name of its licence."""
GRANTS = {
    "MIT": "Permission is hereby granted, free of charge",
    "OFL-1.1": "SIL OPEN FONT LICENSE Version 1.1",
}
"""A sentence of each licence."""

OpenPage = Callable[..., Any]


def locked(name: str, version: str) -> bool:
    """Whether npm installs this package for the page, and not only for its tools."""
    packages = json.loads((WEB / "package-lock.json").read_text("utf-8"))["packages"]
    found = packages.get(f"node_modules/{name}", {})
    return found.get("version") == version and not found.get("dev")


def test_every_package_that_the_sources_import_is_listed() -> None:
    imported = set()
    for file in WEB.joinpath("src").rglob("*"):
        if file.suffix in (".ts", ".css"):
            text = file.read_text("utf-8")
            found = re.findall(r"""(?:from |import |import\(|url\()["']((?:@[\w-]+/)?[\w-]+)[/"']""", text)
            imported |= set(found)
    assert {"three", "@codemirror/view", "uplot", "@fontsource-variable/inter"} < imported
    assert imported <= {name for name, _, _ in LISTED.findall(TEXT)}


def test_each_package_is_one_of_the_page_and_has_its_licence() -> None:
    _, *parts = RULE.split(TEXT)
    for part in parts:
        head, _, licence = part.strip().partition("\n\n")
        for line in head.splitlines():
            name, version, kind = LISTED.fullmatch(line).groups()
            assert locked(name, version), line
            assert GRANTS[kind] in licence, line
            assert "Copyright" in licence, line


def test_the_licence_of_the_wheel_names_each_of_them() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    kinds = {kind for _, _, kind in LISTED.findall(TEXT)}
    assert set(project["license"].split(" AND ")) == {"Apache-2.0", *kinds}


def test_the_server_sends_them(viewing: str, open_page: OpenPage) -> None:
    assert load_page()[f"/{LICENCES}"].body.decode() == TEXT
    page = open_page(viewing)
    page.keyboard.press("?")
    link = page.get_by_role("link", name="Show their licences")
    assert (
        page.evaluate("address => fetch(address).then((found) => found.text())", link.get_attribute("href"))
        == TEXT
    )


def test_an_exported_page_contains_them(tmp_path: Path, open_page: OpenPage) -> None:
    out = tmp_path / "kbot.html"
    assert run(["export", "kbot", "-o", str(out)]) == 0
    page = open_page(out.as_uri())
    page.get_by_role("button", name="About").click()
    page.get_by_text("Show their licences").click()
    assert page.locator("dialog[open] pre").inner_text().strip() == TEXT.strip()


@pytest.fixture
def build() -> ModuleType:
    """`hatch_build.py`."""
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_licence_files_of_a_package_are_built_in(
    build: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "WEB", tmp_path)
    (tmp_path / "a" / "LICENSE").mkdir(parents=True)  # sorts before the files
    (tmp_path / "a" / "package.json").write_text('{"name": "a", "version": "1.0", "license": "MIT OR BSD"}')
    for name in ("MIT", "BSD"):
        (tmp_path / "a" / f"LICENSE-{name}").write_text(f"{name} licence\n")
    found = tmp_path / "packages.json"
    found.write_text('["a"]')
    assert build.licences([found]).endswith("\n\na 1.0 (MIT OR BSD)\n\nBSD licence\n\nMIT licence\n")


def test_a_package_without_a_licence_is_not_built_in(
    build: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "WEB", tmp_path)
    for name in ("a", "b"):
        folder = tmp_path / "node_modules" / name
        folder.mkdir(parents=True)
        (folder / "package.json").write_text(f'{{"name": "{name}", "version": "1.0", "license": "MIT"}}')
        (folder / "LICENCE.md").write_text("Copyright of two\n")
    found = tmp_path / "packages.json"
    found.write_text('["node_modules/a", "node_modules/b"]')
    assert build.licences([found, found]).endswith("\n\na 1.0 (MIT)\nb 1.0 (MIT)\n\nCopyright of two\n")
    (tmp_path / "node_modules" / "b" / "LICENCE.md").unlink()
    with pytest.raises(SystemExit, match="the package b has no file with its licence"):
        build.licences([found])
