"""Estimates how the wheels follow commands, and the scale of the gyro.

The wheels follow commanded speeds u with a scale K, a delay d and a time constant T:
T dy/dt + y = K u(t - d). The drive's controller in the description computes u from a twist. This is the usual
model of a controlled motor, a first-order lag with a dead time: K. Åström and T. Hägglund, Advanced PID
Control, ISA, 2006.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from kbot.identify.intervals import DEVIATION_OF_MAD, half_widths
from kbot.identify.log import Array, DriveLog, Motions
from kbot.identify.nominal import Nominal

ENCODER, GYRO, DELAY, TIME_CONSTANT = "encoder_scale", "gyro_scale", "delay", "motor_time_constant"
_LONGEST_DELAY, _LONGEST_TIME_CONSTANT = 2.0, 3.0
"""Bounds of the search in s, above those of any drive."""
_SHORTEST = 1e-3
"""Shortest time constant in s: a shorter one is not distinguished from none."""
_DELAYS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 1.5)
_TIME_CONSTANTS = (0.005, 0.03, 0.1, 0.25, 0.6, 1.5)
"""s. The search starts at the best of these."""
_FEWEST = 20
"""Intervals with commands and wheel speeds."""
_FEWEST_CHANGES = 3
"""Changes of the command, without which neither a delay nor a time constant is observable."""
_LEAST_EXPLAINED = 0.5
"""Share of the variance of the wheel speeds that the commands must explain: below it a model is not
satisfactory (D. Moriasi and others, Model Evaluation Guidelines, Transactions of the ASABE 50(3), 2007)."""
_SETTLED = 5.0
"""Time constants after a change of the command from which the wheels have reached it but for 0.7 %."""
_LEAST_SETTLED = 0.1
"""Share of the intervals from which the scale is estimated, if the commands change too soon to settle."""
_OUTLIER = 5.0
"""Error of an interval that is left out, in robust standard deviations: a wheel that is blocked."""


@dataclass(frozen=True, slots=True)
class Interval:
    """The value of a parameter, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Response:
    """How the wheels follow the commands.

    observable   the parameters that the log shows, by name
    wheel_speed  root mean square in rad/s of the errors of the wheel speeds with them, without outliers; None
                 if the log does not show the response
    """

    observable: dict[str, Interval]
    wheel_speed: float | None = None


def gyro_scale(log: DriveLog, motions: Motions, is_outlier: NDArray[np.bool_]) -> Interval | None:
    """The measured turn of the gyro divided by that of the reference, with a constant bias of the gyro.

    Both turns have noise, so that a regression of one on the other would be biased. The turn that the wheels
    show is their instrument: it is correlated with both, and not with their noise (P. Wright, The Tariff on
    Animal and Vegetable Oils, 1928, appendix B).

    The turns are in rad, and the scale has no unit. None if the log does not show it.
    """
    durations = np.nan_to_num(log.durations)
    turned = _sums(log.gyro * durations, motions)
    wheels = _sums(motions.wheel_angles[:, 1] - motions.wheel_angles[:, 0], motions)
    lasted = _sums(durations, motions)
    turns = motions.displacements[:, 2]
    used = np.isfinite(turned) & np.isfinite(turns) & ~is_outlier
    if used.sum() < _FEWEST or not np.ptp(log.gyro[np.isfinite(log.gyro)]):
        return None  # a gyro that never changes does not measure
    instruments = np.column_stack([wheels, lasted])[used]
    columns = np.column_stack([turns, lasted])[used]
    measured = turned[used]
    for _ in range(2):  # once more, without the outliers of the gyro
        cross = instruments.T @ columns
        if np.linalg.cond(cross) > 1e12:
            return None
        found = np.linalg.solve(cross, instruments.T @ measured)
        errors = measured - columns @ found
        spread = DEVIATION_OF_MAD * float(np.median(np.abs(errors))) + 1e-12
        kept = np.abs(errors) < _OUTLIER * spread
        if kept.all():
            break
        instruments, columns, measured = instruments[kept], columns[kept], measured[kept]
    errors = measured - columns @ found
    projected = instruments @ np.linalg.lstsq(instruments, columns, rcond=None)[0]
    half = float(half_widths(projected, errors, np.array([[1.0, 0.0]]), 1)[0])
    return Interval(float(found[0]), float(found[0]) - half, float(found[0]) + half)


def _sums(values: Array, motions: Motions) -> Array:
    """The sum of the values of the intervals of each displacement. NaN if one is absent."""
    sums = np.concatenate([[0.0], np.cumsum(np.nan_to_num(values))])
    absent = np.concatenate([[0], np.cumsum(~np.isfinite(values))])
    found: Array = np.where(
        absent[motions.stop] == absent[motions.start], sums[motions.stop] - sums[motions.start], np.nan
    )
    return found


def response(log: DriveLog, nominal: Nominal) -> Response:
    """How the wheels follow the commands: the scale, the delay in s and the time constant in s."""
    durations = np.nan_to_num(log.durations)
    ends = np.cumsum(durations)
    starts = ends - durations
    commanded = _wheel_commands(log, nominal)
    used = np.isfinite(commanded).all(axis=1) & np.isfinite(log.wheel_speeds).all(axis=1) & (ends > starts)
    if used.sum() < _FEWEST:
        return Response({})
    # before the first command the robot stands
    model = _Response(starts, np.nan_to_num(commanded), starts[used], ends[used])
    measured = log.wheel_speeds[used]
    if not np.abs(commanded[used]).max() > 0.0:
        return Response({})
    grid = [(delay, constant) for delay in _DELAYS for constant in _TIME_CONSTANTS]
    best = min(grid, key=lambda pair: _misfit(model.unit(*pair), measured))
    unit = model.unit(*best)
    scale = float((unit * measured).sum() / max((unit * unit).sum(), 1e-12))
    start = np.array([scale, *best])
    kept = np.ones(len(measured), dtype=bool)
    for _ in range(2):
        start = _fitted(model, measured, kept, start)
        errors = np.abs(measured - start[0] * model.unit(start[1], start[2])).max(axis=1)
        spread = DEVIATION_OF_MAD * float(np.median(errors)) + 1e-9
        # the response differs from the model most where the command changes: only gross errors are left out
        kept = errors < np.maximum(_OUTLIER * spread, 0.3 * np.abs(measured).max())
    start = _fitted(model, measured, kept, start)
    if model.changes >= _FEWEST_CHANGES:
        left = (measured - start[0] * model.unit(start[1], start[2]))[kept]
        about_mean = measured[kept] - measured[kept].mean(axis=0)
        if (left**2).sum() > (1.0 - _LEAST_EXPLAINED) * (about_mean**2).sum():
            return Response({})
    return _observable(model, measured, kept, start, float(np.median(durations[used])))


def _wheel_commands(log: DriveLog, nominal: Nominal) -> Array:
    """(N, 2) the speeds in rad/s of the left and right wheel that the drive's controller computes."""
    radius, separation = nominal.declared_sizes
    linear, angular = log.commands.T
    half = angular * separation / 2.0
    return np.column_stack([linear - half, linear + half]) / radius


class _Response:
    """The mean speeds in intervals of a first-order system whose input is constant between changes."""

    def __init__(self, times: Array, inputs: Array, starts: Array, ends: Array) -> None:
        changes = np.concatenate([[True], (np.diff(inputs, axis=0) != 0.0).any(axis=1)])
        self._times, self._inputs = times[changes], inputs[changes]
        self._starts, self._ends = starts, ends
        lasted = np.diff(self._times)
        self._integrals = np.vstack([np.zeros(2), np.cumsum(self._inputs[:-1] * lasted[:, None], axis=0)])
        self._lasted = lasted

    @property
    def changes(self) -> int:
        return len(self._times)

    def unit(self, delay: float, constant: float) -> Array:
        """(n, 2) the mean speeds with a scale of 1."""
        constant = max(constant, _SHORTEST)
        state, states = self._inputs[0], [self._inputs[0]]
        for now, decay in zip(self._inputs[:-1], np.exp(-self._lasted / constant).tolist(), strict=True):
            state = now + (state - now) * decay
            states.append(state)
        before, after = (
            self._at(times - delay, constant, np.array(states)) for times in (self._starts, self._ends)
        )
        mean: Array = (after - before) / (self._ends - self._starts)[:, None]
        return mean

    def held(self, delay: float) -> tuple[Array, Array]:
        """(n, 2) the delayed command in each interval, and (n,) for how long in s it applied before.

        The time is negative if the next command is sent before the end of the interval: the delay may be
        estimated too long, because of a slow start.
        """
        first, last = (
            np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, None)
            for times in (self._starts - delay, self._ends - 1e-9)
        )
        return self._inputs[first], np.where(first == last, self._starts - delay - self._times[first], -1.0)

    def _at(self, times: Array, constant: float, states: Array) -> Array:
        """The integral of the output: that of the input, less the time constant times the output's change."""
        index = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, None)
        passed = times - self._times[index]
        now, state = self._inputs[index], states[index]
        outputs = now + (state - now) * np.exp(-np.maximum(passed, 0.0) / constant)[:, None]
        inside: Array = self._integrals[index] + now * passed[:, None] - constant * outputs
        return inside


def _misfit(unit: Array, measured: Array) -> float:
    scale = float((unit * measured).sum()) / max(float((unit * unit).sum()), 1e-12)
    return float(np.abs(measured - scale * unit).sum())


def _fitted(model: _Response, measured: Array, kept: NDArray[np.bool_], start: Array) -> Array:
    def errors(values: Array) -> Array:
        left: Array = (measured - values[0] * model.unit(values[1], values[2]))[kept].ravel()
        return left

    lowest, highest = [-np.inf, 0.0, _SHORTEST], [np.inf, _LONGEST_DELAY, _LONGEST_TIME_CONSTANT]
    inside = np.clip(start, lowest, highest)
    found: Array = least_squares(errors, inside, bounds=(lowest, highest), x_scale=[1.0, 0.1, 0.1]).x
    return found


def _observable(
    model: _Response, measured: Array, kept: NDArray[np.bool_], found: Array, interval: float
) -> Response:
    """The intervals of the parameters that the log shows. Times are never negative."""
    scale, delay, constant = found.tolist()
    steps = (1e-6, 1e-4, 1e-4)
    slopes = []
    for index, step in enumerate(steps):
        low, high = found.copy(), found.copy()
        low[index], high[index] = found[index] - step, found[index] + step
        change = high[0] * model.unit(high[1], high[2]) - low[0] * model.unit(low[1], low[2])
        slopes.append((change[kept] / (2.0 * step)).ravel())
    derivatives = np.column_stack(slopes)
    if model.changes < _FEWEST_CHANGES:
        derivatives = derivatives[:, :1]
    sizes = np.linalg.norm(derivatives, axis=0)
    if not sizes[0] or np.linalg.cond(derivatives / np.maximum(sizes, 1e-12)) > 1e6:
        return Response({})
    unit = model.unit(delay, constant)
    left = (measured - scale * unit)[kept].ravel()
    halves = half_widths(derivatives, left, np.eye(derivatives.shape[1]), 2)
    observable = {}
    settled = _settled_scale(model, unit, measured, kept, found)
    if settled is not None and settled.high - settled.low < abs(settled.value):
        observable[ENCODER] = settled
        scale = settled.value
    for name, value, half in zip(
        (DELAY, TIME_CONSTANT), (delay, constant), halves[1:].tolist(), strict=False
    ):
        if half < max(0.5 * value, interval):
            observable[name] = Interval(value, max(value - half, 0.0), value + half)
    errors = (measured - scale * unit)[kept]
    return Response(observable, float(np.sqrt((errors**2).mean())) if observable else None)


def _settled_scale(
    model: _Response, unit: Array, measured: Array, kept: NDArray[np.bool_], found: Array
) -> Interval | None:
    """The scale from the intervals in which the wheels have reached the command.

    A controller that limits accelerations follows a step with a ramp, which is not the exponential of the
    model. A fit to all intervals compensates for the difference with the scale: for KBot's simulated drive
    with commands of 0.5 to 1 s it was 1.021 instead of 1. The interval includes what the rest of the
    exponential changes, because a ramp has no such rest. At most the later half of the intervals is used,
    because the last of the response of a real motor is slower than the exponential.
    """
    _, delay, constant = found.tolist()
    commanded, passed = model.held(delay)
    usable = kept & (passed >= 0.0) & (commanded != 0.0).any(axis=1)
    if not usable.any():
        return None
    median, longest = np.quantile(passed[usable], (0.5, 1.0 - _LEAST_SETTLED), method="lower").tolist()
    used = usable & (passed >= min(max(_SETTLED * constant, median), longest))
    followed, wanted, speeds = unit[used], commanded[used], measured[used]
    if not followed.any():
        return None
    value = float((followed * speeds).sum() / (followed**2).sum())
    reached = float((wanted * speeds).sum() / (wanted**2).sum())
    left = (speeds - value * followed).ravel()
    noise = float(half_widths(followed.reshape(-1, 1), left, np.eye(1), 2)[0])
    half = float(np.hypot(noise, value - reached))
    return Interval(value, value - half, value + half)
