"""Repairs impossible inertia tensors of robots and of worlds, and reports it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import THINNEST, possible_moments, principal_axes

Array = NDArray[np.float64]
Report = Callable[[str, str, str, str], None]
"""Reports a repair: the code of the finding, the problem, what KBot does instead, and a hint to fix it."""

SMALLEST = 1e-14
"""kg or kg m^2. The engine treats less as zero: MuJoCo's smallest mass of a moving body is 1e-15."""
_WATER = 1000.0
"""Density in kg/m^3."""


def possible_tensor(
    name: str,
    mass: float,
    tensor: Array,
    corners: Callable[[], Array],
    report: Report,
    *,
    moves_alone: bool = True,
) -> Array:
    """The tensor (3, 3) in kg m^2 of a body called `name`, or the nearest possible one, which is reported.

    A body without inertia gets that of a solid box of its `mass` around `corners` (n, 3) in m, in the axes of
    the tensor; without a size, that of a cube of water. A body that does not move alone may have none: it is
    a point mass on another one.
    """
    moments, axes = principal_axes(tensor)
    moments[np.abs(moments) <= SMALLEST] = 0.0
    if not moments.any() and not moves_alone:
        return np.zeros((3, 3))
    possible = possible_moments(moments)
    hint = "give <inertia> the moments of the link's shape"
    if possible is None:
        box, what = _box(mass, corners())
        lack = "has no moment of inertia above 0" if moments.any() else "moves but has no inertia"
        uses = f"uses that of {what}: {_listed(np.diag(box))} kg m^2"
        report("W103", f"{name} {lack}", uses, hint)
        return box
    changed = float(np.abs(possible - moments).max())
    if changed <= 1e-12 * moments[2]:
        return tensor
    if moments[0] <= 0.0:
        problem = (
            f"{name} has an impossible inertia: its smallest principal moment is {moments[0]:.4g} kg m^2"
        )
        report("W104", problem, f"uses the principal moments {_listed(possible)} kg m^2", hint)
    elif changed > 5e-4 * moments[2]:
        a, b, c = moments
        problem = (
            f"{name} has an impossible inertia: the largest principal moment, {c:.4g}, exceeds"
            f" the sum of the others, {a:.4g} + {b:.4g} kg m^2"
        )
        report("W104", problem, f"adds {changed:.4g} kg m^2 to each of the smaller ones", hint)
    repaired: Array = axes @ np.diag(possible) @ axes.T
    return repaired


def _box(mass: float, corners: Array) -> tuple[Array, str]:
    """The inertia tensor of a solid box around points, and what it is."""
    size, what = np.ptp(corners, axis=0) if len(corners) else np.zeros(3), "a box around its shapes"
    if not size.any():
        size, what = np.full(3, (mass / _WATER) ** (1.0 / 3.0)), "a cube of water"
    size = np.maximum(size, THINNEST * size.max())
    second = mass * size**2 / 12.0
    return np.diag(second.sum() - second), what


def _listed(moments: Array) -> str:
    return ", ".join(f"{moment:.4g}" for moment in moments)
