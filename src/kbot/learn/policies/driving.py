"""Drives simulated robots to goals with a policy: `go_to_with_policy`, and the navigation of `Goals`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.interface.policy_interface import Sectors
from kbot.learn.interface.robot_interface import policy_interface
from kbot.learn.interface.targets import GoalTarget
from kbot.learn.policies.policy import ARRIVE, SILENCE, Policy, PolicyController
from kbot.learn.policies.speed_finding import speed_finding
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Observation
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.goals.goals import Goals
from kbot.navigation.simulated.lidars import LidarPoints, level_lidar, lidar_view
from kbot.navigation.simulated.odometry_estimate import OdometryEstimate
from kbot.navigation.simulated.pilot import Pilot
from kbot.navigation.simulated.trip import Trip, judged, run_trip
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError


def fitted(policy: Policy, simulation: Simulation) -> Policy:
    """The policy with an interface that fits the simulation's first robot.

    If the policy's file does not describe its inputs and actions, they are the default ones of the robot. A
    policy that is faster than the robot is added to the simulation's findings.

    Raises: KbotError: the robot cannot drive, or the policy does not fit it."""
    robot = simulation.robots.first
    default = policy_interface(simulation, GoalTarget.kind)  # raises an error for a robot that cannot drive
    if policy.interface is None:
        try:
            return policy.with_interface(default)
        except KbotError as error:
            raise KbotError(
                f"the policy's file does not describe its inputs, and they are not the default ones of robot"
                f" '{robot.name}': {error}"
            ) from None
    interface = policy.goal_interface
    fastest = 1.0 / simulation.timestep
    if interface.rate > fastest + 1e-9:
        raise KbotError(
            f"the policy computes {interface.rate:g} commands per second, but the simulation makes"
            f" only {fastest:g} steps"
        )
    if interface.lateral is not None and not robot.drives_sideways:
        raise KbotError(
            f"the policy commands a lateral speed, but robot '{robot.name}' cannot drive sideways"
        )
    if interface.lidar is not None:
        _require_view(interface.lidar, level_lidar(simulation), robot.name)
    if robot.wheels is not None:
        finding = speed_finding(interface.top_speeds, robot.name, robot.wheels.fastest)
        if finding is not None and finding not in simulation.driver_findings:
            simulation.driver_findings.append(finding)
    return policy


def _require_view(sectors: Sectors, lidar: LidarSensor | None, name: str) -> None:
    if lidar is None:
        raise KbotError(
            f"the policy sees obstacles with a lidar, but robot '{name}' declares no level lidar with one row"
            " of beams"
        )
    if unseen := sectors.unseen(lidar_view(lidar), f"the lidar of robot '{name}'"):
        raise KbotError(unseen)


class WithPolicy:
    """A `GoalNavigation`: drives to one goal after another with a policy, without a map.

    The robot's pose at the first goal is its start pose. The estimate then continues from goal to goal. If
    the robot is placed while it has no goal, or the simulation is reset, it gets the new pose."""

    surroundings: Literal["none"] = "none"

    def __init__(
        self,
        simulation: Simulation,
        policy: Policy,
        arrive: float = ARRIVE,
        estimate: OdometryEstimate | None = None,
    ) -> None:
        """`arrive`: radius in m within which a goal is reached. `estimate`: the robot's pose, by default one
        that begins at the first goal."""
        self._simulation, self._policy, self._arrive = simulation, policy, arrive
        self._estimate = estimate
        self._lidar: LidarSensor | None = None
        self._controller: PolicyController | None = None
        self._is_set_up = False
        self._after: Callable[[], None] = lambda: None
        self.path = None
        self.grid = None

    @property
    def status(self) -> GoalReport | None:
        return None if self._controller is None else self._controller.status

    @property
    def pose(self) -> PlanarPose:
        """The robot's estimate; its start pose before the first goal."""
        if self._estimate is None:
            return self._simulation.ground_truth.pose
        if self._controller is None or self._controller.is_done:
            self._estimate.look_for_jump()
        return self._estimate.pose

    def set_up(self) -> None:
        """Before the first goal, fit the policy to the robot. Raises KbotError: it does not fit."""
        if not self._is_set_up:
            self._policy = fitted(self._policy, self._simulation)
            self._lidar = level_lidar(self._simulation)
            self._is_set_up = True

    def go(self, goal: PlanarPose, timeout: float | None, any_heading: bool) -> None:
        """Replace the current goal, whose heading is always free. Raises KbotError as `PolicyController`."""
        self._controller = PolicyController(self._policy, goal, self._arrive, timeout, _silence(self._lidar))

    def drive(self, after: Callable[[], None]) -> Pilot:
        self._after = after
        seen = LidarPoints(self._lidar) if self._lidar else None
        rate = self._policy.required_interface.rate
        self._estimate = self._estimate or OdometryEstimate(self._simulation)
        self._estimate.look_for_jump()
        return Pilot(self._simulation, self, rate, "odometry", seen, self._estimate)

    def update(self, observation: Observation) -> Twist:
        controller = self._controller
        if controller is None:
            return STILL
        wanted = controller.update(observation)
        self._after()
        return wanted

    def prepare(self, goal: PlanarPose | None) -> None:
        """There is nothing to prepare."""

    def world_changed(self) -> None:
        """The lidar detects what has changed."""

    def cancel(self, reason: str) -> None:
        self._end(GoalState.CANCELLED, reason)

    def refuse(self, reason: str) -> None:
        self._end(GoalState.REFUSED, reason)

    def _end(self, state: GoalState, reason: str) -> None:
        if self._controller is not None:
            self._controller.end(state, reason)


def policy_goals(
    simulation: Simulation,
    policy: Policy,
    arrive: float = ARRIVE,
    estimate: OdometryEstimate | None = None,
) -> Goals:
    """Goals to which the simulation's robot drives with a policy. They are refused if it does not fit.

    `estimate` is the robot's pose, to continue that of other goals."""
    return Goals(simulation, WithPolicy(simulation, policy, arrive, estimate))


def go_to_with_policy(
    simulation: Simulation,
    policy: Policy,
    goal: PlanarPose,
    *,
    arrive: float = ARRIVE,
    timeout: float | None = None,
) -> Trip:
    """Run the simulation until its robot has reached the goal or gives up. The robot is then stopped.

    The robot knows its start pose, and then only what its wheels and its lidar measure. It stops by its
    odometry. The goal is reached if it stops for this, and the true position came within `arrive`.

    Args:
        simulation: whose first robot drives.
        policy: drives the robot.
        goal: in the world's frame. The heading at the goal is free.
        arrive: radius in m within which the goal is reached.
        timeout: time limit in s, by default from the distance of the goal.

    Raises:
        KbotError: the robot cannot drive, the policy does not fit it, a number is not finite or not above 0,
            or the goal is too far away.
    """
    policy, lidar = fitted(policy, simulation), level_lidar(simulation)
    controller = PolicyController(policy, goal, arrive, timeout, _silence(lidar))
    rate = policy.required_interface.rate
    pilot = Pilot(simulation, controller, rate, "odometry", LidarPoints(lidar) if lidar else None)
    trip = run_trip(
        simulation,
        goal,
        arrive,
        rate,
        lambda: controller.status,
        lambda: pilot.estimate.pose,
        pilot.close,
    )
    return judged(trip) if trip.reached else trip  # a policy that passed its goal, and did not stop, is stuck


def _silence(lidar: LidarSensor | None) -> float:
    """Seconds without a scan after which the robot is stopped: two and a half periods of a slow lidar."""
    return SILENCE if lidar is None else max(SILENCE, 2.5 / lidar.spec.rate)
