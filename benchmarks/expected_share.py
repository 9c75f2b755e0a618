"""Which share of a command a robot's own files let it drive, in closed form and without a simulation.

    python benchmarks/expected_share.py FILE [--package-path=FOLDER…] [NAME:=VALUE…]

Prints the shares of 0.3 m/s and of 0.5 rad/s, for 5 s from standstill, as JSON with a reason:

- A controller commands the wheels by the radius r and the separation s that it declares, with their
  multipliers. On wheels of radius R and separation S, the robot drives R/r and turns (R/r)(s/S) of that.
- A controller that names the left wheels right turns the robot the other way, an axis that points to the
  right drives it backwards, and wheels that roll along y do not drive it along x.
- A limit of speed, of the controller or of a wheel's joint, replaces the command.
- With the acceleration a and the jerk j, the speed v takes v/a + a/j or, below a^2/j, 2 sqrt(v/j). Half of
  it is lost. Without a declared acceleration it is KBot's, 1 m/s^2 and 8 rad/s^2.
- A motor with an effort limit E turns a wheel with dry friction F and damping D at w = (E - F) / D or slower.
  n motors bring a mass m to the speed v with the time constant t = m R^2 / (n D), after -t ln(1 - v / (w R)).

How far a skid-steered robot turns depends on the friction of its tyres, and is left out. KBot only reads the
description: the sizes of wheels from shapes and joints, and the declared values.
"""

from __future__ import annotations

import json
import sys
from math import copysign, cos, exp, inf, log, sqrt
from typing import NamedTuple

from kbot.kinematics.bodies import total_mass
from kbot.kinematics.drive.declared import DeclaredDrive, Holonomic, declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive, find_drive
from kbot.kinematics.drive.nearby import with_nearby_drive
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.text import DiagnosticCollector
from kbot.xacro import Packages

SECONDS, SPEED, RATE = 5.0, 0.3, 0.5
ACCELERATIONS = (1.0, 8.0)
"""KBot's own limits in m/s^2 and rad/s^2."""
NAMES = {
    "velocity": (
        ("max_linear_velocity", "max_velocity", "linear.x.max_velocity"),
        ("max_angular_velocity", "angular.z.max_velocity"),
    ),
    "acceleration": (
        ("max_linear_acceleration", "max_acceleration", "linear.x.max_acceleration"),
        ("max_angular_acceleration", "angular.z.max_acceleration"),
    ),
    "jerk": (
        ("max_linear_jerk", "max_jerk", "linear.x.max_jerk"),
        ("max_angular_jerk", "angular.z.max_jerk"),
    ),
}
RIM = ("wheelAcceleration", "max_wheel_acceleration")


class Limits(NamedTuple):
    """Limits of driving (m) or turning (rad)."""

    velocity: float
    acceleration: float
    jerk: float


def expected(robot: RobotModel) -> dict[str, object] | None:
    """The shares of a robot, or None if it does not drive or nothing is declared about its drive."""
    robot = with_nearby_drive(robot, DiagnosticCollector())
    drive = find_drive(robot)
    if not isinstance(drive, DifferentialDrive):
        return None
    controller = drive_controller(declared_drives(robot))
    reasons: list[str] = []
    radius, separation = declared_sizes(drive, controller, reasons)
    scale = drive.radius / radius
    limits = [limits_of(controller, is_turn, drive.separation) for is_turn in (False, True)]
    rim = radius * wheel_speed(robot, drive, reasons)
    fastest = (min(limits[0].velocity, rim), min(limits[1].velocity, rim / (separation / 2.0)))
    for speed, most in zip((SPEED, RATE), fastest, strict=True):
        if most < speed:
            reasons.append(f"at most {most:.3g} {'m/s' if speed == SPEED else 'rad/s'}")
    way = driven(SPEED, limits[0]._replace(velocity=fastest[0]))
    weak = SPEED * SECONDS - lost_by_motors(robot, drive, min(SPEED, fastest[0]))
    if weak < 0.97 * way:
        reasons.append("weak motors")
    straight = scale * min(way, weak) / (SPEED * SECONDS)
    turn = scale * (separation / drive.separation)
    turn *= driven(RATE, limits[1]._replace(velocity=fastest[1])) / (RATE * SECONDS)
    ways = directions(drive, reasons)
    angle: float | None = turn * ways[1]
    if isinstance(drive, SteeredDrive):
        angle = straight * ways[0]  # it turns as far as it drives on the arc
    elif len(drive.left) > 1:
        angle = None
    return {"distance": straight * ways[0], "angle": angle, "reason": ", ".join(reasons)}


def declared_sizes(
    drive: DifferentialDrive, controller: DeclaredDrive | None, reasons: list[str]
) -> tuple[float, float]:
    """The radius and separation with which the controller computes, m. Missing ones are the true ones."""
    if controller is None or (isinstance(drive, HolonomicDrive) and drive.kind is not Holonomic.TRACKS):
        return drive.radius, drive.separation
    values = []
    for name, given, true in (
        ("radius", controller.radius, drive.radius),
        ("separation", controller.separation, drive.separation),
    ):
        value = given.value if given is not None and given.value > 0.0 else true
        values.append(value)
        if abs(value - true) > 0.01 * true:
            reasons.append(f"{name} {value:.4g} m, wheels {true:.4g} m")
    return values[0], values[1]


def limits_of(controller: DeclaredDrive | None, is_turn: bool, separation: float) -> Limits:
    """The declared limits of a drive."""
    axis = "angular.z" if is_turn else "linear.x"
    found = {}
    for kind, names in NAMES.items():
        given = controller.first(*names[is_turn]) if controller is not None else None
        switch = controller.given.get(f"{axis}.has_{kind}_limits") if controller is not None else None
        is_on = switch.value is not False if switch is not None else _is_on(controller)
        value = given.number if given is not None and is_on else None
        found[kind] = value if value is not None and value > 0.0 else None
    own = ACCELERATIONS[is_turn]
    rim = controller.first(*RIM) if controller is not None and controller.plugin is not None else None
    if rim is not None and rim.number:
        own = min(rim.number / (separation / 2.0), own) if is_turn else rim.number
    return Limits(found["velocity"] or inf, found["acceleration"] or own, found["jerk"] or inf)


def _is_on(controller: DeclaredDrive | None) -> bool:
    """Whether limits apply without a `has_…_limits`: in plugins and in ROS 2."""
    return controller is None or controller.plugin is not None or controller.ros == 2


def wheel_speed(robot: RobotModel, drive: DifferentialDrive, reasons: list[str]) -> float:
    """The highest speed of all driving wheels in rad/s, by their joints' limits and damping."""
    most = inf
    for name in drive.joints:
        joint = robot.joints[name]
        if joint.limit is None:
            continue
        most = min(most, joint.limit.velocity or inf)
        damping = joint.dynamics.damping if joint.dynamics is not None else 0.0
        if joint.limit.effort and damping > 0.0 and joint.dynamics is not None:
            reached = max(0.0, joint.limit.effort - joint.dynamics.friction) / damping
            if reached * drive.radius < SPEED:
                reasons.append(f"{joint.limit.effort:g} N m against damping")
            most = min(most, reached)
    return most


def lost_by_motors(robot: RobotModel, drive: DifferentialDrive, speed: float) -> float:
    """The distance in m by which motors at their effort limits miss a command, until they reach `speed`."""
    joints = [robot.joints[name] for name in drive.joints]
    efforts = [joint.limit.effort if joint.limit is not None else 0.0 for joint in joints]
    if not joints or not all(efforts):
        return 0.0
    frictions = [joint.dynamics.friction if joint.dynamics is not None else 0.0 for joint in joints]
    damping = sum(joint.dynamics.damping if joint.dynamics is not None else 0.0 for joint in joints)
    force = (sum(efforts) - sum(frictions)) / drive.radius
    mass, viscous = total_mass(robot), damping / drive.radius**2
    if force <= 0.0:
        return SPEED * SECONDS
    if viscous < 1e-6 * force:
        return SPEED * min(SECONDS, mass * speed / force) / 2.0
    time, most = mass / viscous, force / viscous
    start = min(SECONDS, -time * log(1.0 - speed / most) if speed < 0.999 * most else SECONDS)
    covered = most * (start - time * (1.0 - exp(-start / time)))
    return SPEED * start - covered + (SPEED - speed) * (SECONDS - start)


def directions(drive: DifferentialDrive, reasons: list[str]) -> tuple[float, float]:
    """The component of driving along x, and the sign of turning."""
    ahead, turns = cos(drive.axle_in_base.yaw), 1.0
    if ahead < 0.9:
        reasons.append("the wheels do not roll along x")
    mistakes = drive.mistakes.values() if not isinstance(drive, HolonomicDrive) else ()
    if any("backwards" in mistake for mistake in mistakes):
        ahead, turns = -ahead, -turns
        reasons.append("axes point to the right")
    if any("reversed" in mistake for mistake in mistakes):
        turns = -turns
        reasons.append("left and right are exchanged")
    return ahead, turns


def driven(speed: float, limits: Limits) -> float:
    """The distance or angle that a command of `speed` covers in `SECONDS`, from standstill."""
    speed = copysign(min(abs(speed), limits.velocity), speed)
    acceleration, jerk = limits.acceleration, limits.jerk
    if speed < acceleration * acceleration / jerk:
        start = 2.0 * sqrt(speed / jerk)
    else:
        start = speed / acceleration + acceleration / jerk
    if start <= SECONDS:
        return speed * (SECONDS - start / 2.0)
    return speed * SECONDS * SECONDS / start / 2.0  # about, for a start that is not over


def main() -> int:
    words = sys.argv[2:]
    folders = [word.partition("=")[2] for word in words if word.startswith("--package-path=")]
    given = dict(word.split(":=", 1) for word in words if ":=" in word)
    loaded = load_robot(sys.argv[1], given, {}, Packages(folders))
    print(json.dumps(expected(loaded.robot) if loaded.robot is not None else None))
    return 0


if __name__ == "__main__":
    sys.exit(main())
