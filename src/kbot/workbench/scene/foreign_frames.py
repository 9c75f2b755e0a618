"""Frames on `/tf` that are not links of the robot, such as `map`."""

from __future__ import annotations

import math
from collections.abc import Mapping

from kbot.kinematics.transform import Transform
from kbot.messages.bus import Bus, Subscription
from kbot.messages.types import TFMessage, TransformStamped

WORLD, MAP = "world", "map"
TOPICS = ("/tf", "/tf_static")

Frames = Mapping[str, tuple[str, Transform]]
"""Parent and `world_from_frame`, by name."""
Edges = Mapping[str, tuple[str, Transform]]
"""Parent and `parent_from_child`, by child."""


class ForeignFrames:
    """Hears the transforms of a bus, and hangs those that the robot does not have itself on those it has."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._seen = -1
        self._heard: dict[str, Subscription] = {}
        self._edges: dict[str, tuple[str, Transform]] = {}
        """`parent_from_child`, by child."""

    def forget(self) -> None:
        """Start anew, as time did."""
        self._edges.clear()

    def poses(self, links: Mapping[str, Transform], own: Frames) -> Frames:
        """Every frame that hangs on the `links`, given as `world_from_link`, or on the robot's `own` frames,
        which come first. Where nobody says where `map` is, it is the world."""
        self._listen()
        at = {WORLD: Transform.identity(), **links, **{name: pose for name, (_, pose) in own.items()}}
        found = dict(own)
        edges = _placed(
            {child: edge for child, edge in self._edges.items() if child not in at or edge[0] not in at},
            at,
            found,
        )
        if MAP not in at:
            at[MAP] = Transform.identity()
            found[MAP] = WORLD, at[MAP]
            _placed(edges, at, found)
        return found

    def _listen(self) -> None:
        if self._bus.changes == self._seen:
            return
        for topic in TOPICS:
            if topic in self._bus.topics and topic not in self._heard:
                self._heard[topic] = self._bus.subscribe(topic, TFMessage, self._hear)
        self._seen = self._bus.changes

    def _hear(self, message: TFMessage) -> None:
        for transform in message.transforms:
            parent_from_child = read_transform(transform)
            if parent_from_child is not None:
                self._edges[plain(transform.child_frame_id)] = (
                    plain(transform.header.frame_id),
                    parent_from_child,
                )


def frame_for_peers(frames: Frames, root: str) -> str:
    """The frame that what is told on tf hangs on, which `world` is no part of: that of the odometry, or the
    robot's `root` where it has none."""
    above = (name for name, (parent, _) in frames.items() if name != MAP and parent in (WORLD, MAP))
    return next(above, root)


def plain(frame: str) -> str:
    """A frame's name as ROS 2 has it: without the slash that old ROS puts before it."""
    return frame.lstrip("/")


def read_transform(stamped: TransformStamped) -> Transform | None:
    """`parent_from_child`; None where the numbers are none, as a quaternion of zeros."""
    moved, turned = stamped.transform.translation, stamped.transform.rotation
    numbers = (moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w)
    if not all(map(math.isfinite, numbers)) or not any(numbers[3:]):
        return None
    rotation = Transform.from_quaternion_xyzw(numbers[3:])
    return Transform.from_xyz_rpy(numbers[:3], (0.0, 0.0, 0.0)) @ rotation


def _placed(edges: Edges, at: dict[str, Transform], found: dict[str, tuple[str, Transform]]) -> Edges:
    """Put in place all that hangs on what is in place already; returns the edges that do not."""
    while True:
        waiting = {}
        for child, (parent, parent_from_child) in edges.items():
            if parent in at and child not in at:
                at[child] = at[parent] @ parent_from_child
                found[child] = parent, at[child]
            elif child in at and parent not in at:
                at[parent] = at[child] @ parent_from_child.inverse()
                found[parent] = WORLD, at[parent]
                if child in found:
                    found[child] = parent, at[child]
            else:
                waiting[child] = parent, parent_from_child
        if len(waiting) == len(edges):
            return waiting
        edges = waiting
