"""A rigid transform: the pose of one frame in another."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief
from kbot.kinematics.spatial import rotation
from kbot.model import Pose

Array = NDArray[np.float64]

_LEAST = 1e-290
"""Squared length of a quaternion below which underflow loses too many digits."""


class Transform(Brief):
    """An immutable rigid transform. `a_from_b` converts coordinates in frame b to frame a.

    Names compose from left to right: `a_from_c = a_from_b @ b_from_c`.
    """

    __slots__ = ("_matrix", "_quaternion")

    _matrix: Array
    _quaternion: tuple[float, float, float, float]
    """Computed when it is first needed: the pieces of a mesh have the same transform."""

    def __init__(self, matrix: ArrayLike) -> None:
        """`matrix` is homogeneous (4, 4), with an orthonormal rotation.

        Raises:
            ValueError: a wrong shape, a number that is not finite, or not a rigid transform.
        """
        copy = np.array(matrix, dtype=np.float64)
        if copy.shape != (4, 4):
            raise ValueError(f"a transform needs a (4, 4) matrix, not the shape {copy.shape}")
        if not np.isfinite(copy).all():
            raise ValueError("the matrix of a transform has a number that is not finite")
        turn = copy[:3, :3]
        rigid = np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
        if not rigid or not np.allclose(copy[3], (0.0, 0.0, 0.0, 1.0), atol=1e-9):
            raise ValueError("the matrix is not a rigid transform")
        copy.flags.writeable = False
        object.__setattr__(self, "_matrix", copy)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Transform cannot be changed")

    @classmethod
    def _trusted(cls, matrix: Array) -> Transform:
        """Wrap a matrix without checks or a copy. It must be rigid, and the caller must not change it."""
        matrix.flags.writeable = False
        transform = object.__new__(cls)
        object.__setattr__(transform, "_matrix", matrix)
        return transform

    @classmethod
    def identity(cls) -> Transform:
        return cls._trusted(np.eye(4))

    @classmethod
    def from_rotation_translation(cls, rotation: ArrayLike, translation: ArrayLike) -> Transform:
        """From a rotation matrix (3, 3) and a translation (3,)."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = translation
        return cls(matrix)

    @classmethod
    def from_xyz_rpy(cls, xyz: Sequence[float], rpy: Sequence[float]) -> Transform:
        """From URDF's `<origin>`: metres, and roll, pitch, yaw about fixed axes in radians.

        Raises:
            ValueError: a number is not finite.
        """
        (x, y, z), (roll, pitch, yaw) = _finite(xyz), _finite(rpy)
        (a, b, c), (d, e, f), (g, h, i) = rotation((roll, pitch, yaw))
        return cls._trusted(np.array([[a, b, c, x], [d, e, f, y], [g, h, i, z], [0.0, 0.0, 0.0, 1.0]]))

    @classmethod
    def of(cls, pose: Pose) -> Transform:
        """From an `<origin>` of a robot. Raises ValueError as `from_xyz_rpy` does."""
        return cls.from_xyz_rpy(pose.xyz, pose.rpy)

    @classmethod
    def from_quaternion_xyzw(
        cls, quaternion: Sequence[float], translation: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Transform:
        """From a quaternion (x, y, z, w), normalised here, and a translation in metres.

        Raises:
            ValueError: the quaternion's length is zero, or a number is not finite.
        """
        x, y, z, w = _finite(quaternion)
        tx, ty, tz = _finite(translation)
        norm = x * x + y * y + z * z + w * w
        if not _LEAST < norm < math.inf:  # the squares underflow or overflow
            most = max(map(abs, (x, y, z, w)))
            if most == 0.0:
                raise ValueError("a quaternion of length zero is not a rotation")
            x, y, z, w = x / most, y / most, z / most, w / most
            norm = x * x + y * y + z * z + w * w
        s = 2.0 / norm
        matrix = np.array(
            [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), tx],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w), ty],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y), tz],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        return cls._trusted(matrix)

    @property
    def matrix(self) -> Array:
        """Homogeneous matrix (4, 4), read-only."""
        return self._matrix

    @property
    def translation(self) -> Array:
        """Metres, (3,), read-only."""
        return self._matrix[:3, 3]

    @property
    def rotation(self) -> Array:
        """Rotation matrix (3, 3), read-only."""
        return self._matrix[:3, :3]

    @property
    def quaternion_xyzw(self) -> tuple[float, float, float, float]:
        """Unit quaternion x, y, z, w with w >= 0."""
        if not hasattr(self, "_quaternion"):
            object.__setattr__(self, "_quaternion", quaternion_xyzw_from_rotation(self.rotation))
        return self._quaternion

    @property
    def rpy(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw about fixed axes in radians. At a pitch of +-pi/2 only the sum or difference of
        roll and yaw is defined, and yaw is 0."""
        r = self._matrix
        cos_pitch = float(np.hypot(r[0, 0], r[1, 0]))
        pitch = float(np.arctan2(-r[2, 0], cos_pitch))
        if cos_pitch < 1e-9:
            return float(np.arctan2(-r[1, 2], r[1, 1])), pitch, 0.0
        return float(np.arctan2(r[2, 1], r[2, 2])), pitch, float(np.arctan2(r[1, 0], r[0, 0]))

    @property
    def yaw(self) -> float:
        """Heading in radians of the x axis seen from above."""
        return float(np.arctan2(self._matrix[1, 0], self._matrix[0, 0]))

    def __matmul__(self, other: Transform) -> Transform:
        if not isinstance(other, Transform):
            return NotImplemented
        return Transform._trusted(self._matrix @ other._matrix)

    def inverse(self) -> Transform:
        """`b_from_a` of an `a_from_b`."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation.T
        matrix[:3, 3] = -(self.rotation.T @ self.translation)
        return Transform._trusted(matrix)

    def apply(self, points: ArrayLike) -> Array:
        """Points (3,) or (n, 3) from the inner frame to the outer frame."""
        result: Array = np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation
        return result

    def is_close(self, other: Transform, tolerance: float = 1e-9) -> bool:
        """Whether no entry of the two matrices differs by more than `tolerance`."""
        return bool(np.abs(self._matrix - other._matrix).max() <= tolerance)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Transform) and bool((self._matrix == other._matrix).all())

    def __hash__(self) -> int:
        return hash((self._matrix + 0.0).tobytes())  # -0.0 equals 0.0

    def __reduce__(self) -> tuple[type[Transform], tuple[Array]]:
        return (Transform, (self._matrix,))

    def __repr__(self) -> str:
        xyz = ", ".join(f"{v + 0.0:.6g}" for v in self.translation)  # -0.0 is 0.0
        rpy = ", ".join(f"{v + 0.0:.6g}" for v in self.rpy)
        return f"Transform(xyz=({xyz}), rpy=({rpy}))"


def _finite(values: Sequence[float]) -> tuple[float, ...]:
    numbers = tuple(map(float, values))
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"a number is not finite: {numbers}")
    return numbers


def rotations_about(axis: Sequence[float], angles: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) about a unit axis by angles (...) in radians (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.asarray(angles, dtype=np.float64)[..., None, None]
    result: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return result


def quaternion_xyzw_from_rotation(rotation: ArrayLike) -> tuple[float, float, float, float]:
    """Unit quaternion x, y, z, w with w >= 0 of a rotation matrix (3, 3).

    It is computed from its largest component (Shepperd 1978), which is accurate for every angle.
    """
    r = np.asarray(rotation, dtype=np.float64)
    xx, yy, zz = float(r[0, 0]), float(r[1, 1]), float(r[2, 2])
    candidates = (xx - yy - zz, yy - xx - zz, zz - xx - yy, xx + yy + zz)
    largest = max(range(4), key=candidates.__getitem__)
    a, b, c = float(r[2, 1] - r[1, 2]), float(r[0, 2] - r[2, 0]), float(r[1, 0] - r[0, 1])
    d, e, f = float(r[1, 0] + r[0, 1]), float(r[0, 2] + r[2, 0]), float(r[2, 1] + r[1, 2])
    t = 1.0 + candidates[largest]
    x, y, z, w = ((t, d, e, a), (d, t, f, b), (e, f, t, c), (a, b, c, t))[largest]
    scale = 1.0 / float(np.sqrt(x * x + y * y + z * z + w * w))
    if w < 0.0:
        scale = -scale
    return x * scale, y * scale, z * scale, w * scale
