"""The whole robot: links and joints by name, in the order they were written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from kbot.model.joint import Joint
from kbot.model.link import Link, Material
from kbot.text import Element, Origin


@dataclass(frozen=True)
class Robot:
    """A robot description: a tree of links held together by joints.

    `extensions` are the root's elements that URDF itself does not define (`<gazebo>`,
    `<transmission>`, `<ros2_control>` …), as written and with their origins.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    materials: Mapping[str, Material]
    extensions: tuple[Element, ...]
    origin: Origin

    @cached_property
    def root(self) -> str:
        """Name of the link that is no joint's child."""
        children = {joint.child for joint in self.joints.values()}
        return next(name for name in self.links if name not in children)

    @cached_property
    def parent_joint(self) -> Mapping[str, Joint]:
        """The joint above each link, the root left out."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def child_joints(self) -> Mapping[str, tuple[Joint, ...]]:
        """The joints beneath each link."""
        below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            below[joint.parent].append(joint)
        return {name: tuple(joints) for name, joints in below.items()}

    @cached_property
    def movable_joints(self) -> tuple[Joint, ...]:
        """Joints whose position is one number, in order, mimics included."""
        return tuple(joint for joint in self.joints.values() if joint.has_position)
