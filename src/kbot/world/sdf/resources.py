"""Finds the files that a world names by `model://`, `package://`, `file://` or a relative path."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from kbot.text import DescriptionError, DiagnosticCollector, Element, KbotError, read_source
from kbot.text.files import from_file_uri
from kbot.text.suggest import did_you_mean
from kbot.text.xml import MAX_READ_NESTING, parse_document
from kbot.world.sdf.model_paths import LIBRARY, fuel_stores, model_paths
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.values import SdfValues
from kbot.xacro import Packages

NOT_IN_REACH = "{} is not in the models and packages of this machine"
"""The message for a file that a peer names. It does not reveal whether the file exists elsewhere."""

WHOLE = re.compile("[0-9]{1,9}")
"""A part of a version. `str.isdigit` also accepts what `int` rejects, such as '²' and 5000 digits."""

_FUEL = re.compile(
    r"https?://(?:app|fuel|staging-fuel)\.(?:gazebosim|ignitionrobotics)\.org/1\.0/([^/]+)/models/([^/]+)"
    r"(?:/([^/]+))?(?:/files/(.+))?"
)
"""Owner, model, version, and a file of the model."""


def read_xml(path: str | Path, findings: DiagnosticCollector | None = None) -> Element:
    """The root element of an SDF file.

    What libsdformat reads although it is not well-formed is added to the findings as a warning. Undeclared
    XML prefixes are allowed.

    Raises:
        DescriptionError: the file cannot be read.
    """
    document = parse_document(read_source(path), MAX_READ_NESTING, lenient=True)
    if findings is not None:
        findings.diagnostics += [fault for fault in document.diagnostics if fault.code != "P004"]
    return document.root


class ResourceFinder:
    """Finds files as Gazebo does.

    It searches the folders in Gazebo's environment variables, then around the file that names them, then in
    the models that ship with KBot. Results are cached, because a world may name a file a thousand times. With
    a `reach`, only files within it are found.
    """

    def __init__(self, values: SdfValues, reach: Reach | None = None) -> None:
        self._values, self._reach = values, reach
        self._found: dict[tuple[str, str], str | None] = {}
        self._reasons: dict[tuple[str, str], tuple[str, str]] = {}
        """The message and the hint about each file that is not found."""
        self._models: dict[str, tuple[str, Element]] = {}
        self._packages: dict[str, Packages] = {}

    def find(self, uri: Element, beside: str) -> str | None:
        """The file or folder of a `<uri>` in the file `beside`.

        If it is not found, the result is None and the finding a warning: the rest of the world is usable.
        """
        text = uri.text.strip()
        key = text, beside
        if key not in self._found:
            self._found[key] = self._usable(text, self._paths(text, Path(beside).absolute().parent))
        path = self._found[key]
        if path is None:
            if key not in self._reasons:
                self._reasons[key] = self._reason(text, beside)
            message, hint = self._reasons[key]
            self._values.fault("W202", message, uri.origin, "leaves it out", hint)
        return path

    def _reason(self, text: str, beside: str) -> tuple[str, str]:
        """The message and the hint about a file that is not found."""
        if _is_remote(text):
            hint = f"download it with: gz fuel download -u '{text}'" if _FUEL.match(text) else ""
            return f"KBot does not download models: {text}", hint
        if self._reach is not None:
            return NOT_IN_REACH.format(text or "an empty <uri>"), ""
        hint = ""
        if text.startswith("model://"):
            near = did_you_mean(text.removeprefix("model://"), self._names(beside))
            hint = near or "add the folder that contains the model's folder to GZ_SIM_RESOURCE_PATH"
        return f"{text or 'an empty <uri>'} not found", hint

    def _usable(self, uri: str, paths: Iterable[Path]) -> str | None:
        """The first path that exists and is in reach."""
        try:
            existing = (str(path) for path in paths if path.exists())
            return next((p for p in existing if self._reach is None or self._reach.holds(p, uri)), None)
        except (OSError, ValueError):  # not a valid file name, or in an unreadable folder
            return None

    def model(self, path: str) -> tuple[str, Element]:
        """The SDF file of a model (a folder or a file) and its root element.

        Raises:
            DescriptionError: the file cannot be read.
            KbotError: the folder has no SDF file, or the file is not in reach.
        """
        if path not in self._models:
            file = model_file(path)
            if self._reach is not None and not self._reach.holds(file):
                raise KbotError(NOT_IN_REACH.format(file))
            self._models[path] = file, read_xml(file, self._values.findings)
        return self._models[path]

    def _paths(self, text: str, folder: Path) -> Iterator[Path]:
        """The candidate paths of a URI, in search order."""
        scheme, mark, rest = text.partition("://")
        if not text:
            return
        if _is_remote(text):
            yield from self._local_copies(text, folder)
        elif mark and scheme == "package":
            around = str(folder)
            if around not in self._packages:
                self._packages[around] = Packages(around=around)
            with suppress(KbotError):
                found = self._packages[around].resolve(text)
                if found:
                    yield Path(found)
        elif mark and scheme == "file" and (path := Path(from_file_uri(rest))).is_absolute():
            yield path
        elif mark and scheme in ("model", "file"):
            yield from (root / rest for root in self._roots(folder))
        else:
            yield folder / text
            yield from (root / text for root in self._roots(folder))

    def _local_copies(self, text: str, folder: Path) -> Iterator[Path]:
        """The local copies of a model or file on Fuel: Gazebo's downloads, the wanted version first and then
        the newest, and models of that name."""
        found = _FUEL.match(text)
        if found is None:
            return
        owner, name, version, file = (unquote(part or "") for part in found.groups())
        for store in fuel_stores():
            copies = [
                p.parent for p in (store / owner.lower() / "models" / name.lower()).glob("*/model.config")
            ]
            copies.sort(key=lambda copy: (copy.name == version, _version(copy.name)), reverse=True)
            yield from (copy / file for copy in copies)
        for root in self._roots(folder):
            for spelling in (name, name.lower().replace(" ", "_")):
                if (root / spelling / "model.config").is_file():
                    yield root / spelling / file

    def _roots(self, folder: Path) -> Iterator[Path]:
        """The folders that may contain model folders."""
        yield from model_paths()
        for parent in (folder, *folder.parents[:3]):
            yield parent
            yield parent / "models"
        yield LIBRARY

    def _names(self, beside: str) -> list[str]:
        roots = (root for root in self._roots(Path(beside).absolute().parent) if root.is_dir())
        return [
            entry.name for root in roots for entry in root.iterdir() if (entry / "model.config").is_file()
        ]


def fuel_model(text: str) -> str | None:
    """The name of a model on Gazebo Fuel. None for another URL."""
    found = _FUEL.match(text)
    return unquote(found[2]) if found else None


def _is_remote(text: str) -> bool:
    return text.startswith(("http://", "https://"))


def model_file(path: str) -> str:
    """The SDF file of a model's folder: the one of the newest version in its model.config.

    If `path` is a file, it is returned unchanged.

    Raises:
        KbotError: the folder has no SDF file.
    """
    folder = Path(path)
    if folder.is_file():
        return path
    config = folder / "model.config"
    if not config.is_file():
        fallback = folder / "model.sdf"
        if fallback.is_file():
            return str(fallback)
        raise KbotError(f"the folder {path} has no model.config")
    try:
        entries = list(read_xml(config).elements("sdf"))
    except DescriptionError as error:
        raise KbotError(str(error)) from None
    named = sorted(entries, key=lambda e: _version(e.attributes.get("version", "0")))
    if not named:
        raise KbotError(f"{config} has no <sdf> element")
    return str(folder / named[-1].text.strip())


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(word) if WHOLE.fullmatch(word) else 0 for word in text.split("."))
