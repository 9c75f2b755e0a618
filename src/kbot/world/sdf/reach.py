"""Decides which files a description from a peer may name."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from kbot.world.sdf.model_paths import LIBRARY, fuel_stores, model_paths
from kbot.xacro.packages import Packages, lies_in_package


class Reach:
    """The files that a peer may name.

    They are those of the models that ship with KBot, of Gazebo's model paths, of its downloads from Fuel, and
    of the packages found. Symbolic links are resolved first.
    """

    def __init__(self) -> None:
        self._packages = Packages()
        self._roots = [Path(os.path.realpath(root)) for root in (*model_paths(), *fuel_stores(), LIBRARY)]

    def holds(self, file: str, uri: str = "") -> bool:
        """Whether a file, which `uri` was resolved to, is one of them."""
        try:
            real = Path(os.path.realpath(file))
            if any(real.is_relative_to(root) for root in self._roots):
                return True
            return lies_in_package(real, uri, self._packages)
        except (OSError, ValueError):  # not a valid file name, or in an unreadable folder
            return False

    def resolve(self, uri: str) -> str | None:
        """The file or folder of a URI. None if it is not allowed or does not exist."""
        try:
            return next((path for path in self._paths(uri) if self.holds(path, uri)), None)
        except (OSError, ValueError):
            return None

    def _paths(self, uri: str) -> Iterator[str]:
        found = self._packages.resolve(uri)
        if found is not None:
            yield found
        scheme, mark, rest = uri.partition("://")
        if not mark or scheme in ("model", "file"):
            inner = rest if mark else uri
            yield from (str(root / inner) for root in self._roots if (root / inner).exists())
