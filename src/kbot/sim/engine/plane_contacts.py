"""Lets cylinders touch planes without MuJoCo's own function for this pair, which fails on level cylinders.

docs/explanation/cylinder-on-a-plane.md describes the failure. A plane sees a cylinder as a box with the same
ends, on which it stands, and a disc at each end, on whose rims it rolls and leans. MuJoCo computes the
distances of boxes and ellipsoids from a plane without dividing by a length that may be a rounding error.
"""

from __future__ import annotations

from math import sqrt

import mujoco
import numpy as np

from kbot.sim.engine.contacts import PLANES
from kbot.sim.engine.placing import PLANE_GROUP

_INSET = 0.01
"""How far the box's edges are inside the curved surface, as a share of the radius. A rolling cylinder sinks
in by up to 0.05 mm. With edges on the surface, the box then touches too and slows the cylinder down."""
_RECESS = 1e-5
"""How far the discs are behind the ends, as a share of the radius: the largest error of a distance. A
standing cylinder sinks in by 1e-8 m, so it stands on the box alone, whose four contacts do not move about."""
_THIN = 1e-6
"""Half axis of a disc along the cylinder, as a share of the radius. It only has to be less than `_RECESS`."""
_COPIED = ("solref", "solimp", "friction", "priority", "condim", "solmix")


def add_plane_shapes(body: mujoco.MjsBody, geom: mujoco.MjsGeom, planes: int) -> None:
    """Let a cylinder of a moving body touch planes as a box and two discs. Other shapes are not changed.

    `planes` are the contact bits of the world's planes. The contacts of `geom` must be set already.
    """
    if geom.type != mujoco.mjtGeom.mjGEOM_CYLINDER:
        return
    touched = geom.conaffinity & PLANES
    geom.conaffinity &= ~PLANES
    if not touched & planes:
        return
    radius, half = float(geom.size[0]), float(geom.size[1])
    side = (1.0 - _INSET) * radius / sqrt(2.0)
    end = max(half - _RECESS * radius, 0.0)
    shapes = (
        (mujoco.mjtGeom.mjGEOM_BOX, (side, side, half), 0.0),
        (mujoco.mjtGeom.mjGEOM_ELLIPSOID, (radius, radius, _THIN * radius), end),
        (mujoco.mjtGeom.mjGEOM_ELLIPSOID, (radius, radius, _THIN * radius), -end),
    )
    for kind, size, along in shapes:
        offset = np.zeros(3)
        mujoco.mju_rotVecQuat(offset, np.array([0.0, 0.0, along]), geom.quat)
        added = body.add_geom(type=kind, size=size, pos=geom.pos + offset, quat=geom.quat, mass=0.0)
        for name in _COPIED:
            setattr(added, name, getattr(geom, name))
        added.contype, added.conaffinity, added.group = 0, touched, PLANE_GROUP
