"""Faults to inject into a run (slip, payload, blocked joint); `Disturbances.schedule` sets their times.

`begin` lets a fault act and returns the function that ends it, None if there is nothing to end.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, Protocol, runtime_checkable

import mujoco
import numpy as np

from kbot.kinematics.bodies import MassProperties, principal_axes
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
"""N m or N of friction that nothing turns against."""
ROUGHEST = 1e3
"""Coefficient of friction: hundreds of times that of rubber."""


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
        """Start to act. Returns the function that ends it, None if there is nothing to end.

        Raises:
            KbotError: the fault names something that is not there.
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
        # friction that is as stiff as a contact; the engine's own lets a servo creep on
        return _all(
            _changed(target, "dof_solref", [(dof, 0)], SOLREF[0]),
            _changed(target, "dof_solimp", [(dof, 0), (dof, 1)], SOLIMP[1]),
            _changed(target, "dof_frictionloss", [dof], STUCK),
        )


@dataclass(frozen=True, slots=True)
class Slip:
    """A link, such as a wheel, whose coefficient of friction is another: oil, ice, a worn tyre."""

    link: str
    friction: float
    robot: str | None = None

    def __post_init__(self) -> None:
        if not (is_within(self.friction, ROUGHEST) and self.friction >= 0.0):
            told = reprlib.repr(self.friction)
            raise KbotError(f"a coefficient of friction is a number from 0 to {ROUGHEST:g}, not {told}")
        _keep(self, friction=float(self.friction))

    def begin(self, target: Target) -> End:
        model, _ = target.engine.current()
        body = target.robots.named(self.robot).body.index(self.link)
        geoms = np.flatnonzero(model.geom_bodyid == body).tolist()
        priority, dimensions = rank(self.friction)
        return _all(
            _changed(target, "geom_friction", [(geom, 0) for geom in geoms], self.friction),
            _changed(target, "geom_priority", geoms, priority),
            _changed(target, "geom_condim", geoms, dimensions),
        )


@dataclass(frozen=True, slots=True)
class Payload:
    """A load of `mass` kg, as a point at a place (m) in a link's frame."""

    link: str
    mass: float
    at: Vector = (0.0, 0.0, 0.0)
    robot: str | None = None

    def __post_init__(self) -> None:
        mass = positive("the mass of a payload in kg", self.mass, HEAVIEST)
        _keep(self, mass=mass, at=vector("the place of a payload in m", self.at, FURTHEST))

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
        _reckon_anew(model)

        def end() -> None:
            for name, value in zip(names, before, strict=True):
                getattr(model, name)[body] = value
            _reckon_anew(model)

        return end


@dataclass(frozen=True, slots=True)
class LostCommands:
    """Each command that comes from outside is lost with this probability, by the simulation's seed."""

    share: float = 1.0

    def __post_init__(self) -> None:
        if not (is_within(self.share, 1.0) and self.share >= 0.0):
            raise KbotError(f"a share of commands is a number from 0 to 1, not {reprlib.repr(self.share)}")
        _keep(self, share=float(self.share))

    def begin(self, target: Target) -> End:
        before, target.commands.lost_share = target.commands.lost_share, self.share

        def end() -> None:
            target.commands.lost_share = before

        return end


@dataclass(frozen=True, slots=True)
class SilentTopic:
    """Nothing is heard on a topic: a sensor's cable is out."""

    topic: str

    def __post_init__(self) -> None:
        if not isinstance(self.topic, str):
            raise KbotError(f"a topic is spoken of by its name, not {reprlib.repr(self.topic)}")

    def begin(self, target: Target) -> End:
        target.bus.require(self.topic)
        before = target.bus.mute(self.topic)

        def end() -> None:
            target.bus.mute(self.topic, before)

        return end


@dataclass(frozen=True, slots=True)
class Kick:
    """A speed that the robot's body has at once: m/s and rad/s along the world's axes."""

    linear: Vector
    angular: Vector = (0.0, 0.0, 0.0)
    robot: str | None = None

    def __post_init__(self) -> None:
        linear = vector("a speed in m/s", self.linear, FASTEST)
        _keep(self, linear=linear, angular=vector("a turning speed in rad/s", self.angular, FASTEST))

    def begin(self, target: Target) -> None:
        if target.engine.has_failed:
            return  # the run reports that once this step is over
        target.robots.named(self.robot).body.set_twist(self.linear, self.angular)
        target.engine.mark_moved()


FAULTS: Mapping[str, type] = {
    kind.__name__: kind for kind in (BlockedJoint, Slip, Payload, LostCommands, SilentTopic, Kick)
}


def to_journal(fault: Fault) -> dict[str, object]:
    """What `from_journal` makes it of again; one of a user's own making is known by its words alone."""
    values = asdict(fault) if is_dataclass(fault) and not isinstance(fault, type) else repr(fault)
    return {"fault": type(fault).__name__, "values": values}


def from_journal(note: Mapping[str, Any]) -> Fault:  # Any: JSON
    """A fault as it was written down. Raises KbotError for one that is not KBot's."""
    kind = FAULTS.get(note["fault"])
    if kind is None:
        raise KbotError(f"the fault '{note['fault']}' is not one of KBot's own")
    values = {name: tuple(v) if isinstance(v, list) else v for name, v in note["values"].items()}
    fault: Fault = kind(**values)
    return fault


def _keep(fault: object, **values: float | Vector) -> None:
    """Numbers as Python has them: a fault is frozen, may be given numpy's, and is written down as JSON."""
    for name, value in values.items():
        object.__setattr__(fault, name, value)


def _changed(target: Target, name: str, places: Sequence[object], value: float) -> End:
    """Set entries of one of the model's arrays; how to set them back."""
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


def _reckon_anew(model: mujoco.MjModel) -> None:
    """Bring up to date what the engine keeps of masses; its own scratch, so that the run is untouched."""
    mujoco.mj_setConst(model, mujoco.MjData(model))
