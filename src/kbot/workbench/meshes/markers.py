"""Load the meshes that markers refer to, so that the page can fetch them from the server."""

from __future__ import annotations

import dataclasses
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from kbot.messages.visualization import MESH_RESOURCE, Marker, MarkerArray
from kbot.model.meshes import keep_mesh, read_mesh
from kbot.text import KbotError
from kbot.workbench.meshes.store import MeshStore
from kbot.worker import PEER_READING, LimitExceeded
from kbot.xacro.packages import PackageNotFound, Packages


class MarkerMeshes:
    """Replaces the `package://` address of a mesh with its id, or with an empty string if it cannot be
    loaded."""

    def __init__(
        self,
        meshes: MeshStore,
        around: str,
        package_path: Sequence[str] = (),
        when_loaded: Callable[[], None] = lambda: None,
    ) -> None:
        """`around` is the description whose packages are searched.

        `when_loaded` is called on another thread after a mesh was read. Until then its markers have no mesh.
        """
        self._meshes = meshes
        self._packages = Packages(package_path, around)
        self._when_loaded = when_loaded
        self._ids: dict[str, str] = {}
        """By address: the id of each mesh in `_meshes`, or an empty string."""
        self._read: dict[str, str] = {}
        """By address: each file that was read, but is not in `_meshes` yet."""
        self._waiting: deque[tuple[str, str]] = deque()
        """Addresses and files to read."""
        self._is_reading = False
        self._lock = threading.Lock()

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
            self._ids[address] = ""
            file = self._file(address)
            if file:
                self._start_reading(address, file)
        elif (file := self._read.pop(address, "")) != "":
            try:
                self._ids[address] = self._meshes.add_file(file)
            except KbotError:
                self._ids[address] = ""
        return dataclasses.replace(marker, mesh_resource=self._ids[address])

    def _file(self, address: str) -> str:
        """Return the file of an address inside a package, or an empty string: other programs may publish
        markers."""
        scheme, _, rest = address.partition("://")
        path = self._packages.resolve(address) if scheme == "package" else None
        if path is None:
            return ""
        try:
            folder = Path(self._packages.find(rest.partition("/")[0])).resolve()
        except PackageNotFound:
            return ""
        return path if Path(path).resolve().is_relative_to(folder) else ""

    def _start_reading(self, address: str, file: str) -> None:
        with self._lock:
            self._waiting.append((address, file))
            if self._is_reading:
                return
            self._is_reading = True
        threading.Thread(target=self._read_all, daemon=True, name="kbot-marker-meshes").start()

    def _read_all(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._is_reading = False
                    return
                address, file = self._waiting.popleft()
            with suppress(LimitExceeded):  # then the marker stays without a mesh
                keep_mesh(PEER_READING.call(read_mesh, file))
                self._read[address] = file
                self._when_loaded()
