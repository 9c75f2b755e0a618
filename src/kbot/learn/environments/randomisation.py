"""Domain randomisation: values that are drawn anew for each episode."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields, replace
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.learn.environments.option_checks import require_range
from kbot.navigation.controller import Observation
from kbot.robot import Value
from kbot.sim import Simulation
from kbot.sim.injected_faults import ROUGHEST, Slip
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list

T = TypeVar("T")
Range = tuple[float, float]
NONE: Range = (0.0, 0.0)
_LONGEST_DELAY = 10.0
"""s. No robot can be driven with a longer delay."""
_LARGEST = 1e12
"""No value of a description is larger."""
_range = partial(require_range, may_be_number=True)


@dataclass(frozen=True)
class Noise(Generic[T]):
    """The standard deviations of what the policy sees: the values of an episode, or ranges for all episodes.

    position  of the pose in m
    heading   of the pose in rad
    speed     measured, forward and to the left, in m/s
    turn      measured turning speed in rad/s
    lidar     of each point that the lidar detects, in m, along its beam
    """

    position: T
    heading: T
    speed: T
    turn: T
    lidar: T


def read_noise(given: object) -> Noise[Range]:
    """The ranges of the option `noise`.

    Raises:
        KbotError: it does not map names to ranges or numbers.
    """
    names = [each.name for each in fields(Noise)]
    values = _mapping("noise", given)
    _require_known("noise", values, names)
    return Noise(*(_range(f"noise {name}", values.get(name, 0.0), 0.0, 1e3) for name in names))


@dataclass(frozen=True)
class Randomisation:
    """The ranges (low, high) from which each episode draws. A number is a range of one value.

    properties  ranges of xacro arguments and properties, by name
    friction    coefficient of friction of all wheels that drive or steer; None for that of the description
    noise       ranges of standard deviations: see `Noise`
    delay       s from a command of the policy until the robot receives it
    """

    properties: tuple[tuple[str, Range], ...] = ()
    friction: Range | None = None
    noise: Noise[Range] = Noise(NONE, NONE, NONE, NONE, NONE)
    delay: Range = NONE

    @classmethod
    def of(cls, given: object) -> Randomisation:
        """Read the option `randomise`.

        Raises:
            KbotError: a name is unknown, or a value is not a range.
        """
        values = _mapping("randomise", given)
        _require_known("randomise", values, [each.name for each in fields(cls)])
        properties = _mapping("properties", values.get("properties"))
        friction = values.get("friction")
        return cls(
            tuple((name, _range(name, value, -_LARGEST, _LARGEST)) for name, value in properties.items()),
            None if friction is None else _range("friction", friction, 0.0, ROUGHEST),
            read_noise(values.get("noise")),
            _range("delay", values.get("delay", 0.0), 0.0, _LONGEST_DELAY),
        )

    def draw_values(self, random: np.random.Generator) -> dict[str, Value]:
        """The values of xacro arguments and properties for an episode."""
        return {name: float(random.uniform(*span)) for name, span in self.properties}

    def draw(self, random: np.random.Generator) -> Drawn:
        """All other values for an episode."""
        noise = Noise(*(float(random.uniform(*span)) for span in astuple(self.noise)))
        friction = None if self.friction is None else float(random.uniform(*self.friction))
        return Drawn(friction, noise, float(random.uniform(*self.delay)))


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of one episode. `delay` is in s."""

    friction: float | None = None
    noise: Noise[float] = Noise(0.0, 0.0, 0.0, 0.0, 0.0)
    delay: float = 0.0

    @property
    def is_noisy(self) -> bool:
        return any(astuple(self.noise))

    def seen(
        self, observation: Observation, random: np.random.Generator, lidar_at: NDArray[np.float64]
    ) -> Observation:
        """The observation with noise. `lidar_at` (x, y) in m is the lidar's place in the base's frame.

        Without noise of the lidar, no random numbers are drawn for its points.
        """
        noise = self.noise
        x, y, yaw, forward, left, turn = random.standard_normal(6).tolist()
        pose, twist = observation.pose, observation.twist
        points = observation.obstacles
        if points is not None and noise.lidar:
            beams = points - lidar_at
            shift = noise.lidar * random.standard_normal(len(points))
            shares = 1.0 + shift / np.maximum(np.hypot(*beams.T), 1e-9)
            points = lidar_at + beams * np.maximum(shares, 0.0)[:, None]
        return replace(
            observation,
            pose=PlanarPose(
                pose.x + noise.position * x, pose.y + noise.position * y, pose.yaw + noise.heading * yaw
            ),
            twist=PlanarTwist(
                twist.x + noise.speed * forward, twist.y + noise.speed * left, twist.yaw + noise.turn * turn
            ),
            obstacles=points,
        )

    def apply(self, simulation: Simulation) -> list[int]:
        """Change the simulation for the episode that starts now. Returns the numbers of its faults, to end
        them after the episode."""
        drive = simulation.robots.first.drive
        if self.friction is None or not isinstance(drive, DifferentialDrive):
            return []
        return [
            simulation.disturbances.schedule(Slip(link, self.friction), simulation.time)
            for link in drive.tyres
        ]


def require_friction(simulation: Simulation) -> None:
    """Raises KbotError: the friction of this robot's wheels cannot change."""
    if isinstance(simulation.robots.first.drive, HolonomicDrive):
        raise KbotError(
            "friction cannot be randomised for a holonomic base, whose wheels slide without friction"
        )


def _mapping(name: str, given: object) -> Mapping[str, object]:
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(isinstance(key, str) for key in given):
        raise KbotError(f"{name} must be a dict of ranges by name, not {reprlib.repr(given)}")
    return given


def _require_known(what: str, values: Mapping[str, object], names: list[str]) -> None:
    for name in values:
        if name not in names:
            raise KbotError(f"unknown name '{name}' in {what}: {suggest_or_list(name, names)}")
