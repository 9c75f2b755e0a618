"""The base classes of all sensors: mounting on a link, rate, latency, topic and noise."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.transform import Transform
from kbot.messages import Header
from kbot.messages.bus import Publisher
from kbot.messages.clock import NANOSECONDS
from kbot.messages.names import require_topic_name
from kbot.sensors.noise import Noise, NoiseSource
from kbot.sim import Simulation
from kbot.text import KbotError, Origin
from kbot.text.suggest import suggest_or_list

M = TypeVar("M")
A = TypeVar("A")

HERE = Transform.identity()

_OTHERS = frozenset(
    {
        "/clock", "/tf", "/tf_static", "/robot_description", "/map", "/map_metadata", "/plan",
        "/navigation_status", "/goal_pose", "/move_base_simple/goal", "/move_base/NavfnROS/plan",
        "/move_base/current_goal", "/move_base/goal", "/move_base/cancel", "/move_base/status",
        "/move_base/feedback", "/move_base/result", "/initialpose", "/clicked_point", "/contacts",
    }
)  # fmt: skip
_KBOT = "/kbot/"
"""Reserved topics, and a reserved prefix: the run, its page and its recording publish on them."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Spec(Brief, ABC):
    """The declaration of a sensor.

    `pose` is `link_from_sensor`. `rate` is in Hz. `latency` is the time from measuring to publishing in s.
    `topic` defaults to the sensor's name, `frame` to the link, and `robot` to the simulation's first robot.
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
            raise KbotError(f"{self.label}: the rate must be from 1e-09 to 1e+05 Hz, not {self.rate}")
        if not (math.isfinite(self.latency) and self.latency >= 0.0):
            raise KbotError(f"{self.label}: the latency must be at least 0 s and finite, not {self.latency}")

    @property
    def label(self) -> str:
        return self.name or self.kind

    @property
    def topics(self) -> tuple[str, ...]:
        """The names of its topics as declared. The first is that of its readings."""
        return (self.topic or self.label,)

    # Any: each sensor has its own message type
    @abstractmethod
    def mount(self, simulation: Simulation) -> Sensor[Any]: ...


class Sensor(Brief, ABC, Generic[M]):
    """A sensor on a simulated robot.

    It measures at its rate and publishes the readings on its topic. `latest` is the newest reading.
    """

    message_type: type[M]

    def __init__(self, simulation: Simulation, spec: Spec) -> None:
        """Raises KbotError: the link does not exist, or the topic's name is not valid or is in use."""
        self.simulation, self.spec = simulation, spec
        self.owner = simulation.robots.named(spec.robot or None).name
        robot = simulation.robots.named(self.owner).robot
        if spec.link not in robot.links:
            raise KbotError(
                f"{spec.label}: robot '{robot.name}' has no link '{spec.link}': "
                + suggest_or_list(spec.link, robot.links)
            )
        self._model: mujoco.MjModel | None = None
        self._engine()
        self._rotation, self._offset = spec.pose.rotation, spec.pose.translation
        self._period = 1.0 / spec.rate
        self._publisher: Publisher[M] = self._advertise(self.topic, self.message_type)
        self.only_with_subscribers = False
        """Whether it measures only while one of its topics has a subscriber."""
        self.is_needed: Callable[[int], bool] | None = None
        """Whether anybody reads the measurement of a time in ns. None: every measurement is made."""
        self._latest: tuple[int, M] | None = None
        self._pending: list[tuple[int, M]] = []
        self._timer = simulation.clock.every(spec.rate, self._sample)
        simulation.robots.when_changed.append(self._close_with_robot)

    @property
    def topic(self) -> str:
        """The topic of its readings, in its robot's namespace."""
        naming = self.simulation.robots.named(self.owner).naming
        return naming.topic(self.spec.topics[0])

    def _advertise(self, topic: str, message_type: type[A]) -> Publisher[A]:
        """Raises KbotError: the topic's name is not valid in ROS, or is in use."""
        require_sensor_topic(topic)
        return self.simulation.bus.advertise(topic, message_type, rate=self.spec.rate)

    def _noise_of(self, noise: Noise, what: str, count: int) -> NoiseSource:
        """The noise of `count` values per sample. `what` makes its random numbers independent of others."""
        name = f"{self.spec.label}/{what}"
        return NoiseSource(noise, self.simulation.seed, name, count, self._period)

    @property
    def _namespace(self) -> str:
        return self.simulation.robots.named(self.owner).naming.namespace

    @property
    def has_reading(self) -> bool:
        """Whether it has published a reading since the start of the run."""
        if self._latest is not None and self._latest[0] > self.simulation.clock.nanoseconds:
            self._latest = None  # a reset or a restored state set the time back
        return self._latest is not None

    @property
    def latest(self) -> M:
        """The newest reading.

        Raises:
            KbotError: there is no reading yet, or none since a reset (`has_reading`).
        """
        if not self.has_reading or self._latest is None:
            raise KbotError(self._why_no_reading())
        return self._latest[1]

    def _why_no_reading(self) -> str:
        if self.only_with_subscribers and not self.has_subscribers:
            return f"{self.spec.label} has no reading: it measures only while its topic has a subscriber"
        # a step more than the first reading takes, because run rounds to steps; up to whole milliseconds
        seconds = self._period + self.spec.latency + self.simulation.timestep
        return (
            f"{self.spec.label} has no reading yet: advance the simulation first, for example with"
            f" sim.run({math.ceil(1e3 * seconds - 1e-6) / 1e3:g}), or call measure()"
        )

    @abstractmethod
    def measure(self, sample: int | None = None) -> M:
        """Measure now, with the noise of a sample number, or without noise for None."""

    def close(self) -> None:
        """Stop measuring."""
        self._timer.cancel()
        self._publisher.close()
        if self._close_with_robot in self.simulation.robots.when_changed:
            self.simulation.robots.when_changed.remove(self._close_with_robot)

    def _close_with_robot(self) -> None:
        if self.owner not in self.simulation.robots:
            self.close()

    @property
    def has_subscribers(self) -> bool:
        """Whether one of its topics has a subscriber."""
        return self._publisher.has_subscribers

    def _sample(self) -> None:
        if self.only_with_subscribers and not self.has_subscribers:
            return
        now = self.simulation.clock.nanoseconds
        if self.is_needed is not None and not self.is_needed(now):
            return
        message = self.measure(round(now / NANOSECONDS * self.spec.rate))
        if not self.spec.latency:
            self._publish(now, message)
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
            self._publish(*self._pending.pop(0))

    def _publish(self, stamp: int, message: M) -> None:
        self._latest = stamp, message
        if self._publisher.has_subscribers:
            self._publisher.publish_plain(message)

    def _header(self) -> Header:
        return Header(self.simulation.clock.stamp, self._frame)

    @property
    def _frame(self) -> str:
        return self.simulation.robots.named(self.owner).naming.frame_prefix + (
            self.spec.frame or self.spec.link
        )

    def _engine(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """The engine's model and data. They change when robots are spawned or deleted."""
        model, data = self.simulation.engine.current()
        if model is not self._model:
            self._model = model
            self._bind(model)
            # views of the engine's arrays, which save looking them up for each reading
            self._body_place: NDArray[np.float64] = data.xpos[self._body]
            self._body_axes: NDArray[np.float64] = data.xmat[self._body].reshape(3, 3)
        return model, data

    def _bind(self, model: mujoco.MjModel) -> None:
        """Look up the sensor's body in the engine's model."""
        name = f"{self.owner}/{self.spec.link}"
        self._body: int = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if self._body < 0:
            raise KbotError(f"{self.spec.label}: robot '{self.owner}' was deleted")

    def _place(self) -> tuple[mujoco.MjModel, mujoco.MjData, NDArray[np.float64], NDArray[np.float64]]:
        """The engine's model and data, and the sensor's position (3,) and axes (3, 3) in the world."""
        model, data = self._engine()
        rotation = self._body_axes
        return model, data, self._body_place + rotation.dot(self._offset), rotation.dot(self._rotation)

    def _shown(self) -> Iterator[str]:
        yield repr(self.spec.label)
        yield f"link={self.spec.link!r}"
        yield f"rate={self.spec.rate:g}"
        yield f"topic={self._publisher.topic!r}"


def require_sensor_topic(topic: str) -> None:
    """Raises KbotError: a topic's full name is not valid or is reserved."""
    require_topic_name(topic)
    if topic in _OTHERS or topic.startswith(_KBOT):
        raise KbotError(f"the topic {topic} is reserved: choose another for the sensor")
