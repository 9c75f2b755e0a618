"""Lets a `LocalNavigator` drive a simulated robot, with nothing but its start pose and its own sensors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Odometry
from kbot.messages.bus import Subscription
from kbot.messages.sensing import Imu, LaserScan
from kbot.navigation.controller import Observation
from kbot.navigation.perception.attitude import Attitude
from kbot.navigation.perception.fault_watch import FaultWatch
from kbot.navigation.perception.pose_estimate import PoseEstimate
from kbot.navigation.perception.rolling_grid import SensorPlace
from kbot.navigation.perception.scan_matching import Match, ScanMatcher
from kbot.navigation.simulated.lidars import base_from_lidar, level_lidars
from kbot.navigation.simulated.mobility import BaseKind, mobility
from kbot.navigation.simulated.motion_limits import motion_limits
from kbot.navigation.simulated.shape import loads
from kbot.navigation.space.footprint import Outline
from kbot.navigation.without_map.approach import Approaches
from kbot.navigation.without_map.local_navigator import LocalNavigator, LocalSettings
from kbot.sensors.declared import mount_declared
from kbot.sensors.imu import ImuSensor
from kbot.sensors.lidar import LidarSensor, scan_points
from kbot.sim import Simulation
from kbot.sim.wheel_odometry import Motion
from kbot.text import KbotError

_LOAD_MARGIN = 0.02
"""m. A load may shift by less."""
_ALL_AROUND = math.radians(350.0)
DEFAULT_SETTINGS = LocalSettings()
_ODOMETRY_SILENCE = 0.1
"""s: the time of five messages at 50 Hz. At lower rates it is the time of five messages too."""


class _Lidar:
    """A lidar of the robot, and where it is on the base."""

    def __init__(self, sensor: LidarSensor, load: Outline | None = None) -> None:
        """`load` is the outline of a robot with a load, which the lidar may detect."""
        self.sensor, self._load = sensor, load
        self.base_from_sensor = base_from_lidar(sensor)
        self.stamp = -math.inf
        self.points: NDArray[np.float64] | None = None
        self.matcher = ScanMatcher()
        self._received: LaserScan | None = None
        # by topic, as the robot's computer receives it: a fault may silence it
        self._subscription = sensor.simulation.bus.subscribe(sensor.topic, LaserScan, self._receive)

    def close(self) -> None:
        self._subscription.close()

    def forget(self, now: float) -> None:
        """Forget all scans up to now, because the robot was placed elsewhere."""
        self.stamp, self.points, self.matcher, self._received = now, None, ScanMatcher(), None

    def _receive(self, scan: LaserScan) -> None:
        self._received = scan

    def new_scan(self) -> LaserScan | None:
        """The latest scan, if it was not returned before."""
        scan = self._received
        if scan is None or scan.header.stamp.seconds <= self.stamp:
            return None
        self.stamp = scan.header.stamp.seconds
        if self._load is not None:
            scan = self._without_load(scan, self._load)
        self.points = scan_points(scan, self.base_from_sensor)
        return scan

    def _without_load(self, scan: LaserScan, load: Outline) -> LaserScan:
        """The scan without the beams that end within the outline of the robot: they measure its load."""
        angles = scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
        ends = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0) * np.array(
            [np.cos(angles), np.sin(angles)]
        )
        in_base = ends.T @ self.base_from_sensor[:2, :2].T + self.base_from_sensor[:2, 3]
        own = np.isfinite(scan.ranges) & load.grown(_LOAD_MARGIN).holds(in_base)
        return replace(scan, ranges=np.where(own, np.float32(np.nan), scan.ranges))


class _WheelOdometry:
    """The wheel odometry of a simulation's first robot, as the robot's computer receives it: if a fault
    silences its topic, the last one."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._last = simulation, simulation.odometry
        self._received_at = simulation.time
        robot = simulation.robots.first
        self._subscription: Subscription | None = None
        # without messages there is no topic that a fault can silence
        if robot.settings is not None and robot.settings.odometry.is_published:
            self._longest = max(_ODOMETRY_SILENCE, 5.0 / robot.settings.odometry.rate)
            topic = robot.naming.topic(robot.settings.odometry_topic)
            self._subscription = simulation.bus.subscribe(topic, Odometry, self._receive)

    def __call__(self) -> Motion:
        if self._subscription is None or self._simulation.time - self._received_at < self._longest:
            self._last = self._simulation.odometry
        return self._last

    def close(self) -> None:
        if self._subscription is not None:
            self._subscription.close()

    def _receive(self, message: Odometry) -> None:
        self._received_at = self._simulation.time


class LocalPilot:
    """Drives a simulation's robot by a `LocalNavigator` until it is closed.

    The navigator gets the robot's pose once, at the start. After that it gets the robot's wheel odometry, the
    turning speed of its IMU and the scans of its level lidars. While there is no goal, the pilot estimates
    the robot's pose and does not command it. If the robot is then placed elsewhere, it gets the new pose. A
    robot that is moved on the way to a goal must notice that itself. A reset cancels the goal."""

    def __init__(
        self,
        simulation: Simulation,
        navigator: LocalNavigator,
        lidars: list[LidarSensor],
        odometry: Callable[[], Motion] | None = None,
        after: Callable[[], None] = lambda: None,
    ) -> None:
        """`odometry` replaces the robot's wheel odometry. `after` is called after each update of a goal."""
        moves = mobility(simulation)
        base, load = moves.base, moves.shape.outline if loads(simulation) else None
        self._simulation, self._navigator = simulation, navigator
        self._wheels = _WheelOdometry(simulation)
        self._odometry = odometry or self._wheels
        self._lidars = [_Lidar(lidar, load) for lidar in lidars]
        self._after = after
        self._attitude: Attitude | None = None
        self._begin_estimate()
        self._subscription: Subscription | None = None
        imu = _imu(simulation)
        if imu is not None:
            base_from_link = simulation.link_pose(base).inverse() @ simulation.link_pose(imu.spec.link)
            base_from_imu: NDArray[np.float64] = (base_from_link @ imu.spec.pose).rotation
            self._vertical, self._attitude = base_from_imu[2], Attitude(base_from_imu)
            self._subscription = simulation.bus.subscribe(imu.topic, Imu, self._turn)
        self._timer = simulation.clock.every(navigator.settings.rate, self.tick)

    def close(self) -> None:
        """Stop driving. The robot keeps its last command."""
        self._timer.cancel()
        self._wheels.close()
        for lidar in self._lidars:
            lidar.close()
        if self._subscription is not None:
            self._subscription.close()

    @property
    def pose(self) -> PlanarPose:
        """The estimated pose of the base, in the world's frame."""
        self._look_for_jump()
        return self.estimate.pose

    def _begin_estimate(self) -> None:
        """Start from the true pose."""
        simulation = self._simulation
        limits = self._navigator.limits
        self.estimate = PoseEstimate(simulation.ground_truth.pose, limits.drift, limits.centre)
        self._jumps, self._time = simulation.robots.first.jumps, simulation.time
        self._begin_watch()

    def _begin_watch(self) -> None:
        settings = self._navigator.settings
        self._watch, self._commanded = FaultWatch(settings.frozen, settings.lost), 0.0

    def _look_for_jump(self) -> None:
        """Start again if the robot was placed elsewhere while it had no goal, or if the time was set back."""
        simulation, navigator = self._simulation, self._navigator
        was_reset = simulation.time < self._time
        was_placed = simulation.robots.first.jumps != self._jumps and not navigator.is_driving
        self._time = simulation.time
        if not was_reset and not was_placed:
            return
        navigator.cancel("the simulation was reset")
        navigator.grid.clear()
        for lidar in self._lidars:
            lidar.forget(simulation.time)
        if self._attitude is not None:
            self._attitude.forget()
        self._begin_estimate()

    def tick(self) -> None:
        """Update the estimate and, if there is a goal, the navigator, and command the robot."""
        simulation, now = self._simulation, self._simulation.time
        had_goal = self._navigator.is_driving
        self._look_for_jump()
        motion = self._odometry()
        self.estimate.add_odometry(now, motion.pose, motion.twist)
        scans, fits = [], None
        for lidar in self._lidars:
            scan = lidar.new_scan()
            if scan is not None:
                match = self._match(lidar)
                fits = match.fits if match is not None else fits
                base = self.estimate.at(lidar.stamp)
                scans.append((scan, SensorPlace.on_base(base, lidar.base_from_sensor)))
        if not had_goal:
            self._begin_watch()
            return
        points = [lidar.points for lidar in self._lidars if lidar.points is not None]
        obstacles = np.concatenate(points) if len(points) == len(self._lidars) else None
        age = now - min(lidar.stamp for lidar in self._lidars)
        fallen = self._attitude.describe_fall() if self._attitude is not None else ""
        fault = self._watch.update(now, self._commanded, motion.pose, self.estimate.by_scans, fits)
        observation = Observation(now, self.estimate.pose, self.estimate.twist, obstacles, age, fallen, fault)
        wanted = self._navigator.update(observation, scans)
        self._commanded = wanted.linear.x
        simulation.cmd_vel(wanted.linear.x, wanted.angular.z, wanted.linear.y)
        self._after()

    def _match(self, lidar: _Lidar) -> Match | None:
        """Correct the estimate by a new scan; None if nothing is near enough to match it."""
        assert lidar.points is not None
        predicted = self.estimate.by_scans_at(lidar.stamp)
        match = lidar.matcher.match(lidar.points, predicted, self.estimate.has_gyro)
        if match is not None and match.is_good:
            self.estimate.add_match(lidar.stamp, match.pose)
            lidar.matcher.renew(lidar.points, match)
        elif match is not None and match.fits:
            # too little of an earlier view is left: go on from the prediction
            lidar.matcher.renew(lidar.points, Match(predicted, match.share))
        return match

    def _turn(self, message: Imu) -> None:
        spin = message.angular_velocity
        rate = float(self._vertical @ (spin.x, spin.y, spin.z))
        self.estimate.add_rate(message.header.stamp.seconds, rate)
        force = message.linear_acceleration
        if self._attitude is not None:
            self._attitude.add(message.header.stamp.seconds, (force.x, force.y, force.z))


def _imu(simulation: Simulation) -> ImuSensor | None:
    """The first IMU that the description declares, mounted; None if there is none."""
    sensors, _ = mount_declared(simulation, strict=False)
    first = simulation.robots.first.name
    return next((s for s in sensors.values() if isinstance(s, ImuSensor) and s.owner == first), None)


def local_navigator(
    simulation: Simulation,
    max_speed: tuple[float, float] | None = None,
    settings: LocalSettings = DEFAULT_SETTINGS,
) -> tuple[LocalNavigator, list[LidarSensor]]:
    """A navigator for a simulation's first robot, and the robot's level lidars.

    Raises: KbotError: the robot cannot drive, has no size or no level lidar, or a speed is not above
    0."""
    robot, moves = simulation.robots.first, mobility(simulation)
    lidars = level_lidars(simulation)
    if not lidars:
        raise KbotError(
            f"robot '{robot.name}' declares no level lidar with one row of beams,"
            " which a goal without a map needs"
        )
    rate = min(lidar.spec.rate for lidar in lidars)
    is_blind = not _see_all_around(lidars)
    if is_blind and moves.kind is BaseKind.SIDEWAYS:
        # it looks where it drives, as a base that only turns on the spot
        moves = replace(moves, kind=BaseKind.TURNS, point=PlanarPose())
    limits = moves.with_limits(motion_limits(robot, max_speed))
    is_blind = is_blind and moves.kind is BaseKind.STEERS  # the others turn before they drive
    navigator = LocalNavigator(
        moves.outline, limits, rate, settings, simulation.seed, moves.point, Approaches.of(moves), is_blind
    )
    return navigator, lidars


def _see_all_around(lidars: Sequence[LidarSensor]) -> bool:
    """Whether a lidar's beams, or those of all together, cover all directions up to a few degrees."""
    return sum(abs(lidar.spec.angle_max - lidar.spec.angle_min) for lidar in lidars) >= _ALL_AROUND
