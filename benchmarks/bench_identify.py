"""kbot identify: intervals that contain the truth, the time for a log, and public logs of real robots.

    python benchmarks/bench_identify.py [--robots N] [--jobs N] [--from FOLDER]

Each of 1,000 synthetic robots has random wheel radii, separation and sensor pose, drives at random for 400
intervals, and its wheels slip by 0.3 to 2 % of the travel of an interval. A fifth of the logs each has noise
of displacements, noise of poses, displacements over 0.1 to 3 s, noise that is correlated in time, and 3 %
outliers (failed scan matching, or a wheel that spins). The table has the share of the 95 % intervals that
contain the truth (target: 93 to 97 %). A ten-minute log has 30,000 rows. The public logs are those of a real
robot with the sensor in three places, and their published answers: github.com/AndreaCensi/calibration. The
table has the largest difference in published standard deviations (target: 2). Exit status 1 if a target is
missed, or the public logs are not fetched.

`--from FOLDER` reads the bare git folder `AndreaCensi+calibration/repo` in it instead of GitHub, for a
machine without network. KBOT_REPOSITORIES names the same folder.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from kbot.identify.csv_file import read_csv
from kbot.identify.identification import KINEMATIC, identify
from kbot.identify.log import DriveLog
from kbot.identify.nominal import read_nominal

KINDS = ("displacements", "poses", "unequal intervals", "correlated noise", "outliers")
INTERVALS = 400
LOW, HIGH = 0.93, 0.97
LONGEST = 10.0
SIGMAS = 2.0
URL = "https://github.com/AndreaCensi/calibration"
REPOSITORY = "AndreaCensi+calibration/repo"
LOGS = [f"{name}{part}" for name in ("lstraight", "l90", "lmov") for part in ("", "_0", "_1", "_2")]


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--from", dest="folder", default=os.environ.get("KBOT_REPOSITORIES"))
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        results = [
            intervals(words.robots, words.jobs),
            ten_minutes(Path(scratch)),
            public_logs(words.folder, Path(scratch)),
        ]
    return 0 if all(results) else 1


def intervals(robots: int, jobs: int) -> bool:
    with ProcessPoolExecutor(jobs) as pool:
        found = list(pool.map(contained, range(robots), chunksize=5))
    hits = np.array(found, dtype=float)
    print(f"{robots} synthetic robots: share of 95 % intervals that contain the truth, in %\n")
    print("| log | " + " | ".join(KINEMATIC) + " |")
    print("| --- |" + " ---: |" * len(KINEMATIC))
    for index, kind in enumerate(KINDS):
        print_row(kind, hits[index :: len(KINDS)])
    print_row("all", hits)
    shares = hits.mean(axis=0)
    return bool(((shares >= LOW) & (shares <= HIGH)).all())


def print_row(name: str, hits: np.ndarray) -> None:
    print(f"| {name} | " + " | ".join(f"{100 * share:.1f}" for share in hits.mean(axis=0)) + " |")


def contained(seed: int) -> list[bool]:
    """Whether the interval of each parameter contains the truth."""
    truth, log = synthetic(seed, KINDS[seed % len(KINDS)])
    found = identify(log, NOMINAL).parameters
    shown = []
    for name, value in truth.items():
        estimate = found.get(name)
        if estimate is None:
            shown.append(False)
            continue
        turns = 2 * np.pi if name == "sensor_yaw" else np.inf
        value += turns * round((estimate.value - value) / turns) if np.isfinite(turns) else 0.0
        shown.append(estimate.low <= value <= estimate.high)
    return shown


NOMINAL = read_nominal("kbot", {}, {}, (), None)


def synthetic(
    seed: int, kind: str, count: int = INTERVALS, duration: float = 0.5
) -> tuple[dict[str, float], DriveLog]:
    rng = np.random.default_rng(seed)
    radius, separation = rng.uniform(0.03, 0.1), rng.uniform(0.12, 0.5)
    left, right = radius * (1.0 + rng.normal(0.0, 0.01, 2))
    lever = separation * rng.uniform(-0.5, 0.5, 2)
    yaw = rng.uniform(-np.pi, np.pi)
    durations = rng.uniform(0.1, 3.0, count) if kind == "unequal intervals" else np.full(count, duration)
    angles = commanded(rng, durations, radius, separation) * durations[:, None]
    slipping = angles * (1.0 + rng.normal(0.0, 1.0, angles.shape) * rng.choice([0.003, 0.01, 0.02]))
    if kind == "outliers":
        spins = np.flatnonzero(rng.random(count) < 0.015)
        slipping[spins, rng.integers(0, 2, len(spins))] *= 1.0 - rng.uniform(0.1, 0.9, len(spins))
    ahead, turn = slipping @ (left, right) / 2.0, slipping @ (-left, right) / separation
    sinc = np.sinc(turn / 2.0 / np.pi)
    moved = np.column_stack([ahead * sinc * np.cos(turn / 2.0), ahead * sinc * np.sin(turn / 2.0)])
    moved += rotated(np.tile(lever, (count, 1)), turn) - lever
    true = np.column_stack([rotated(moved, np.full(count, -yaw)), turn])
    noise = rng.normal(0.0, 1.0, (count, 3))
    if kind == "correlated noise":
        for index in range(1, count):
            noise[index] = 0.6 * noise[index - 1] + 0.8 * noise[index]
    noise *= (*[rng.choice([0.001, 0.003, 0.01])] * 2, rng.choice([0.001, 0.003, 0.01]))
    absent = np.full((count, 3), np.nan)
    displacements, poses = absent, absent
    if kind == "poses":
        heading = np.concatenate([[0.0], np.cumsum(turn)])
        places = np.cumsum(rotated(true[:, :2], heading[:-1]), axis=0)
        poses = np.column_stack([places, heading[1:]]) + noise
    else:
        displacements = true + noise
    if kind == "outliers":
        failed = rng.random(count) < 0.015
        displacements[failed] += rng.normal(0.0, 1.0, (failed.sum(), 3)) * (0.2, 0.2, 0.3)
    log = DriveLog(
        path="synthetic",
        durations=durations,
        wheel_speeds=angles / durations[:, None],
        displacements=displacements,
        poses=poses,
        commands=absent[:, :2],
        gyro=absent[:, 0],
    )
    values = (float(left), float(right), separation, *lever.tolist(), yaw)
    return dict(zip(KINEMATIC, values, strict=True)), log


def commanded(
    rng: np.random.Generator, durations: np.ndarray, radius: float, separation: float
) -> np.ndarray:
    """Wheel speeds that change every few seconds: drives along lines, curves and turns on the spot."""
    times, speeds, until, now = np.cumsum(durations), [], 0.0, np.zeros(2)
    for at in times:
        if at >= until:
            until = at + rng.uniform(2.0, 6.0)
            linear = rng.uniform(-0.1, 0.5) if rng.random() < 0.8 else 0.0
            angular = rng.uniform(-1.5, 1.5) if not linear or rng.random() < 0.5 else 0.0
            now = (linear + np.array([-0.5, 0.5]) * angular * separation) / radius
        speeds.append(now)
    return np.array(speeds)


def rotated(points: np.ndarray, angles: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(angles), np.sin(angles)
    return np.column_stack([cos * points[:, 0] - sin * points[:, 1], sin * points[:, 0] + cos * points[:, 1]])


def ten_minutes(scratch: Path) -> bool:
    rows = 30_000
    _, log = synthetic(0, "poses", rows, 600.0 / rows)
    path = scratch / "log.csv"
    table = np.column_stack([np.cumsum(log.durations), log.wheel_speeds, log.poses])
    header = "time,left_wheel_velocity,right_wheel_velocity,pose_x,pose_y,pose_yaw"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")
    started = time.process_time()
    identify(read_csv(str(path)), NOMINAL)
    seconds = time.process_time() - started
    print(f"\nA ten-minute log of {rows} rows: {seconds:.1f} s of processor time (target: {LONGEST:.0f})")
    return seconds < LONGEST


def public_logs(folder: str | None, scratch: Path) -> bool:
    repository = f"{folder}/{REPOSITORY}" if folder else str(scratch / "repository")
    if not folder:
        clone = ["git", "clone", "--quiet", "--depth", "1", "--bare", URL, repository]
        cloned = subprocess.run(clone, capture_output=True, text=True)
        if cloned.returncode:
            print(f"\nThe public logs are not fetched: {cloned.stderr.strip()}")
            return False
    print("\n| public log | intervals | outliers | largest difference, sigma |")
    print("| --- | ---: | ---: | ---: |")
    largest = 0.0
    for name in LOGS:
        text = shown(repository, f"reference-output/{name}.tuple")
        tuples = [json.loads(part + "}") for part in text.split("}") if part.strip()]
        answer = json.loads(shown(repository, f"reference-output/{name}_results.json"))
        found = identify(of_tuples(name, tuples), NOMINAL)
        published = (answer["r_diam"], answer["axle"], answer["l_x"], answer["l_y"], answer["l_theta"])
        values = (answer["l_diam"] / 2.0, published[0] / 2.0, *published[1:])
        sigmas = np.sqrt(np.diag(answer["covariance"]))
        distances = [
            abs(found.parameters[key].value - value) / sigma
            for key, value, sigma in zip(KINEMATIC, values, sigmas, strict=True)
        ]
        largest = max(largest, *distances)
        print(f"| {name} | {len(tuples)} | {found.residual.outliers} | {max(distances):.2f} |")
    print(f"\nlargest difference {largest:.2f} sigma (target: {SIGMAS:.0f})")
    return largest < SIGMAS


def shown(repository: str, path: str) -> str:
    command = ["git", "-C", repository, "show", f"HEAD:{path}"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def of_tuples(name: str, tuples: list[dict[str, object]]) -> DriveLog:
    absent = np.full((len(tuples), 3), np.nan)
    return DriveLog(
        path=name,
        durations=np.array([row["T"] for row in tuples]),
        wheel_speeds=np.array([[row["phi_l"], row["phi_r"]] for row in tuples]),
        displacements=np.array([row["sm"] for row in tuples]),
        poses=absent,
        commands=absent[:, :2],
        gyro=absent[:, 0],
    )


if __name__ == "__main__":
    sys.exit(main())
