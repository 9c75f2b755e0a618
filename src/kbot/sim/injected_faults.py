"""Faults to inject into a run: slip, payload, blocked joint and others.

`Disturbances.schedule` sets their times. `begin` starts a fault and returns the function that ends it, or
None if the fault needs no end.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, Protocol, runtime_checkable

import mujoco
import numpy as np

from kbot.kinematics.bodies import MassProperties, principal_axes
from kbot.kinematics.drive.drive import HolonomicDrive
from kbot.messages.bus import Bus
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.engine.contacts import rank
from kbot.sim.engine.engine import Engine
from kbot.sim.numbers import FASTEST, FURTHEST, Vector, is_within, positive, vector
from kbot.sim.recipe import SOLIMP, SOLREF
from kbot.sim.robots import Robots
from kbot.text import KbotError
from kbot.world.world import HEAVIEST

End = Callable[[], None]
STUCK = 1e6
"""Dry friction in N m or N that is too large for any motor to overcome."""
ROUGHEST = 1e3
"""Largest coefficient of friction: hundreds of times that of rubber."""


@dataclass(frozen=True)
class Target:
    """The parts of a simulation that a fault acts on."""

    engine: Engine
    bus: Bus
    commands: CommandDelivery
    robots: Robots


@runtime_checkable
class Fault(Protocol):
    def begin(self, target: Target) -> End | None:
        """Start the fault. Returns the function that ends it, or None if it needs no end.

        Raises:
            KbotError: the fault names something that does not exist.
        """
        ...


@dataclass(frozen=True, slots=True)
class BlockedJoint:
    """A joint that does not move, such as a wheel with something in its spokes."""

    joint: str
    robot: str | None = None

    def begin(self, target: Target) -> End:
        robot = target.robots.named(self.robot)
        dof = robot.body.dof(self.joint)
        # friction as stiff as a contact: with MuJoCo's default softness a servo would still creep
        return _all(
            _changed(target, "dof_solref", [(dof, 0)], SOLREF[0]),
            _changed(target, "dof_solimp", [(dof, 0), (dof, 1)], SOLIMP[1]),
            _changed(target, "dof_frictionloss", [dof], STUCK),
        )


@dataclass(frozen=True, slots=True)
class Slip:
    """A link, such as a wheel, with a different coefficient of friction: oil, ice, a worn tyre."""

    link: str
    friction: float
    robot: str | None = None

    def __post_init__(self) -> None:
        if not (is_within(self.friction, ROUGHEST) and self.friction >= 0.0):
            given = reprlib.repr(self.friction)
            raise KbotError(f"a coefficient of friction must be from 0 to {ROUGHEST:g}, not {given}")
        _set_numbers(self, friction=float(self.friction))

    def begin(self, target: Target) -> End:
        model, _ = target.engine.current()
        robot = target.robots.named(self.robot)
        body = robot.body.index(self.link)
        if isinstance(robot.drive, HolonomicDrive) and self.link in robot.drive.carriers:
            raise KbotError(
                f"'{self.link}' carries a holonomic base: it slides freely, and has no friction to change"
            )
        geoms = np.flatnonzero(model.geom_bodyid == body).tolist()
        priority, dimensions = rank(self.friction)
        # the tyres of a skid-steer robot have contact pairs with the ground, which is the first of each pair
        pairs = [pair for pair in range(model.npair) if model.pair_geom2[pair] in geoms]
        return _all(
            *(
                _changed(
                    target,
                    "pair_friction",
                    [(pair, 0), (pair, 1)],
                    min(self.friction, float(model.geom_friction[model.pair_geom1[pair], 0])),
                )
                for pair in pairs
            ),
            _changed(target, "geom_friction", [(geom, 0) for geom in geoms], self.friction),
            _changed(target, "geom_priority", geoms, priority),
            _changed(target, "geom_condim", geoms, dimensions),
        )


@dataclass(frozen=True, slots=True)
class Payload:
    """An extra point mass on a link.

    link   link that carries it
    mass   its mass in kg
    at     its position x, y, z in m, in the link's frame
    robot  name of the robot; by default the first
    """

    link: str
    mass: float
    at: Vector = (0.0, 0.0, 0.0)
    robot: str | None = None

    def __post_init__(self) -> None:
        mass = positive("the mass of a payload in kg", self.mass, HEAVIEST)
        _set_numbers(self, mass=mass, at=vector("the position of a payload in m", self.at, FURTHEST))

    def begin(self, target: Target) -> End:
        model, _ = target.engine.current()
        body = target.robots.named(self.robot).body.index(self.link)
        names = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
        before = [np.copy(getattr(model, name)[body]) for name in names]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[body])
        axes = turn.reshape(3, 3)
        tensor = axes @ np.diag(model.body_inertia[body]) @ axes.T
        own = MassProperties(float(model.body_mass[body]), before[1], tensor)
        load = MassProperties(self.mass, np.array(self.at), np.zeros((3, 3)))
        whole = MassProperties.combined([own, load])
        moments, directions = principal_axes(whole.tensor)
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, directions.ravel())
        for name, value in zip(names, (whole.mass, whole.center, quaternion, moments), strict=True):
            getattr(model, name)[body] = value
        _update_constants(model)

        def end() -> None:
            for name, value in zip(names, before, strict=True):
                getattr(model, name)[body] = value
            _update_constants(model)

        return end


@dataclass(frozen=True, slots=True)
class LostCommands:
    """Each command from outside is lost with probability `share`. The simulation's seed decides which."""

    share: float = 1.0

    def __post_init__(self) -> None:
        if not (is_within(self.share, 1.0) and self.share >= 0.0):
            raise KbotError(f"the share of lost commands must be from 0 to 1, not {reprlib.repr(self.share)}")
        _set_numbers(self, share=float(self.share))

    def begin(self, target: Target) -> End:
        before, target.commands.lost_share = target.commands.lost_share, self.share

        def end() -> None:
            target.commands.lost_share = before

        return end


@dataclass(frozen=True, slots=True)
class SilentTopic:
    """A topic without messages, as if a sensor's cable were unplugged."""

    topic: str

    def __post_init__(self) -> None:
        if not isinstance(self.topic, str):
            raise KbotError(f"a topic must be given by its name, not {reprlib.repr(self.topic)}")

    def begin(self, target: Target) -> End:
        target.bus.require(self.topic)
        before = target.bus.mute(self.topic)

        def end() -> None:
            target.bus.mute(self.topic, before)

        return end


@dataclass(frozen=True, slots=True)
class Kick:
    """An instant change of the robot's velocity.

    linear   velocity x, y, z in m/s, in world axes
    angular  velocity about x, y, z in rad/s, in world axes
    robot    name of the robot; by default the first
    """

    linear: Vector
    angular: Vector = (0.0, 0.0, 0.0)
    robot: str | None = None

    def __post_init__(self) -> None:
        linear = vector("the linear velocity in m/s", self.linear, FASTEST)
        angular = vector("the angular velocity in rad/s", self.angular, FASTEST)
        _set_numbers(self, linear=linear, angular=angular)

    def begin(self, target: Target) -> None:
        if target.engine.has_failed:
            return  # the run reports the failure after this step
        target.robots.named(self.robot).body.set_twist(self.linear, self.angular)
        target.engine.mark_moved()


FAULTS: Mapping[str, type] = {
    kind.__name__: kind for kind in (BlockedJoint, Slip, Payload, LostCommands, SilentTopic, Kick)
}


def to_journal(fault: Fault) -> dict[str, object]:
    """The fault as JSON for `from_journal`. A user-defined fault is stored by its repr only."""
    values = asdict(fault) if is_dataclass(fault) and not isinstance(fault, type) else repr(fault)
    return {"fault": type(fault).__name__, "values": values}


def from_journal(note: Mapping[str, Any]) -> Fault:  # Any: JSON
    """Restore a fault from the journal. Raises KbotError for a fault that does not ship with KBot."""
    kind = FAULTS.get(note["fault"])
    if kind is None:
        raise KbotError(f"the fault '{note['fault']}' does not ship with KBot and cannot be restored")
    values = {name: tuple(v) if isinstance(v, list) else v for name, v in note["values"].items()}
    fault: Fault = kind(**values)
    return fault


def _set_numbers(fault: object, **values: float | Vector) -> None:
    """Replace a fault's numbers, which may be numpy's, by Python floats: the journal writes them as JSON."""
    for name, value in values.items():
        object.__setattr__(fault, name, value)


def _changed(target: Target, name: str, places: Sequence[object], value: float) -> End:
    """Set entries of one of the model's arrays. Returns the function that restores them."""
    model, _ = target.engine.current()
    array = getattr(model, name)
    before = [(place, array[place]) for place in places]
    for place in places:
        array[place] = value

    def end() -> None:
        for place, old in before:
            array[place] = old

    return end


def _all(*ends: End) -> End:
    def end() -> None:
        for each in ends:
            each()

    return end


def _update_constants(model: mujoco.MjModel) -> None:
    """Recompute the constants that MuJoCo derives from masses, with scratch data: the run is not touched."""
    mujoco.mj_setConst(model, mujoco.MjData(model))
