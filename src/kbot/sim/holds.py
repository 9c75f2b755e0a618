"""Joints that a servo holds at a position, where and as long as that is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mujoco

from kbot.sim.numbers import FURTHEST, is_within, numbers, shortened
from kbot.sim.servo import engage_hold, release_hold
from kbot.text import KbotError


class JointHolds:
    """The position servos of a robot's joints that do not drive; without force until they hold."""

    def __init__(self, model: Any, data: Any, prefix: str, joints: Iterable[str]) -> None:  # noqa: ANN401
        self._model, self._ctrl = model, numbers(data.ctrl)
        kind, joint_kind = mujoco.mjtObj.mjOBJ_ACTUATOR, mujoco.mjtObj.mjOBJ_JOINT
        found = {name: mujoco.mj_name2id(model, kind, prefix + name) for name in joints}
        self._actuators = {name: index for name, index in found.items() if index >= 0}
        self._dofs = {
            name: int(model.jnt_dofadr[mujoco.mj_name2id(model, joint_kind, prefix + name)])
            for name in self._actuators
        }
        self._engaged: set[str] = set()

    @property
    def joints(self) -> tuple[str, ...]:
        """Those that can be held."""
        return tuple(self._actuators)

    @property
    def engaged(self) -> frozenset[str]:
        """Those that are held now."""
        return frozenset(self._engaged)

    def hold(self, joint: str, position: float) -> None:
        """Hold a joint at a position in rad or m. Raises KbotError where that is none."""
        if not is_within(position, FURTHEST):
            raise KbotError(
                f"a joint's position is a finite number up to {FURTHEST:g}, not {shortened(position)}"
            )
        self._engage(joint)
        self._ctrl[self._actuators[joint]] = position

    def release(self, joint: str) -> None:
        if joint in self._engaged:
            release_hold(self._model, self._actuators[joint])
            self._engaged.discard(joint)

    def release_all(self) -> None:
        for joint in tuple(self._engaged):
            self.release(joint)

    def engage_only(self, joints: Iterable[str]) -> None:
        """Hold just these, at the positions the engine's state has for them."""
        self.release_all()
        for joint in joints:
            self._engage(joint)

    def _engage(self, joint: str) -> None:
        engage_hold(self._model, self._actuators[joint], self._dofs[joint])
        self._engaged.add(joint)
