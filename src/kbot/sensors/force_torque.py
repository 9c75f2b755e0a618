"""Force and torque through a joint, as a load cell measures them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.messages import Vector3
from kbot.messages.sensing import Wrench, WrenchStamped
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


@dataclass(frozen=True, kw_only=True, repr=False)
class ForceTorque(Spec):
    """A force-torque sensor in a `joint` of any type.

    `axes` are those of the joint's child, of its parent, or of the sensor (rotated by `pose` in the child).
    `child_to_parent` measures what the child exerts on the parent, `parent_to_child` the opposite. `link`
    only names a frame, by default that of `axes`. The noises `force` (N) and `torque` (N m) apply to each
    axis.
    """

    kind: ClassVar[str] = "force_torque"
    link: str = ""
    rate: float = 100.0
    joint: str
    axes: Literal["child", "parent", "sensor"] = "child"
    direction: Literal["child_to_parent", "parent_to_child"] = "child_to_parent"
    force: Noise = NONE
    torque: Noise = NONE

    def mount(self, simulation: Simulation) -> ForceTorqueSensor:
        return ForceTorqueSensor(simulation, self)


class ForceTorqueSensor(Sensor[WrenchStamped]):
    """Publishes a WrenchStamped, with the torque about the joint's origin."""

    message_type = WrenchStamped
    spec: ForceTorque

    def __init__(self, simulation: Simulation, spec: ForceTorque) -> None:
        """Raises KbotError: the robot has no such joint."""
        robot = simulation.robots.named(spec.robot or None).robot
        joint = robot.joints.get(spec.joint)
        if joint is None:
            hint = did_you_mean(spec.joint, robot.joints)
            raise KbotError(f"{spec.label}: unknown joint '{spec.joint}'" + (f": {hint}" if hint else ""))
        frame = spec.frame or spec.link or (joint.parent if spec.axes == "parent" else joint.child)
        super().__init__(simulation, replace(spec, link=joint.child, frame=frame))
        self._parent = joint.parent
        self._force = self._noise_of(spec.force, "force", 3)
        self._torque = self._noise_of(spec.torque, "torque", 3)

    def measure(self, sample: int | None = None) -> WrenchStamped:
        force, torque = self._through_joint()
        if sample is not None:
            force, torque = self._force.apply(force, sample), self._torque.apply(torque, sample)
        return WrenchStamped(self._header(), Wrench(Vector3(*force.tolist()), Vector3(*torque.tolist())))

    def _through_joint(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Force (N) and torque (N m) in the axes of the spec.

        The engine's inverse dynamics compute what the parent exerts on the child. Their torque is about the
        centre of mass of the whole robot, so it is shifted to the joint's origin.
        """
        model, data, _, axes = self._place()
        mujoco.mj_rnePostConstraint(model, data)
        felt = data.cfrc_int[self._body]
        force = felt[3:].copy()
        # the joint's origin is that of the child link
        origin = data.xpos[self._body]
        torque = felt[:3] + np.cross(data.subtree_com[model.body_rootid[self._body]] - origin, force)
        if self.spec.axes == "child":
            axes = data.xmat[self._body].reshape(3, 3)
        elif self.spec.axes == "parent":
            axes = self.simulation.robots.named(self.owner).body.link_pose(self._parent).rotation
        sign = 1.0 if self.spec.direction == "parent_to_child" else -1.0
        return sign * (axes.T @ force), sign * (axes.T @ torque)
