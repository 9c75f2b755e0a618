"""Identifies a robot's parameters from a log: the kinematic part, and what the log cannot show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kbot.identify.dynamic import DELAY, ENCODER, GYRO, TIME_CONSTANT, gyro_scale, response
from kbot.identify.kinematic import KinematicFit, fit, rough_error
from kbot.identify.log import Array, DriveLog, Motions, motions_of
from kbot.identify.nominal import Nominal
from kbot.identify.odometry_model import CURVATURE, LEFT, RIGHT, YAW, residuals
from kbot.identify.result import (
    LEFT_RADIUS,
    RIGHT_RADIUS,
    SENSOR_X,
    SENSOR_Y,
    SENSOR_YAW,
    WHEEL_SEPARATION,
    Estimate,
    Identification,
    Residual,
)
from kbot.kinematics.angles import wrap
from kbot.text import KbotError
from kbot.text.notes import note

_WIDEST = 0.5
"""Half the width of the widest interval of a parameter that the log shows: relative to the wheel's radius, to
the wheel separation (also for the sensor's position), or in rad."""
_FACTOR = 3.0
"""Ratio to the description's radius or separation from which the log or the file is wrong. It is below the
factor of each confusion of units, of which that of feet and metres is the smallest."""
_RADIUS_FACTORS = {
    "wheel speeds in degrees per second": np.pi / 180.0,
    "wheel speeds in rpm": np.pi / 30.0,
    "wheel speeds in revolutions per second": 2.0 * np.pi,
    "a reference in mm": 1000.0,
    "a reference in cm": 100.0,
    "a reference in feet": 1.0 / 0.3048,
    "times in ms": 1e-3,
}
"""Factors of the wheel radius if a log has other units than m, s and rad/s."""
_SAME_FACTOR = 1.3
"""Ratio up to which a factor fits a unit: radii in a file are wrong by less, and the factors of two units
differ by more."""
_ALIASED = 0.5
"""Error of rotation in rad from which the turns are not explained: those of wrong units alias."""
_INACCURATE = 0.1
"""Error in rad of a rotation from which the reference may be in degrees."""
_MIRRORED = 1.5
"""Ratio of the mean errors of translation as they are and with x and y exchanged, from which the reference is
mirrored. Over 900 synthetic robots with correct columns, the ratio was at most 1.13, in a log of 20
intervals. With exchanged columns and a ratio below 1.5, noise hides the difference: the errors of the wheel
sizes were at most twice the half-width of their intervals."""
_NEGLIGIBLE = np.array([1e-4, 1e-4, 1e-3])
"""Errors in m, m and rad below which an outlier is not a slip or a collision. In a recording of KBot without
noise, a difference of a time stamp in the last digit makes an outlier."""
_SEPARATIONS = (1.0 / 3.0, 1.0, 3.0)
"""If a log does not show the wheel separation, the radii of the wheels must hold for these multiples of the
description's separation. Two unequal wheels drive a curve whose radius depends on the separation."""

_LINES_AND_TURNS = "needs drives along a line and turns, with a reference of translation and rotation"
KINEMATIC = {
    LEFT_RADIUS: ("m", _LINES_AND_TURNS),
    RIGHT_RADIUS: ("m", _LINES_AND_TURNS),
    WHEEL_SEPARATION: ("m", "needs turns, and drives along a line"),
    SENSOR_X: ("m", "needs turns, and drives along a line"),
    SENSOR_Y: ("m", "needs turns, and drives along a line"),
    SENSOR_YAW: ("rad", "needs drives along a line, with a reference of translation"),
}
"""The parameters of the odometry model in its order: unit, and what a log needs."""
_DYNAMIC: dict[str, tuple[str, float | None, str]] = {
    ENCODER: ("1", 1.0, "needs commands (cmd_v, cmd_w) that the wheels follow and reach"),
    GYRO: ("1", 1.0, "needs a gyro (imu_wz), turns, and a reference of rotation"),
    DELAY: ("s", None, "needs commands (cmd_v, cmd_w) that change and that the wheels follow"),
    TIME_CONSTANT: ("s", None, "needs commands (cmd_v, cmd_w) that change and that the wheels follow"),
}
"""Unit, value without an error, and what a log needs."""


def identify(log: DriveLog, nominal: Nominal) -> Identification:
    """Estimate the parameters of a robot.

    Raises:
        KbotError: the log shows no motion, has no reference, contradicts the sides of the wheels, or has
            numbers that no robot can have.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what follows from it is a LinAlgError
            return _identify(log, nominal)
    except np.linalg.LinAlgError:
        raise KbotError(
            f"{log.path}: no wheel sizes explain the numbers of the log. They must be in s, m, rad and rad/s"
        ) from None


def _identify(log: DriveLog, nominal: Nominal) -> Identification:
    all_motions = motions_of(log)
    is_moving = all_motions.is_moving
    motions = all_motions.only(is_moving)
    _require_axes(log, motions, nominal)
    found = fit(motions, nominal.start)
    _require_radians(log, found, nominal)
    _require_plausible(log, motions, found, nominal)
    low, high = _bounds(found.parameters, found.half_widths)
    value = _natural(found.parameters)
    if not _is_observable(low, high, nominal)[CURVATURE]:
        separation = nominal.drive.separation
        fits = [
            fit(motions, _with_separation(nominal.start, separation * k), held=CURVATURE)
            for k in _SEPARATIONS
        ]
        found = fits[1]
        bounds = np.array([_bounds(each.parameters, each.half_widths) for each in fits])
        low, high, value = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0), _natural(found.parameters)
        low[CURVATURE], high[CURVATURE] = -np.inf, np.inf
    is_observable = _is_observable(low, high, nominal)
    estimates, unobservable = {}, {}
    for index, (name, (unit, needed)) in enumerate(KINEMATIC.items()):
        if is_observable[index]:
            numbers = (float(value[index]), float(low[index]), float(high[index]))
            estimates[name] = Estimate(*numbers, unit, nominal.values[name])
        else:
            unobservable[name] = needed
    is_outlier, is_disturbed = np.zeros((2, len(all_motions)), dtype=bool)
    is_outlier[is_moving] = found.is_outlier
    wheel_speed = _add_dynamic(log, nominal, all_motions, is_outlier, estimates, unobservable)
    kept = motions.only(~found.is_outlier)
    translation, rotation = _root_mean_square(found.errors[~found.is_outlier])
    before = _root_mean_square(residuals(nominal.start, kept))
    if nominal.axle_from_sensor is None:
        before = (None, before[1])  # the errors of an unknown sensor mean nothing
    residual = Residual(len(kept), int(found.is_outlier.sum()), translation, rotation, *before, wheel_speed)
    is_large = (np.abs(np.nan_to_num(found.errors)) > _NEGLIGIBLE).any(axis=1)
    is_disturbed[is_moving] = found.is_outlier & is_large
    link = nominal.sensor_link
    sources = {**log.sources, **({} if link is None else {"sensor_link": link})}
    return Identification(estimates, unobservable, residual, is_disturbed, sources)


def _add_dynamic(
    log: DriveLog,
    nominal: Nominal,
    motions: Motions,
    is_outlier: NDArray[np.bool_],
    estimates: dict[str, Estimate],
    unobservable: dict[str, str],
) -> float | None:
    """Add how the wheels follow commands, and the scale of the gyro.

    Returns the error in rad/s of the wheel speeds that follow commands.
    """
    followed = response(log, nominal)
    observable = dict(followed.observable)
    scale = gyro_scale(log, motions, is_outlier)
    if scale is not None and scale.high - scale.low < 2.0 * _WIDEST:
        observable[GYRO] = scale
    for name, (unit, usual, needed) in _DYNAMIC.items():
        if name in observable:
            each = observable[name]
            estimates[name] = Estimate(each.value, each.low, each.high, unit, usual)
            if usual is not None and not _is_plausible(each.value, usual):
                note(f"{log.path}: {name} is {each.value:.4g}. Check the units and signs of the log")
        else:
            unobservable[name] = needed
    return followed.wheel_speed


def _with_separation(start: Array, separation: float) -> Array:
    changed = start.copy()
    changed[CURVATURE] = 1.0 / separation
    return changed


def _natural(parameters: Array) -> Array:
    """The parameters with the separation instead of its inverse, and the yaw wrapped."""
    natural = parameters.copy()
    natural[CURVATURE] = 1.0 / natural[CURVATURE]
    natural[YAW] = wrap(float(natural[YAW]))
    return natural


def _bounds(parameters: Array, half_widths: Array) -> tuple[Array, Array]:
    """The ends of the intervals of `_natural`. They are infinite if the curvature may be 0 or negative."""
    natural = _natural(parameters)
    low, high = natural - half_widths, natural + half_widths
    curvature, half = parameters[CURVATURE], half_widths[CURVATURE]
    low[CURVATURE] = 1.0 / (curvature + half) if curvature + half > 0.0 else -np.inf
    high[CURVATURE] = 1.0 / (curvature - half) if curvature - half > 0.0 else np.inf
    unknown = ~np.isfinite(natural)
    low[unknown], high[unknown] = -np.inf, np.inf
    return low, high


def _is_observable(low: Array, high: Array, nominal: Nominal) -> NDArray[np.bool_]:
    """(6,) which parameters the log shows: those with an interval that is narrow for their size."""
    observable = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(observable, low, 0.0), np.where(observable, high, 0.0)
    # a robot may be several times as large as described
    left, right, separation = np.maximum(
        (nominal.left, nominal.right, nominal.drive.separation), np.abs(low + high)[: CURVATURE + 1] / 2.0
    )
    sizes = np.array([left, right, separation, separation, separation, 1.0])
    observable &= (high - low) / 2.0 < _WIDEST * sizes
    return observable


def _require_axes(log: DriveLog, motions: Motions, nominal: Nominal) -> None:
    """Fail if the reference explains the log only with x and y exchanged.

    The exchange is a reflection, which no pose of the sensor explains: the sensor then moves aside as in
    turns to the other side. Drives along a line do not show it. A reference without rotations does not
    either, because exchanged wheels look the same in it.
    """
    swap = [1, 0, 2]
    other = motions_of(replace(log, displacements=log.displacements[:, swap], poses=log.poses[:, swap]))
    other = other.only(other.is_moving)
    if rough_error(motions, nominal.start) > _MIRRORED * rough_error(other, nominal.start):
        kind = "pose" if np.isfinite(log.poses).any() else "displacement"
        topic = log.sources.get("reference")
        names = f"{kind}_x and {kind}_y" if topic is None else f"x and y of {topic}"
        raise KbotError(
            f"{log.path}: {names} are exchanged, or one of them has the wrong sign: the reference moves "
            "aside as in turns to the other side. x is forwards, y to the left, and yaw counterclockwise"
        )


def _require_radians(log: DriveLog, found: KinematicFit, nominal: Nominal) -> None:
    """Fail if the rotations of the reference have large errors, and explain the log only as degrees."""
    translation, rotation = _root_mean_square(found.errors[~found.is_outlier])
    if rotation is None or rotation < _INACCURATE:
        return
    units = np.array([1.0, 1.0, np.radians(1.0)])
    motions = motions_of(replace(log, displacements=log.displacements * units, poses=log.poses * units))
    motions = motions.only(motions.is_moving)
    try:
        other = fit(motions, nominal.start)
        _require_plausible(log, motions, other, nominal)
    except (KbotError, np.linalg.LinAlgError):
        return
    predicted = (motions.displacements - other.errors)[~other.is_outlier]
    new_translation, new_rotation = _root_mean_square(other.errors[~other.is_outlier])
    _, turns = _root_mean_square(predicted)
    if new_rotation is None or turns is None or new_rotation > rotation / 10.0:
        return
    shows_turns = new_rotation < turns / 2.0
    moves_better = bool(translation and new_translation and new_translation < translation / 2.0)
    if shows_turns or moves_better:
        raise KbotError(f"{log.path}: the rotations of the reference are in degrees. They must be in rad")


def _is_plausible(size: float, usual: float) -> bool:
    """Whether a size is near that of the description. NaN counts as near, because it shows nothing."""
    return not (size <= usual / _FACTOR or size >= usual * _FACTOR)


def _rough_radius(motions: Motions) -> float:
    """The mean wheel radius from the drives along a line, without rotations. NaN if there are none."""
    sums = np.vstack([np.zeros(2), np.cumsum(motions.wheel_angles, axis=0)])
    left, right = (sums[motions.stop] - sums[motions.start]).T
    moved = np.hypot(motions.displacements[:, 0], motions.displacements[:, 1])
    is_line = (np.abs(right - left) < 0.2 * np.abs(right + left)) & np.isfinite(moved)
    if not is_line.any():
        return np.nan
    return float(np.median(moved[is_line] / np.abs(left + right)[is_line])) * 2.0


def _require_plausible(log: DriveLog, motions: Motions, found: KinematicFit, nominal: Nominal) -> None:
    """Fail if the reference contradicts the wheel speeds."""
    high = found.parameters + found.half_widths
    for side, index in (("left", LEFT), ("right", RIGHT)):
        if high[index] < 0.0:
            raise KbotError(
                f"{log.path}: a positive speed of the {side} wheel drives backwards, or that of the other "
                "wheel does. Change the sign of its speeds: positive is forwards"
            )
    if high[CURVATURE] < 0.0:
        raise KbotError(
            f"{log.path}: the robot turns against its wheel speeds. The left and right wheels are "
            "exchanged, or both speeds have the wrong sign"
        )
    mean = float(np.abs(found.parameters[[LEFT, RIGHT]]).mean())
    usual = (nominal.left + nominal.right) / 2.0
    _, rotation = _root_mean_square(found.errors)
    rough = _rough_radius(motions)
    is_known = bool(np.isfinite(high[[LEFT, RIGHT]]).all())
    if rotation is not None and rotation > _ALIASED and not _is_plausible(rough, usual):
        mean, is_known = rough, True
    if is_known and not _is_plausible(mean, usual):
        ratio = mean / usual
        units = [
            unit
            for unit, factor in _RADIUS_FACTORS.items()
            if factor / _SAME_FACTOR < ratio < factor * _SAME_FACTOR
        ]
        fits = f". This factor fits {' or '.join(units)}" if units else ""
        raise KbotError(
            f"{log.path}: the reference moves as if the wheels had a radius of {mean:.3g} m, not the "
            f"{usual:.3g} m of the file: a factor of {ratio:.3g}{fits}. Correct the log, which must "
            "be in m, s, rad and rad/s, or the value in the file. If the robot is stuck or its wheels spin, "
            "cut these parts of the log"
        )
    curvature, usual = float(found.parameters[CURVATURE]), nominal.drive.separation
    is_known = found.half_widths[CURVATURE] < curvature
    if is_known and not _is_plausible(1.0 / curvature, usual):
        raise KbotError(
            f"{log.path}: the reference moves as if the wheels were {1.0 / curvature:.3g} m apart, not the "
            f"{usual:.3g} m of the file. It must be in m and rad"
        )


def _root_mean_square(errors: Array) -> tuple[float | None, float | None]:
    translation = errors[:, :2][np.isfinite(errors[:, :2]).all(axis=1)]
    rotation = errors[np.isfinite(errors[:, 2]), 2]
    return (
        float(np.sqrt((translation**2).sum(axis=1).mean())) if len(translation) else None,
        float(np.sqrt((rotation**2).mean())) if len(rotation) else None,
    )
