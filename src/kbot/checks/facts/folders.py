"""File names in the folders around a description. Each folder is listed once per run."""

from __future__ import annotations

import os


class Folders:
    """Lists folders, and finds files whose names differ only by case."""

    def __init__(self) -> None:
        self._names: dict[str, tuple[str, ...]] = {}
        self._matches: dict[str, str | None] = {}

    def names(self, folder: str) -> tuple[str, ...]:
        """The names in a folder. Empty if the folder does not exist."""
        names = self._names.get(folder)
        if names is None:
            try:
                names = tuple(os.listdir(folder or "."))
            except OSError:
                names = ()
            self._names[folder] = names
        return names

    def find_ignoring_case(self, path: str) -> str | None:
        """The existing path that equals this one, or differs from it only by case. None if there is none."""
        folder, name = os.path.split(path)
        if not self.names(folder):
            inner = self._folder(folder) if folder not in ("", path) else None
            if inner is None or inner == folder:  # it does not exist, or it is empty
                return None
            return self.find_ignoring_case(os.path.join(inner, name))
        match = next((n for n in self.names(folder) if n.lower() == name.lower()), None)
        return os.path.join(folder, match) if match else None

    def _folder(self, path: str) -> str | None:
        if path not in self._matches:
            self._matches[path] = self.find_ignoring_case(path)
        return self._matches[path]
