"""Finds the files that a mesh file names (materials, buffers, textures), only in its own package."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from trimesh.resolvers import Resolver

from kbot.model._mesh_limits import MOST_NAMED_BYTES
from kbot.text.files import read_bytes

logging.getLogger("trimesh").addHandler(logging.NullHandler())
"""What it says of textures that it does not find would go to stderr otherwise, with tracebacks."""


class PackageFiles(Resolver):
    """Finds what a mesh file names by a path relative to its folder, within the package around it.

    The package is the nearest folder above with a `package.xml` or a Gazebo model's `model.config`; without
    one it is the mesh's own folder and the one above, for the usual `../textures/`.
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
        """The bytes of a file.

        Raises:
            FileNotFoundError: there is none of this name within the package.
        """
        written = name.strip().removeprefix("file://").replace("\\", "/")
        for candidate in (written, written.lstrip("/"), written.rpartition("/")[2]):
            path = (self._folder / candidate).resolve()
            if path.is_relative_to(self._root):
                with suppress(OSError):
                    data = read_bytes(path, self._left, from_pipe=False)
                    self._left -= len(data)  # a file may name another one many times
                    return data
        raise FileNotFoundError(name)

    def keys(self) -> Iterator[str]:
        return (str(path.relative_to(self._folder)) for path in self._folder.rglob("*") if path.is_file())

    def namespaced(self, namespace: str) -> PackageFiles:
        return PackageFiles(str(self._folder / namespace / "mesh"))

    def write(self, name: str, data: bytes) -> None:
        raise PermissionError(f"{name}: nothing is written beside a mesh")
