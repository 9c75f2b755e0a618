"""Tests that a Ray cluster gives the results of this machine, also if it loses machines and processes."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE

import psutil
import pytest

from kbot.sweep import cluster
from kbot.sweep.cluster import LOCAL, RayCluster, parse_place
from kbot.sweep.journal import Journal
from kbot.sweep.plan import Plan
from kbot.sweep.processes import Processes
from kbot.sweep.runner import Sweep
from kbot.text import KbotError
from kbot.trials.pool import Pool, Task
from kbot.trials.results import TrialResult
from kbot.trials.scenario import RobotSource, Scenario

sys.path.insert(0, str(Path(__file__).parent))
from ray_run import plan_of

HERE = Path(__file__).parent
RUNS = 12
ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="radius" value="0.035"/>
  <xacro:include filename="$(dirname)/wheels.xacro"/>
  <link name="base_link">
    <visual><geometry><box size="0.16 0.12 0.02"/></geometry></visual>
    <collision><geometry><box size="0.16 0.12 0.02"/></geometry></collision>
    <inertial><mass value="1"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.003"/></inertial>
  </link>
  <link name="caster">
    <collision><origin xyz="-0.06 0 ${0.02 - radius}"/>
      <geometry><sphere radius="0.02"/></geometry></collision>
  </link>
  <joint name="caster_joint" type="fixed"><parent link="base_link"/><child link="caster"/></joint>
  <xacro:wheel side="left" y="0.08"/>
  <xacro:wheel side="right" y="-0.08"/>
  <gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so">
    <left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>
    <wheel_separation>0.16</wheel_separation><wheel_diameter>${2 * radius}</wheel_diameter>
  </plugin></gazebo>
</robot>
"""
WHEELS = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="side y">
    <link name="${side}_wheel">
      <visual><geometry><cylinder radius="${radius}" length="0.02"/></geometry></visual>
      <collision><geometry><cylinder radius="${radius}" length="0.02"/></geometry></collision>
      <inertial><mass value="0.1"/>
        <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0001"/></inertial>
    </link>
    <joint name="${side}_joint" type="continuous">
      <parent link="base_link"/><child link="${side}_wheel"/>
      <origin xyz="0 ${y} 0" rpy="${-pi/2} 0 0"/><axis xyz="0 0 1"/>
    </joint>
  </xacro:macro>
</robot>
"""
# so long that the runs outlast the search for a process to kill, and the detection of a lost cluster
SCENARIO = """name: drive
robot: r.xacro
duration: 60
steps:
  - command: {linear: 0.3}
  - at: 2
    command: {}
expect:
  - contacts: {max: 0}
"""


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a robot of two files, and a scenario."""
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "r.xacro").write_text(ROBOT)
    (folder / "wheels.xacro").write_text(WHEELS)
    (folder / "drive.scenario.yaml").write_text(SCENARIO)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def nodes(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A cluster of three nodes. The first line of its output is the address. No process remains."""
    environment = {**os.environ, "RAY_USAGE_STATS_ENABLED": "0"}
    with (tmp_path / "nodes.log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, str(HERE / "ray_nodes.py"), "0"],
            stdin=PIPE, stdout=PIPE, stderr=log, text=True, env=environment,
        )  # fmt: skip
    try:
        yield process
    finally:
        started = psutil.Process(process.pid).children(recursive=True)
        process.communicate(timeout=60)
        _, left = psutil.wait_procs(started, 10)
        for each in left:  # agents of a node whose head is lost end late
            with suppress(psutil.NoSuchProcess):
                each.kill()


def local_table(plan: Plan, folder: Path) -> bytes:
    """The table of the sweep in processes of this machine."""
    folder.mkdir()
    with Journal(folder / "runs.jsonl", plan) as journal, Pool(1) as pool, Processes(pool) as processes:
        sweep = Sweep(plan, journal, folder)
        sweep.run(processes)
        return sweep.table.read_bytes()


def test_a_killed_node_and_a_killed_process_lose_nothing(nodes: subprocess.Popen[str], work: Path) -> None:
    """Other nodes get the files of the working directory. Ray prints nothing."""
    assert nodes.stdin is not None
    assert nodes.stdout is not None
    address = nodes.stdout.readline().strip()
    run = subprocess.Popen(
        [sys.executable, str(HERE / "ray_run.py"), address, "out"],
        cwd=work, stdout=PIPE, stderr=PIPE, text=True,
    )  # fmt: skip
    assert run.stdout is not None
    dots = run.stdout.read(4)
    nodes.stdin.write("kill\n")
    nodes.stdin.flush()
    assert nodes.stdout.readline() == "killed\n"
    dots += run.stdout.read(2)
    workers: list[psutil.Process] = []
    while run.poll() is None and not workers:  # between two runs, none executes one
        workers = [each for each in psutil.Process(nodes.pid).children(recursive=True) if is_running(each)]
    workers[0].kill()
    rest, errors = run.communicate(timeout=300)
    assert (dots + rest, errors, run.returncode) == ("." * RUNS, "", 0)
    assert len((work / "out/runs.jsonl").read_text().splitlines()) == RUNS
    assert (work / "out/results.parquet").read_bytes() == local_table(plan_of(), work / "here")


def test_a_lost_cluster_is_an_error_and_the_same_command_continues(
    nodes: subprocess.Popen[str], work: Path
) -> None:
    assert nodes.stdout is not None
    address = nodes.stdout.readline().strip()
    words = ("r.xacro", "--set", "radius=0.03:0.045:40", "--scenario", "drive.scenario.yaml", "--out", "out")
    command = [sys.executable, "-m", "kbot", "sweep", *words]
    run = subprocess.Popen([*command, "--on", address], cwd=work, stdout=PIPE, stderr=PIPE, text=True)
    journal = work / "out/runs.jsonl"
    while run.poll() is None and not (journal.exists() and journal.read_text()):
        time.sleep(0.2)
    for process in psutil.Process(nodes.pid).children():
        if process.name() == "gcs_server":
            process.kill()
    _, errors = run.communicate(timeout=300)
    assert run.returncode == 2
    assert errors.startswith("error: the connection to the cluster was lost: ")
    assert errors.count("\n") == 1
    done = len(journal.read_text().splitlines())
    assert 0 < done < 40
    again = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300, check=False)
    assert again.returncode == 0
    assert f"continuing: {done} of 40 runs are finished" in again.stderr


def is_running(process: psutil.Process) -> bool:
    """Whether a process of Ray executes a run."""
    try:
        return process.cmdline()[:1] != [] and process.cmdline()[0].startswith("ray::_run")
    except psutil.NoSuchProcess:
        return False


def test_a_cluster_on_this_machine_ends_with_the_sweep(work: Path) -> None:
    command = [sys.executable, str(HERE / "ray_run.py"), "ray", "out"]
    run = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300, check=False)
    assert (run.stdout, run.stderr, run.returncode) == ("." * RUNS, "", 0)
    assert (work / "out/results.parquet").read_bytes() == local_table(plan_of(), work / "here")


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("ray", LOCAL),
        ("ray://head:10001", "ray://head:10001"),
        ("head:6379", "head:6379"),
        ("auto", "auto"),
        ("[::1]:6379", "[::1]:6379"),
    ],
)
def test_places(text: str, address: str) -> None:
    assert parse_place(text) == address


@pytest.mark.parametrize("text", ["", "local", "head", "ray:", "http://head:6379", "a b:1"])
def test_other_places_are_refused(text: str) -> None:
    with pytest.raises(KbotError, match=r"is not the address of a cluster. Use ray for this machine"):
        parse_place(text)


def test_a_machine_with_another_version_is_refused(work: Path) -> None:
    task = Task(Scenario(name="s", duration=1.0, robot=RobotSource("r.xacro")))
    call = cluster._Call((task, 30.0), str(work), True, {"kbot": "0.0.1"})
    with pytest.raises(KbotError, match=r"has kbot .*, not 0.0.1, so that results could differ"):
        raise cluster._run(call).error or AssertionError


def test_paths_of_the_working_directory_are_those_of_the_machine() -> None:
    robot = RobotSource("/home/me/r.xacro", {"a": "1"}, packages=("/home/me/p",))
    task = Task(
        Scenario(name="s", duration=1.0, robot=robot),
        python_file="/home/me/s.py",
        keys={"world": "/home/me/w.sdf", "duration": 3.0},
    )
    moved = cluster._moved(task, "/home/me", "/tmp/x")
    assert moved.scenario.robot == RobotSource("/tmp/x/r.xacro", {"a": "1"}, packages=("/tmp/x/p",))
    assert (moved.python_file, moved.keys) == ("/tmp/x/s.py", {"world": "/tmp/x/w.sdf", "duration": 3.0})
    assert cluster._moved(moved, "/tmp/x", "/home/me") == task
    failed = TrialResult("s", 0, error="/tmp/x/r.xacro:3: wrong")
    assert cluster._moved(failed, "/tmp/x", "/home/me").error == "/home/me/r.xacro:3: wrong"


@pytest.mark.parametrize(
    ("text", "moved"),
    [
        ("/ws/my_robot", "/ray"),
        ("/ws/my_robot/r.xacro", "/ray/r.xacro"),
        ("/ws/my_robot_description/meshes", "/ws/my_robot_description/meshes"),
        ("/ws/my_robot 2/r.xacro", "/ws/my_robot 2/r.xacro"),
        ("/home/ws/my_robot/r.xacro", "/home/ws/my_robot/r.xacro"),
        ("/opt:/ws/my_robot:/usr", "/opt:/ray:/usr"),
        ("file:///ws/my_robot/a.stl", "file:///ray/a.stl"),
        ("found in '/ws/my_robot', not here", "found in '/ray', not here"),
    ],
)
def test_only_paths_in_the_working_directory_are_replaced(text: str, moved: str) -> None:
    assert cluster._moved(text, "/ws/my_robot", "/ray") == moved


def test_a_backslash_in_a_path_is_kept() -> None:
    assert cluster._moved("/ws/a.stl", "/ws", r"C:\new\1") == r"C:\new\1/a.stl"


@pytest.mark.filterwarnings("ignore")  # of the import of Ray
def test_the_root_folder_is_not_sent_to_a_cluster(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    with pytest.raises(KbotError, match=r"the working directory .* is the root"), RayCluster("head:6379"):
        pass


@pytest.mark.filterwarnings("ignore")  # of the import of Ray
def test_an_address_without_a_cluster_is_an_error() -> None:
    why = r"cannot use a Ray cluster at 127.0.0.1:9: .*refused"
    with pytest.raises(KbotError, match=why), RayCluster("127.0.0.1:9"):
        pass


def test_jobs_limit_the_runs_at_the_same_time_on_another_cluster(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cluster on this machine has as many processors as jobs, and takes runs in advance."""
    clusters = [RayCluster("ray://head:10001"), RayCluster("ray://head:10001", 3), RayCluster(LOCAL, 3)]
    for each, processors in zip(clusters, (8, 8, 3), strict=True):
        monkeypatch.setattr(each, "_processors", processors)
    assert [each.capacity for each in clusters] == [16, 3, 6]
