"""All batteries of `kbot try` on KBot and on twenty public robots, and the efficiency of parallel trials.

    python benchmarks/bench_trials.py [ROBOT…]

Each robot of the corpus is tried in all batteries that apply to it, in two processes. The reason is given for
each failure. With the names of robots, only these are tried.

The parallel efficiency compares the pool of `kbot try` with two independent processes. Each of these loads
KBot and runs all batteries several times in order. The pool runs as many trials in all. Both start from
nothing. The efficiency is the wall-clock time of the two processes divided by that of the pool, for the
best of several rounds in turn.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from kbot.model.load import load_robot
from kbot.text import KbotError
from kbot.trials import RobotSource, TrialResult, run_trial
from kbot.trials.batteries import all_batteries, not_applicable
from kbot.trials.pool import Pool, Task, run_tasks
from kbot.trials.robot_facts import robot_facts
from kbot.trials.trial import load_source

SHARED = Path(os.environ.get("KBOT_SHARED", Path(__file__).parents[2] / "shared"))
CORPUS = SHARED / "corpus"
PROCESSES = 2
REPEATS, ROUNDS = 4, 3
"""Runs of all batteries by each independent process, and rounds of the comparison."""
LIMIT = 600.0
"""Processor time in seconds of one trial."""


@dataclass(frozen=True)
class Robot:
    """A robot of the corpus."""

    name: str
    file: str
    arguments: str = ""

    @property
    def source(self) -> RobotSource:
        given = dict(word.split(":=", 1) for word in self.arguments.split())
        return RobotSource(str(CORPUS / self.file), given)


TB3 = "src/ROBOTIS-GIT+turtlebot3/turtlebot3_description/urdf"
LINOROBOT = "src/linorobot+linorobot2/linorobot2_description/urdf/robots"
NAV2 = "src/ros-navigation+nav2_minimal_turtlebot_simulation"
MIR = "src/DFKI-NI+mir_robot/mir_description/urdf/mir.urdf.xacro"
ROBOTS = (
    Robot("turtlebot3_burger", f"{TB3}/turtlebot3_burger.urdf"),
    Robot(
        "turtlebot3_waffle",
        "src/ROBOTIS-GIT+turtlebot3_simulations/turtlebot3_gazebo/urdf/turtlebot3_waffle.urdf",
    ),
    Robot("turtlebot3_waffle_pi", f"{TB3}/turtlebot3_waffle_pi.urdf"),
    Robot("tb3_nav2", f"{NAV2}/nav2_minimal_tb3_sim/urdf/turtlebot3_waffle.urdf"),
    Robot(
        "turtlebot3_manipulation",
        "src/ROBOTIS-GIT+turtlebot3_manipulation/turtlebot3_manipulation_description/urdf/"
        "turtlebot3_manipulation.urdf.xacro",
    ),
    Robot("kobuki", "src/yujinrobot+kobuki/kobuki_description/urdf/kobuki_standalone.urdf.xacro"),
    Robot("create3", f"{NAV2}/nav2_minimal_tb4_description/urdf/icreate/create3.urdf.xacro"),
    Robot("turtlebot4", f"{NAV2}/nav2_minimal_tb4_description/urdf/standard/turtlebot4.urdf.xacro"),
    Robot("mir_100", MIR),
    Robot("mir_250", MIR, "mir_type:=mir_250"),
    Robot("linorobot_2wd", f"{LINOROBOT}/2wd.urdf.xacro"),
    Robot("linorobot_turtlebot", f"{LINOROBOT}/turtlebot.urdf.xacro"),
    Robot("linorobot_vattenkar", f"{LINOROBOT}/vattenkar.urdf.xacro"),
    Robot("andino", "src/Ekumen-OS+andino/andino_description/urdf/andino.urdf.xacro"),
    Robot(
        "andino_gz_classic",
        "src/Ekumen-OS+andino/andino_gz_classic/urdf/andino_gz_classic.xacro",
        "use_gazebo_ros_control:=false use_fixed_caster:=true",
    ),
    Robot("diffbot", "src/ros-mobile-robots+diffbot/diffbot_description/urdf/diffbot.urdf.xacro"),
    Robot(
        "sam_bot",
        "src/ros-navigation+navigation2_tutorials/sam_bot_description/src/description/"
        "sam_bot_description.urdf",
    ),
    Robot("warthog", "src/warthog-cpr+warthog/warthog_description/urdf/warthog.urdf.xacro"),
    Robot("linorobot_4wd", f"{LINOROBOT}/4wd.urdf.xacro"),
    Robot("urdf_tutorial", "src/ros+urdf_sim_tutorial/urdf/13-diffdrive.urdf.xacro"),
    Robot("linorobot_mecanum", f"{LINOROBOT}/mecanum.urdf.xacro"),
    Robot(
        "carlikebot",
        "expected/ros-controls+ros2_control_demos/example_11/description/urdf/carlikebot.urdf.xacro.urdf",
    ),
)


def main(names: list[str]) -> int:
    if names == ["--alone"]:
        run_alone()
        return 0
    chosen = [robot for robot in ROBOTS if not names or robot.name in names]
    if not names:
        print_efficiency()
    if CORPUS.is_dir():
        print_robots(chosen)
    else:
        print(f"no corpus at {CORPUS}")
    return 0


def tasks_of(source: RobotSource) -> list[Task]:
    made = (replace(scenario, robot=source) for scenario in all_batteries(load_source(source)))
    return [Task(scenario, seed) for scenario in made for seed in scenario.seeds]


def run_alone() -> None:
    """Run all batteries on KBot `REPEATS` times, without a pool."""
    robot = load_robot("kbot").require()
    for scenario in REPEATS * all_batteries(robot):
        for seed in scenario.seeds:
            run_trial(scenario, seed, robot)


def print_efficiency() -> None:
    tasks = tasks_of(RobotSource("kbot"))
    once, alone, pooled = [], [], []
    for _ in range(ROUNDS):
        once.append(wall(lambda: run_pool(tasks)))
        alone.append(wall(run_independent))
        pooled.append(wall(lambda: run_pool(PROCESSES * REPEATS * tasks)))
    print(
        f"all {len(tasks)} trials of KBot once, in {PROCESSES} processes: {min(once):.1f} s   (limit: 60 s)"
    )
    print(f"parallel efficiency: {min(alone) / min(pooled):.2f}   (target: 0.95)\n")


def run_pool(tasks: list[Task]) -> list[TrialResult]:
    with Pool(PROCESSES) as pool:
        results = run_tasks(pool, tasks, limit=LIMIT)
    return [result for result in results if result is not None]


def run_independent() -> None:
    words = [sys.executable, __file__, "--alone"]
    # in sessions of their own, as the processes of the pool: Linux divides a busy machine between sessions
    for process in [subprocess.Popen(words, start_new_session=True) for _ in range(PROCESSES)]:
        process.wait()


def wall(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def print_robots(robots: list[Robot]) -> None:
    print("| robot | drive | size, m | passed | failed, and why | not applicable |")
    print("| --- | --- | ---: | ---: | --- | --- |")
    for robot in robots:
        try:
            model = load_source(robot.source)
            facts, tasks = robot_facts(model), tasks_of(robot.source)
        except KbotError as error:
            print(f"| {robot.name} | | | | {str(error).splitlines()[0]} | |")
            continue
        results = run_pool(tasks)
        failed = [result for result in results if not result.passed]
        reasons = "; ".join(f"{result.name}: {result.reason}" for result in failed)
        counts = f"{len(results) - len(failed)} of {len(results)}"
        left_out = ", ".join(not_applicable(model))
        print(
            f"| {robot.name} | {facts.kind} | {facts.size:.2f} | {counts} | {reasons} | {left_out} |",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
