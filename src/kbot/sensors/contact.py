"""Bumpers: whether a link touches something other than its own robot, and with which force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np

from kbot.messages.sensing import Bool
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.world_builder import PREFIX, owner


@dataclass(frozen=True, kw_only=True, repr=False)
class Contact(Spec):
    """A bumper on `link`, or with `everywhere` on all links of the robot. It does not detect the ground."""

    kind: ClassVar[str] = "bumper"
    rate: float = 50.0
    everywhere: bool = False

    def mount(self, simulation: Simulation) -> ContactSensor:
        return ContactSensor(simulation, self)


@dataclass(frozen=True, slots=True)
class Touch:
    """A touched body (its name in the world, or `robot/link`) and the contact force in N."""

    body: str
    force: float


class ContactSensor(Sensor[Bool]):
    """Publishes whether something is touched at the time of a sample (std_msgs/Bool)."""

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
        """Everything that is currently touched."""
        model, data = self._engine()
        if not data.ncon:
            return []
        pairs = data.contact.geom[: data.ncon]
        found, force = [], np.zeros(6)
        for at, (own, other) in enumerate(pairs.tolist()):
            if own < 0 or other < 0:
                continue
            if self._mine[other]:
                own, other = other, own
            if not self._mine[own] or self._own[other] or self._ground[other]:
                continue
            if data.contact.exclude[at]:
                continue
            mujoco.mj_contactForce(model, data, at, force)
            found.append(Touch(owner(model, other).removeprefix("/"), float(np.linalg.norm(force[:3]))))
        return found

    def measure(self, sample: int | None = None) -> Bool:
        return Bool(bool(self.touches()))
