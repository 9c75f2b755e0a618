"""Load the meshes that markers refer to, so that the page can fetch them from the server."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from kbot.messages.visualization import MESH_RESOURCE, Marker, MarkerArray
from kbot.text import KbotError
from kbot.workbench.meshes.store import MeshStore
from kbot.xacro.packages import PackageNotFound, Packages


class MarkerMeshes:
    """Replaces the `package://` address of a mesh with its id, or with an empty string if it cannot be
    loaded."""

    def __init__(self, meshes: MeshStore, around: str, package_path: Sequence[str] = ()) -> None:
        """`around` is the description whose packages are searched."""
        self._meshes = meshes
        self._packages = Packages(package_path, around)
        self._ids: dict[str, str] = {}

    def __call__(self, message: object) -> object:
        """Return the message as it is sent to pages."""
        if isinstance(message, MarkerArray) and any(m.type == MESH_RESOURCE for m in message.markers):
            return MarkerArray(tuple(self._prepared(marker) for marker in message.markers))
        if isinstance(message, Marker):
            return self._prepared(message)
        return message

    def _prepared(self, marker: Marker) -> Marker:
        if marker.type != MESH_RESOURCE:
            return marker
        address = marker.mesh_resource
        if address not in self._ids:
            self._ids[address] = self._read(address)
        return dataclasses.replace(marker, mesh_resource=self._ids[address])

    def _read(self, address: str) -> str:
        scheme, _, rest = address.partition("://")
        path = self._packages.resolve(address) if scheme == "package" else None
        if path is None:
            return ""
        try:
            folder = Path(self._packages.find(rest.partition("/")[0])).resolve()
            # only files inside the package, because other programs may publish markers
            return self._meshes.add_file(path) if Path(path).resolve().is_relative_to(folder) else ""
        except (KbotError, PackageNotFound):
            return ""
