"""Which files a description from a peer may name."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from kbot.world.sdf.model_paths import LIBRARY, fuel_stores, model_paths
from kbot.xacro.packages import Packages, lies_in_package


class Reach:
    """Files of the models that ship with KBot, of Gazebo's model paths, of what it keeps of Fuel, and of the
    packages found. Symbolic links are followed before it is decided."""

    def __init__(self) -> None:
        self._packages = Packages()
        self._roots = [Path(os.path.realpath(root)) for root in (*model_paths(), *fuel_stores(), LIBRARY)]

    def holds(self, file: str, uri: str = "") -> bool:
        """Whether a file, that a URI led to, is one of them."""
        try:
            real = Path(os.path.realpath(file))
            if any(real.is_relative_to(root) for root in self._roots):
                return True
            return lies_in_package(real, uri, self._packages)
        except (OSError, ValueError):  # no name of a file, or in a folder that may not be read
            return False

    def resolve(self, uri: str) -> str | None:
        """The file or folder that a URI names; None for one that is elsewhere, or nowhere."""
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
