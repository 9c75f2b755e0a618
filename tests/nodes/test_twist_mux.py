"""twist_mux and topic_tools/relay in a simulation. Expected values follow the source of twist_mux."""

import pytest

from kbot.messages import Odometry, Twist, TwistStamped, Vector3
from kbot.messages.sensing import Bool
from kbot.ros.nodes.relays import Relayed, relay_topics
from kbot.ros.nodes.twist_mux import MuxInput, MuxSettings, run_muxes
from kbot.sim import Simulation
from kbot.text import Origin, Source

ORIGIN = Origin(Source("a.launch", "<launch/>").whole())
OUT = "/drive"


class Mux:
    """A twist_mux from /keys, /cmd_vel and /goal, in rising priority, to the drive of the robot."""

    def __init__(self, sim: Simulation, lock_timeout: float = 0.0) -> None:
        self.sim = sim
        self.sim.bus.subscribe(OUT, Twist, lambda message: self.passed.append(message.linear.x))
        inputs = ((0.5, "/keys", 1.0), (0.5, "/cmd_vel", 2.0), (0.0, "/goal", 3.0))
        commands = tuple(MuxInput(topic, timeout, priority) for timeout, topic, priority in inputs)
        locks = (MuxInput("/stop", lock_timeout, 3.0), MuxInput("/all", 0.0, 255.0))
        self.passed: list[float] = []
        assert run_muxes(sim.bus, sim.clock, (MuxSettings(commands, locks, OUT, None, ORIGIN),)) == []

    def send(self, topic: str, speed: float) -> list[float]:
        self.passed.clear()
        self.sim.bus.publish(topic, Twist(Vector3(speed)))
        return list(self.passed)


@pytest.fixture
def sim() -> Simulation:
    return Simulation("kbot")


def test_higher_priority_hides_lower_until_its_timeout(sim: Simulation) -> None:
    mux = Mux(sim)
    assert mux.send("/keys", 0.1) == [0.1]
    assert mux.send("/cmd_vel", 0.2) == [0.2]
    sim.run(0.4)
    assert mux.send("/keys", 0.1) == []
    sim.run(0.2)
    assert mux.send("/keys", 0.1) == [0.1]
    assert mux.send("/goal", 0.3) == [0.3]
    sim.run(5.0)
    assert mux.send("/cmd_vel", 0.2) == []


def test_lock_stops_lower_priorities(sim: Simulation) -> None:
    mux = Mux(sim)
    sim.bus.publish("/stop", Bool(data=True))
    assert (mux.send("/cmd_vel", 0.2), mux.send("/goal", 0.3)) == ([], [0.3])
    sim.bus.publish("/all", Bool(data=True))
    assert mux.send("/goal", 0.3) == []
    sim.bus.publish("/all", Bool())
    assert mux.send("/goal", 0.3) == [0.3]


def test_lock_that_is_not_published_is_closed(sim: Simulation) -> None:
    mux = Mux(sim, lock_timeout=0.5)
    assert mux.send("/cmd_vel", 0.2) == []
    sim.bus.publish("/stop", Bool())
    assert mux.send("/cmd_vel", 0.2) == [0.2]


def test_robot_receives_a_command_only_through_the_mux(sim: Simulation) -> None:
    Mux(sim).send("/cmd_vel", 0.2)
    sim.run(1.0)
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=1e-6)


def test_command_is_converted_to_the_type_of_the_output(sim: Simulation) -> None:
    received: list[TwistStamped] = []
    sim.bus.subscribe(OUT, TwistStamped, received.append)
    settings = MuxSettings((MuxInput("/keys", 0.5, 1.0),), (), OUT, False, ORIGIN)
    assert run_muxes(sim.bus, sim.clock, (settings,)) == []
    sim.bus.publish("/keys", Twist(Vector3(0.1)))
    assert received == [TwistStamped(twist=Twist(Vector3(0.1)))]


def test_mux_without_a_robot_is_reported(sim: Simulation) -> None:
    (note,) = run_muxes(sim.bus, sim.clock, (MuxSettings((), (), "/cmd_vel_out", None, ORIGIN),))
    assert (note.code, "no robot subscribes to /cmd_vel_out" in note.message) == ("L063", True)


@pytest.mark.parametrize(
    ("command", "lock", "reason"),
    [
        ("/cmd_vel", "/odom", "topic /odom carries Odometry, not Bool"),
        ("/odom", "/stop", "topic /odom carries Odometry, not Twist"),
        ("/drive", "/stop", "/drive is both an input and the output"),
    ],
)
def test_mux_that_is_not_run_leaves_the_robots_commands(
    sim: Simulation, command: str, lock: str, reason: str
) -> None:
    sim.bus.subscribe(OUT, Twist, lambda _: None)
    commands, locks = (MuxInput(command, 0.5, 1.0),), (MuxInput(lock, 0.0, 1.0),)
    (note,) = run_muxes(sim.bus, sim.clock, (MuxSettings(commands, locks, OUT, None, ORIGIN),))
    assert (note.message, note.hint) == (f"the twist_mux is not run: {reason}", "")
    sim.bus.publish("/cmd_vel", Twist(Vector3(0.2)))
    sim.run(0.4)
    assert sim.odometry.twist.x == pytest.approx(0.2, abs=0.02)


def test_relay_republishes_odometry_and_passes_commands_on(sim: Simulation) -> None:
    rules = (Relayed("/odom", "/base/odom", ORIGIN), Relayed("/base/drive", "/cmd_vel", ORIGIN))
    assert relay_topics(sim, rules) == []
    received: list[Odometry] = []
    sim.bus.subscribe("/base/odom", Odometry, received.append)
    sim.bus.publish("/base/drive", Twist(Vector3(0.2)))
    sim.run(0.4)
    assert received[-1].twist.twist.linear.x == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize(
    ("source", "target", "reason"),
    [
        ("/none", "/other", "the simulation does not publish /none"),
        ("/cmd_vel", "/other", "the simulation does not publish /cmd_vel"),
        ("/odom", "/cmd_vel", "topic /odom carries Odometry, not Twist"),
        ("/cmd_vel", "/cmd_vel", "the source is the same topic"),
    ],
)
def test_relay_that_passes_nothing_on_is_reported(
    sim: Simulation, source: str, target: str, reason: str
) -> None:
    (note,) = relay_topics(sim, (Relayed(source, target, ORIGIN),))
    assert (note.code, note.message) == ("L063", f"nothing is relayed to {target}: {reason}")
