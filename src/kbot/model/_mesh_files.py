"""Finds the files that a mesh file refers to (materials, buffers, textures), only in its own package."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from trimesh.resolvers import Resolver

from kbot.model._mesh_limits import MOST_NAMED_BYTES
from kbot.text.files import read_bytes
from kbot.text.folders import files_below

logging.getLogger("trimesh").addHandler(logging.NullHandler())
"""Otherwise, trimesh prints tracebacks to stderr for textures that it does not find."""


class PackageFiles(Resolver):
    """Finds files by their path relative to a mesh file, within the mesh's package.

    The package is the nearest enclosing folder with a `package.xml` or a Gazebo model's `model.config`. If
    there is none, it is the parent of the mesh's folder, for the usual `../textures/`.
    """

    def __init__(self, mesh: str) -> None:
        self._folder = Path(mesh).resolve().parent
        marked = (
            folder
            for folder in (self._folder, *self._folder.parents)
            if (folder / "package.xml").is_file() or (folder / "model.config").is_file()
        )
        self._root = next(marked, self._folder.parent)
        self._left = MOST_NAMED_BYTES

    def get(self, name: str) -> bytes:
        """The content of a file.

        Raises:
            FileNotFoundError: the package has no such file, or all files together are too large.
        """
        written = name.strip().removeprefix("file://").replace("\\", "/")
        for candidate in (written, written.lstrip("/"), written.rpartition("/")[2]):
            path = (self._folder / candidate).resolve()
            if path.is_relative_to(self._root):
                with suppress(OSError):
                    data = read_bytes(path, self._left, from_pipe=False)
                    self._left -= len(data)  # a file may refer to another one many times
                    return data
        raise FileNotFoundError(name)

    def keys(self) -> Iterator[str]:
        files = files_below(self._folder, lambda name: True)
        return (str(Path(file).relative_to(self._folder)) for file in files)

    def namespaced(self, namespace: str) -> PackageFiles:
        return PackageFiles(str(self._folder / namespace / "mesh"))

    def write(self, name: str, data: bytes) -> None:
        raise PermissionError(f"{name}: files next to a mesh are read-only")
