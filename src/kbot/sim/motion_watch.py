"""Watches whether a robot moves as it is commanded, and whether its odometry is right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import acos, atan2, cos, hypot, inf, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, SteeredDrive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.sim.collisions import Collisions
from kbot.sim.command_watch import CommandWatch, Miss
from kbot.sim.disturbances import Disturbances
from kbot.sim.drive.twist_controller import STILL, Twist
from kbot.sim.energy_watch import EnergyWatch, Jump
from kbot.sim.engine.engine import Engine
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robots import Robots
from kbot.sim.true_rolling import TrueRolling
from kbot.sim.wheel_odometry import composed

OFF = 0.02
"""Share of the distance driven by which odometry may differ from the true motion.

The shipped robot and the book's differ by 0.0001. A declared wheel separation or radius may differ by 0.01
(D105, D106), and two such errors add up. A caster that scrubs gives 0.05 and more."""
LEAST_OFF = 0.01
"""Smallest difference in m that is reported, or half a wheel radius if that is more.

A run of a few centimetres is too short to judge odometry. On the edge of a ramp of 30 degrees the body turns
about its axle by half a radian, which odometry takes for half a wheel radius of driving."""
STUCK = 0.2
"""Share of the commanded distance below which a robot hardly moves. A robot that is slow to accelerate, or
climbs a slope, covers more."""
STUCK_TIME, STUCK_WAY = 1.0, 0.03
"""Seconds, and commanded metres, over which that share is measured."""
CHANGING_TIME = 3.0
"""The same for a command that changes, which may be zero between the samples. Six samples in a row are not
those of a key that is tapped."""
FAR = (20.0, 5.0)
"""How many times faster than the drive allows a command is that is reported, for driving and for turning.

Speeds in mm/s are 1000 times too large, and in degrees 57 times. A program that multiplies the distance to
its goal by a gain may command several times what the drive allows."""
FAR_TIME, FAR_CHANGING_TIME = 0.5, 2.0
"""Seconds for which a constant and a changing command must be too fast. A program that multiplies an angle by
a gain soon commands less, because the robot turns."""
AT_LIMIT, TOO_SLOW = 0.99, 0.9
"""Shares of a motor's torque limit, and of its commanded speed, above and below which a motor is too weak."""
WEAK_TIME = 1.0
"""Seconds for which it must be. A robot that accelerates at 1 m/s^2 reaches an ordinary speed earlier."""
UPRIGHT = cos(radians(60.0))
"""Upward component of the axle's z axis below which a robot has fallen over. Ramps are less steep."""
SETTLING = 0.6
"""Seconds after a start during which the robot settles on its wheels, and is not watched: one sample."""
FLIGHT = 0.25
"""Seconds without a contact from which a robot flies. Driving off an edge of 0.2 m takes 0.2 s."""
LANDING = 1.0
"""Seconds after a flight within which its landing explains what a robot does."""
_CONTACTS = 4
"""Control periods between two looks at the contacts: 0.08 s."""
_EVERY = 28
"""Control periods between two samples: 0.56 s. With ten samples a second, the steps take 5 % more time. A
command that is switched on and off ten times a second is not sampled in step."""
_PERIOD = _EVERY * CONTROL_PERIOD
_NO_LIMIT = (inf, inf, inf)


@dataclass(frozen=True, slots=True)
class Explanation:
    """What acted on the robot from outside before something was observed, both may be empty.

    touched      the object or robot that it touched, and since when in s
    disturbance  a push or an injected fault
    flight       when its flight began in s, if it is in the air or has just landed, else None
    """

    touched: str
    touched_at: float
    disturbance: str
    flight: float | None = None

    @property
    def is_known(self) -> bool:
        return bool(self.touched or self.disturbance or self.flight is not None)


@dataclass(frozen=True, slots=True)
class OdometryError:
    """Odometry differs from the motion of the axle since `since` (s). `explanation` is of that time.

    position_error, heading_error         difference in m and rad (odometry minus truth)
    distance, rotation                    the true path length in m, and the sum of all turns in rad
    odometry_distance, odometry_rotation  the same by odometry
    share                                 the difference as a share of the distance that the wheels drove
    total, slip                           the difference in m, with half a wheel separation for each rad; and
                                          its part that is left if odometry is computed from the true sizes,
                                          sides and axes of the wheels
    """

    since: float
    explanation: Explanation
    position_error: float
    heading_error: float
    distance: float
    rotation: float
    odometry_distance: float
    odometry_rotation: float
    share: float
    total: float
    slip: float


@dataclass(frozen=True, slots=True)
class Standstill:
    """The robot hardly moved from `since` (s) on, though it was commanded.

    share        of the commanded distance that it covered
    allowed      share of the commanded distance that the limits of speed and acceleration allow
    wheels_turn  whether the wheels turned nevertheless
    """

    since: float
    explanation: Explanation
    share: float
    allowed: float
    wheels_turn: bool

    @property
    def is_limited(self) -> bool:
        """Whether the limits of the drive explain at least half of the distance that is missing."""
        return self.allowed < 2.0 * STUCK


@dataclass(frozen=True, slots=True)
class Excess:
    """The robot was commanded to be far faster than its drive allows, from `since` (s) on.

    The `commanded` and the `allowed` speed are those on an `axis`: 0 forwards, 1 sideways, 2 for the turn.
    """

    since: float
    commanded: float
    allowed: float
    axis: int

    @property
    def is_turn(self) -> bool:
        return self.axis == 2


@dataclass(frozen=True, slots=True)
class Weakness:
    """The motor of a driving `joint` was at its torque limit from `since` (s) on, and too slow.

    most              the limit in N m
    commanded, speed  the commanded and the true speed in rad/s, as magnitudes
    """

    since: float
    explanation: Explanation
    joint: str
    most: float
    commanded: float
    speed: float


@dataclass(frozen=True, slots=True)
class Fall:
    """The robot lay on its side or back from `since` (s) on. `twist` is what its drive then commanded."""

    since: float
    explanation: Explanation
    twist: Twist


class MotionWatch:
    """Watches the first robot of a simulation.

    `odometry_error`, `standstill`, `excess`, `weakness`, `fall` and `jump` are what was observed since the
    last reset or placement of the robot, `touched` is what the robot first touched except the ground. All are
    None or empty without one.

    Only the motion of the axle relative to itself is compared with odometry. So the slope of a ramp, which
    shortens the way on the map, is not an error.
    """

    # the window over which commanded and covered distance are compared
    _window: float
    _window_wanted: Twist | None
    _is_steady: bool
    _window_way: float
    _window_odometry: float
    _window_commanded: float
    _window_allowed: float

    def __init__(self, engine: Engine, robots: Robots, disturbances: Disturbances) -> None:
        self._engine, self._robots, self._disturbances = engine, robots, disturbances
        self._collisions = Collisions(robots)
        self.restarts = 0
        self.restart()

    def restart(self) -> None:
        """Forget everything: the robot is placed elsewhere, or time has jumped."""
        robot = self._robots.first
        drive = robot.drive
        self.restarts += 1
        self.odometry_error: OdometryError | None = None
        self.standstill: Standstill | None = None
        self.excess: Excess | None = None
        self.weakness: Weakness | None = None
        self._weak_since: dict[str, float] = {}
        self.fall: Fall | None = None
        self._energy = EnergyWatch(self._engine, self._disturbances)
        self.has_touched = False
        self._flies_since: tuple[float, float] | None = None
        self._flight = (0.0, -inf)
        self._fastest = robot.wheels.fastest if robot.wheels is not None else _NO_LIMIT
        self._far_since: float | None = None
        self._far_wanted, self._far_changed = STILL, 0.0
        self.touched, self._touched_at = "", 0.0
        self._last_touched, self._last_touched_at = "", 0.0
        self._least_up = 1.0
        self._jumps = robot.jumps
        self._begun = self._engine.time
        self._command = CommandWatch(self._begun)
        self._contacts, self._count = -1, 0
        self._half = drive.separation / 2.0 if isinstance(drive, DifferentialDrive) else 0.0
        self._torques = _torque_limits(robot)
        self._least = (
            max(LEAST_OFF, drive.radius / 2.0) if isinstance(drive, DifferentialDrive) else LEAST_OFF
        )
        self._yaw = drive.axle_in_base.yaw if isinstance(drive, DifferentialDrive) else 0.0
        self._turns_in_place = not isinstance(drive, SteeredDrive) or drive.turns_in_place
        self._axle_of = _axle_of(robot.body.base_from_root, drive)
        self._last = self._axle_of(robot.body.root_place) if robot.body.root_qpos >= 0 else None
        self._heading = robot.body.heading
        self._rolling = TrueRolling(robot)
        self._wheel_motion = robot.wheels.wheel_motion() if robot.wheels is not None else lambda: STILL
        self._odometry = self._true = self._rolled = robot.wheels.axle if robot.wheels is not None else STILL
        if robot.wheels is not None:
            self._command.start(self._begun, robot.wheels.wanted)
        self._way = self._turned = self._odometry_way = self._odometry_turned = 0.0
        self._start_window(self._begun)

    def look(self) -> None:
        """Call this every control period, after odometry was updated."""
        count = self._count = self._count + 1
        wheels = self._robots.first.wheels
        if wheels is not None and wheels.wanted != self._command.wanted:
            self._command.start(self._engine.time - CONTROL_PERIOD, wheels.wanted)
        if self._last is not None:
            self._energy.look(self._robots.first)
        if count % _CONTACTS:
            return
        if self.excess is None:
            self._look_at_command()
        if count == _EVERY:
            self._count = 0
            self._look_at_contacts()
            self._sample()
        elif self._engine.data.ncon != self._contacts or self._flies_since is not None:
            self._look_at_contacts()

    def _look_at_command(self) -> None:
        """Find a command that stays far above what the drive allows."""
        wheels = self._robots.first.wheels
        wanted = wheels.wanted if wheels is not None else STILL
        (x, y, yaw), (most_x, most_y, most_yaw) = wanted, self._fastest
        ahead, aside, turn = abs(x) / most_x, abs(y) / most_y, abs(yaw) / most_yaw
        if ahead < FAR[0] and aside < FAR[0] and turn < FAR[1]:
            self._far_since = None
            return
        # the axis of the command: forwards, sideways, or the turn, which counts first
        axis = 2 if turn >= FAR[1] else int(aside > ahead)
        time = self._engine.time
        if self._far_since is None or wanted != self._far_wanted:
            self._far_wanted, self._far_changed = wanted, time
        if self._far_since is None:
            self._far_since = time
        if time - self._far_changed >= FAR_TIME or time - self._far_since >= FAR_CHANGING_TIME:
            self.excess = Excess(self._far_since, wanted[axis], self._fastest[axis], axis)

    def _look_at_contacts(self) -> None:
        model, data = self._engine.model, self._engine.data
        self._contacts = data.ncon
        touched = self._collisions.touched(model, data)
        if touched:
            self._last_touched, self._last_touched_at = touched, self._engine.time
            if not self.touched:
                self.touched, self._touched_at = touched, self._engine.time
        time = self._engine.time
        if self._last is None or self._collisions.is_touching(model, data):
            self._flies_since, self.has_touched = None, True
            return
        rise = self._robots.first.body.root_velocity[2]
        if self._flies_since is None:
            self._flies_since = (time if self.has_touched else self._begun), rise
        since, before = self._flies_since
        # wheels that hop touch nothing at many looks, but do not fall
        if time > since + FLIGHT and rise - before < 0.5 * float(model.opt.gravity[2]) * (time - since):
            self._flight = since, time

    def _sample(self) -> None:
        robot = self._robots.first
        if robot.jumps != self._jumps:
            self.restart()
        if self._last is None:
            return
        time, before, heading = self._engine.time, self._last, self._heading
        self._heading = robot.body.heading
        now = self._last = self._axle_of(robot.body.root_place)
        up = 1.0 - 2.0 * (now[4] * now[4] + now[5] * now[5])
        if up < self._least_up:
            self._least_up = up
            if up < UPRIGHT and self.fall is None:
                self.fall = Fall(time, self.explanation, robot.wheels.twist if robot.wheels else STILL)
        wheels = robot.wheels
        if wheels is None:
            return
        moved, turned_wheels = _motion(before, now, self._heading - heading), self._wheel_motion()
        rolled = self._rolling.motion(turned_wheels)
        self._rolled = composed(self._rolled, PlanarPose(*rolled))
        self._command.add(time, *map(self._in_base, (moved, turned_wheels, rolled)))
        if time < self._begun + SETTLING:
            self._odometry = self._true = self._rolled = wheels.axle
            self._start_window(time)
            return
        if self._torques:
            self._look_at_motors(time)
        way, turned = self._move(moved)
        odometry_way, odometry_turned = self._move_odometry(wheels.axle)
        half = self._half
        if not wheels.has_true_odometry:
            self._compare(time)
        if wheels.wanted == STILL or self._window_wanted is None:
            # a command that came since the last sample has been there for less than a period
            self._start_window(time, wheels.wanted)
            return
        half *= self._turns_in_place
        self._window_way += way + half * turned
        self._window_odometry += odometry_way + half * odometry_turned
        x, y, yaw = wheels.wanted
        self._window_commanded += (hypot(x, y) + half * abs(yaw)) * _PERIOD
        self._is_steady = self._is_steady and self._window_wanted == wheels.wanted
        x, y, yaw = wheels.twist
        self._window_allowed += (hypot(x, y) + half * abs(yaw)) * _PERIOD
        # a command that changes all the time is never reached
        commanded = self._window_commanded if self._is_steady else self._window_allowed
        least_time = STUCK_TIME if self._is_steady else CHANGING_TIME
        if time - self._window > least_time and commanded > STUCK_WAY:
            self._end_window(time, commanded)
            self._window_wanted = wheels.wanted

    def _look_at_motors(self, time: float) -> None:
        """Find a motor that stays at its torque limit without reaching the commanded speed."""
        body = self._robots.first.body
        speeds = body.joint_velocities
        for joint, most in self._torques.items():
            commanded, speed = abs(body.servo_command(joint)), abs(speeds[joint])
            if abs(body.motor_torque(joint)) < AT_LIMIT * most or speed >= TOO_SLOW * commanded:
                self._weak_since.pop(joint, None)
                continue
            since = self._weak_since.setdefault(joint, time)
            known = self.weakness
            if time - since > WEAK_TIME and (known is None or known.joint == joint):
                explanation = self.explanation if known is None else known.explanation
                since = since if known is None else known.since
                self.weakness = Weakness(since, explanation, joint, most, commanded, speed)

    def _in_base(self, moved: Twist) -> Twist:
        """A motion in the direction of the base: the axle of some robots lies along its x axis."""
        (x, y, turn), c, s = moved, cos(self._yaw), sin(self._yaw)
        return c * x - s * y, s * x + c * y, turn

    def _move(self, moved: Twist) -> tuple[float, float]:
        """Add the axle's motion, in its own frame, to its true pose. Returns the distance and the turn."""
        forward, left, turn = moved
        self._true = composed(self._true, PlanarPose(*moved))
        way, turned = hypot(forward, left), abs(turn)
        self._way += way
        self._turned += turned
        return way, turned

    def _move_odometry(self, axle: tuple[float, float, float]) -> tuple[float, float]:
        x, y, yaw = self._odometry
        self._odometry = axle
        way, turned = hypot(axle[0] - x, axle[1] - y), abs(axle[2] - yaw)
        self._odometry_way += way
        self._odometry_turned += turned
        return way, turned

    def _compare(self, time: float) -> None:
        x, y, yaw = self._true
        odometry_x, odometry_y, odometry_yaw = self._odometry
        rolled_x, rolled_y, rolled_yaw = self._rolled
        off, turned_off, half = hypot(odometry_x - x, odometry_y - y), odometry_yaw - yaw, self._half
        error = off + half * abs(turned_off)
        slip = hypot(rolled_x - x, rolled_y - y) + half * abs(rolled_yaw - yaw)
        driven = max(self._way + half * self._turned, self._odometry_way + half * self._odometry_turned)
        if error > self._least and error > OFF * driven:
            known = self.odometry_error
            self.odometry_error = OdometryError(
                known.since if known is not None else time,
                known.explanation if known is not None else self.explanation,
                off,
                turned_off,
                self._way,
                self._turned,
                self._odometry_way,
                self._odometry_turned,
                error / driven,
                error,
                slip,
            )

    def _start_window(self, time: float, wanted: Twist = STILL) -> None:
        """`wanted` is the command of the window, which begins now. Without one, nothing is compared."""
        self._window = time
        self._window_wanted, self._is_steady = wanted if wanted != STILL else None, True
        self._window_way = self._window_odometry = self._window_commanded = self._window_allowed = 0.0

    def _end_window(self, time: float, commanded: float) -> None:
        share = self._window_way / commanded
        if share < STUCK and self.standstill is None:
            turns = self._window_odometry > 0.5 * self._window_allowed
            # what it touched earlier does not hold it now
            held_by = self._last_touched if self._last_touched_at >= self._window else ""
            touched_at = self._touched_at if held_by == self.touched else self._last_touched_at
            explanation = Explanation(held_by, touched_at, self._disturbances.last, self.flight)
            allowed = self._window_allowed / commanded
            self.standstill = Standstill(self._window, explanation, share, allowed, turns)
        self._start_window(time)

    @property
    def miss(self) -> Miss | None:
        """The first steady command that the robot does not follow, or None."""
        return self._command.miss

    @property
    def tilt(self) -> float:
        """The largest angle in rad between the robot's z axis and the vertical so far."""
        return acos(min(1.0, max(-1.0, self._least_up)))

    @property
    def up(self) -> NDArray[np.float64]:
        """The axle's z axis (3,) in the world, of a robot that is not fixed."""
        _, _, _, w, x, y, z = self._axle_of(self._robots.first.body.root_place)
        return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])

    @property
    def explanation(self) -> Explanation:
        """What has acted on the robot from outside so far."""
        return Explanation(self.touched, self._touched_at, self._disturbances.last, self.flight)

    @property
    def flight(self) -> float | None:
        """When the robot's flight began in s, if it is in the air or has just landed, else None."""
        since, until = self._flight
        return since if self._engine.time <= until + LANDING else None

    @property
    def begun(self) -> float:
        """When the watch began in s: at the start, or when the robot was last placed."""
        return self._begun

    @property
    def jump(self) -> Jump | None:
        """The first jump in velocity that no force explains, or None."""
        return self._energy.jump


def _torque_limits(robot: SimulatedRobot) -> dict[str, float]:
    """The torque limits in N m of the driving joints that have one."""
    if not isinstance(robot.drive, DifferentialDrive) or robot.settings is None:
        return {}
    own = robot.settings.torque or inf
    limits = {joint: min(robot.robot.joints[joint].effort_limit, own) for joint in robot.drive.joints}
    return {joint: most for joint, most in limits.items() if most < inf}


Place = tuple[float, float, float, float, float, float, float]


def _motion(before: Place, now: Place, spun: float) -> Twist:
    """The motion between two places: forwards and to the left in m, in the frame before, and the turn in rad.

    `spun` is the change of the heading in rad with full turns.
    """
    dx, dy, dz = now[0] - before[0], now[1] - before[1], now[2] - before[2]
    w, x, y, z = before[3:]
    # the first two rows of the rotation matrix of a conjugate quaternion
    forward = (1 - 2 * (y * y + z * z)) * dx + 2 * (x * y + w * z) * dy + 2 * (x * z - w * y) * dz
    left = 2 * (x * y - w * z) * dx + (1 - 2 * (x * x + z * z)) * dy + 2 * (y * z + w * x) * dz
    real = w * now[3] + x * now[4] + y * now[5] + z * now[6]
    up = w * now[6] - z * now[3] - x * now[5] + y * now[4]
    turn = 2.0 * atan2(up, real)
    turn += 2.0 * pi * round((spun - turn) / (2.0 * pi))  # a fast robot makes several turns
    return forward, left, turn


def _axle_of(base_from_root: Transform, drive: object) -> Callable[[Place], Place]:
    """Converts `world_from_root` to `world_from_axle`. Without a drive, the axle is the base."""
    base_from_axle = drive.axle_in_base if isinstance(drive, DifferentialDrive) else Transform.identity()
    root_from_axle = base_from_root.inverse() @ base_from_axle
    if np.abs(root_from_axle.matrix - np.eye(4)).max() < 1e-12:
        return lambda place: place
    tx, ty, tz = root_from_axle.translation.tolist()
    bx, by, bz, bw = root_from_axle.quaternion_xyzw

    def convert(place: Place) -> Place:
        px, py, pz, w, x, y, z = place
        return (
            px + (1 - 2 * (y * y + z * z)) * tx + 2 * (x * y - w * z) * ty + 2 * (x * z + w * y) * tz,
            py + 2 * (x * y + w * z) * tx + (1 - 2 * (x * x + z * z)) * ty + 2 * (y * z - w * x) * tz,
            pz + 2 * (x * z - w * y) * tx + 2 * (y * z + w * x) * ty + (1 - 2 * (x * x + y * y)) * tz,
            w * bw - x * bx - y * by - z * bz,
            w * bx + x * bw + y * bz - z * by,
            w * by - x * bz + y * bw + z * bx,
            w * bz + x * by - y * bx + z * bw,
        )

    return convert
