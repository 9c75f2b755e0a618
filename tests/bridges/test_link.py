"""PeerLink: messages between the simulation's thread and the threads of bridges."""

import math
import threading

import pytest

import kbot
from kbot.messages import types as msg
from kbot.messages.navigation import PoseStamped
from kbot.record.feed import Feed, Packet
from kbot.ros.bridges.link import BUSY_SECONDS, MOST_CALLS, WAITING, PeerLink
from kbot.ros.bridges.service import Answer, Service
from kbot.ros.service_types import service_type
from kbot.sim import Simulation
from kbot.text import KbotError


def linked() -> tuple[Simulation, PeerLink, list[str]]:
    """A simulation, its link, and what the link has reported to the user."""
    sim, reported = Simulation(kbot.load("kbot")), list[str]()
    link = PeerLink(reported.append)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    return sim, link, reported


def test_topics_have_a_type_and_a_direction() -> None:
    _, link, _ = linked()
    assert {name: (t.type_name, t.is_input) for name, t in link.topics.items()} == {
        "/clock": ("rosgraph_msgs/msg/Clock", False),
        "/joint_states": ("sensor_msgs/msg/JointState", False),
        "/odom": ("nav_msgs/msg/Odometry", False),
        "/tf": ("tf2_msgs/msg/TFMessage", False),
        "/cmd_vel": ("geometry_msgs/msg/Twist", True),
    }


def test_a_command_takes_effect_within_one_control_period() -> None:
    sim, link, _ = linked()
    sim.step(5)
    link.send("/cmd_vel", msg.Twist(msg.Vector3(0.3)))
    sim.run(0.02)
    assert sim.robots.first.twist.x > 0.0
    link.send("/cmd_vel", msg.TwistStamped(msg.Header(), msg.Twist(msg.Vector3(-0.3))))
    sim.run(0.5)
    assert sim.robots.first.twist.x < 0.0


def test_the_newest_messages_are_delivered_if_there_are_too_many() -> None:
    sim, link, _ = linked()
    received: list[float] = []
    sim.bus.subscribe("/cmd_vel", msg.Twist, lambda m: received.append(m.linear.x))
    for number in range(10_000):
        link.send("/cmd_vel", msg.Twist(msg.Vector3(float(number))))
    sim.run(0.02)
    assert received == [float(n) for n in range(10_000 - WAITING, 10_000)]


def test_each_sender_gets_one_result_per_message() -> None:
    sim, link, _ = linked()
    results: dict[int, list[str]] = {number: [] for number in range(WAITING + 3)}
    for number, result in results.items():
        speed = math.inf if number == WAITING else 0.1
        link.send("/cmd_vel", msg.Twist(msg.Vector3(speed)), result.append)
    assert [number for number, result in results.items() if result] == [0, 1, 2]
    sim.run(0.02)
    refused = results.pop(WAITING)
    assert len(refused) == 1
    assert "finite" in refused[0]
    assert set(map(tuple, results.values())) == {("",)}


def test_invalid_messages_are_reported_once_and_dropped() -> None:
    sim, link, reported = linked()
    for _ in range(5):
        link.send("/cmd_vel", msg.Twist(msg.Vector3(math.nan)))
        link.send("/cmd_vel", msg.String("not a twist"))
        link.send("/odom", msg.Odometry())
        link.send("/nothing", msg.String())
        sim.run(0.02)
    assert len(reported) == 2
    assert "finite" in reported[0]
    assert "carries Twist, not String" in reported[1]
    assert "/nothing" not in sim.bus.topics


def test_receivers_continue_with_the_next_simulation() -> None:
    sim, link, _ = linked()
    found: list[Packet] = []
    link.open("/odom", found.append)
    sim.run(0.04)
    assert found
    other = Simulation(kbot.load("kbot"))
    link.attach(other, Feed(other.bus, lambda: other.clock.nanoseconds))
    found.clear()
    sim.run(0.1)
    assert not found
    other.run(0.1)
    assert len(found) == 5
    link.close("/odom", found.append)
    other.run(0.02)
    found.clear()
    other.run(0.1)
    assert not found


def test_serve_does_nothing_without_a_simulation() -> None:
    PeerLink(print).serve()


def test_hidden_topics_are_not_visible_to_peers() -> None:
    sim, reported = Simulation(kbot.load("kbot")), list[str]()
    goals: list[PoseStamped] = []
    sim.bus.subscribe("goal_pose", PoseStamped, goals.append)
    link, received = PeerLink(reported.append, frozenset({"/goal_pose", "/odom"})), list[Packet]()
    link.open("/odom", received.append)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    link.send("/goal_pose", PoseStamped())
    sim.run(0.1)
    assert {"/tf", "/cmd_vel"} <= link.topics.keys()
    assert not link.topics.keys() & {"/goal_pose", "/odom"}
    assert (goals, received) == ([], [])


def test_a_receiver_is_woken_once_per_time_step() -> None:
    sim, link, _ = linked()
    events: list[str] = []

    def wake() -> None:
        events.append("woken")

    def receive(packet: Packet) -> None:
        events.append(packet.topic)
        link.schedule(wake)

    for topic in ("/odom", "/tf", "/joint_states"):
        link.open(topic, receive)
    sim.run(0.02)
    events.clear()
    sim.run(0.02)
    assert sorted(events[:3]) == ["/joint_states", "/odom", "/tf"]
    assert events[3:] == ["woken"]


def test_receivers_are_woken_while_paused_and_without_batches() -> None:
    sim, link, _ = linked()
    woken: list[int] = []
    sim.paused = True
    link.schedule(lambda: woken.append(1))
    assert woken == []
    sim.run_errands()
    assert woken == [1]
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), batches=False)
    link.schedule(lambda: woken.append(2))
    assert woken == [1, 2]


def test_a_call_that_is_prepared_delays_no_other_call() -> None:
    sim, link, _ = linked()
    may_end = threading.Event()

    def read(request: str) -> str:
        may_end.wait(60)
        return f"{request}, read"

    def fail(request: str) -> str:
        raise ValueError("a bug")

    kind = service_type("std_srvs/Empty")
    echo: Answer = lambda simulation, request: request  # noqa: E731
    prepared = {"/slow": read, "/quick": None, "/faulty": fail}
    link.offer({name: Service(name, kind, echo, prepare) for name, prepare in prepared.items()})
    slow, faulty, quick = (link.call(name, "model") for name in ("/slow", "/faulty", "/quick"))
    sim.run_errands()
    assert quick.result(0) == "model"
    assert not slow.done()
    with pytest.raises(KbotError, match="KBot could not process this: ValueError: a bug"):
        faulty.result(60)
    may_end.set()
    while not slow.done():
        sim.run_errands()
    assert slow.result(0) == "model, read"


def test_calls_that_are_prepared_count_as_waiting() -> None:
    _, link, _ = linked()
    may_end = threading.Event()
    service = Service(
        "/slow", service_type("std_srvs/Empty"), lambda sim, request: None, lambda request: may_end.wait(60)
    )
    link.offer({"/slow": service})
    for _ in range(MOST_CALLS):
        link.call("/slow", None)
    with pytest.raises(KbotError, match="calls are already waiting"):
        link.call("/slow", None)
    may_end.set()


def test_slow_calls_do_not_stop_the_simulation() -> None:
    """A peer can call a slow service many times: the server answers pages and Ctrl-C between the calls."""
    sim, link, _ = linked()
    answered = threading.Event()

    def slow(simulation: Simulation, request: object) -> None:
        answered.wait(2 * BUSY_SECONDS)

    link.offer({"/slow": Service("/slow", service_type("std_srvs/Empty"), slow)})
    calls = [link.call("/slow", None) for _ in range(3)]
    for count in (1, 2, 3):
        assert sim.run_errands()
        assert sum(call.done() for call in calls) == count
    assert not sim.run_errands()
