"""Finds files that a world names: `model://`, `package://`, `file://` and relative paths."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from kbot.text import DescriptionError, Element, KbotError, read_source
from kbot.text.files import from_file_uri
from kbot.text.suggest import did_you_mean
from kbot.text.xml import MAX_READ_NESTING, parse_document
from kbot.world.sdf.model_paths import LIBRARY, fuel_stores, model_paths
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.values import SdfValues
from kbot.xacro import Packages

NOT_IN_REACH = "{} is not found among the models and packages here"
"""What is said of a file that a peer names: the same whether it is elsewhere or nowhere."""

WHOLE = re.compile("[0-9]{1,9}")
"""A part of a version; `str.isdigit` takes what `int` does not, such as '²' and 5000 digits."""

_FUEL = re.compile(
    r"https?://(?:app|fuel|staging-fuel)\.(?:gazebosim|ignitionrobotics)\.org/1\.0/([^/]+)/models/([^/]+)"
)


def read_xml(path: str | Path) -> Element:
    """The root of an SDF file; name prefixes need not be declared, for its own reader knows no namespaces.

    Raises:
        DescriptionError: it cannot be read.
    """
    document = parse_document(read_source(path), MAX_READ_NESTING)
    faults = [fault for fault in document.diagnostics if fault.code != "P004"]
    if faults:
        raise DescriptionError(faults)
    return document.root


class ResourceFinder:
    """Finds files as Gazebo does: in the folders of its variables, then around the file that names them,
    then among the models that ship with KBot. What was found once is kept: a world may name it a thousand
    times. Within a `reach`, no others than its files are found."""

    def __init__(self, values: SdfValues, reach: Reach | None = None) -> None:
        self._values, self._reach = values, reach
        self._found: dict[tuple[str, str], str] = {}
        self._models: dict[str, tuple[str, Element]] = {}
        self._packages: dict[str, Packages] = {}

    def find(self, uri: Element, beside: str, *, needed: bool = True) -> str | None:
        """The file or folder that a `<uri>` in the file `beside` names; None, with a finding, if none: an
        error where it is `needed`, else a warning."""
        text = uri.text.strip()
        known = self._found.get((text, beside))
        if known is not None:
            return known
        tell = self._values.findings.error if needed else self._values.findings.warning
        if text.startswith(("http://", "https://")):
            known = self._usable(text, _fetched_before(text))
            if known is None:
                hint = "download the model and put its folder into GZ_SIM_RESOURCE_PATH"
                tell("W202", f"nothing is fetched from the network: {text}", uri.origin, hint)
                return None
            self._found[text, beside] = known
            return known
        path = self._usable(text, self._paths(text, Path(beside).absolute().parent))
        if path is not None:
            self._found[text, beside] = path
            return path
        if self._reach is not None:
            tell("W202", NOT_IN_REACH.format(text or "an empty <uri>"), uri.origin)
            return None
        hint = did_you_mean(text.removeprefix("model://"), self._names(beside)) if "model://" in text else ""
        tell("W202", f"{text or 'an empty <uri>'} is not found", uri.origin, hint)
        return None

    def _usable(self, uri: str, paths: Iterable[Path]) -> str | None:
        """The first of them that is there and in reach."""
        try:
            there = (str(path) for path in paths if path.exists())
            return next((p for p in there if self._reach is None or self._reach.holds(p, uri)), None)
        except (OSError, ValueError):  # no name of a file, or in a folder that may not be read
            return None

    def model(self, path: str) -> tuple[str, Element]:
        """The SDF file of a model's folder, or a file of one, and its root.

        Raises:
            DescriptionError: it cannot be read.
            KbotError: the folder has no SDF file, or one that is out of reach.
        """
        if path not in self._models:
            file = model_file(path)
            if self._reach is not None and not self._reach.holds(file):
                raise KbotError(NOT_IN_REACH.format(file))
            self._models[path] = file, read_xml(file)
        return self._models[path]

    def _paths(self, text: str, folder: Path) -> Iterator[Path]:
        """Where a URI may lead, in the order in which it is looked for."""
        scheme, mark, rest = text.partition("://")
        if not text:
            return
        if mark and scheme == "package":
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

    def _roots(self, folder: Path) -> Iterator[Path]:
        """Folders that may hold model folders."""
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


def fuel_model(text: str) -> tuple[str, str] | None:
    """Owner and name of a model of Gazebo Fuel, None for another address."""
    found = _FUEL.match(text)
    return (found[1], unquote(found[2])) if found else None


def _fetched_before(text: str) -> Iterator[Path]:
    """A model of Fuel that Gazebo keeps on this machine, or that ships with KBot under that name."""
    model = fuel_model(text)
    if model is None:
        return
    owner, name = model
    for store in fuel_stores():
        versions = (store / owner.lower() / "models" / name.lower()).glob("*/model.config")
        newest = max(versions, key=lambda p: _version(p.parent.name), default=None)
        if newest is not None:
            yield newest.parent
    own = LIBRARY / name.lower().replace(" ", "_")
    if own.is_dir():
        yield own


def model_file(path: str) -> str:
    """The SDF file of a model's folder, by its model.config: that of the newest version; a file is its own.

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
        raise KbotError(f"{path} has no model.config")
    try:
        entries = list(read_xml(config).elements("sdf"))
    except DescriptionError as error:
        raise KbotError(str(error)) from None
    named = sorted(entries, key=lambda e: _version(e.attributes.get("version", "0")))
    if not named:
        raise KbotError(f"{config} names no <sdf>")
    return str(folder / named[-1].text.strip())


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(word) if WHOLE.fullmatch(word) else 0 for word in text.split("."))
