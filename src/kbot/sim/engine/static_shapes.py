"""Adds thousands of static shapes to the engine's model.

Each time that a shape is added, the engine renumbers all elements of its model. The time grows with the
square of their number: 20 s for 90,000 shapes. So they are added to small models, which are then attached.
"""

from __future__ import annotations

import mujoco

_MOST = 2000
"""Shapes of a small model. With twice as many, 90,000 shapes take as long, and with eight times as many three
times as long."""


class StaticShapes:
    """Adds shapes to the body of the world. The first thousands are added directly."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self._spec = self._model = spec
        self._count = 0
        self._named: list[tuple[mujoco.MjsGeom, str, str, str]] = []

    def next_body(self) -> mujoco.MjsBody:
        """Return the body of the next shape."""
        if self._count == _MOST:
            self._attach()
            self._model, self._count = mujoco.MjSpec(), 0
        self._count += 1
        return self._model.worldbody

    def name(self, geom: mujoco.MjsGeom, name: str) -> None:
        """Set the name of a shape of the body that `next_body` returned last."""
        if self._model is self._spec:
            geom.name = name
        else:  # attaching compares all names, and changes them and references to meshes
            self._named.append((geom, name, geom.meshname, geom.hfieldname))

    def finish(self) -> None:
        """Attach and name all shapes. No more can be added."""
        self._attach()
        for geom, name, mesh, field in self._named:
            geom.name, geom.meshname, geom.hfieldname = name, mesh, field

    def _attach(self) -> None:
        if self._model is not self._spec:
            frame = self._spec.worldbody.add_frame()
            self._spec.attach(self._model, prefix="small/", frame=frame)
