"""Speed of the vector environment, as a share of `mujoco.rollout` with the same motion on as many cores.

    python benchmarks/bench_learn.py [--robots 8] [--actions 15] [--cores 1 2]

Both simulate the same robots with the same commands: `mujoco.rollout` gets the wheel commands that the
environment gave, and its robots must end where those of the environment end. Each call of either simulates
one action of 0.1 s for all robots. Only the environment limits accelerations, computes odometry, watches for
collisions and falls, and returns observations, rewards and infos; with a lidar, it also casts the rays. The
medians of alternating calls are compared. Without a lidar, the difference is the time of Python: up to ten
wheel commands and five control periods for each action, and the observation and reward. With two cores, the
results also pass between processes.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from typing import Any

import gymnasium
import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

import kbot

REPEATS = 40
"""Runs of all actions, 2 to 5 s together: a machine's speed can vary for half a second."""
SEED = 3
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
CASES: dict[str, dict[str, Any]] = {
    "empty world": {"world": "empty", "distance": (10.0, 12.0)},
    "rooms": {"world": "rooms"},
    "rooms, with a lidar": {"world": "rooms", "properties": {"lidar": True}},
}
TARGET = 0.8
"""The least share without a lidar. Exit status 1 if it is missed."""
AGREES = 1e-6
"""m and rad. `mujoco.rollout` does not set all of the state that the next step depends on."""


class Case:
    """One environment, and what `mujoco.rollout` needs to repeat its run."""

    def __init__(self, options: dict[str, Any], robots: int, actions: int, cores: int) -> None:
        random = np.random.default_rng(1)
        self.actions = random.uniform(-1.0, 1.0, (actions, robots, 2)).astype(np.float32)
        self.actions[..., 0] = self.actions[..., 0] * 0.1 - 0.8  # slowly, so that none reaches a wall
        self.environment = make(options, robots, cores)
        self.environment.reset(seed=SEED)
        recorded = make(options, robots, 1)  # in this process
        recorded.reset(seed=SEED)
        group = recorded.unwrapped._groups[0].group
        simulations = [episodes.stage.simulation for episodes in group.episodes]
        self.models = [simulation.engine.model for simulation in simulations]
        self.data = [mujoco.MjData(self.models[0]) for _ in range(cores)]
        self.start = np.array([state(simulation) for simulation in simulations])
        controls: list[list[NDArray[np.float64]]] = [[] for _ in simulations]
        for simulation, commands in zip(simulations, controls, strict=True):
            simulation.stepping.watchers.append(
                lambda _, data, commands=commands: commands.append(data.ctrl.copy())
            )
        drive(recorded, self.actions)
        steps = len(controls[0]) // actions
        self.controls = np.array(controls).reshape(robots, actions, steps, -1)
        self.steps = steps * actions * robots
        self.rollout = rollout.Rollout(nthread=cores if cores > 1 else 0)
        ends = np.array([state(simulation) for simulation in simulations])
        positions = slice(1, 1 + self.models[0].nq)
        off = np.abs(self.repeat() - ends)[:, positions].max()
        if off > AGREES:
            raise SystemExit(f"mujoco.rollout ends {off:g} away from the environment")

    def repeat(self) -> NDArray[np.float64]:
        now = self.start
        for at in range(len(self.actions)):
            now = self.advance(now, at)
        return now

    def advance(self, now: NDArray[np.float64], at: int) -> NDArray[np.float64]:
        """The states after one action."""
        states, _ = self.rollout.rollout(self.models, self.data, now, self.controls[:, at])
        last: NDArray[np.float64] = states[:, -1]
        return last

    def measure(self) -> tuple[float, float]:
        """Physics steps per second of the environment, and its share of `mujoco.rollout`.

        The two sides take turns at each action, because the speed of a machine varies.
        """
        ours, theirs = [], []
        for _ in range(REPEATS):
            self.environment.reset(seed=SEED)
            now = self.start
            for at, action in enumerate(self.actions):
                begun = time.perf_counter()
                self.environment.step(action)
                middle = time.perf_counter()
                now = self.advance(now, at)
                ours.append(middle - begun)
                theirs.append(time.perf_counter() - middle)
        self.environment.close()
        self.rollout.close()
        per_action = self.steps / len(self.actions)
        return per_action / statistics.median(ours), statistics.median(theirs) / statistics.median(ours)


def make(options: dict[str, Any], robots: int, processes: int) -> Any:  # noqa: ANN401 - of Gymnasium
    return gymnasium.make_vec("kbot/Goal-v0", num_envs=robots, processes=processes, time_limit=1e6, **options)


def drive(environment: Any, actions: NDArray[np.float32]) -> None:  # noqa: ANN401 - of Gymnasium
    for action in actions:
        _, _, terminated, _, _ = environment.step(action)
        if terminated.any():
            raise SystemExit("an episode ended, so that the two sides would not compute the same")


def state(simulation: kbot.Simulation) -> NDArray[np.float64]:
    model, data = simulation.engine.model, simulation.engine.data
    found = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, found, STATE)
    return found


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--actions", type=int, default=15)
    parser.add_argument("--cores", type=int, nargs="+", default=sorted({1, os.cpu_count() or 1}))
    options = parser.parse_args()
    print(f"{options.robots} robots, {options.actions} actions of 0.1 s each; mujoco.rollout is 1.00\n")
    print("| world | cores | physics steps/s | actions/s | share of mujoco.rollout |")
    print("| --- | --- | --- | --- | --- |")
    failed = False
    for name, case in CASES.items():
        for cores in options.cores:
            speed, share = Case(case, options.robots, options.actions, cores).measure()
            failed |= share < TARGET and "lidar" not in name
            print(f"| {name} | {cores} | {speed:,.0f} | {speed / 50:,.0f} | {share:.2f} |", flush=True)
    print(f"\nTarget without a lidar: {TARGET}.")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
