"""Synthetic logs of differential robots whose parameters are known, by an integration of their own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

DISPLACEMENTS = (
    "duration,left_wheel_velocity,right_wheel_velocity,displacement_x,displacement_y,displacement_yaw"
)
POSES = "time,left_wheel_velocity,right_wheel_velocity,pose_x,pose_y,pose_yaw"


@dataclass(frozen=True)
class Truth:
    """Radii, separation and pose of the sensor in the frame at the middle of the axle, in m and rad."""

    left_wheel_radius: float = 0.034
    right_wheel_radius: float = 0.0345
    wheel_separation: float = 0.17
    sensor_x: float = 0.05
    sensor_y: float = 0.01
    sensor_yaw: float = 0.1


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def displacement(truth: Truth, left: float, right: float, steps: int = 2000) -> np.ndarray:
    """The sensor's displacement while the wheels turn by these angles in rad, by many small steps."""
    ahead = (truth.left_wheel_radius * left + truth.right_wheel_radius * right) / 2.0
    turn = (truth.right_wheel_radius * right - truth.left_wheel_radius * left) / truth.wheel_separation
    headings = (np.arange(steps) + 0.5) / steps * turn
    moved = np.array([np.cos(headings).sum(), np.sin(headings).sum()]) * ahead / steps
    lever = np.array([truth.sensor_x, truth.sensor_y])
    return np.array([*(rotation(-truth.sensor_yaw) @ (moved + rotation(turn) @ lever - lever)), turn])


def chained(displacements):
    """The poses after each displacement, from the origin."""
    place, yaw, poses = np.zeros(2), 0.0, []
    for x, y, turn in displacements:
        place, yaw = place + rotation(yaw) @ (x, y), yaw + turn
        poses.append([*place, yaw])
    return np.array(poses)


def speeds(truth: Truth, count: int, rng, *, turns: bool = True, drives: bool = True) -> np.ndarray:
    """Wheel speeds (count, 2) in rad/s of a robot that drives and turns at random."""
    linear = rng.uniform(0.1, 0.4, count) if drives else np.zeros(count)
    angular = rng.uniform(-1.0, 1.0, count) if turns else np.zeros(count)
    half = angular * truth.wheel_separation / 2.0
    return np.column_stack(
        [(linear - half) / truth.left_wheel_radius, (linear + half) / truth.right_wheel_radius]
    )


def rows(truth: Truth, wheel_speeds, rng, *, duration=0.5, slip=0.0, noise=(0.0, 0.0)) -> np.ndarray:
    """One row an interval: duration, wheel speeds and the measured displacement."""
    slipping = wheel_speeds * (1.0 + rng.normal(0.0, 1.0, wheel_speeds.shape) * slip) * duration
    measured = np.array([displacement(truth, *angles, steps=200) for angles in slipping])
    measured += rng.normal(0.0, 1.0, measured.shape) * (noise[0], noise[0], noise[1])
    return np.column_stack([np.full(len(measured), duration), wheel_speeds, measured])


def write(path: Path, header: str, table) -> Path:
    lines = [",".join("" if np.isnan(x) else f"{x:.12g}" for x in row) for row in table]
    path.write_text("\n".join([header, *lines]) + "\n")
    return path
