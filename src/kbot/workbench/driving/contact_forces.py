"""Publish the contact forces on the simulated robot as markers on `/contacts`."""

from __future__ import annotations

import mujoco
import numpy as np

from kbot.kinematics.bodies import total_mass
from kbot.kinematics.spatial import GRAVITY
from kbot.messages.control import Duration
from kbot.messages.types import WORLD, Header, Point, Vector3
from kbot.messages.visualization import ARROW, ColorRGBA, Marker, MarkerArray
from kbot.render.bounds import visible_bounds
from kbot.sim import Simulation
from kbot.sim.engine.geometry import own_geometries
from kbot.workbench.topics.marker_state import CLEAR

TOPIC = "/contacts"
RATE = 25.0
"""Hz of simulated time."""
YELLOW = ColorRGBA(1.0, 0.84, 0.04, 1.0)


class ContactForces:
    """Publishes an arrow for each force on the robot, starting at the contact point, while there are
    subscribers.

    A force equal to the robot's weight is drawn as long as the robot's radius.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._publisher = simulation.bus.advertise(TOPIC, MarkerArray, rate=RATE)
        low, high = visible_bounds(simulation.robot)
        gravity = float(np.linalg.norm(simulation.world.gravity)) or GRAVITY
        self._length = (
            float(np.linalg.norm(high - low)) / 2 / max(total_mass(simulation.robot) * gravity, 1e-9)
        )
        simulation.clock.every(RATE, self._publish)

    def _publish(self) -> None:
        if self._publisher.has_subscribers:
            header = Header(self._simulation.clock.stamp, WORLD)
            markers = (self._marker(header, number, *force) for number, force in enumerate(self.forces()))
            self._publisher.publish(MarkerArray((CLEAR, *markers)))

    def forces(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the position (3,) in m and the force on the robot (3,) in N of each contact, in the world
        frame."""
        model, data = self._simulation.engine.current()
        own = np.zeros(model.ngeom, dtype=bool)
        own[own_geometries(model, self._simulation.robots.first.name)] = True
        found, wrench = [], np.zeros(6)
        for index in range(data.ncon):
            contact = data.contact[index]
            first, second = (own[g] if g >= 0 else False for g in contact.geom)
            if first == second or contact.exclude:
                continue
            mujoco.mj_contactForce(model, data, index, wrench)
            # The rows of the frame are the contact's axes. The force acts from the first shape on the second.
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            found.append((contact.pos.copy(), force if second else -force))
        return found

    def _marker(self, header: Header, number: int, place: np.ndarray, force: np.ndarray) -> Marker:
        tip = place + force * self._length
        wide = float(np.linalg.norm(tip - place)) * 0.08
        return Marker(
            header=header,
            ns="contacts",
            id=number,
            type=ARROW,
            scale=Vector3(wide, 2.0 * wide, 0.0),
            color=YELLOW,
            lifetime=Duration(1),
            points=(Point(*place.tolist()), Point(*tip.tolist())),
        )
