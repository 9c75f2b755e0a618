"""Programs of `kbot.Node` in trials: they run in step with simulated time."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest

import kbot
from kbot.extensions import ProgramFailed, program_runner
from kbot.record.run_outputs import RunOutputs
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.trials import Program, Scenario
from kbot.trials.trial import run_trial

HEAD = """\
import json, os, sys, time
import kbot
from kbot.messages import JointState, Odometry, String, Twist, TwistStamped, Vector3
from kbot.messages.sensing import LaserScan
"""
LINES = HEAD.count("\n")
"""Lines of each program before the test's own."""

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a program, with the usual imports, and return its path."""

    def to_file(text: str, name: str = "program.py") -> str:
        path = tmp_path / name
        path.write_text(HEAD + dedent(text).lstrip("\n"))
        return str(path)

    return to_file


@pytest.fixture(params=["local", "ros1", "ros2"])
def transport(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    if name == "ros2":
        pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    return name


@contextmanager
def running(*programs: Program, world: str = "empty") -> Iterator[Simulation]:
    """A simulation of KBot with a lidar, whose programs are ready."""
    simulation = Simulation(kbot.load("kbot", lidar=True), world)
    mount_declared(simulation, strict=False)
    reported: list[str] = []
    peers = program_runner().open_programs(programs, reported.append)
    outputs = RunOutputs(reported.append, peers=peers)
    try:
        outputs.join(simulation, "", world)
        yield simulation
        assert reported == []
    finally:
        outputs.close()


FOLLOWER = """
node = kbot.Node("follower")
seen = {"free": 1.0, "x": 0.0}
stamped = node.param("stamped", False)
node.subscribe("scan", LaserScan, lambda scan: seen.update(free=float(scan.ranges[0])))
node.subscribe("odom", Odometry, lambda odometry: seen.update(x=odometry.pose.pose.position.x))

def drive():
    twist = Twist(Vector3(min(0.3, 0.4 * seen["free"])), Vector3(0.0, 0.0, 0.5 - seen["x"]))
    node.publish("cmd_vel", TwistStamped(twist=twist) if stamped else twist)

node.every(1 / 30, drive)
node.spin()
"""


def test_reruns_are_equal_bit_for_bit(write: Write, transport: str) -> None:
    program = Program(write(FOLLOWER), transport=transport)
    states = set()
    for _ in range(5):
        with running(program, world="rooms") as simulation:
            simulation.run(1.0)
            states.add(simulation.state_sha256())
            assert simulation.odometry.pose.x > 0.1
    assert len(states) == 1


def test_all_transports_and_stamped_commands_give_the_same_run(write: Write) -> None:
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    file, states = write(FOLLOWER), set()
    for transport in ("local", "ros1", "ros2"):
        for arguments in ((), ("_stamped:=true",)) if transport != "ros1" else ((),):
            with running(Program(file, arguments, transport), world="rooms") as simulation:
                simulation.run(0.5)
                states.add(simulation.state_sha256())
    assert len(states) == 1


def test_commands_with_values_of_numpy_give_the_same_run(write: Write, transport: str) -> None:
    """0.25 and 0.5 are exact in all of numpy's types."""
    text = """
        import numpy as np
        node = kbot.Node("n")
        node.publish("cmd_vel", Twist(Vector3({speed}), Vector3(0.0, 0.0, {turn})))
        node.spin()
        """
    states = set()
    for speed, turn in (("0.25", "0.5"), ("np.float32(0.25)", "np.array(0.5)")):
        file = write(text.format(speed=speed, turn=turn))
        with running(Program(file, transport=transport)) as simulation:
            simulation.run(0.3)
            states.add(simulation.state_sha256())
            assert simulation.odometry.pose.x > 0.02
    assert len(states) == 1


def test_no_message_is_lost_and_callbacks_run_in_order(write: Write, transport: str, tmp_path: Path) -> None:
    """Odometry and joint states have 50 Hz, so 0.5 s have 25 of each. Time comes first, then the topic."""
    file = write(f"""
        node, seen = kbot.Node("n"), []
        add = lambda name, message: seen.append([name, message.header.stamp.nanoseconds, node.now])
        node.subscribe("joint_states", JointState, lambda message: add("j", message))
        node.subscribe("odom", Odometry, lambda message: add("o", message))
        node.spin(0.5)
        open({str(tmp_path / "seen.json")!r}, "w").write(json.dumps(seen))
        """)
    with running(Program(file, transport=transport)) as simulation:
        simulation.run(0.6)
    expected = [
        [topic, 20_000_000 * tick, 20_000_000 * tick / 1e9] for tick in range(1, 26) for topic in ("j", "o")
    ]
    assert json.loads((tmp_path / "seen.json").read_text()) == expected


def test_timers_run_at_the_first_tick_after_they_are_due(write: Write, tmp_path: Path) -> None:
    """At 30 Hz the call k is due at k 33.333333 ms, and ticks are at multiples of 20 ms."""
    file = write(f"""
        node, calls = kbot.Node("n"), []
        node.every(1 / 30, lambda: calls.append(node.now))
        node.spin(1.0)
        open({str(tmp_path / "calls.json")!r}, "w").write(json.dumps(calls))
        """)
    with running(Program(file)) as simulation:
        simulation.run(1.1)
    expected = [-(-k * 33_333_333 // 20_000_000) * 20_000_000 / 1e9 for k in range(1, 31)]
    assert json.loads((tmp_path / "calls.json").read_text()) == expected


def test_parameters_come_from_the_command_line_and_the_simulation(
    write: Write, transport: str, tmp_path: Path
) -> None:
    file = write(f"""
        node = kbot.Node("n")
        found = [node.param("speed", 0.1), node.param("side", "left"), node.param("/use_sim_time", False)]
        open({str(tmp_path / "found.json")!r}, "w").write(json.dumps([*found, *node.arguments]))
        node.spin()
        """)
    words = (
        ("--ros-args", "-p", "speed:=0.25", "--", "own") if transport == "ros2" else ("_speed:=0.25", "own")
    )
    with running(Program(file, words, transport)) as simulation:
        simulation.run(0.1)
    # a node of ROS 2 has only the parameters of its command line
    assert json.loads((tmp_path / "found.json").read_text()) == [0.25, "left", transport != "ros2", "own"]


def test_a_command_before_the_first_tick_is_not_lost(write: Write, transport: str) -> None:
    file = write("""
        node = kbot.Node("n")
        node.publish("cmd_vel", Twist(Vector3(0.2)))
        node.spin()
        """)
    with running(Program(file, transport=transport)) as simulation:
        assert simulation.robots.first.is_following
        simulation.run(0.3)
        assert simulation.odometry.pose.x > 0.02


def test_a_late_subscriber_receives_a_latched_message(write: Write, tmp_path: Path) -> None:
    file = write(f"""
        node, seen = kbot.Node("n"), []
        def look():
            timer.cancel()
            node.subscribe("robot_description", String, lambda m: seen.append([node.now, m.data[:5]]))
        timer = node.every(0.1, look)
        node.spin(0.4)
        open({str(tmp_path / "seen.json")!r}, "a").write(json.dumps(seen) + "\\n")
        """)
    for transport in ("local", "ros1"):
        with running(Program(file, transport=transport)) as simulation:
            simulation.run(0.5)
    assert (tmp_path / "seen.json").read_text().split("\n")[:2] == ['[[0.1, "<?xml"]]'] * 2


@pytest.mark.parametrize("transport", ["ros1", "ros2"])
@pytest.mark.parametrize("sender_is_first", [True, False])
def test_programs_take_turns_in_the_order_of_the_scenario(
    write: Write, transport: str, sender_is_first: bool, tmp_path: Path
) -> None:
    if transport == "ros2":
        pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    sender = write(
        """
        node = kbot.Node("sender")
        node.every(0.02, lambda: node.publish("note", String(f"{node.now:g}")))
        node.spin()
        """,
        "sender.py",
    )
    receiver = write(
        f"""
        node, seen = kbot.Node("receiver"), []
        node.subscribe("note", String, lambda note: seen.append([node.now, float(note.data)]))
        node.spin(0.2)
        open({str(tmp_path / "seen.json")!r}, "w").write(json.dumps(seen))
        """,
        "receiver.py",
    )
    files = (sender, receiver) if sender_is_first else (receiver, sender)
    with running(*(Program(file, transport=transport) for file in files)) as simulation:
        simulation.run(0.3)
    # the one that runs first receives a message in its next turn, and there at the time of its publication
    ticks = range(1, 11 if sender_is_first else 10)
    expected = [[tick * 20_000_000 / 1e9] * 2 for tick in ticks]
    assert json.loads((tmp_path / "seen.json").read_text()) == expected


@pytest.mark.parametrize("transport", ["ros1", "ros2"])
def test_topics_of_a_robot_that_is_spawned_later(write: Write, transport: str, tmp_path: Path) -> None:
    """The robot exists from 0.1 s on. Its topics are connected at the next tick, and odometry has 50 Hz."""
    if transport == "ros2":
        pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    file = write(f"""
        node, seen = kbot.Node("n"), []
        node.subscribe("/second/odom", Odometry, lambda m: seen.append(round(m.header.stamp.seconds, 3)))
        node.spin(0.25)
        open({str(tmp_path / "seen.json")!r}, "w").write(json.dumps(seen))
        """)
    with running(Program(file, transport=transport)) as simulation:
        simulation.run(0.1)
        simulation.models.spawn_model("kbot", "second", x=1.0)
        simulation.run(0.2)
    assert json.loads((tmp_path / "seen.json").read_text()) == [0.14, 0.16, 0.18, 0.2, 0.22, 0.24, 0.26]


def test_a_program_may_end_before_the_run(write: Write, transport: str) -> None:
    file = write("""
        node = kbot.Node("n")
        def stop(odometry):
            if odometry.pose.pose.position.x > 0.1:
                node.publish("cmd_vel", Twist())
                node.close()
        node.subscribe("odom", Odometry, stop)
        node.publish("cmd_vel", Twist(Vector3(0.3)))
        node.spin()
        """)
    with running(Program(file, transport=transport)) as simulation:
        simulation.run(2.0)
        # at 0.3 m/s it stops within a few ticks after 0.1 m
        assert 0.1 < simulation.odometry.pose.x < 0.2


FAILURES = {
    "raises": (
        """
        node, ticks = kbot.Node("n"), []
        def tick():
            ticks.append(1)
            if len(ticks) == 10:
                raise ValueError("no way")
        node.every(0.02, tick)
        node.spin()
        """,
        r"program\.py:{5}: program\.py exited with status 1 in the tick at 0\.200 s: ValueError: no way",
    ),
    "exits": (
        """
        node, ticks = kbot.Node("n"), []
        node.every(0.02, lambda: ticks.append(1) or len(ticks) < 10 or os._exit(3))
        node.spin()
        """,
        r"/program\.py exited with status 3 in the tick at 0\.200 s",
    ),
    "exits with a reason": (
        """
        node = kbot.Node("n")
        node.every(0.1, lambda: sys.exit("error: no wall found"))
        node.spin()
        """,
        r"/program\.py exited with status 1 in the tick at 0\.100 s: error: no wall found",
    ),
    "is killed": (
        """
        node = kbot.Node("n")
        node.every(0.1, lambda: os.kill(os.getpid(), 9))
        node.spin()
        """,
        r"/program\.py was ended by SIGKILL in the tick at 0\.100 s",
    ),
    "hangs": (
        """
        node = kbot.Node("n")
        def think():
            while True:
                time.sleep(0.01)
        node.every(0.1, think)
        node.spin()
        """,
        r"program\.py:{4}: program\.py did not answer the tick at 0\.100 s within 2 s",
    ),
    "never connects": ("time.sleep(600)", r"/program\.py did not connect with a kbot\.Node within 6 s"),
    "never spins": (
        """
        node = kbot.Node("n")
        time.sleep(600)
        """,
        r"program\.py:{2}: program\.py did not start, that is call spin or step, within 6 s",
    ),
    "ends at once": ("", r"/program\.py exited with status 0 before it connected"),
    "closes at once": ('kbot.Node("n").close()', r"/program\.py closed its node before the run began"),
    "unknown topic": (
        """
        node = kbot.Node("n")
        node.subscribe("odon", Odometry, print)
        """,
        r"program\.py:{2}: program\.py exited with status 1 before it was ready: "
        r"there is no topic /odon: did you mean '/odom'",
    ),
    "wrong type": (
        """
        node = kbot.Node("n")
        node.subscribe("odom", Twist, print)
        """,
        r"program\.py:{2}: .*/odom carries nav_msgs/msg/Odometry, not geometry_msgs/msg/Twist",
    ),
    "two nodes": (
        """
        first = kbot.Node("a")
        second = kbot.Node("b")
        """,
        r"program\.py:{2}: .*in a trial, a program can have one node only",
    ),
    "bad command": (
        """
        node = kbot.Node("n")
        node.publish("cmd_vel", Twist(Vector3(float("nan"))))
        node.spin()
        """,
        r"program\.py before it was ready: /cmd_vel: .*",
    ),
    "not Python": (
        "if",
        r"program\.py:{1}: program\.py exited with status 1 before it connected: SyntaxError: invalid syntax",
    ),
}


@pytest.mark.parametrize("failure", FAILURES)
def test_error_names_the_program_the_time_and_the_line(write: Write, failure: str) -> None:
    text, message = FAILURES[failure]
    message = re.sub(r"\{(\d+)\}", lambda found: str(LINES + int(found[1])), message)
    program = Program(write(text), time_limit=2.0)
    with pytest.raises(ProgramFailed, match=message) as caught, running(program) as simulation:
        simulation.run(1.0)
    assert "\n" not in str(caught.value)


def test_a_ros1_topic_needs_its_own_type(write: Write) -> None:
    program = Program(write(FOLLOWER), ("_stamped:=true",), "ros1")
    message = "/cmd_vel carries geometry_msgs/msg/Twist, not geometry_msgs/msg/TwistStamped"
    with pytest.raises(ProgramFailed, match=message), running(program, world="rooms") as simulation:
        simulation.run(1.0)


def test_two_nodes_of_one_name_are_refused(write: Write) -> None:
    programs = [Program(write('kbot.Node("n").spin()', name), transport="ros1") for name in ("a.py", "b.py")]
    with pytest.raises(ProgramFailed, match=r"a\.py has a node /n too"), running(*programs):
        pytest.fail("the second node is refused")


def test_a_trial_with_programs(write: Write, tmp_path: Path) -> None:
    """A recording does not change the run, and the failure of a program is the error of the trial."""
    scenario = Scenario("t", 0.5, world="rooms", programs=[Program(write(FOLLOWER))])
    robot = kbot.load("kbot", lidar=True)
    plain = run_trial(scenario, robot=robot)
    recorded = run_trial(scenario, robot=robot, record=str(tmp_path / "run.mcap"))
    assert plain.error == recorded.error == ""
    assert plain.state_sha256 == recorded.state_sha256
    assert plain.is_deterministic
    # without lockstep the program drives from the start of the process on, in real time
    loose = run_trial(
        replace(scenario, programs=[Program(scenario.programs[0].file, lockstep=False)]), robot=robot
    )
    assert (loose.error, loose.is_deterministic) == ("", False)
    failing = Program(write(FAILURES["raises"][0], "failing.py"))
    failed = run_trial(replace(scenario, programs=[failing]), robot=robot)
    assert failed.failed_at == 0.2
    assert failed.error.endswith("failing.py exited with status 1 in the tick at 0.200 s: ValueError: no way")


def test_errors_of_settings() -> None:
    with pytest.raises(KbotError, match=r"p\.py: unknown transport 'ros3': choose from local, ros1, ros2"):
        running(Program("p.py", transport="ros3")).__enter__()
    with pytest.raises(KbotError, match=r"p\.py: the time limit must be above 0 s, not 0"):
        running(Program("p.py", time_limit=0.0)).__enter__()
    with pytest.raises(ProgramFailed, match="/no/such cannot be started: No such file or directory"):
        running(Program("/no/such")).__enter__()


def test_a_program_without_lockstep_runs_in_real_time(write: Write) -> None:
    file = write("""
        node = kbot.Node("n")
        node.every(0.05, lambda: node.publish("cmd_vel", Twist(Vector3(0.2))))
        node.spin()
        """)
    with running(Program(file, lockstep=False)) as simulation:
        began = time.monotonic()
        simulation.run(1.0)
        # it never runs ahead of real time
        assert time.monotonic() - began > 0.9
        while simulation.odometry.pose.x < 0.02:
            simulation.run(0.1)
            assert time.monotonic() - began < 60.0


def test_a_node_in_lockstep_receives_messages_of_programs_that_are_not(write: Write, tmp_path: Path) -> None:
    talker = write(
        """
        node = kbot.Node("talker")
        node.every(0.05, lambda: node.publish("note", String("hello")))
        node.spin()
        """,
        "talker.py",
    )
    listener = write(
        f"""
        node = kbot.Node("listener")
        node.subscribe("note", String, lambda note: open({str(tmp_path / "seen")!r}, "w").write(note.data))
        node.spin()
        """,
        "listener.py",
    )
    programs = Program(talker, transport="ros1", lockstep=False), Program(listener, transport="ros1")
    with running(*programs) as simulation:
        end = time.monotonic() + 60.0
        while not (tmp_path / "seen").is_file():
            simulation.run(0.1)
            assert time.monotonic() < end
    assert (tmp_path / "seen").read_text() == "hello"


def test_programs_end_with_a_killed_simulation(write: Write, tmp_path: Path) -> None:
    """The program hangs in a loop while the process of the simulation is killed."""
    pid_file = tmp_path / "pid"
    file = write(f"""
        node = kbot.Node("n")
        def hang():
            open({str(pid_file)!r}, "w").write(str(os.getpid()))
            while True:
                pass
        node.every(0.02, hang)
        node.spin()
        """)
    code = (
        "from kbot.trials import Program, Scenario; from kbot.trials.trial import run_trial; import kbot\n"
        f"run_trial(Scenario('t', 1.0, programs=[Program({file!r})]), robot=kbot.load('kbot'))"
    )
    simulating = subprocess.Popen([sys.executable, "-c", code])
    try:
        wait_until(lambda: pid_file.is_file() and bool(pid_file.read_text()))
    finally:
        simulating.kill()
        simulating.wait()
    wait_until(lambda: not is_running(int(pid_file.read_text())))


def is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return "Z" not in Path(f"/proc/{pid}/stat").read_text().split()[2:3] if Path("/proc").is_dir() else True


def wait_until(met: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not met():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_each_process_has_its_own_ros_domain() -> None:
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    from kbot.ros.lockstep.endpoints import free_domain

    own = free_domain()
    code = "from kbot.ros.lockstep.endpoints import free_domain; print(free_domain(), free_domain())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    first, second = done.stdout.split()
    assert first == second
    assert int(first) != own == free_domain()
