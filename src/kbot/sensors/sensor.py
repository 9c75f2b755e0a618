"""What all sensors share: mounting on a link, rate, latency, topic and noise."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.messages import Header
from kbot.messages.bus import Publisher
from kbot.messages.clock import NANOSECONDS
from kbot.messages.names import require_topic_name
from kbot.sensors.noise import Noise, NoiseSource
from kbot.sim import Simulation
from kbot.text import KbotError, Origin
from kbot.text.suggest import did_you_mean

M = TypeVar("M")
A = TypeVar("A")

HERE = Transform.identity()

_OTHERS = frozenset(
    {
        "/clock", "/tf", "/tf_static", "/robot_description", "/map", "/map_metadata", "/plan",
        "/navigation_status", "/goal_pose", "/move_base_simple/goal", "/move_base/cancel", "/initialpose",
        "/clicked_point", "/contacts",
    }
)  # fmt: skip
_KBOT = "/kbot/"
"""Topics that no sensor speaks on, and beneath which none does: a run, its page and its recording do."""


@dataclass(frozen=True, kw_only=True)
class Spec(ABC):
    """A sensor as it is declared. `pose` is `link_from_sensor`; `rate` in Hz; `latency` in s is how long a
    reading takes to be heard; `topic` and `frame` are the sensor's name and the link where not given, and
    `robot` is the simulation's first.
    """

    link: str
    name: str = ""
    pose: Transform = HERE
    rate: float = 10.0
    latency: float = 0.0
    topic: str = ""
    frame: str = ""
    robot: str = ""
    origin: Origin | None = None

    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not 1e-9 <= self.rate <= 1e5:
            raise KbotError(f"{self.label}: a rate is above 0 Hz, from 1e-09 to 1e+05, not {self.rate}")
        if not (math.isfinite(self.latency) and self.latency >= 0.0):
            raise KbotError(f"{self.label}: a latency is 0 s or more, not {self.latency}")

    @property
    def label(self) -> str:
        return self.name or self.kind

    @property
    def topics(self) -> tuple[str, ...]:
        """Those it is heard on, as they are written; its readings on the first."""
        return (self.topic or self.label,)

    # Any: each sensor has its own type of message
    @abstractmethod
    def mount(self, simulation: Simulation) -> Sensor[Any]: ...


class Sensor(ABC, Generic[M]):
    """A sensor on a simulated robot. It measures at its rate as time passes, and what it says is heard on its
    topic and read as `latest`."""

    message_type: type[M]

    def __init__(self, simulation: Simulation, spec: Spec) -> None:
        """Raises KbotError: the robot has no such link, the topic's name is none, or it is another's."""
        self.simulation, self.spec = simulation, spec
        self.owner = simulation.robots.named(spec.robot or None).name
        robot = simulation.robots.named(self.owner).robot
        if spec.link not in robot.links:
            hint = did_you_mean(spec.link, robot.links)
            raise KbotError(
                f"{spec.label}: robot '{robot.name}' has no link '{spec.link}'"
                + (f": {hint}" if hint else "")
            )
        self._model: mujoco.MjModel | None = None
        self._engine()
        self._rotation, self._offset = spec.pose.rotation, spec.pose.translation
        self._period = 1.0 / spec.rate
        self._publisher: Publisher[M] = self._advertise(self.topic, self.message_type)
        self.only_when_heard = False
        """Whether it measures only while someone listens to its topics."""
        self._latest: tuple[int, M] | None = None
        self._pending: list[tuple[int, M]] = []
        self._timer = simulation.clock.every(spec.rate, self._sample)
        simulation.robots.when_changed.append(self._go_with_robot)

    @property
    def topic(self) -> str:
        """Where its readings are heard, in the namespace of its robot."""
        naming = self.simulation.robots.named(self.owner).naming
        return naming.topic(self.spec.topics[0])

    def _advertise(self, topic: str, message_type: type[A]) -> Publisher[A]:
        """Raises KbotError: the topic's name is none in ROS, or it is another's."""
        require_sensor_topic(topic)
        return self.simulation.bus.advertise(topic, message_type, rate=self.spec.rate)

    def _noise_of(self, noise: Noise, what: str, count: int) -> NoiseSource:
        """The noise of `count` values of a sample, called so."""
        name = f"{self.spec.label}/{what}"
        return NoiseSource(noise, self.simulation.seed, name, count, self._period)

    @property
    def _namespace(self) -> str:
        return self.simulation.robots.named(self.owner).naming.namespace

    @property
    def latest(self) -> M | None:
        """What was heard last; None before the first reading, also after a reset."""
        if self._latest is not None and self._latest[0] > self.simulation.clock.nanoseconds:
            self._latest = None
        return self._latest[1] if self._latest else None

    @abstractmethod
    def measure(self, sample: int | None = None) -> M:
        """What it senses now: without its noise, or with that of a sample's number."""

    def close(self) -> None:
        """Measure no more."""
        self._timer.cancel()
        self._publisher.close()
        if self._go_with_robot in self.simulation.robots.when_changed:
            self.simulation.robots.when_changed.remove(self._go_with_robot)

    def _go_with_robot(self) -> None:
        if self.owner not in self.simulation.robots:
            self.close()

    @property
    def has_subscribers(self) -> bool:
        """Whether someone listens to it."""
        return self._publisher.has_subscribers

    def _sample(self) -> None:
        if self.only_when_heard and not self.has_subscribers:
            return
        now = self.simulation.clock.nanoseconds
        message = self.measure(round(now / NANOSECONDS * self.spec.rate))
        if not self.spec.latency:
            self._hear(now, message)
            return
        self._pending = [p for p in self._pending if p[0] < now]
        self._pending.append((now, message))

        def arrive() -> None:
            later.cancel()
            self._arrive()

        later = self.simulation.clock.every(1.0 / self.spec.latency, arrive)

    def _arrive(self) -> None:
        due = self.simulation.clock.nanoseconds - round(self.spec.latency * NANOSECONDS)
        while self._pending and self._pending[0][0] <= due:
            self._hear(*self._pending.pop(0))

    def _hear(self, stamp: int, message: M) -> None:
        self._latest = stamp, message
        if self._publisher.has_subscribers:
            self._publisher.publish(message)

    def _header(self) -> Header:
        return Header(self.simulation.clock.stamp, self._frame)

    @property
    def _frame(self) -> str:
        return self.simulation.robots.named(self.owner).naming.frame_prefix + (
            self.spec.frame or self.spec.link
        )

    def _engine(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """The engine's model and data; they are other ones once robots have come or gone."""
        model, data = self.simulation.engine.current()
        if model is not self._model:
            self._model = model
            self._bind(model)
            # what the engine writes to, seen without asking it each time
            self._body_place: NDArray[np.float64] = data.xpos[self._body]
            self._body_axes: NDArray[np.float64] = data.xmat[self._body].reshape(3, 3)
        return model, data

    def _bind(self, model: mujoco.MjModel) -> None:
        """Look up what it needs in a model of the engine's."""
        name = f"{self.owner}/{self.spec.link}"
        self._body: int = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if self._body < 0:
            raise KbotError(f"{self.spec.label}: robot '{self.owner}' is no longer there")

    def _place(self) -> tuple[mujoco.MjModel, mujoco.MjData, NDArray[np.float64], NDArray[np.float64]]:
        """The engine's model and data, and where the sensor is: place (3,) and axes (3, 3) in the world."""
        model, data = self._engine()
        rotation = self._body_axes
        return model, data, self._body_place + rotation.dot(self._offset), rotation.dot(self._rotation)


def require_sensor_topic(topic: str) -> None:
    """Raises KbotError: no sensor speaks on a topic of this full name."""
    require_topic_name(topic)
    if topic in _OTHERS or topic.startswith(_KBOT):
        raise KbotError(f"topic {topic} is not for sensors: give it another")


def own_geometries(model: mujoco.MjModel, robot: str) -> NDArray[np.intp]:
    """The engine's indices of a robot's shapes."""
    prefix = f"{robot}/"
    bodies = np.array([model.body(b).name.startswith(prefix) for b in range(model.nbody)])
    return np.flatnonzero(bodies[model.geom_bodyid])
