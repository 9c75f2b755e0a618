"""Each example does what it claims. Those that connect to a running KBot are tested in tests/client."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from numpy.typing import NDArray
from pyarrow import parquet

import kbot
from kbot.learn import Policy, go_to_with_policy
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.sim.script import Script
from kbot.text import KbotError
from kbot.world.occupancy_files import read_map
from kbot.world.occupancy_of_world import world_grid

EXAMPLES = Path(__file__).parents[2] / "examples"
MOST_LINES = 60


@dataclass(frozen=True)
class Run:
    """How a script drove: its simulation, the true poses (n, 3) in m and rad ten times a second, and whether
    the robot touched anything but the ground."""

    sim: kbot.Simulation
    path: NDArray[np.float64]
    collided: bool

    @property
    def length(self) -> float:
        return float(np.hypot(*np.diff(self.path[:, :2], axis=0).T).sum())


def drive(name: str, world: str) -> Run:
    sim = kbot.Simulation(kbot.load("kbot"), world=world)
    poses: list[tuple[float, float, float]] = []

    def sample() -> None:
        truth = sim.ground_truth
        poses.append((truth.pose.x, truth.pose.y, truth.unwrapped_yaw))

    sim.clock.every(10.0, sample)
    watch = CollisionWatch(sim)
    Script(str(EXAMPLES / f"{name}.py")).run(sim)
    watch.close()
    return Run(sim, np.array(poses), watch.collided)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_is_short(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= MOST_LINES


def test_the_wall_follower_keeps_its_distance_for_more_than_a_round() -> None:
    """The walls are at 1.49 m. After the first 10 s the robot is beside one of them."""
    run = drive("wall_follower", "rooms:columns=1,rows=1,size=3")
    along = run.path[100:]
    to_wall = 1.49 - np.abs(along[:, :2]).max(axis=1)
    assert (to_wall > 0.3).all()
    assert (to_wall < 0.5).all()
    assert abs(np.median(to_wall) - 0.4) < 0.02
    bearing = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))  # seen from the middle of the room
    assert bearing[0] - bearing[-1] > 2 * np.pi  # the wall is on the left, so the round is clockwise
    assert not run.collided


def test_the_line_follower_completes_the_track() -> None:
    """The line is 2 straights of 2 m and 2 half circles with a radius of 0.75 m, and 3 cm wide."""
    run = drive("line_follower", "track")
    x, y = np.abs(run.path[:, 0]), run.path[:, 1] - 0.75
    off = np.where(x <= 1.0, np.abs(np.abs(y) - 0.75), np.abs(np.hypot(x - 1.0, y) - 0.75))
    assert off.max() < 0.015
    assert run.path[-1, 2] == pytest.approx(2 * np.pi, abs=0.1)
    assert run.length > 2 * 2.0 + 2 * np.pi * 0.75


def test_obstacle_avoidance_drives_on_without_a_collision() -> None:
    run = drive("obstacle_avoidance", "rooms:columns=2,rows=2")
    assert not run.collided
    assert run.length > 10.0
    rooms = {(round(x / 2.0), round(y / 2.0)) for x, y, _ in run.path}  # rooms of 2 m
    assert len(rooms) >= 3


def test_go_to_goal_reaches_its_goal(capsys: pytest.CaptureFixture[str]) -> None:
    run = drive("go_to_goal", "maze:size=5,seed=2")
    assert capsys.readouterr().out.startswith("reached after")
    assert run.path[-1, :2] == pytest.approx([2.4, 2.4], abs=0.012)
    assert not run.collided


def test_the_map_matches_the_world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """98 % of the known cells agree with the world, both rooms of 4 m^2 are known, no wall is invented."""
    monkeypatch.chdir(tmp_path)
    run = drive("draw_a_map", "rooms:columns=2,rows=1")
    drawn = read_map("map.yaml")
    world = world_grid(run.sim.world, resolution=drawn.resolution)
    centers = drawn.centers(np.argwhere(drawn.cells >= 0))
    real = np.array([world.value(x, y) for x, y in centers])
    mine = drawn.cells[drawn.cells >= 0]
    assert ((mine > 50) == (real > 50)).mean() > 0.98
    assert (mine < 50).sum() * drawn.resolution**2 > 0.85 * 2 * 4.0
    assert all(real[mine > 50] > 50)
    assert not run.collided


def test_the_second_robot_stays_behind_the_first() -> None:
    """The lidar is 2 cm behind the middle of the axle, and measures to the nearest point of the robot ahead,
    whose caster and base reach 10 cm behind its own axle."""
    sim = kbot.Simulation(kbot.load("kbot"))
    gaps = []

    def sample() -> None:
        if sim.time > 10.0:
            ahead, behind = sim.ground_truth.pose, sim.robots["follower"].ground_truth.pose
            gaps.append(np.hypot(ahead.x - behind.x, ahead.y - behind.y))

    sim.clock.every(10.0, sample)
    Script(str(EXAMPLES / "two_robots.py")).run(sim)
    assert len(gaps) > 250
    assert min(gaps) > 0.4
    assert max(gaps) < 0.55


def test_the_own_sensor_finds_the_lamp() -> None:
    run = drive("own_sensor", "empty")
    x, y, _ = run.path[-1]
    assert np.hypot(x - 1.5, y - 1.0) < 0.25  # the sensors are 4 cm ahead of the axle


def test_the_own_controller_follows_a_wall() -> None:
    run = drive("own_controller", "corridor:width=1.2")
    assert run.path[-1, 0] > 2.0
    assert 0.59 - run.path[-1, 1] == pytest.approx(0.3, abs=0.03)  # the wall is 2 cm thick
    assert not run.collided


@pytest.mark.parametrize(
    "path",
    sorted(path for path in EXAMPLES.glob("*.py") if "def drive(" in path.read_text()),
    ids=lambda p: p.stem,
)
def test_a_script_starts_beside_the_page(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page runs in real time, so only the first half second is tested."""
    monkeypatch.chdir(tmp_path)
    sim = kbot.Simulation("kbot", world="maze:size=5,seed=2" if path.stem == "go_to_goal" else "track")

    def stop() -> None:
        raise KbotError("half a second is over")

    sim.clock.every(2.0, stop)
    with sim.serve(browser=False), pytest.raises(KbotError, match="half a second is over"):
        Script(str(path)).run(sim)
    assert sim.time == pytest.approx(0.5)


def test_the_notebook_runs() -> None:
    notebook = nbformat.read(EXAMPLES / "first_drive.ipynb", as_version=4)
    NotebookClient(notebook, timeout=300, startup_timeout=300, kernel_name="python3").execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    pictures = [output for output in shown if "text/html" in output.get("data", {})]
    lines = "".join(output.get("text", "") for output in shown).splitlines()
    assert len(pictures) == 2
    assert sum(len(cell.source.splitlines()) for cell in notebook.cells) <= MOST_LINES
    for line in lines[:2]:  # odometry and truth, after a square
        _, _, x, _, _, y, _, _, heading, _ = line.split()
        assert (float(x), float(y), float(heading)) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    assert float(lines[2].split()[2]) > 0.5  # on ice


def test_the_wheel_example_chooses_the_smallest_wheel_that_climbs(tmp_path: Path) -> None:
    """A wheel cannot climb a step of its own radius, and the torque of KBot's grows with its radius."""
    words = ["kbot", "--set", "wheel_radius=0.02:0.05:3", "--scenario", "straight"]
    words += ["--scenario", str(EXAMPLES / "choose_a_wheel" / "stairs.scenario.yaml")]
    command = [sys.executable, "-m", "kbot", "sweep", *words, "--objective", "wheel_radius", "--json"]
    done = subprocess.run([*command, "--out", str(tmp_path)], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert [best["values"] for best in found["best"]] == [{"wheel_radius": 0.035}]
    assert (found["passed"], found["failed"]) == (5, 1)
    rows = parquet.read_table(found["table"]).to_pylist()
    climbed = [row["final_up"] for row in rows if row["scenario"] == "stairs"]
    assert climbed == pytest.approx([0.0, 0.028, 0.028], abs=0.002)


def test_the_trained_policy_arrives_where_a_straight_line_does_not() -> None:
    """In rooms that the policy has not seen in training."""
    folder = EXAMPLES / "train_a_policy"
    words = [sys.executable, "evaluate.py", "policy.onnx", "--episodes", "6"]
    printed = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout
    rows = [line.strip("| ").split(" | ") for line in printed.splitlines()[2:]]
    shares = {driver: [int(each.rstrip("%")) for each in row[:3]] for driver, *row in rows}
    assert shares["policy"] == [100, 0, 0]
    arrived, _, late = shares["straight line"]
    assert arrived < 70
    assert late >= 30


def test_a_driver_that_never_arrives_has_no_speed() -> None:
    folder = EXAMPLES / "train_a_policy"
    words = [sys.executable, "evaluate.py", "policy.onnx", "--episodes", "1"]
    printed = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout
    assert "| straight line | 0% | 0% | 100% | - |" in printed


def test_the_trained_policy_needs_no_training_environment() -> None:
    """It drives through two doors in rooms of another layout, as `kbot sim --policy` does."""
    sim = kbot.Simulation(kbot.load("kbot", lidar=True), world="rooms")
    policy = Policy.read(EXAMPLES / "train_a_policy" / "policy.onnx")
    trip = go_to_with_policy(sim, policy, kbot.PlanarPose(4.0, 2.0))
    assert trip.reached, trip.status
    assert not trip.collided
    assert trip.distance < 1.5 * trip.shortest
