"""Frames on `/tf` that are not links of the robot, such as `map`."""

from __future__ import annotations

import math
from collections.abc import Mapping

from kbot.kinematics.transform import Transform
from kbot.messages.bus import Bus, Subscription
from kbot.messages.types import WORLD, TFMessage, TransformStamped

MAP = "map"
TOPICS = ("/tf", "/tf_static")

Frames = Mapping[str, tuple[str, Transform]]
"""Parent and `world_from_frame`, by name."""
Edges = Mapping[str, tuple[str, Transform]]
"""Parent and `parent_from_child`, by child."""


class ForeignFrames:
    """Subscribes to the transforms of a bus, and connects frames that the robot does not have to those it
    has."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._seen = -1
        self._subscriptions: dict[str, Subscription] = {}
        self._edges: dict[str, tuple[str, Transform]] = {}
        """`parent_from_child`, by child."""

    def forget(self) -> None:
        """Forget all transforms, for example after time was reset."""
        self._edges.clear()

    def poses(self, links: Mapping[str, Transform], own: Frames) -> Frames:
        """Return every frame that is connected to the `links` (as `world_from_link`) or to the robot's `own`
        frames.

        `own` frames come first. If no transform places `map`, it equals the world.
        """
        self.subscribe()
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

    def subscribe(self) -> None:
        """Subscribe to the topics of transforms that exist. Messages from before that are missed."""
        if self._bus.changes == self._seen:
            return
        for topic in TOPICS:
            if topic in self._bus.topics and topic not in self._subscriptions:
                self._subscriptions[topic] = self._bus.subscribe(topic, TFMessage, self._receive)
        self._seen = self._bus.changes

    def _receive(self, message: TFMessage) -> None:
        for transform in message.transforms:
            parent_from_child = read_transform(transform)
            if parent_from_child is not None:
                self._edges[plain(transform.child_frame_id)] = (
                    plain(transform.header.frame_id),
                    parent_from_child,
                )


def frame_for_peers(frames: Frames, root: str) -> str:
    """Return the topmost frame on tf without `world`: the odometry frame, or the robot's `root` if there is
    none."""
    above = (name for name, (parent, _) in frames.items() if name != MAP and parent in (WORLD, MAP))
    return next(above, root)


def plain(frame: str) -> str:
    """Return a frame's name as in ROS 2, without the leading slash of early ROS 1."""
    return frame.lstrip("/")


def read_transform(stamped: TransformStamped) -> Transform | None:
    """Return `parent_from_child`, or None for invalid numbers such as a zero quaternion."""
    moved, turned = stamped.transform.translation, stamped.transform.rotation
    numbers = (moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w)
    if not all(map(math.isfinite, numbers)) or not any(numbers[3:]):
        return None
    rotation = Transform.from_quaternion_xyzw(numbers[3:])
    return Transform.from_xyz_rpy(numbers[:3], (0.0, 0.0, 0.0)) @ rotation


def _placed(edges: Edges, at: dict[str, Transform], found: dict[str, tuple[str, Transform]]) -> Edges:
    """Place all frames that are connected to placed ones, and return the remaining edges."""
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
