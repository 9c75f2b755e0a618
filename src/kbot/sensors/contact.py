"""Bumpers: whether, and how hard, a link touches something that is not its own robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np

from kbot.messages.sensing import Bool
from kbot.sensors.sensor import Sensor, Spec, own_geometries
from kbot.sim import Simulation
from kbot.sim.engine.world_builder import PREFIX, owner


@dataclass(frozen=True, kw_only=True)
class Contact(Spec):
    """`everywhere`: any link of the robot counts, not only `link`. What is driven on does not count."""

    kind: ClassVar[str] = "bumper"
    rate: float = 50.0
    everywhere: bool = False

    def mount(self, simulation: Simulation) -> ContactSensor:
        return ContactSensor(simulation, self)


@dataclass(frozen=True, slots=True)
class Touch:
    """What is touched, by the name of its body in the world or `robot/link`, and with how many newtons."""

    body: str
    force: float


class ContactSensor(Sensor[Bool]):
    """Says whether something is touched (std_msgs/Bool) at the moment of a sample."""

    message_type = Bool
    spec: Contact

    def _bind(self, model: mujoco.MjModel) -> None:
        super()._bind(model)
        own = own_geometries(model, self.owner)
        self._own = np.zeros(model.ngeom, dtype=bool)
        self._own[own] = True
        self._mine = self._own.copy()
        if not self.spec.everywhere:
            self._mine &= model.geom_bodyid == self._body
        bodies = self.simulation.world.bodies
        ground = {PREFIX + body.name for body in bodies if all(part.ground for part in body.parts)}
        self._ground = np.array([owner(model, geom) in ground for geom in range(model.ngeom)])

    def touches(self) -> list[Touch]:
        """Everything touched now."""
        model, data = self._engine()
        if not data.ncon:
            return []
        pairs = data.contact.geom[: data.ncon]
        found, force = [], np.zeros(6)
        for at, (one, other) in enumerate(pairs.tolist()):
            if one < 0 or other < 0:
                continue
            if self._mine[other]:
                one, other = other, one
            if not self._mine[one] or self._own[other] or self._ground[other]:
                continue
            if data.contact.exclude[at]:
                continue
            mujoco.mj_contactForce(model, data, at, force)
            found.append(Touch(owner(model, other).removeprefix("/"), float(np.linalg.norm(force[:3]))))
        return found

    def measure(self, sample: int | None = None) -> Bool:
        return Bool(bool(self.touches()))
