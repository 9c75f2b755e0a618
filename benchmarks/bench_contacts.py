"""Distance of a plane and each shape in the engine, compared with the analytic distance.

    python benchmarks/bench_contacts.py [--poses 100000]

Half of the poses are random. In the others an axis of the shape is perpendicular or parallel to the plane:
exactly, up to rounding, or with a tilt of 1e-17 to 0.1 rad. The plane is level, or tilted. `plain MuJoCo` is
MuJoCo's own cylinder, which KBot replaces. Exit status 1 if a shape of KBot exceeds its limit.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot import Transform
from kbot.sim.engine.assembly import compile_model
from kbot.world import Body, Box, Capsule, Cylinder, Ellipsoid, Part, Sphere, TriangleMesh, World
from kbot.world.builders import floor
from kbot.world.world import Shape

Array = NDArray[np.float64]

LEVEL = (0.0, 0.0, 0.0)
TILTED = (0.3, -0.2, 0.7)
"""Roll, pitch and yaw of the plane in rad."""
ROUNDING = 1e-9
"""m. Errors of rounding alone are about 1e-16 m."""
DISC = 1.1e-5
"""Largest error of a cylinder's distance as a share of its radius. KBot's own shapes are off by 1e-5."""

_GOLDEN = (1.0 + sqrt(5.0)) / 2.0
ICOSAHEDRON = 0.06 * np.array(
    [
        np.roll((0.0, first, second * _GOLDEN), turn)
        for turn in range(3)
        for first in (-1.0, 1.0)
        for second in (-1.0, 1.0)
    ]
)
"""Vertices (12, 3) in m. A mesh collides as the convex hull of its vertices."""


@dataclass(frozen=True)
class Case:
    """A shape, how far it reaches (n,) in m along unit vectors (n, 3) of its frame, and its limit in m."""

    shape: Shape
    reach: Callable[[Array], Array]
    limit: float


def _cylinder(radius: float, length: float) -> Case:
    def reach(along: Array) -> Array:
        return radius * np.hypot(along[:, 0], along[:, 1]) + length / 2.0 * abs(along[:, 2])

    return Case(Cylinder(radius, length), reach, DISC * radius)


CASES = {
    "cylinder": _cylinder(0.05, 0.2),
    "round deck": _cylinder(0.12, 0.006),
    "disc": _cylinder(0.3, 1e-4),
    "rod": _cylinder(0.004, 1.0),
    "box": Case(Box((0.2, 0.3, 0.1)), lambda along: abs(along) @ (0.1, 0.15, 0.05), ROUNDING),
    "sphere": Case(Sphere(0.1), lambda along: np.full(len(along), 0.1), ROUNDING),
    "capsule": Case(Capsule(0.05, 0.2), lambda along: 0.05 + 0.1 * abs(along[:, 2]), ROUNDING),
    "ellipsoid": Case(
        Ellipsoid((0.1, 0.2, 0.05)), lambda along: np.linalg.norm(along * (0.1, 0.2, 0.05), axis=1), ROUNDING
    ),
    "mesh": Case(
        TriangleMesh(ICOSAHEDRON, np.zeros((0, 3), dtype=np.int32)),
        lambda along: (along @ ICOSAHEDRON.T).max(axis=1),
        1e-7,  # MuJoCo stores vertices with 24 bits
    ),
}


def product(first: Array, second: Array) -> Array:
    """Products (n, 4) of quaternions (n, 4), real part first."""
    real, imaginary = first[:, :1], first[:, 1:]
    other, rest = second[:, :1], second[:, 1:]
    dot = (imaginary * rest).sum(axis=1, keepdims=True)
    return np.hstack([real * other - dot, real * rest + other * imaginary + np.cross(imaginary, rest)])


def about(axes: Array, angles: Array) -> Array:
    """Quaternions (n, 4) of rotations about unit vectors (n, 3) by angles (n,) in rad."""
    return np.hstack([np.cos(angles / 2.0)[:, None], axes * np.sin(angles / 2.0)[:, None]])


def orientations(count: int, random: np.random.Generator) -> Array:
    """`plane_from_shape` of poses as quaternions (count, 4)."""
    up = np.tile((0.0, 0.0, 1.0), (count, 1))
    heading = random.uniform(-pi, pi, count)
    across = np.stack([np.cos(heading), np.sin(heading), np.zeros(count)], axis=1)
    tilt = 10.0 ** random.uniform(-17.0, -1.0, count) * random.integers(0, 2, count)
    tilt += random.choice((0.0, pi / 2.0, pi), count)
    ordered = about(across, tilt)
    for _ in range(3):  # as after some steps of a turn: each product is rounded
        ordered = product(ordered, about(up, random.uniform(-pi, pi, count)))
    ordered *= 1.0 + random.uniform(-9e-16, 9e-16, (count, 1))  # MuJoCo normalises above 1e-15
    anywhere = random.normal(size=(count, 4))
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    return np.where(random.integers(0, 2, (count, 1)) == 1, ordered, anywhere)


def down(orientation: Array) -> Array:
    """The direction (n, 3) to the plane, in the frames of shapes with `plane_from_shape` (n, 4)."""
    w, x, y, z = orientation.T
    return -np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z], axis=1)


def model(case: Case, plane: tuple[float, float, float]) -> mujoco.MjModel:
    """The engine's model of a plane and a body of the shape, as KBot builds it."""
    ground = Body("ground", floor().parts, Transform.from_xyz_rpy((0.0, 0.0, 0.0), plane))
    inertia = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    moving = Body("shape", (Part(case.shape),), mass=1.0, inertia=inertia)
    return compile_model(World("plane", (ground, moving)), (), 0.002)[0]


def plain(case: Case, plane: tuple[float, float, float]) -> mujoco.MjModel:
    """The model of `model`, with MuJoCo's own cylinder."""
    made = model(case, plane)
    made.geom_contype[:] = made.geom_conaffinity[:] = 0
    for kind, bits in ((mujoco.mjtGeom.mjGEOM_PLANE, 1), (mujoco.mjtGeom.mjGEOM_CYLINDER, 1)):
        made.geom_contype[made.geom_type == kind] = bits
        made.geom_conaffinity[made.geom_type == kind] = bits
    return made


def errors(engine: mujoco.MjModel, case: Case, plane: tuple[float, float, float], count: int) -> Array:
    """Differences (count,) in m from the analytic distance. inf where the engine reports none."""
    random = np.random.default_rng(7)
    gaps = 10.0 ** random.uniform(-6.0, -1.0, count) * random.choice((-1.0, 1.0), count)
    turned = orientations(count, random)
    x, y, z, w = Transform.from_xyz_rpy((0.0, 0.0, 0.0), plane).quaternion_xyzw
    world = product(np.tile((w, x, y, z), (count, 1)), turned)
    normal = Transform.from_xyz_rpy((0.0, 0.0, 0.0), plane).rotation[:, 2]
    heights = case.reach(down(turned / np.linalg.norm(turned, axis=1, keepdims=True))) + gaps
    engine.geom_margin[:] = engine.body_margin[:] = 1.0  # the engine reports distances up to its margin
    data, found = mujoco.MjData(engine), np.full(count, np.inf)
    for index in range(count):
        data.qpos[:3] = heights[index] * normal
        data.qpos[3:] = world[index]
        mujoco.mj_kinematics(engine, data)
        mujoco.mj_collision(engine, data)
        if data.ncon:
            found[index] = data.contact.dist.min()
    return abs(found - gaps)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=100_000, help="poses per shape and plane")
    count = parser.parse_args().poses
    rows = [(name, case, model, case.limit) for name, case in CASES.items()]
    rows.append(("cylinder, plain MuJoCo", CASES["cylinder"], plain, np.inf))
    rows.append(("round deck, plain MuJoCo", CASES["round deck"], plain, np.inf))
    failed = False
    print(f"{'shape':26}{'plane':10}{'largest error':>16}{'off by > 0.1 mm':>18} of {count}")
    for name, case, build, limit in rows:
        for plane, angles in (("level", LEVEL), ("tilted", TILTED)):
            off = errors(build(case, angles), case, angles, count)
            exceeded = bool(off.max() > limit)
            failed |= exceeded
            verdict = "   EXCEEDED" if exceeded else ""
            print(f"{name:26}{plane:10}{1e3 * off.max():13.6f} mm{(off > 1e-4).sum():18d}{verdict}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
