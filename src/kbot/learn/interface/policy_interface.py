"""What a policy sees and what it commands: named numbers with units and bounds.

Training, simulation, trials and real robots use this one module. `Pilot` and `NodePilot` give a controller
the same `Observation`, and `PolicyInterface.observe` turns it into the vector for the policy.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief
from kbot.learn.interface.targets import TARGET_FIELDS, Field, Target
from kbot.messages import Twist, Vector3
from kbot.navigation.controller import Observation
from kbot.navigation.lidar_view import LidarView
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list

Vector = NDArray[np.float32]

_OVERSPEED = 1.5
"""The seen speeds are bounded by the highest commanded ones times this, because a robot can slide or roll
downhill."""
_FASTEST, _MOST_SECTORS, _MOST_RATE = 1000.0, 10_000, 1000.0
"""m/s or rad/s, sectors, and Hz, far above those of any robot: only a mistake exceeds them."""
_LEAST_RATE = 0.1
"""Hz. A run of a policy with fewer commands would wait for the next one for very long."""
_BETWEEN_BEAMS = 0.02
"""rad by which a lidar may see less than the sectors: the gap between two beams."""
_RANGE_ROUNDING = 1e-3
"""m by which the range of a lidar may be less than the reach. Messages contain it in single precision."""
_LONGEST_SHOWN = 200
"""Characters of an error about a text that may come from a stranger."""
FORMAT = 1
"""The version of `to_json`. It changes when a policy of an older version would see something else."""


@dataclass(frozen=True, slots=True)
class Sectors:
    """The directions around the base in which a policy sees the distance of the nearest obstacle.

    `count` sectors of equal width go counter-clockwise from the direction `start` to `end` (rad in the base's
    frame, 0 is ahead). `reach` in m is the distance that a sector without an obstacle shows.
    """

    count: int
    start: float = -math.pi
    end: float = math.pi
    reach: float = 5.0

    def __post_init__(self) -> None:
        is_whole = isinstance(self.count, int) and not isinstance(self.count, bool)
        if not (is_whole and 1 <= self.count <= _MOST_SECTORS):
            raise KbotError(
                f"lidar sectors must be a whole number from 1 to {_MOST_SECTORS}, not {self.count!r}"
            )
        if not 0.0 < self.end - self.start <= 2.0 * math.pi + 1e-9:
            raise KbotError(
                f"lidar sectors must span more than 0 and at most 2 pi rad, not {self.start} to {self.end}"
            )
        if not (math.isfinite(self.reach) and self.reach > 0.0):
            raise KbotError(f"the reach of lidar sectors must be above 0 m and finite, not {self.reach}")

    def unseen(self, view: LidarView, lidar: str = "the lidar") -> str:
        """What a lidar with this name does not see of the sectors: a sentence, or an empty text."""
        offset = (self.start - view.start + _BETWEEN_BEAMS) % (2.0 * math.pi) - _BETWEEN_BEAMS
        span = view.end - view.start
        if not (view.is_full or offset + self.end - self.start <= span + _BETWEEN_BEAMS):  # also for NaN
            wanted, found = (
                f"{math.degrees(low):.0f} to {math.degrees(high):.0f} degrees"
                for low, high in ((self.start, self.end), (view.start, view.end))
            )
            return f"the policy sees obstacles from {wanted}, but {lidar} only from {found}"
        if not self.reach <= view.reach + _RANGE_ROUNDING:
            found = f"{lidar} only up to {view.reach:g} m"
            return f"the policy sees obstacles up to {self.reach:g} m, but {found}"
        return ""

    def nearest(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """The distance in m of the nearest point in each sector. `points` (n, 2) are in the base's frame."""
        found = np.full(self.count, self.reach)
        angles = np.mod(np.arctan2(points[:, 1], points[:, 0]) - self.start, 2.0 * math.pi)
        sector = (angles * (self.count / (self.end - self.start))).astype(np.intp)
        if self.end - self.start >= 2.0 * math.pi - 1e-9:
            # rounding can put an angle just below a full turn into the sector after the last
            np.minimum(sector, self.count - 1, out=sector)
        seen = sector < self.count
        np.minimum.at(found, sector[seen], np.hypot(*points[seen].T))
        return found


@dataclass(frozen=True, repr=False)
class PolicyInterface(Brief):
    """What a policy sees and commands, and how often.

    target   `goal` or `path`: where the policy drives
    linear   lowest and highest forward speed in m/s
    angular  lowest and highest turning speed in rad/s
    lateral  lowest and highest speed to the left in m/s, for a holonomic base; None for other robots
    lidar    the sectors in which it sees obstacles; None for a policy without a lidar
    rate     commands per second
    """

    target: str
    linear: tuple[float, float]
    angular: tuple[float, float]
    lateral: tuple[float, float] | None = None
    lidar: Sectors | None = None
    rate: float = 10.0

    def __post_init__(self) -> None:
        if self.target not in TARGET_FIELDS:
            hint = suggest_or_list(str(self.target), TARGET_FIELDS)
            raise KbotError(f"unknown target of a policy {self.target!r}: {hint}")
        for name in ("linear", "angular", "lateral"):
            bounds = getattr(self, name)
            if bounds is None and name == "lateral":
                continue
            low, high = bounds
            if not -_FASTEST <= low < high <= _FASTEST:
                raise KbotError(
                    f"the {name} speed of a policy must have a lower and a higher bound within"
                    f" ±{_FASTEST:g}, not {low} to {high}"
                )
        if not _LEAST_RATE <= self.rate <= _MOST_RATE:
            raise KbotError(
                f"the rate of a policy must be from {_LEAST_RATE:g} to {_MOST_RATE:g} Hz, not {self.rate}"
            )

    @cached_property
    def actions(self) -> tuple[Field, ...]:
        """The speeds that the policy commands. The policy gives each as a number from -1 (`low`) to 1
        (`high`)."""
        sideways = () if self.lateral is None else (_speed("lateral", "m/s", self.lateral, "to the left"),)
        return (
            _speed("linear", "m/s", self.linear, "forward"),
            _speed("angular", "rad/s", self.angular, "turn to the left"),
            *sideways,
        )

    @cached_property
    def inputs(self) -> tuple[Field, ...]:
        """The numbers that the policy sees, in the order of the vector."""
        moves = tuple(
            Field(
                f"{action.name}_velocity",
                action.unit,
                -_OVERSPEED * max(abs(action.low), abs(action.high)),
                _OVERSPEED * max(abs(action.low), abs(action.high)),
                f"measured speed, {action.meaning}",
            )
            for action in self.actions
        )
        last = tuple(
            Field(f"last_{action.name}", "1", -1.0, 1.0, f"the policy's last number for `{action.name}`")
            for action in self.actions
        )
        return (*TARGET_FIELDS[self.target], *moves, *last, *self._lidar_fields())

    def _lidar_fields(self) -> tuple[Field, ...]:
        if self.lidar is None:
            return ()
        width = math.degrees(self.lidar.end - self.lidar.start) / self.lidar.count
        first = math.degrees(self.lidar.start)
        return tuple(
            Field(
                f"lidar_{at}",
                "m",
                0.0,
                self.lidar.reach,
                f"nearest obstacle from {first + at * width:.4g}° to {first + (at + 1) * width:.4g}°",
            )
            for at in range(self.lidar.count)
        )

    @cached_property
    def low(self) -> Vector:
        """The lower bounds of `inputs`."""
        return np.array([field.low for field in self.inputs], dtype=np.float32)

    @cached_property
    def high(self) -> Vector:
        """The upper bounds of `inputs`."""
        return np.array([field.high for field in self.inputs], dtype=np.float32)

    @property
    def top_speeds(self) -> tuple[float, float, float]:
        """The highest speeds that the policy commands: forward and to the left in m/s, turning in rad/s."""
        bounds = self.linear, self.lateral or (0.0, 0.0), self.angular
        forward, left, turning = (max(-low, high) for low, high in bounds)
        return forward, left, turning

    @property
    def no_action(self) -> Vector:
        """The action that commands no motion, or the slowest that the bounds allow. It is the last action at
        the start."""
        return np.array([_share(field, 0.0) for field in self.actions], dtype=np.float32)

    def observe(self, observation: Observation, target: Target, last_action: ArrayLike) -> Vector:
        """The vector that the policy sees. Every number is limited to its bounds.

        `last_action` is the vector that the policy returned last, at first `no_action`.

        Raises:
            KbotError: as `numbers`.
        """
        return self.bounded(self.numbers(observation, target, np.asarray(last_action).tolist()))

    def bounded(self, numbers: ArrayLike) -> Vector:
        """The vector of what `numbers` returned, or the vectors (n, ...) of several."""
        return np.minimum(np.maximum(np.array(numbers, dtype=np.float32), self.low), self.high)

    def numbers(self, observation: Observation, target: Target, last_action: list[float]) -> list[float]:
        """The numbers of `inputs` before they are limited to their bounds.

        Raises:
            KbotError: the policy sees a lidar, and no scan was received yet, or the target is of another
                kind.
        """
        if target.kind != self.target:
            raise KbotError(f"the policy drives to a {self.target}, not to a {target.kind}")
        moved = observation.twist
        values = [*target.values(observation.pose), moved.x, moved.yaw]
        if self.lateral is not None:
            values.append(moved.y)
        values += last_action
        if self.lidar is not None:
            if observation.obstacles is None:
                raise KbotError("the policy sees a lidar, but no scan was received yet")
            values += self.lidar.nearest(observation.obstacles).tolist()
        return values

    def speeds(self, action: ArrayLike) -> tuple[float, float, float]:
        """The speeds forward (m/s), of turning (rad/s) and to the left (m/s) of a policy's vector.

        Numbers beyond -1 and 1 are limited.

        Raises:
            KbotError: the vector has another length, or a number is not finite.
        """
        return self.speeds_of(self.limited(action))

    def speeds_of(self, shares: list[float]) -> tuple[float, float, float]:
        """As `speeds`, of numbers that `limited` returned."""
        wanted = [
            low + (share + 1.0) / 2.0 * span for (low, span), share in zip(self._ranges, shares, strict=True)
        ]
        return wanted[0], wanted[1], wanted[2] if len(wanted) > 2 else 0.0

    @cached_property
    def _ranges(self) -> tuple[tuple[float, float], ...]:
        """The lower bound and the width of the range of each speed in `actions`."""
        return tuple((field.low, field.high - field.low) for field in self.actions)

    def limited(self, action: ArrayLike) -> list[float]:
        """The numbers of a policy's vector, limited to -1 and 1. Raises KbotError as `speeds` does."""
        try:
            numbers = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise KbotError(f"an action must be {len(self.actions)} numbers, not {action!r}") from None
        if numbers.shape != (len(self.actions),):
            names = ", ".join(field.name for field in self.actions)
            raise KbotError(
                f"an action must have {len(self.actions)} numbers ({names}), not the shape {numbers.shape}"
            )
        shares: list[float] = numbers.tolist()
        if not all(map(math.isfinite, shares)):
            raise KbotError(f"an action must be finite numbers, not {shares}")
        return [min(max(share, -1.0), 1.0) for share in shares]  # ten times as fast as numpy on so few

    def twist(self, action: ArrayLike) -> Twist:
        """The command of a policy's vector. Raises KbotError as `speeds` does."""
        linear, angular, lateral = self.speeds(action)
        return Twist(Vector3(linear, lateral, 0.0), Vector3(0.0, 0.0, angular))

    def named(self, vector: ArrayLike) -> dict[str, float]:
        """The numbers of an observed vector by name."""
        numbers = np.asarray(vector, dtype=np.float64).tolist()
        return {field.name: number for field, number in zip(self.inputs, numbers, strict=True)}

    def to_json(self) -> str:
        """Text for `from_json`, to store with a trained policy."""
        return json.dumps({"format": FORMAT, **asdict(self)})

    @classmethod
    def from_json(cls, text: str) -> PolicyInterface:
        """Read what `to_json` returned.

        Raises:
            KbotError: the text is something else, or of a version that this KBot does not know.
        """
        try:
            values: Any = json.loads(text)
            if not isinstance(values, dict) or "format" not in values:
                raise TypeError("no format")
            if values.pop("format") != FORMAT:
                raise KbotError(f"the policy was trained with another version of KBot's inputs than {FORMAT}")
            lidar, lateral = values.pop("lidar"), values.pop("lateral")
            return cls(
                target=values.pop("target"),
                linear=_pair(values.pop("linear")),
                angular=_pair(values.pop("angular")),
                lateral=None if lateral is None else _pair(lateral),
                lidar=None if lidar is None else Sectors(**lidar),
                rate=float(values.pop("rate")),
            )
        except KbotError as error:
            raise KbotError(_short(str(error))) from None
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
            why = _short(repr(error))
            raise KbotError(f"not a description of a policy's inputs and actions: {why}") from None


def _short(error: str) -> str:
    """The text of an error, which can contain a value of any length."""
    return error if len(error) <= _LONGEST_SHOWN else f"{error[:_LONGEST_SHOWN]}…"


def _pair(values: list[float]) -> tuple[float, float]:
    low, high = values
    return float(low), float(high)


def _speed(name: str, unit: str, bounds: tuple[float, float], meaning: str) -> Field:
    return Field(name, unit, *bounds, meaning)


def _share(field: Field, value: float) -> float:
    """The number from -1 to 1 that commands a value."""
    return min(max(2.0 * (value - field.low) / (field.high - field.low) - 1.0, -1.0), 1.0)
