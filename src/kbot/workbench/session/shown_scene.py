"""The scene of a session, updated when objects or robots are spawned and deleted."""

from __future__ import annotations

import dataclasses

from kbot.model import RobotModel
from kbot.workbench.driving.mover import Mover
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import Scene, Things
from kbot.workbench.scene.scene import all_bodies, build_scene
from kbot.workbench.source.shown import ShownDescription
from kbot.world.world import World


class ShownScene:
    """What the pages draw; each change of it has a `revision` of its own."""

    def __init__(
        self,
        shown: ShownDescription,
        meshes: MeshStore,
        motion: Mover,
        world: World | None,
        *,
        on_ground: bool,
    ) -> None:
        """`on_ground`: the robot stands where the frame of the poses has its floor."""
        self._shown, self._meshes, self._on_ground = shown, meshes, on_ground
        self.world = world
        self.revision = 0
        self.outside: tuple[str, ...] = ()
        """What is said of meshes from elsewhere of robots beside the one on show; they are not sent."""
        self.scene = self.build(motion)

    def build(self, motion: Mover) -> Scene:
        """All of it anew."""
        others = self._look(motion)
        self.scene = build_scene(
            self._shown.robot,
            self.world,
            self._meshes,
            self.revision,
            frame=motion.world,
            on_ground=self._on_ground,
            controls=motion.controls,
            others=others,
        )
        return self.scene

    def look_around(self, motion: Mover) -> Things | None:
        """What is there now besides the robot, where anything came or went."""
        world, others = motion.present
        if world is self._present[0] and others == self._present[1]:
            return None
        shown = self._look(motion)
        bodies = all_bodies(self.world, shown, self._meshes)
        self.scene = dataclasses.replace(self.scene, revision=self.revision, bodies=bodies)
        return Things(self.revision, bodies)

    def _look(self, motion: Mover) -> dict[str, RobotModel]:
        """The robots beside the one on show, as a page may see them."""
        self._present = world, others = motion.present
        self.world = world or self.world
        self.revision += 1
        confined = {name: self._shown.confine(robot) for name, robot in others.items()}
        self.outside = tuple(
            f"{name}/{finding.message}" for name, other in confined.items() for finding in other.findings
        )
        return {name: other.robot for name, other in confined.items()}
