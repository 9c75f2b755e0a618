"""Finds the Python modules of ROS packages in their source folders, as they are after a build."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

from kbot.xacro.packages import Packages


def folder_of_module(name: str, packages: Packages) -> str | None:
    """The folder from which `import name` finds the module of the package with this name. None if there is no
    such package, or it has no such module."""
    package = packages.folder(name)
    if package is None:
        return None
    for folder in (Path(package), Path(package, "src")):
        if (folder / name / "__init__.py").is_file():
            return str(folder)
    return None


@contextmanager
def importable(packages: Packages) -> Iterator[None]:
    """Let Python import the modules of packages within the block, if it does not find them elsewhere."""
    finder = _Finder(packages)
    sys.meta_path.append(finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if name.partition(".")[0] in finder.found]:
            del sys.modules[name]


class _Finder:
    def __init__(self, packages: Packages) -> None:
        self._packages = packages
        self.found: set[str] = set()
        """The names of the modules that were imported."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        folder = None if path is not None else folder_of_module(name, self._packages)
        if folder is None:
            return None
        self.found.add(name)
        return PathFinder.find_spec(name, [folder], target)
