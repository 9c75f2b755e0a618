"""Time from the built wheel to a robot that drives, in a new virtual environment.

    python benchmarks/bench_first_hour.py [--runs N]

The wheel is built first, which is not measured. Then pip installs it into a new virtual environment, and
`kbot --no-browser` starts. A second terminal publishes `/cmd_vel` and reads `/odom`. The run ends when the
odometry shows that the robot has moved by 1 cm. pip takes the dependencies from its cache or from the
network, so the first run also measures the connection. The peer is the installation of the dependencies
alone: it shows which part KBot cannot avoid.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import venv
from itertools import pairwise
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1]
TARGET = 60.0
"""Seconds from the wheel to a driving robot."""
MOVED = 0.01
"""m: far more than the noise of a standing robot, which is 0."""
STEPS = ("virtual environment", "installation", "start of kbot", "first movement")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=3)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        wheel = build_wheel(Path(folder))
        times = [measure(wheel, Path(folder) / f"run_{run}") for run in range(runs)]
        bare = [install_dependencies(wheel, Path(folder) / f"bare_{run}") for run in range(runs)]
    for index, step in enumerate(STEPS):
        print(f"{step:32}{median(run[index] for run in times):8.1f} s")
    total = median(sum(run) for run in times)
    print(f"{'wheel to a driving robot':32}{total:8.1f} s   (target: {TARGET:g})")
    share = median(run[1] for run in times) / median(bare)
    print(f"{'installation / dependencies alone':34}{share:6.2f}")
    if total > TARGET:
        sys.exit(1)


def build_wheel(folder: Path) -> Path:
    command = [sys.executable, "-m", "build", "--wheel", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return next(folder.glob("*.whl"))


def measure(wheel: Path, folder: Path) -> list[float]:
    """Seconds of each step."""
    marks = [time.perf_counter()]
    programs = make_environment(folder)
    marks.append(time.perf_counter())
    pip_install(programs, str(wheel))
    marks.append(time.perf_counter())
    kbot = str(programs / "kbot")
    # a folder of its own, so that no other KBot on this machine is found
    environment = os.environ | {"XDG_RUNTIME_DIR": str(folder), "KBOT_TRANSPORT": "local"}
    environment.pop("PYTHONPATH", None)
    pipe = {"stdout": subprocess.PIPE, "text": True, "env": environment}
    with subprocess.Popen([kbot, "--no-browser", "--port", "0"], **pipe) as running:
        running.stdout.readline()  # the address
        marks.append(time.perf_counter())
        words = ["/cmd_vel", "{linear: {x: 0.2}}", "--rate", "20", "--times", "200"]
        with subprocess.Popen([kbot, "topic", "pub", *words], **pipe) as driving:
            echo = [kbot, "topic", "echo", "/odom", "--field", "pose.pose.position.x"]
            with subprocess.Popen(echo, **pipe) as odometry:
                for line in odometry.stdout:
                    if line.strip(" -\n") and float(line) > MOVED:
                        break
                marks.append(time.perf_counter())
                odometry.terminate()
            driving.terminate()
        running.terminate()
    return [after - before for before, after in pairwise(marks)]


def install_dependencies(wheel: Path, folder: Path) -> float:
    """Seconds in which pip installs what the wheel depends on."""
    programs = make_environment(folder)
    pip_install(programs, str(wheel))
    listed = subprocess.run(
        [str(programs / "python"), "-m", "pip", "freeze", "--exclude", "kbot"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    fresh = make_environment(folder / "fresh")
    begun = time.perf_counter()
    pip_install(fresh, *listed)
    return time.perf_counter() - begun


def make_environment(folder: Path) -> Path:
    """A new virtual environment. Returns the folder of its programs."""
    venv.create(folder / "venv", with_pip=True)
    return folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")


def pip_install(programs: Path, *packages: str) -> None:
    command = [str(programs / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*command, *packages], check=True)


if __name__ == "__main__":
    main()
