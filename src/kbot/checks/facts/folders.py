"""The files in the folders around a description, each folder read once per run."""

from __future__ import annotations

import os


class Folders:
    """The names in folders, and files that are called almost as one says."""

    def __init__(self) -> None:
        self._names: dict[str, tuple[str, ...]] = {}
        self._almost: dict[str, str | None] = {}

    def names(self, folder: str) -> tuple[str, ...]:
        """The names in a folder; none where there is no such folder."""
        names = self._names.get(folder)
        if names is None:
            try:
                names = tuple(os.listdir(folder or "."))
            except OSError:
                names = ()
            self._names[folder] = names
        return names

    def but_for_case(self, path: str) -> str | None:
        """What there is of the path's name, or of one that differs by capital letters only."""
        folder, name = os.path.split(path)
        if not self.names(folder):
            inner = self._folder(folder) if folder not in ("", path) else None
            if inner is None or inner == folder:  # not there, or there and empty
                return None
            return self.but_for_case(os.path.join(inner, name))
        match = next((n for n in self.names(folder) if n.lower() == name.lower()), None)
        return os.path.join(folder, match) if match else None

    def _folder(self, path: str) -> str | None:
        if path not in self._almost:
            self._almost[path] = self.but_for_case(path)
        return self._almost[path]
