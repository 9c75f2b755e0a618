"""A policy from an ONNX file, and the controller that drives a robot with it.

policy = Policy.read("policy.onnx")
NodePilot(node, PolicyController(policy, PlanarPose(2.0, 1.0)))
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.interface.policy_interface import PolicyInterface, Vector
from kbot.learn.interface.targets import GoalTarget
from kbot.learn.policies.network import MOST_BYTES, Network, open_session, read_network, run, with_metadata
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Observation
from kbot.navigation.goal_checks import require_goal
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.text import KbotError
from kbot.text.files import read_bytes, write_bytes

ARRIVE = 0.2
"""m. The distance from a goal that counts as reached."""
_STOPS_WITHIN = 0.8
"""The robot stops within this share of the arrival radius, to allow for odometry error."""
INTERFACE_KEY = "kbot_policy"
"""The key of the ONNX file's metadata under which the policy's inputs and actions are described."""
SILENCE = 0.5
"""s without a scan after which the robot is stopped."""
GIVE_UP = 4.0
"""The goal is given up after this many times the seconds without a scan after which the robot is stopped."""
SLACK, GRACE = 8.0, 60.0
"""The default time limit is SLACK times the straight-line driving time at full speed, plus GRACE s."""
OUTPUT_TOLERANCE = 1e-3
"""How far a number of the network may be beyond -1 or 1. Rounding in a network is smaller."""
_EARLY = 0.1
"""Share of a period by which a command may be early. A node's timer is not exact."""

_network = lru_cache(maxsize=8)(read_network)
"""Checked networks by their bytes: the check takes a second, and every run of a trial reads the file."""


@dataclass(frozen=True, slots=True, repr=False)
class Policy(Brief):
    """A network, and what its numbers mean.

    network    is called with the vector that the interface describes
    interface  None if the file does not describe it
    """

    network: Network
    interface: PolicyInterface | None = None

    @classmethod
    def read(cls, file: str | os.PathLike[str]) -> Policy:
        """Read an ONNX file. It may come from a stranger.

        Raises: KbotError: it is missing or too large, is not a policy, or does not match the inputs and
        actions that it describes; or the extra `policy` is not installed."""
        try:
            data = read_bytes(file, MOST_BYTES)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise KbotError(f"policy {os.fspath(file)} cannot be read: {reason}") from None
        try:
            return policy_of(data)
        except KbotError as error:
            raise KbotError(f"policy {os.fspath(file)}: {error}") from None

    @property
    def required_interface(self) -> PolicyInterface:
        """The interface. Raises KbotError: the file does not describe it."""
        if self.interface is None:
            raise KbotError(
                "the policy's file does not describe its inputs. Write it with kbot.learn.save_policy"
            )
        return self.interface

    @property
    def goal_interface(self) -> PolicyInterface:
        """As `required_interface`. Raises KbotError also if the policy does not drive to goals."""
        interface = self.required_interface
        if interface.target != GoalTarget.kind:
            raise KbotError(
                f"the policy follows a {interface.target}, and cannot drive to a goal. Run it in"
                " kbot/Follow-v0 or with a controller of your own"
            )
        return interface

    def act(self, seen: Vector) -> Vector:
        """The policy's numbers from -1 to 1 for what it sees.

        Raises: KbotError: the network cannot be run, or a number is not finite or out of range."""
        try:
            found = run(_session(self.network.data), self.network, seen)
        except KbotError as error:
            raise KbotError(f"the policy {error}") from None
        for field, value in zip(self.required_interface.actions, found.tolist(), strict=True):
            if not abs(value) <= 1.0 + OUTPUT_TOLERANCE:  # also for NaN
                why = "is out of range" if math.isfinite(value) else "is not finite"
                raise KbotError(
                    f"the policy's output '{field.name}' {why}: {value:.3g} instead of a number from -1 to 1"
                )
        return np.clip(found, -1.0, 1.0)

    def with_interface(self, interface: PolicyInterface) -> Policy:
        """The same network with these inputs and actions. Raises KbotError: it does not match them."""
        for what, found, fields in (
            ("input", self.network.inputs, interface.inputs),
            ("output", self.network.outputs, interface.actions),
        ):
            if found != len(fields):
                names = ", ".join(field.name for field in fields[:12])
                more = ", …" if len(fields) > 12 else ""
                raise KbotError(
                    f"the network's {what} has {found} numbers instead of {len(fields)} ({names}{more})"
                )
        return replace(self, interface=interface)


def policy_of(data: bytes) -> Policy:
    """The policy in the bytes of an ONNX file. Raises KbotError as `Policy.read`, without the file's name."""
    network = _network(data)
    policy = Policy(network)
    described = network.metadata.get(INTERFACE_KEY)
    return policy if described is None else policy.with_interface(PolicyInterface.from_json(described))


def save_policy(network: bytes, interface: PolicyInterface, file: str | os.PathLike[str]) -> Policy:
    """Write an ONNX network with a description of its inputs and actions to a file, and return the policy.

    The network's input is the vector of `interface.observe`, as float32 of the shape (1, n) or (batch, n).
    Its output has a number from -1 to 1 for each of `interface.actions`.

    Raises: KbotError: it is not such a network, or the extra `policy` is not installed."""
    described = with_metadata(network, {INTERFACE_KEY: interface.to_json()})
    policy = policy_of(described)
    write_bytes(file, described)
    return policy


class PolicyController(Brief):
    """Drives to a goal with a policy. It is a `Controller`, so `Pilot` and `NodePilot` drive robots with it.

    `status` is the state of the goal. The robot stands still before and after it. The policy computes
    `required_rate` commands per second, so the pilot must be at least as fast."""

    def __init__(
        self,
        policy: Policy,
        goal: PlanarPose,
        arrive: float = ARRIVE,
        timeout: float | None = None,
        silence: float = SILENCE,
    ) -> None:
        """Drive to a goal.

        Args:
            policy: with an interface.
            goal: in the frame of the observed poses. The heading at the goal is free.
            arrive: distance in m from the goal that counts as reached.
            timeout: time limit in s, by default from the distance of the goal.
            silence: seconds without a scan after which the robot is stopped. After four times as long, the
                goal is given up.

        Raises: KbotError: the policy has no interface or does not drive to goals, a number is not finite or
        not above 0, or the goal is too far away."""
        self.interface = policy.goal_interface
        require_goal(goal)
        for what, value in (("arrival radius", arrive), ("timeout", 1.0 if timeout is None else timeout)):
            if not (math.isfinite(value) and value > 0.0):
                raise KbotError(f"the {what} must be a finite number above 0, not {value}")
        self.arrive, self.silence = arrive, silence
        self.required_rate = self.interface.rate
        self.top_speeds = self.interface.top_speeds
        self.status = GoalReport(goal, GoalState.ACCEPTED)
        self._target = GoalTarget(goal.x, goal.y)
        self._policy = policy
        self._timeout, self._begun, self._deadline = timeout, math.nan, math.inf
        self._last: Vector = self.interface.no_action
        self._command, self._due, self._time = STILL, -math.inf, -math.inf

    @property
    def is_done(self) -> bool:
        """Whether the goal was reached or given up."""
        return self.status.state.is_end

    def end(self, state: GoalState, reason: str = "") -> Twist:
        """End the goal, unless it has ended. Returns the command to stand still."""
        if not self.is_done:
            self.status = GoalReport(self.status.goal, state, reason)
        return STILL

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        if observation.time < self._time:
            return self.end(GoalState.CANCELLED, "the simulation was reset")
        self._time = observation.time
        if math.isnan(self._begun):
            self._begin(observation)
        if observation.fallen:
            return self.end(GoalState.STUCK, observation.fallen)
        left, time = self._target.distance(observation.pose), observation.time
        if left <= _STOPS_WITHIN * self.arrive:
            return self.end(GoalState.REACHED)
        if time > self._deadline:
            took = f"after {time - self._begun:.1f} s, {left:.2f} m left"
            return self.end(GoalState.STUCK, f"out of time: not at the goal {took}")
        if self.interface.lidar is not None:
            if observation.obstacles_age > self.silence:
                return self._wait_for_scan(observation)
            if observation.view is not None and (unseen := self.interface.lidar.unseen(observation.view)):
                return self.end(GoalState.REFUSED, unseen)
        period = 1.0 / self.interface.rate
        if time < self._due - _EARLY * period:
            return self._command
        following = self._due + period
        self._due = following if following > time else time + period
        try:
            self._last = self._policy.act(self.interface.observe(observation, self._target, self._last))
        except KbotError as error:
            return self.end(GoalState.STUCK, f"{error}. The robot was stopped")
        self._command = self.interface.twist(self._last)
        return self._command

    def _begin(self, observation: Observation) -> None:
        self._begun = observation.time
        fastest = max(map(abs, self.interface.linear))
        estimate = SLACK * self._target.distance(observation.pose) / fastest + GRACE
        self._deadline = self._begun + (self._timeout or estimate)
        self.status = replace(self.status, state=GoalState.DRIVING)

    def _wait_for_scan(self, observation: Observation) -> Twist:
        """Stand still without a scan, and give up after a while."""
        silence = min(observation.obstacles_age, observation.time - self._begun)
        if silence > GIVE_UP * self.silence:
            return self.end(GoalState.STUCK, f"the lidar has been silent for {silence:.1f} s")
        self._command, self._due = STILL, -math.inf
        return STILL


@lru_cache(maxsize=8)
def _session(data: bytes) -> Any:  # noqa: ANN401 - onnxruntime has no types
    """The session of a checked network. It keeps nothing from one call to the next."""
    return open_session(data)
