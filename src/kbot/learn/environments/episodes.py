"""Runs episodes of a task: resets the simulation, drives the robot by actions, and computes rewards.

The single environment has one `Episodes`, the vector environment one for each of its environments.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.options import MOST_SEEDS, Options, read_options
from kbot.learn.environments.randomisation import NONE, Drawn, Randomisation, require_friction
from kbot.learn.environments.recently_used import RecentlyUsed
from kbot.learn.environments.stage import SEED, Library, Scene, Stage
from kbot.learn.environments.tasks import TASKS
from kbot.learn.environments.tasks.task import (
    ARRIVED,
    COLLIDED,
    COMMON_REWARDS,
    DIVERGED,
    FELL,
    TIME_LIMIT,
    Reward,
    Task,
    require_started,
)
from kbot.learn.interface.policy_interface import PolicyInterface
from kbot.learn.interface.robot_interface import policy_interface
from kbot.learn.interface.targets import Target
from kbot.messages.clock import NANOSECONDS
from kbot.navigation.controller import Observation
from kbot.navigation.simulated.lidars import LidarPoints, base_from_lidar
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Motion, Simulation, SimulationDiverged, recipe
from kbot.sim.motion_watch import UPRIGHT
from kbot.sim.numbers import is_finite
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list

_SETTLE = 0.1
"""s for which a robot settles on its wheels before an episode."""


class Step(NamedTuple):
    """The result of a step. `PolicyInterface.bounded` makes a vector of the numbers that are `seen`."""

    seen: list[float]
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]  # values of many types


def make_episodes(task: str, options: dict[str, object], library: Library | None = None) -> Episodes:
    """The episodes of a task, with the options of the environment and of the task. Environments with the same
    options can share a `library`.

    Raises:
        DescriptionError: the robot or the world cannot be used.
        KbotError: an option is unknown or not valid.
    """
    kind = TASKS[task]
    options = {**kind.defaults(options), **options}
    return Episodes(read_options(Options, options, (kind,)), read_options(kind, options, (Options,)), library)


class Episodes:
    """Episodes of one robot. `interface` describes the actions and what the policy sees."""

    def __init__(self, options: Options, task: Task, library: Library | None = None) -> None:
        """Build the first stage, so that errors in the options are raised here. Environments with the same
        options can share a `library`.

        Raises:
            DescriptionError: the robot or the world cannot be used.
            KbotError: an option is not valid.
        """
        self.options, self.task = options, task
        self._randomisation = Randomisation.of(options.randomise)
        self.weights = _weights(task, options.rewards)
        """The weight of each term of the reward, by name."""
        self.period = options.steps_per_action * options.timestep
        """s for each action."""
        values = tuple(options.properties.items())
        self._scene = Scene(options.robot, options.world, values, options.packages)
        self.library = library or Library(task.reach)
        self._stages: RecentlyUsed[Stage] = RecentlyUsed()
        nominal = task.scene(self._scene, np.random.default_rng(0))
        first = _with_world_seed(nominal, options.world_seeds[0])
        self.stage = self._stages.get(first.key, lambda: self._make_stage(first))
        self.interface = self._interface_of(self.stage)
        drawn = self._randomisation.draw_values(np.random.default_rng(0))
        if drawn:
            self._make_stage(self.stage.scene.with_drawn(drawn))
        if self._randomisation.friction is not None:
            require_friction(self.stage.simulation)
        if self._randomisation.noise.lidar != NONE and self.interface.lidar is None:
            raise KbotError("noise of the lidar has no effect: the policy sees no lidar. Remove it")
        self._faults: list[int] = []
        self._drawn = Drawn()
        self._is_noisy = False
        self._random = np.random.default_rng(0)
        self._seen: LidarPoints | None = None
        self._lidar_at = np.zeros(2)
        self._target: Target | None = None
        self._last_action: list[float] = self.interface.no_action.tolist()
        self._last_seen = [0.0] * len(self.interface.inputs)
        self._pending: list[tuple[int, tuple[float, float, float]]] = []
        self._map_from_odometry = PlanarPose()
        self._begun = 0
        self._is_over = True

    # episodes

    def reset(self, random: np.random.Generator) -> tuple[list[float], dict[str, Any]]:
        """Start an episode. Returns what the policy sees, as in a `Step`, and the facts of the start.

        The start, the noise and all random values of the episode come from `random`.
        """
        self._is_over = True  # also if the next lines raise an error
        self._random = random
        self._end()
        stage = self.stage = self._stage_of(self._draw_scene(random))
        simulation = stage.simulation
        simulation.reset()
        self._drawn = self._randomisation.draw(random)
        self._is_noisy = self._drawn.is_noisy
        start = self.task.start(stage, random)
        simulation.models.set_pose(start.pose.x, start.pose.y, start.pose.yaw)
        self._faults = self._drawn.apply(simulation)
        lidar = stage.lidar if self.interface.lidar is not None else None
        self._seen = None if lidar is None else LidarPoints(lidar)
        if lidar is not None:
            lidar.is_needed = None
            # the noise of the scans follows from the simulation's seed
            simulation.seed = int(random.integers(MOST_SEEDS))
            lidar.reseed()
            self._lidar_at = base_from_lidar(lidar)[:2, 3]
        first_scan = 0.0 if lidar is None else 1.0 / lidar.spec.rate + lidar.spec.latency
        # whole control periods, and the first scan has arrived
        simulation.run(math.ceil(max(_SETTLE, first_scan) / recipe.CONTROL_PERIOD) * recipe.CONTROL_PERIOD)
        self._begun = simulation.steps
        if lidar is not None:
            lidar.is_needed = self._scans_seen(lidar, simulation.clock.nanoseconds)
        self._target, self._pending = start.target, []
        self._last_action = self.interface.no_action.tolist()
        self._map_from_odometry = start.pose @ simulation.odometry.pose.inverse()
        self._is_over = False
        self._last_seen = self._observe(simulation.ground_truth)
        place = np.array([start.pose.x, start.pose.y, start.pose.yaw])
        return self._last_seen, {"start": place, **start.facts}

    def step(self, given: list[float]) -> Step:
        """Drive for one action, which `PolicyInterface.limited` returned.

        Raises:
            KbotError: the episode is over.
        """
        if self._is_over:
            raise KbotError("the episode is over: call reset first")
        speeds = self.interface.speeds_of(given)
        simulation = self.stage.simulation
        try:
            self._drive(simulation, speeds)
            has_diverged = False
        except SimulationDiverged:
            has_diverged = True
        truth = None if has_diverged else simulation.ground_truth
        terms, outcome = ({"failure": 1.0}, DIVERGED) if truth is None else self._judge(truth.pose)
        terms["time"] = self.period
        terms["change"] = sum([abs(a - b) for a, b in zip(given, self._last_action, strict=True)])
        self._last_action = given
        if truth is not None:
            self._last_seen = self._observe(truth)
        terminated = bool(outcome)
        time = self.time
        truncated = not terminated and time >= self.options.time_limit - 1e-9
        rewards = {name: weight * terms.get(name, 0.0) for name, weight in self.weights.items()}
        info: dict[str, Any] = {"rewards": rewards}
        if terminated or truncated:
            self._is_over = True
            outcome = outcome or TIME_LIMIT
            info |= {"outcome": outcome, "is_success": outcome == ARRIVED, "time": time}
            info |= self.task.facts(time, outcome)
        return Step(self._last_seen, sum(rewards.values()), terminated, truncated, info)

    @property
    def time(self) -> float:
        """s since the start of the episode."""
        return (self.stage.simulation.steps - self._begun) * self.options.timestep

    @property
    def goal(self) -> tuple[float, float]:
        """The goal, or the end of the path, of this episode in m in the world's frame. Raises KbotError: none
        has begun."""
        return require_started(self._target).end

    def _scans_seen(self, lidar: LidarSensor, begin: int) -> Callable[[int], bool]:
        """Which scans are the newest ones at an observation. The others would only cost time."""
        period = round(self.period * NANOSECONDS)
        # a scan is made up to a step after its time
        scan = round(NANOSECONDS / lidar.spec.rate + self.options.timestep * NANOSECONDS)
        latency = round(lidar.spec.latency * NANOSECONDS)

        def is_seen(now: int) -> bool:
            until_observed = (begin - now - latency) % period
            return until_observed < scan  # else the next scan arrives before

        return is_seen

    def _drive(self, simulation: Simulation, speeds: tuple[float, float, float]) -> None:
        """Command the robot after the delay, and simulate until the next action."""
        delay = round(self._drawn.delay / self.options.timestep)
        end = simulation.steps + self.options.steps_per_action
        self._pending.append((simulation.steps + delay, speeds))
        while self._pending and self._pending[0][0] < end:
            due, (linear, angular, lateral) = self._pending.pop(0)
            if due > simulation.steps:
                simulation.step(due - simulation.steps)
            simulation.cmd_vel(linear, angular, lateral)
        simulation.step(end - simulation.steps)

    def _judge(self, pose: PlanarPose) -> tuple[dict[str, float], str]:
        """The values of the terms of the step, which ended at a true pose, and the outcome."""
        simulation = self.stage.simulation
        terms, outcome = self.task.judge(pose, self.period)
        if _has_fallen(simulation):
            outcome = FELL
        elif simulation.collided:
            outcome = COLLIDED
        if outcome:
            terms["arrival" if outcome == ARRIVED else "failure"] = 1.0
        return terms, outcome

    def _observe(self, truth: Motion) -> list[float]:
        """What the policy sees now."""
        simulation = self.stage.simulation
        motion, pose = truth, truth.pose
        if self.options.pose == "odometry":
            motion = simulation.odometry
            pose = self._map_from_odometry @ motion.pose
        points, seen_at = (None, -math.inf) if self._seen is None else self._seen()
        now = simulation.time
        observation = Observation(now, pose, motion.twist, points, now - seen_at)
        if self._is_noisy:
            observation = self._drawn.seen(observation, self._random, self._lidar_at)
        return self.interface.numbers(observation, require_started(self._target), self._last_action)

    def _end(self) -> None:
        """Undo what the last episode changed in its simulation."""
        for fault in self._faults:
            self.stage.simulation.disturbances.end_fault(fault)
        self._faults = []

    # stages

    def _draw_scene(self, random: np.random.Generator) -> Scene:
        scene = self.task.scene(self._scene, random)
        low, high = self.options.world_seeds
        scene = _with_world_seed(scene, int(random.integers(low, high + 1)))
        values = self._randomisation.draw_values(random)
        return scene.with_drawn(values) if values else scene

    def _stage_of(self, scene: Scene) -> Stage:
        if scene.key == self.stage.scene.key:
            return self.stage
        if scene.is_drawn:  # no other episode has the same values
            return self._make_stage(scene)
        return self._stages.get(scene.key, lambda: self._make_stage(scene))

    def _make_stage(self, scene: Scene) -> Stage:
        return Stage(scene, self.library, self.options.timestep)

    def _interface_of(self, stage: Stage) -> PolicyInterface:
        options = self.options
        if options.lidar != 0:
            stage.lidar  # noqa: B018 - mounts it, without the other sensors
        return policy_interface(
            stage.simulation,
            self.task.target,
            sectors=options.lidar,
            reach=options.reach,
            max_speed=options.max_speed,
            reverse=options.reverse,
            rate=options.rate,
        )


def _has_fallen(simulation: Simulation) -> bool:
    _, _, _, _, x, y, _ = simulation.robots.first.body.root_place
    return 1.0 - 2.0 * (x * x + y * y) < UPRIGHT


def _with_world_seed(scene: Scene, seed: int) -> Scene:
    if isinstance(scene.world, str) and SEED in scene.world:
        return replace(scene, world=scene.world.replace(SEED, str(seed)))
    return scene


def _weights(task: Task, given: Mapping[str, float]) -> dict[str, float]:
    """The weight of each term of the reward.

    Raises:
        KbotError: a term is unknown, or a weight not finite.
    """
    terms: dict[str, Reward] = {**task.rewards, **COMMON_REWARDS}
    if not isinstance(given, Mapping):
        raise KbotError(f"rewards must be a dict of weights by name, not {reprlib.repr(given)}")
    for name, weight in given.items():
        if name not in terms:
            raise KbotError(f"unknown term '{name}' in rewards: {suggest_or_list(str(name), terms)}")
        if not is_finite(weight):
            raise KbotError(
                f"the weight of '{name}' in rewards must be a finite number, not {reprlib.repr(weight)}"
            )
    return {name: float(given.get(name, term.weight)) for name, term in terms.items()}
