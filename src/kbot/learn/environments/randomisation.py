"""Domain randomisation: values that are drawn anew for each episode."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.navigation.controller import Observation
from kbot.robot import Value
from kbot.sim import Simulation
from kbot.sim.injected_faults import ROUGHEST, Slip
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list

Range = tuple[float, float]
NONE: Range = (0.0, 0.0)
_LONGEST_DELAY = 10.0
"""s. No robot can be driven with a longer delay."""


@dataclass(frozen=True, slots=True)
class NoiseRanges:
    """The ranges of the standard deviations of what the policy sees. Each episode draws one value of each.

    position  of the pose in m
    heading   of the pose in rad
    speed     measured, forward and to the left, in m/s
    turn      measured turning speed in rad/s
    lidar     of each point that the lidar detects, in m, along its beam
    """

    position: Range = NONE
    heading: Range = NONE
    speed: Range = NONE
    turn: Range = NONE
    lidar: Range = NONE

    @classmethod
    def of(cls, given: object) -> NoiseRanges:
        """Raises KbotError: not a mapping of these names to ranges or numbers."""
        names = [each.name for each in fields(cls)]
        values = _mapping("noise", given)
        _require_known("noise", values, names)
        return cls(**{name: _range(f"noise {name}", value, 0.0, 1e3) for name, value in values.items()})


@dataclass(frozen=True)
class Randomisation:
    """The ranges (low, high) from which each episode draws. A number is a range of one value.

    properties  ranges of xacro arguments and properties, by name
    friction    coefficient of friction of all wheels that drive or steer; None for that of the description
    noise       ranges of standard deviations: see `NoiseRanges`
    delay       s from a command of the policy until the robot receives it
    """

    properties: tuple[tuple[str, Range], ...] = ()
    friction: Range | None = None
    noise: NoiseRanges = NoiseRanges()
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
            tuple((name, _range(name, value, -np.inf, np.inf)) for name, value in properties.items()),
            None if friction is None else _range("friction", friction, 0.0, ROUGHEST),
            NoiseRanges.of(values.get("noise")),
            _range("delay", values.get("delay", 0.0), 0.0, _LONGEST_DELAY),
        )

    def draw_values(self, random: np.random.Generator) -> dict[str, Value]:
        """The values of xacro arguments and properties for an episode."""
        return {name: float(random.uniform(*span)) for name, span in self.properties}

    def draw(self, random: np.random.Generator) -> Drawn:
        """All other values for an episode."""
        noise = [float(random.uniform(*getattr(self.noise, each.name))) for each in fields(self.noise)]
        friction = None if self.friction is None else float(random.uniform(*self.friction))
        return Drawn(friction, Deviations(*noise), float(random.uniform(*self.delay)))


@dataclass(frozen=True, slots=True)
class Deviations:
    """Standard deviations of what the policy sees: see `NoiseRanges`."""

    position: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    turn: float = 0.0
    lidar: float = 0.0

    def add(
        self, observation: Observation, random: np.random.Generator, lidar_at: NDArray[np.float64]
    ) -> Observation:
        """The observation with noise. `lidar_at` (x, y) in m is the lidar's place in the base's frame.

        Without noise of the lidar, no random numbers are drawn for its points.
        """
        x, y, yaw, forward, left, turn = random.standard_normal(6).tolist()
        pose, twist = observation.pose, observation.twist
        points = observation.obstacles
        if points is not None and self.lidar:
            beams = points - lidar_at
            shift = self.lidar * random.standard_normal(len(points))
            shares = 1.0 + shift / np.maximum(np.hypot(*beams.T), 1e-9)
            points = lidar_at + beams * np.maximum(shares, 0.0)[:, None]
        return replace(
            observation,
            pose=PlanarPose(
                pose.x + self.position * x, pose.y + self.position * y, pose.yaw + self.heading * yaw
            ),
            twist=PlanarTwist(
                twist.x + self.speed * forward, twist.y + self.speed * left, twist.yaw + self.turn * turn
            ),
            obstacles=points,
        )

    @property
    def is_none(self) -> bool:
        return self == Deviations()


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of one episode. `delay` is in s."""

    friction: float | None
    noise: Deviations
    delay: float

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


def _range(name: str, value: object, low: float, high: float) -> Range:
    span: Any = (value, value) if isinstance(value, Real) else value  # an error below if it is not a pair
    try:
        low_end, high_end = span
        first, last = float(low_end), float(high_end)
    except (TypeError, ValueError):
        raise KbotError(f"{name} must be a number or (low, high), not {reprlib.repr(value)}") from None
    if not (low <= first <= last <= high and np.isfinite(first) and np.isfinite(last)):
        raise KbotError(
            f"{name} must be a finite range (low, high) within {low:g} to {high:g}, not {reprlib.repr(value)}"
        )
    return first, last
