"""Tests `kbot launch` with a robot: where it starts, what runs, what is recorded, how it ends."""

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from kbot.cli.ros.launch.command import LaunchTerminal
from kbot.kinematics.transform import Transform
from kbot.messages import TFMessage, Twist, Vector3
from kbot.messages.navigation import OccupancyGrid
from kbot.model.load import load_robot
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.record.record_options import RecordOptions
from kbot.record.replay import replay
from kbot.record.run_outputs import RunOutputs
from kbot.ros.launch import Plan, read_launch
from kbot.ros.launch.running.programs import start_programs
from kbot.ros.launch.running.robot_run import RobotRun
from kbot.ros.launch.running.world import choose_world
from kbot.ros.launch.staging import stage
from kbot.ros.peer_options import PeerOptions
from kbot.sim import Simulation
from kbot.templates import Sizes, make_package
from kbot.text import Diagnostic, Severity
from kbot.workbench.session.session import Session
from kbot.xacro import Packages

ROBOT = '<param name="robot_description" command="xacro $(find my_robot)/urdf/my_robot.xacro"/>'
GAZEBO = '<include file="$(find gazebo_ros)/launch/empty_world.launch">{}</include>'
SPAWN = (
    '<node pkg="gazebo_ros" type="spawn_model" name="s" args="-urdf -param robot_description -model r {}"/>'
)

EMPTY = choose_world(None, "empty", print)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("KBOT_TRANSPORT", raising=False)
    make_package(tmp_path / "my_robot", "my_robot", Sizes())
    return tmp_path / "my_robot"


def planned(package: Path, body: str) -> Plan:
    file = package / "launch" / "a.launch"
    file.write_text(f"<launch>{ROBOT}\n{body}\n</launch>\n")
    return read_launch(str(file), packages=Packages(around=str(file))).require()


def run_of(package: Path, body: str) -> RobotRun:
    plan = planned(package, body)
    return RobotRun(plan, stage(plan), LaunchTerminal())


def launched(package: Path, body: str, *options: str) -> subprocess.CompletedProcess[str]:
    """A launch that ends without Ctrl-C."""
    planned(package, body)
    return subprocess.run(
        [sys.executable, "-m", "kbot", "launch", "launch/a.launch", "--no-browser", "--port", "0", *options],
        cwd=package,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:11397/"},
    )


def program(package: Path, name: str, text: str) -> str:
    (package / "scripts").mkdir(exist_ok=True)
    (package / "scripts" / name).write_text(text)
    return f'<node pkg="my_robot" type="{name}" name="{name.partition(".")[0]}" {{}}/>'


def simulated(package: Path, body: str) -> Session:
    run = run_of(package, body)
    return run.session(RunOutputs(print, transforms=run.stand_ins.settings.transforms), EMPTY)


def test_the_robot_starts_at_the_spawn_pose_also_after_a_reset(package: Path) -> None:
    session = simulated(package, GAZEBO.format("") + SPAWN.format("-x 1 -y -2 -Y 1.5"))
    motion = session._motion
    for _ in range(2):
        pose = motion._sim.ground_truth.pose
        assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, -2.0, 1.5))
        motion.drive(0.3, 0.0)
        motion._sim.run(1.0)
        motion.reset()


def test_height_and_attitude_are_those_of_the_spawner(package: Path) -> None:
    session = simulated(package, GAZEBO.format("") + SPAWN.format("-z 0.5 -R 0.1 -P -0.2 -Y 0.7"))
    pose = session._motion._sim.link_pose("base_footprint")
    assert float(pose.translation[2]) == pytest.approx(0.5)
    assert pose.rpy == pytest.approx((0.1, -0.2, 0.7))


def test_arm_that_is_fixed_to_the_world_is_at_the_height_of_its_spawner(package: Path) -> None:
    (package / "urdf" / "my_robot.xacro").write_text(
        """<robot name="arm"><link name="world"/><link name="arm"/><joint name="mount" type="fixed">
        <parent link="world"/><child link="arm"/><origin xyz="0 0 0.1" rpy="0 0 0.3"/></joint></robot>"""
    )
    session = simulated(package, GAZEBO.format("") + SPAWN.format("-x 1 -z 0.5 -R 0.1 -Y 0.4"))
    pose = session._motion._sim.link_pose("arm")
    world_from_spawn = Transform.from_xyz_rpy((1.0, 0.0, 0.5), (0.1, 0.0, 0.4))
    assert pose.is_close(world_from_spawn @ Transform.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, 0.0, 0.3)))


def test_findings_of_the_launch_file_and_failed_nodes_are_for_the_page(package: Path) -> None:
    node = program(package, "bad.py", "import kbot\nraise SystemExit(3)\n").format('output="screen"')
    plan = planned(package, GAZEBO.format("") + SPAWN.format("") + "\n" + node)
    warning = Diagnostic("L063", Severity.WARNING, "done in part", plan.nodes[0].origin)
    run = RobotRun(plan, stage(plan, Packages(around=plan.path)), LaunchTerminal(), (), [warning])
    session = run.session(RunOutputs(print), EMPTY)
    assert [*session.findings().findings][-1].code == "L063"
    with ExitStack() as stack:
        local = PeerOptions()
        start_programs(stack, plan, run._stage.programs, local, print, session.extra_findings.append)
        end = time.monotonic() + 60.0
        while len(session.extra_findings) < 2:
            assert time.monotonic() < end, "no failure"
            time.sleep(0.02)
    failed = session.findings().findings[-1]
    assert (failed.code, failed.message) == ("L090", "/bad exited with status 3")
    assert failed.place is not None
    assert failed.place.line == plan.nodes[-1].origin.span.line


def test_a_paused_gazebo_is_a_paused_simulation(package: Path) -> None:
    paused = GAZEBO.format('<arg name="paused" value="true"/>')
    assert simulated(package, paused + SPAWN.format("")).paused
    assert not simulated(package, paused + SPAWN.format("-unpause")).paused


def test_static_transforms_are_published_with_the_robot_s_own(package: Path) -> None:
    node = (
        '<node pkg="tf2_ros" type="static_transform_publisher" name="t" args="1 2 3 0 0 0 base_link camera"/>'
    )
    session = simulated(package, GAZEBO.format("") + SPAWN.format("") + node)
    received: list[TFMessage] = []
    session._motion.bus.subscribe("/tf_static", TFMessage, received.append)
    frames = {t.child_frame_id: t for t in received[-1].transforms}
    assert {"camera", "base_link", "caster"} <= set(frames)
    place = frames["camera"].transform.translation
    assert (frames["camera"].header.frame_id, place.x, place.y, place.z) == ("base_link", 1.0, 2.0, 3.0)


def test_the_map_server_s_map_is_on_its_topic(package: Path) -> None:
    (package / "m.pgm").write_bytes(b"P5\n3 2\n255\n" + bytes([254, 254, 0, 254, 254, 254]))
    (package / "m.yaml").write_text(
        "image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    node = f'<node pkg="map_server" type="map_server" name="m" args="{package}/m.yaml"/>'
    session = simulated(package, GAZEBO.format("") + SPAWN.format("") + node)
    received: list[OccupancyGrid] = []
    session._motion.bus.subscribe("/map", OccupancyGrid, received.append)
    # the top row of the picture is the last row of the map
    assert list(received[-1].data) == [0, 0, 0, 0, 0, 100]


def test_the_keys_of_the_terminal_drive(package: Path) -> None:
    keys = '<node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="keys"/>'
    run = run_of(package, GAZEBO.format("") + SPAWN.format("") + keys)
    sim = run.session(RunOutputs(print), EMPTY)._motion._sim
    teleop = run.stand_ins.teleop
    assert teleop is not None
    teleop.press("i")
    sim.run(3.0)
    # 0.5 m/s, the initial speed of the node
    assert sim.odometry.twist.x == pytest.approx(0.5, abs=0.02)
    teleop.press("k")
    sim.run(2.0)
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=0.01)


def test_joint_state_publisher_s_parameters_reach_the_sliders(package: Path) -> None:
    node = """<node pkg="joint_state_publisher" type="joint_state_publisher" name="j"><rosparam>
      {zeros: {left_wheel_joint: 1.5}, dependent_joints: {right_wheel_joint: {parent: left_wheel_joint,
      factor: -2.0, offset: 0.5}}}</rosparam></node>"""
    session = run_of(package, node).session(RunOutputs(print), None)
    assert session._motion.moment().positions == {"left_wheel_joint": 1.5, "right_wheel_joint": -2.5}
    assert [joint.name for joint in session._motion.robot.movable_joints if joint.mimic] == [
        "right_wheel_joint"
    ]


def test_a_program_drives_the_robot_and_ends_the_launch_and_the_run_is_recorded(package: Path) -> None:
    node = program(
        package,
        "drive.py",
        "import kbot\nfrom kbot.messages import Odometry, Twist, Vector3\n"
        "node = kbot.Node('drive')\nspeed = node.param('speed', 0.1)\n"
        "node.subscribe('odom', Odometry, lambda m: m.pose.pose.position.x > 0.3 and node.close())\n"
        "node.every(0.1, lambda: node.publish('cmd_vel', Twist(Vector3(speed))))\nnode.spin(60)\n"
        "print('arrived at', speed)\n",
    )
    body = node.replace("/>", '><param name="speed" value="0.4"/></node>').format(
        'required="true" output="screen"'
    )
    done = launched(package, GAZEBO.format("") + SPAWN.format("-x 2") + body, "--record", "run.mcap")
    assert done.returncode == 0, done.stderr
    assert "arrived at 0.4" in done.stdout
    assert "/drive is required and exited with status 0: the launch ends" in done.stderr
    again = replay(str(package / "run.mcap"))
    assert again.is_same
    # 0.3 m from the spawn pose, and further until the last command times out
    assert 2.3 <= again.simulation.ground_truth.pose.x <= 2.3 + 0.4 * 0.8


def test_a_required_program_that_fails_is_the_launch_s_failure(package: Path) -> None:
    node = program(package, "fail.py", "raise SystemExit(3)\n").format('required="true"')
    done = launched(package, GAZEBO.format("") + SPAWN.format("") + node)
    assert done.returncode == 1
    assert "/fail is required and exited with status 3: the launch ends" in done.stderr


def test_rosbag_record_records(package: Path) -> None:
    node = program(
        package,
        "wait.py",
        "import kbot\nfrom kbot.messages import Odometry\nnode = kbot.Node('wait')\nreceived = []\n"
        "def on_message(m):\n"
        "    received.append(m)\n"
        "    if len(received) > 5: node.close()\n"
        "node.subscribe('odom', Odometry, on_message)\nnode.spin(60)\n",
    ).format('required="true"')
    bag = '<node pkg="rosbag" type="record" name="r" args="-O run odom"/>'
    done = launched(package, GAZEBO.format("") + SPAWN.format("") + node + bag)
    assert done.returncode == 0, done.stderr
    topics = Recording(str(package / "run.bag")).summary().topics
    assert topics["/odom"].count > 0
    assert "/joint_states" not in topics


def test_rosparam_dump_writes_what_the_launch_sets(package: Path) -> None:
    node = program(package, "wait.py", "").format('required="true"')
    dump = '<rosparam>{a: {b: 1, c: [2, x]}}</rosparam><rosparam command="dump" file="out.yaml" ns="a"/>'
    assert launched(package, GAZEBO.format("") + SPAWN.format("") + node + dump).returncode == 0
    assert (package / "out.yaml").read_text() == "b: 1\nc:\n- 2\n- x\n"


def test_the_program_of_a_shown_robot_moves_its_joints(package: Path) -> None:
    """A source of joint states over ROS 1, like those in joint_state_publisher's source_list."""
    node = program(
        package,
        "turn.py",
        "import json, kbot\nfrom kbot.messages import JointState\n"
        "node = kbot.Node('turn')\n"
        "turned = JointState(name=('left_wheel_joint',), position=(1.25,))\n"
        "node.every(0.05, lambda: node.publish('turned', turned))\n"
        "def on_message(m):\n"
        "    at = dict(zip(m.name, m.position))\n"
        "    if at['left_wheel_joint'] == 1.25:\n"
        "        print(json.dumps(at)); node.close()\n"
        "node.subscribe('joint_states', JointState, on_message)\nnode.spin(60)\n",
    ).format('required="true" output="screen"')
    jsp = (
        '<node pkg="joint_state_publisher" type="joint_state_publisher" name="j">'
        "<rosparam>{source_list: [turned]}</rosparam></node>"
    )
    done = launched(package, jsp + node)
    assert done.returncode == 0, done.stderr
    output = next(line for line in done.stdout.splitlines() if line.startswith("{"))
    assert json.loads(output) == {"left_wheel_joint": 1.25, "right_wheel_joint": 0.0}


def test_a_shown_robot_is_not_recorded_which_is_reported(package: Path) -> None:
    done = launched(package, "", "--record", "run.mcap")
    assert done.returncode == 2
    assert "--record needs a launch file that simulates a robot" in done.stderr
    assert not (package / "run.mcap").exists()


def test_programs_run_without_a_robot_until_all_have_ended(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KBOT_TRANSPORT", "local")
    node = program(
        package,
        "say.py",
        "import sys\nfrom kbot.ros.client.arguments import read_arguments\n"
        "a = read_arguments('n', sys.argv[1:], {})\nprint(a.full_name, a.parameters, a.rest)\n",
    )
    body = node.replace("/>", '><param name="speed" value="0.4"/></node>').format('args="on" output="screen"')
    (package / "launch" / "own.launch").write_text(f"<launch>{body}</launch>")
    done = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", "launch/own.launch"],
        cwd=package,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "/say exited\n")
    assert "/say {'speed': 0.4} ('on',)" in done.stdout


@pytest.mark.parametrize("text", ["", "so it was"])
def test_only_logs_with_content_are_kept_after_a_launch(
    package: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    scratch = package.parent / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("KBOT_TRANSPORT", "local")
    monkeypatch.setenv("TMPDIR", str(scratch))
    node = program(package, "say.py", f"print({text!r}, end='')").format('output="log"')
    (package / "launch" / "own.launch").write_text(f"<launch>{node}</launch>")
    done = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", "launch/own.launch"],
        cwd=package,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert [log.read_text() for log in scratch.rglob("*.log")] == ([text] if text else [])
    assert bool(list(scratch.glob("kbot-*/launch-*"))) == bool(text)


def test_two_robots_drive_by_separate_topics_also_in_a_replay(package: Path, tmp_path: Path) -> None:
    robots = "".join(
        f'<group ns="{name}">{SPAWN.replace("-param robot", "-param /robot").replace(" r ", f" {name} ")}'
        f"</group>".format(place)
        for name, place in (("a", "-y 1"), ("b", "-x -1 -y -1 -z 0.2 -Y 1.5"))
    )
    run = run_of(package, GAZEBO.format("") + robots)
    file = tmp_path / "run.mcap"
    outputs = RunOutputs(print, RecordOptions(str(file)))
    sim = run.session(outputs, EMPTY)._motion._sim
    assert list(sim.robots) == ["a", "b"]
    assert sim.robots["b"].body.link_pose("base_footprint").translation[2] == pytest.approx(0.2)
    for _ in range(10):
        sim.bus.publish("/b/cmd_vel", Twist(Vector3(0.3), Vector3()))
        sim.run(0.2)
    first, second = (sim.robots[name].ground_truth.pose for name in "ab")
    assert (first.x, first.y) == pytest.approx((0.0, 1.0), abs=1e-3)
    # straight ahead for 2 s at 0.3 m/s, minus the time to fall and to accelerate
    assert -0.65 < second.y < -0.4
    assert second.x == pytest.approx(-1.0, abs=0.1)
    outputs.close()
    again = replay(str(file))
    assert again.is_same
    assert again.same_state
    assert {"/a/odom", "/b/odom", "/b/joint_states"} <= set(Recording(str(file)).summary().topics)


def test_overlapping_robots_are_reported_with_the_line(package: Path) -> None:
    robots = (
        SPAWN.format("-robot_namespace a")
        + "\n"
        + SPAWN.replace('"s"', '"t"').replace(" r ", " q ").format("-x 0.05")
    )
    done = launched(package, GAZEBO.format("") + robots)
    assert done.returncode == 2
    assert "a.launch:3:1: 'q' cannot be placed there: it would overlap 'r" in done.stderr


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the command 0.3 m/s, ten times a second for two seconds."""
    path = tmp_path_factory.mktemp("driven") / "drive.bag"
    sim = Simulation("kbot")
    sim.bus.advertise("/cmd_vel", Twist)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path)):
        for _ in range(20):
            sim.bus.publish("/cmd_vel", Twist(Vector3(0.3), Vector3()))
            sim.run(0.1)
    return path


def play(bag: Path, words: str = "", more: str = "") -> str:
    return f'<node pkg="rosbag" type="play" name="p" args="{bag} {words}" {more}/>'


def test_a_recording_that_the_launch_plays_drives_the_robot(package: Path, driven: Path) -> None:
    session = simulated(package, GAZEBO.format("") + SPAWN.format("") + play(driven))
    sim = session._motion._sim
    sim.run(1.9)
    assert sim.odometry.twist.x == pytest.approx(0.3, abs=0.01)
    sim.run(2.0)
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=0.01)
    assert 0.4 < sim.ground_truth.pose.x < 0.8


def test_joint_states_of_a_recording_move_a_shown_robot(package: Path, tmp_path: Path) -> None:
    bag = tmp_path / "joints.mcap"
    sim = Simulation(load_robot(str(package / "urdf" / "my_robot.xacro")).require())
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(bag)):
        sim.cmd_vel(0.2, 0.0)
        sim.run(2.0)
    session = run_of(package, play(bag)).session(RunOutputs(print), None)
    session.advance(2.5)
    shown, end = session._motion.moment().positions, sim.joint_positions
    assert end["left_wheel_joint"] > 1.0
    assert shown["left_wheel_joint"] == pytest.approx(end["left_wheel_joint"], abs=0.1)


def test_a_launch_with_only_a_recording_ends_with_it(package: Path, driven: Path) -> None:
    file = package / "launch" / "a.launch"
    file.write_text(f"<launch>{play(driven, '-r 4')}</launch>")
    done = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", str(file)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "KBot's recording player" in done.stdout
