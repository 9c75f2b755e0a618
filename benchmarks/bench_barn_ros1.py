"""The BARN challenge's own run.py, unmodified, with KBot as Gazebo, as move_base and as the Jackal's nodes.

    python benchmarks/bench_barn_ros1.py [--from FOLDER] [WORLD ...]

`run.py` and its `gazebo_simulation.py` place the robot by `/gazebo/set_model_state`, send the goal to the
action `move_base`, and judge the run by `/gazebo/get_model_state` and `/collision`, all by rospy. Only the
command `roslaunch` is replaced, by `benchmarks/barn_challenge/roslaunch`. KBot runs in real time with
`--ros1 --no-map`. The robot is that of `bench_barn.py`. The columns are those of run.py: time from 0.1 m of
movement to 1 m from the goal, and the challenge's metric, of at most 0.5. run.py looks every 0.1 s or later.

`FOLDER` holds the challenge: a checkout, or a bare git folder `Daffan+the-barn-challenge/repo` in it. Without
it, GitHub's is fetched. ROS 1 must be installed (scripts/need_ros1.sh).
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
REPOSITORY = "https://github.com/Daffan/the-barn-challenge"
COMMIT = "bf5a226f6088ec96bf0d2dbee3253a8ea6119b83"
PARTS = ("run.py", "gazebo_simulation.py", "jackal_helper/package.xml", "jackal_helper/worlds/BARN")
ROBOT = Path(os.environ.get("KBOT_SHARED", "shared")) / "barn" / "jackal_description"
WORLDS = [*(str(world) for world in range(0, 300, 30)), "242", "298", "92", "299", "58"]
"""Every 30th world, and the five that took longest in `bench_barn.py`."""
PYTHON = "/usr/bin/python3"
"""The Python of the machine's ROS 1."""
TIME_LIMIT = 300.0
"""s for a world: 100 s of simulated time, on a machine that is several times too slow."""
FRAME = "  odom_frame_id: wheel_odom\n"
"""The Jackal's `odom` is that of robot_localization, so that the wheels need another frame."""


def fetch(folder: Path | None, target: Path) -> None:
    """Copy the parts of the challenge that are used to `target`."""
    if folder is not None and (folder / "run.py").exists():
        for part in PARTS:
            (target / part).parent.mkdir(parents=True, exist_ok=True)
            copy = shutil.copytree if (folder / part).is_dir() else shutil.copy
            copy(folder / part, target / part)
        return
    bare = None if folder is None else folder / "Daffan+the-barn-challenge" / "repo"
    if bare is None:
        bare = target / "git"
        subprocess.run(["git", "clone", "-q", "--bare", "--filter=blob:none", REPOSITORY, bare], check=True)
    packed = subprocess.run(["git", "-C", bare, "archive", COMMIT, *PARTS], capture_output=True, check=True)
    subprocess.run(["tar", "x", "-C", target], input=packed.stdout, check=True)


def jackal(target: Path) -> Path:
    """A copy of the robot whose wheel odometry is not in `odom`."""
    robot = target / "jackal_description"
    shutil.copytree(ROBOT, robot)
    file = robot / "config" / "control.yaml"
    key = "jackal_velocity_controller:\n"
    file.write_text(file.read_text().replace(key, key + FRAME))
    return robot


def environment(target: Path) -> dict[str, str]:
    """That of a terminal with ROS 1, its own master, and `roslaunch` replaced."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    messages = target / "messages"
    subprocess.run([PYTHON, HERE / "barn_challenge" / "gazebo_messages.py", messages], check=True)
    return {
        **{name: os.environ[name] for name in ("HOME", "LANG") if name in os.environ},
        "PATH": f"{HERE / 'barn_challenge'}:/usr/bin:/bin",
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(target / "ros"),
        "ROS_PACKAGE_PATH": f"{target}:/usr/share",
        # KBot's own packages must not be those of ROS 1, and run.py needs those of Debian
        "PYTHONPATH": os.pathsep.join(filter(None, (os.environ.get("PYTHONPATH"), str(messages)))),
        "PYTHONUNBUFFERED": "1",
        "BARN_PYTHON": sys.executable,
        "BARN_ROBOT": str(target / "jackal_description"),
    }


def run(world: str, target: Path, variables: dict[str, str], out: Path) -> list[str]:
    """The line that run.py writes for a world. Empty if it writes none."""
    before = out.read_text().splitlines() if out.exists() else []
    command = [PYTHON, "run.py", "--world_idx", world, "--out", str(out)]
    with (target / f"world_{world}.log").open("w") as log:
        process = subprocess.Popen(
            command, cwd=target, env=variables, stdout=log, stderr=log, start_new_session=True
        )
        try:
            process.wait(TIME_LIMIT)
        except subprocess.TimeoutExpired:
            pass
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    lines = out.read_text().splitlines() if out.exists() else []
    return lines[len(before) :]


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--from", dest="folder", type=Path, metavar="FOLDER")
    parser.add_argument("worlds", nargs="*", default=WORLDS)
    options = parser.parse_args()
    if not ROBOT.exists() or shutil.which("roscore", path="/usr/bin") is None:
        print(f"this needs the robot in {ROBOT} (KBOT_SHARED), and ROS 1")
        return 0
    folder = options.folder or (Path(text) if (text := os.environ.get("KBOT_REPOSITORIES")) else None)
    metrics: list[float] = []
    failures = 0
    with tempfile.TemporaryDirectory() as name:
        target = Path(name)
        fetch(folder, target)
        jackal(target)
        variables, out = environment(target), target / "out.txt"
        print("world  result      time    metric")
        for world in options.worlds:
            lines = run(world, target, variables, out)
            if not lines:
                print((target / f"world_{world}.log").read_text()[-3000:], file=sys.stderr)
                print(f"{world:>5}  run.py did not finish")
                failures += 1
                continue
            _, success, collided, _, seconds, metric = lines[-1].split()
            failures += success != "1"
            metrics.append(float(metric))
            result = {"1": "succeeded"}.get(success, "collided" if collided == "1" else "timeout")
            print(f"{world:>5}  {result:9s}  {seconds:>7} s  {metric}", flush=True)
    print(f"success {len(options.worlds) - failures} of {len(options.worlds)}, ", end="")
    print(f"mean metric {statistics.mean(metrics) if metrics else 0.0:.3f}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
