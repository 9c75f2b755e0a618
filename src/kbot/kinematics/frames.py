"""Forward kinematics: the pose of every link for given joint positions, one or many at a time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief, counted
from kbot.kinematics.spatial import Quaternion, SpatialFrame, Vector, quaternion_product
from kbot.kinematics.transform import Transform, rotations_about
from kbot.model import Joint, JointType, RobotModel
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean, suggest_or_list

Array = NDArray[np.float64]
_Position = TypeVar("_Position", float, Array)


_NO_MOTION: Array = np.zeros((4, 4))


@dataclass(frozen=True, slots=True)
class _Step:
    """The pose of a link in its parent: constant + a(q) first + b(q) second, all (4, 4).

    A rotation by q about an axis is I + sin(q) K + (1 - cos(q)) K^2 (Rodrigues), a translation is I + q T.
    """

    link: str
    parent: str
    joint: str
    kind: JointType
    constant: Array
    first: Array
    second: Array


@dataclass(frozen=True, slots=True)
class Follow:
    """How a joint follows another: position = multiplier * position of `leader` + offset.

    A chain of mimic joints is resolved to its first leader.
    """

    leader: str
    multiplier: float
    offset: float


class FrameTree(Brief):
    """The frames of a robot's links.

    Joints without a given position are at 0. A mimic joint follows its leader, unless it has a position of
    its own, as in robot_state_publisher. Planar and floating joints are at 0."""

    def __init__(self, robot: RobotModel) -> None:
        self.robot = robot
        self.root = robot.root
        self._movable = frozenset(joint.name for joint in robot.movable_joints)
        self._follow = mimics(robot)
        self._rest: dict[str, Transform] | None = None

    @cached_property
    def _steps(self) -> list[_Step]:
        """The links beneath the root, parents before children."""
        steps = []
        waiting = [self.root]
        while waiting:
            for joint in self.robot.child_joints[waiting.pop()]:
                steps.append(_step(joint))
                waiting.append(joint.child)
        return steps

    @cached_property
    def _by_link(self) -> dict[str, _Step]:
        return {step.link: step for step in self._steps}

    def poses(self, joints: Mapping[str, float] | None = None) -> dict[str, Transform]:
        """`root_from_link` of every link; positions in rad or m.

        Raises:
            KbotError: an unknown or immovable joint, or a position that is not finite.
        """
        positions = self._positions(joints)
        matrices: dict[str, Array] = {self.root: np.eye(4)}
        for step in self._steps:
            matrices[step.link] = matrices[step.parent] @ _local(step, positions)
        return {link: Transform._trusted(matrices[link]) for link in self.robot.links}

    def pose(
        self, link: str, in_frame: str | None = None, joints: Mapping[str, float] | None = None
    ) -> Transform:
        """`in_frame_from_link`: the pose of `link` in the frame of another link (the root's by default).

        Raises:
            KbotError: an unknown link, and as for `poses`.
        """
        if not joints:
            return self._at_rest(link, in_frame)
        positions = self._positions(joints)
        root_from_link = self._in_root(link, positions)
        if in_frame is None or in_frame == self.root:
            return root_from_link
        return self._in_root(in_frame, positions).inverse() @ root_from_link

    def _at_rest(self, link: str, in_frame: str | None) -> Transform:
        """`pose` with all joints at 0. The poses are kept because they are needed often."""
        self._check_link(link)
        if self._rest is None:
            self._rest = self.poses()
        if in_frame is None or in_frame == self.root:
            return self._rest[link]
        self._check_link(in_frame)
        return self._rest[in_frame].inverse() @ self._rest[link]

    def batch(
        self, joint_names: Sequence[str], positions: ArrayLike, links: Iterable[str] | None = None
    ) -> dict[str, Array]:
        """`root_from_link` matrices (n, 4, 4) of `links` (all by default), read-only.

        `positions` (n, k) has a column for each of the k `joint_names`, in rad or m.

        Raises:
            KbotError: a wrong shape, an unknown link, and as for `poses`.
        """
        try:
            table = np.asarray(positions, dtype=np.float64)
        except (TypeError, ValueError):
            raise KbotError("positions are not a table of numbers") from None
        if table.ndim != 2 or table.shape[1] != len(joint_names):
            raise KbotError(
                f"positions need the shape (n, {len(joint_names)}), one column per joint, not {table.shape}"
            )
        columns = self._columns(joint_names, table)
        wanted = list(self.robot.links) if links is None else list(links)
        for name in wanted:
            self._check_link(name)
        needed = self._with_ancestors(wanted)
        matrices: dict[str, Array] = {self.root: np.eye(4)}
        for step in self._steps:
            if step.link in needed:
                matrices[step.link] = _compose(matrices[step.parent], _local(step, columns))
        shape = (len(table), 4, 4)
        return {name: np.broadcast_to(matrices[name], shape) for name in wanted}

    def _in_root(self, link: str, positions: Mapping[str, float]) -> Transform:
        self._check_link(link)
        matrix = np.eye(4)
        while link != self.root:
            step = self._by_link[link]
            matrix = _local(step, positions) @ matrix
            link = step.parent
        return Transform._trusted(matrix)

    def _check_link(self, link: str) -> None:
        if link not in self.robot.links:
            hint = suggest_or_list(link, self.robot.links)
            raise KbotError(f"the robot has no link '{link}': {hint}")

    def _with_ancestors(self, links: Iterable[str]) -> set[str]:
        needed: set[str] = set()
        for name in links:
            link = name
            while link != self.root and link not in needed:
                needed.add(link)
                link = self._by_link[link].parent
        return needed

    def _positions(self, joints: Mapping[str, float] | None) -> dict[str, float]:
        """Positions by joint, with those of mimic joints."""
        positions: dict[str, float] = {}
        for name, value in (joints or {}).items():
            self._check_joint(name)
            try:
                positions[name] = position = float(value)
            except (TypeError, ValueError):
                raise KbotError(f"the position of joint '{name}' is not a number: {value!r}") from None
            if not math.isfinite(position):
                raise KbotError(f"the position of joint '{name}' is not finite")
        return self._with_mimics(positions, 0.0)

    def _columns(self, joint_names: Sequence[str], table: Array) -> dict[str, Array]:
        """As `_positions`, a column (n, 1, 1) for each joint."""
        columns: dict[str, Array] = {}
        for name, column in zip(joint_names, table.T, strict=True):
            self._check_joint(name)
            if not np.isfinite(column).all():
                raise KbotError(f"the position of joint '{name}' is not finite")
            columns[name] = column[:, None, None]
        return self._with_mimics(columns, np.zeros((len(table), 1, 1)))

    def _with_mimics(self, given: dict[str, _Position], zero: _Position) -> dict[str, _Position]:
        """The `given` positions, and those of mimic joints that follow a leader."""
        positions = dict(given)
        for name, follow in self._follow.items():
            if name not in given:
                positions[name] = follow.multiplier * given.get(follow.leader, zero) + follow.offset
        return positions

    def _check_joint(self, name: str) -> None:
        if name in self._movable:
            return
        joint = self.robot.joints.get(name)
        if joint is not None:
            raise KbotError(f"joint '{name}' is {joint.type} and has no position")
        hint = did_you_mean(name, self._movable)
        raise KbotError(f"the robot has no joint '{name}'" + (f": {hint}" if hint else ""))

    def _shown(self) -> Iterator[str]:
        yield repr(self.robot.name)
        yield counted(len(self.robot.links), "link")
        yield f"root={self.root!r}"


class JointPose:
    """`parent_from_child` of one joint in plain numbers, which is fast for a few joints many times a
    second."""

    def __init__(self, joint: Joint) -> None:
        parent_from_joint = Transform.of(joint.pose)
        x, y, z = parent_from_joint.translation.tolist()
        axis = unit_axis(joint)
        self._translation: Vector = (x, y, z)
        self._rotation = parent_from_joint.quaternion_xyzw
        self._axis = axis.tolist()
        self._slide = (parent_from_joint.rotation @ axis).tolist()
        self._is_slide = joint.type is JointType.PRISMATIC
        self._stays = not any(self._axis)

    def at(self, position: float) -> tuple[Vector, Quaternion]:
        """Translation in m and rotation at a position in rad or m; a joint without a position is at 0."""
        if self._stays or not position:
            return self._translation, self._rotation
        if self._is_slide:
            (x, y, z), (dx, dy, dz) = self._translation, self._slide
            return (x + position * dx, y + position * dy, z + position * dz), self._rotation
        c, s = math.cos(position / 2.0), math.sin(position / 2.0)
        x, y, z = self._axis
        return self._translation, quaternion_product(self._rotation, (x * s, y * s, z * s, c))


def rest_frames(robot: RobotModel) -> dict[str, SpatialFrame]:
    """`root_from_link` of every link with every joint at 0; mimic joints do not follow their leaders.

    This takes 4 us for a robot with five links, while `FrameTree.poses` takes 200 us.
    """
    frames = {robot.root: SpatialFrame()}
    waiting = [robot.root]
    while waiting:
        parent = waiting.pop()
        for joint in robot.child_joints[parent]:
            frames[joint.child] = frames[parent].then(SpatialFrame.of(joint.pose))
            waiting.append(joint.child)
    return frames


def joint_transform(joint: Joint, position: float) -> Transform:
    """`parent_from_child` of a joint at a position in rad or m."""
    parent_from_joint, axis = Transform.of(joint.pose), unit_axis(joint)
    if joint.type is JointType.PRISMATIC:
        moved = Transform.from_rotation_translation(np.eye(3), position * axis)
    else:
        moved = Transform.from_rotation_translation(rotations_about(axis.tolist(), position), np.zeros(3))
    return parent_from_joint @ moved


def unit_axis(joint: Joint) -> Array:
    """The joint's unit axis (3,) in the joint's frame; zero if it was written as zero."""
    axis = np.array(joint.axis)
    length = math.hypot(*joint.axis)  # does not overflow or underflow as the sum of squares would
    return axis / length if length > 0.0 else axis


def _step(joint: Joint) -> _Step:
    origin = Transform.of(joint.pose).matrix
    if not joint.has_position:
        return _Step(joint.child, joint.parent, joint.name, joint.type, origin, _NO_MOTION, _NO_MOTION)
    x, y, z = unit_axis(joint)
    first, second = np.zeros((4, 4)), np.zeros((4, 4))
    if joint.type is JointType.PRISMATIC:
        first[:3, 3] = (x, y, z)
    else:
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        first[:3, :3], second[:3, :3] = cross, cross @ cross
    return _Step(joint.child, joint.parent, joint.name, joint.type, origin, origin @ first, origin @ second)


def _local(step: _Step, positions: Mapping[str, float] | Mapping[str, Array]) -> Array:
    """`parent_from_link`: (4, 4) for a number, (n, 4, 4) for a column (n, 1, 1)."""
    q = positions.get(step.joint)
    if q is None:
        return step.constant
    if step.kind is JointType.PRISMATIC:
        return step.constant + q * step.first
    if isinstance(q, float):
        return step.constant + math.sin(q) * step.first + (1.0 - math.cos(q)) * step.second
    return step.constant + np.sin(q) * step.first + (1.0 - np.cos(q)) * step.second


def _compose(parent: Array, local: Array) -> Array:
    """The matrix product of (4, 4) or (n, 4, 4) with (4, 4) or (n, 4, 4).

    A stack times one matrix is computed as one product, which is faster.
    """
    if parent.ndim == 3 and local.ndim == 2:
        product: Array = (parent.reshape(-1, 4) @ local).reshape(parent.shape)
        return product
    return parent @ local


def mimics(robot: RobotModel) -> dict[str, Follow]:
    """How each mimic joint follows. A joint whose leader is missing or cannot move, or that mimics in a ring,
    is left out."""
    follows: dict[str, Follow] = {}
    for joint in robot.movable_joints:
        multiplier, offset, at, seen = 1.0, 0.0, joint, {joint.name}
        while at.mimic is not None:
            offset += multiplier * at.mimic.offset
            multiplier *= at.mimic.multiplier
            leader = robot.joints.get(at.mimic.joint)
            if leader is None or not leader.has_position or leader.name in seen:
                break
            seen.add(leader.name)
            at = leader
        else:
            if at is not joint:
                follows[joint.name] = Follow(at.name, multiplier, offset)
    return follows
