"""Computes how wheels with their true sizes, sides and axes roll, from a controller's odometry of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.sim.drive.twist_controller import Twist
from kbot.sim.robot import SimulatedRobot


class TrueRolling:
    """Converts motions by odometry of the wheels to those of wheels that roll without slip.

    The difference between the two is the part of an odometry error that wrong sizes, exchanged sides and
    reversed axes explain. What is left is slip.
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        drive, settings = robot.drive, robot.settings
        self._forward = self._turn = 1.0
        """By how much odometry's distances and turns are too large, if the base does not have two sides."""
        self._sides: tuple[Sequence[float], Sequence[float]] | None = None
        """The distances in m that each side of the base drives, from angles of the wheels that the controller
        calls left and right, in rad."""
        if not isinstance(drive, DifferentialDrive) or settings is None:
            return
        self._radius, self._separation = settings.radius, settings.separation
        self._true_separation = drive.separation
        if isinstance(drive, SteeredDrive):
            self._forward = settings.radius / drive.radius
            self._turn = self._forward * drive.wheelbase / (settings.wheelbase or drive.wheelbase)
        elif isinstance(drive, HolonomicDrive):
            self._forward = settings.radius / drive.radius
            # the settings of tracks contain their slip, which odometry does not know
            self._turn = self._forward * drive.separation / (settings.separation * drive.efficiency)
        else:
            self._sides = _sides(drive)

    def motion(self, odometry: Twist) -> Twist:
        """The motion in the frame before it (m, m, rad), from that by odometry."""
        forward, left, turn = odometry
        if self._sides is None:
            return forward / self._forward, left / self._forward, turn / self._turn
        # the wheels drive arcs, whose chords odometry adds up
        length = forward / (_sinc(turn / 2.0) * cos(turn / 2.0)) if abs(turn) < 1.5 else forward
        half = turn * self._separation / 2.0
        angles = (length - half) / self._radius, (length + half) / self._radius
        on_left, on_right = (sum(a * r for a, r in zip(angles, side, strict=True)) for side in self._sides)
        turn = (on_right - on_left) / self._true_separation
        chord = (on_left + on_right) / 2.0 * _sinc(turn / 2.0)
        return chord * cos(turn / 2.0), chord * sin(turn / 2.0), turn


def _sides(drive: DifferentialDrive) -> tuple[Sequence[float], Sequence[float]]:
    """For the left and the right of the base: the distance in m that its wheels drive for each rad of the
    wheels that the controller calls left and right."""
    axle_from_base, leftward = drive.axle_in_base.inverse(), drive.axle_in_base.rotation[:, 1]
    sides: list[list[list[float]]] = [[[], []], [[], []]]
    for named, names in enumerate((drive.left, drive.right)):
        for name in names:
            wheel = drive.wheels[name]
            is_right = int(axle_from_base.apply(wheel.center)[1] < 0.0)
            sign = 1.0 if (wheel.axis @ leftward) * drive.forward[name] > 0.0 else -1.0
            sides[is_right][named].append(sign * (wheel.radius or drive.radius))
    left, right = ([sum(radii) / max(1, sum(map(len, side))) for radii in side] for side in sides)
    return left, right


def _sinc(angle: float) -> float:
    return sin(angle) / angle if abs(angle) > 1e-4 else 1.0 - angle * angle / 6.0
