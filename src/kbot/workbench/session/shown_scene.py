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
    """What the pages draw. Each change increments `revision`."""

    def __init__(
        self,
        shown: ShownDescription,
        meshes: MeshStore,
        motion: Mover,
        world: World | None,
        *,
        on_ground: bool,
    ) -> None:
        """`on_ground` means that the floor is at z = 0 of the frame of the poses."""
        self._shown, self._meshes, self._on_ground = shown, meshes, on_ground
        self.world = world
        self.revision = 0
        self.outside: tuple[str, ...] = ()
        """Findings about meshes of other robots that the page may not load. They are not sent."""
        self.scene = self.build(motion)

    def build(self, motion: Mover) -> Scene:
        """Build the whole scene again."""
        others = self._take_present(motion)
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

    def update(self, motion: Mover) -> Things | None:
        """Return the bodies of the world if any were added or deleted."""
        world, others = motion.present
        if world is self._present[0] and others == self._present[1]:
            return None
        shown = self._take_present(motion)
        bodies = all_bodies(self.world, shown, self._meshes)
        self.scene = dataclasses.replace(self.scene, revision=self.revision, bodies=bodies)
        return Things(self.revision, bodies)

    def _take_present(self, motion: Mover) -> dict[str, RobotModel]:
        """Return the robots besides the one on display, without the meshes that pages may not load."""
        self._present = world, others = motion.present
        self.world = world or self.world
        self.revision += 1
        confined = {name: self._shown.confine(robot) for name, robot in others.items()}
        self.outside = tuple(
            f"{name}/{finding.message}" for name, other in confined.items() for finding in other.findings
        )
        return {name: other.robot for name, other in confined.items()}
