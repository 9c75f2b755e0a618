"""Between the threads: what peers say is delivered by the simulation, what it says is handed out."""

import math

import kbot
from kbot.messages import types as msg
from kbot.messages.navigation import PoseStamped
from kbot.record.feed import Feed, Packet
from kbot.ros.bridges.link import WAITING, PeerLink
from kbot.sim import Simulation


def linked() -> tuple[Simulation, PeerLink, list[str]]:
    sim, told = Simulation(kbot.load("kbot")), list[str]()
    link = PeerLink(told.append)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    return sim, link, told


def test_topics_are_told_with_type_and_direction() -> None:
    _, link, _ = linked()
    assert {name: (t.type_name, t.is_input) for name, t in link.topics.items()} == {
        "/clock": ("rosgraph_msgs/msg/Clock", False),
        "/joint_states": ("sensor_msgs/msg/JointState", False),
        "/odom": ("nav_msgs/msg/Odometry", False),
        "/tf": ("tf2_msgs/msg/TFMessage", False),
        "/cmd_vel": ("geometry_msgs/msg/Twist", True),
    }


def test_a_command_is_obeyed_within_one_control_period() -> None:
    sim, link, _ = linked()
    sim.step(5)
    link.send("/cmd_vel", msg.Twist(msg.Vector3(0.3)))
    sim.run(0.02)
    assert sim.robots.first.twist.x > 0.0
    link.send("/cmd_vel", msg.TwistStamped(msg.Header(), msg.Twist(msg.Vector3(-0.3))))
    sim.run(0.5)
    assert sim.robots.first.twist.x < 0.0


def test_of_a_flood_the_newest_are_delivered() -> None:
    sim, link, _ = linked()
    heard: list[float] = []
    sim.bus.subscribe("/cmd_vel", msg.Twist, lambda m: heard.append(m.linear.x))
    for number in range(10_000):
        link.send("/cmd_vel", msg.Twist(msg.Vector3(float(number))))
    sim.run(0.02)
    assert heard == [float(n) for n in range(10_000 - WAITING, 10_000)]


def test_each_sender_is_told_once_what_became_of_a_message() -> None:
    sim, link, _ = linked()
    told: dict[int, list[str]] = {number: [] for number in range(WAITING + 3)}
    for number, answers in told.items():
        speed = math.inf if number == WAITING else 0.1
        link.send("/cmd_vel", msg.Twist(msg.Vector3(speed)), answers.append)
    assert [number for number, answers in told.items() if answers] == [0, 1, 2]
    sim.run(0.02)
    refused = told.pop(WAITING)
    assert len(refused) == 1
    assert "finite" in refused[0]
    assert set(map(tuple, told.values())) == {("",)}


def test_what_makes_no_sense_is_told_once_and_harms_nothing() -> None:
    sim, link, told = linked()
    for _ in range(5):
        link.send("/cmd_vel", msg.Twist(msg.Vector3(math.nan)))
        link.send("/cmd_vel", msg.String("not a twist"))
        link.send("/odom", msg.Odometry())
        link.send("/nothing", msg.String())
        sim.run(0.02)
    assert len(told) == 2
    assert "finite" in told[0]
    assert "carries Twist, not String" in told[1]
    assert "/nothing" not in sim.bus.topics


def test_receivers_go_along_to_the_next_simulation_with_their_topics() -> None:
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


def test_a_link_to_nothing_serves_nobody() -> None:
    PeerLink(print).serve()


def test_hidden_topics_are_neither_told_of_nor_delivered() -> None:
    sim, told = Simulation(kbot.load("kbot")), list[str]()
    goals: list[PoseStamped] = []
    sim.bus.subscribe("goal_pose", PoseStamped, goals.append)
    link, got = PeerLink(told.append, frozenset({"/goal_pose", "/odom"})), list[Packet]()
    link.open("/odom", got.append)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    link.send("/goal_pose", PoseStamped())
    sim.run(0.1)
    assert {"/tf", "/cmd_vel"} <= link.topics.keys()
    assert not link.topics.keys() & {"/goal_pose", "/odom"}
    assert (goals, got) == ([], [])


def test_a_receiver_is_woken_once_for_all_messages_of_a_moment() -> None:
    sim, link, _ = linked()
    happened: list[str] = []

    def wake() -> None:
        happened.append("woken")

    def receive(packet: Packet) -> None:
        happened.append(packet.topic)
        link.stir(wake)

    for topic in ("/odom", "/tf", "/joint_states"):
        link.open(topic, receive)
    sim.run(0.02)
    happened.clear()
    sim.run(0.02)
    assert sorted(happened[:3]) == ["/joint_states", "/odom", "/tf"]
    assert happened[3:] == ["woken"]


def test_what_is_said_outside_of_time_wakes_with_the_next_errand_or_at_once() -> None:
    sim, link, _ = linked()
    woken: list[int] = []
    sim.paused = True
    link.stir(lambda: woken.append(1))
    assert woken == []
    sim.run_errands()
    assert woken == [1]
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), gathers=False)
    link.stir(lambda: woken.append(2))
    assert woken == [1, 2]
