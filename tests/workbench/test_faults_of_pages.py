"""Kicks, pushes and faults that pages request, and restarting with a seed."""

import json
from math import inf

import numpy as np
import pytest

from kbot.messages.sensing import LaserScan
from kbot.sim.injected_faults import LostCommands
from kbot.text import KbotError
from kbot.workbench.protocol import Disturb, EndFault, Kick, Push, SetWorld, Spawn
from kbot.workbench.protocol.codec import encode
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

pytestmark = pytest.mark.usefixtures("keeps_up")


@pytest.fixture
def session() -> Session:
    return open_session("kbot", simulate=True)


def run(session: Session, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        session.advance(0.02)


@pytest.mark.parametrize("angle", [0.0, 90.0, 225.0])
def test_a_kick_moves_the_robot_in_its_direction(session: Session, angle: float) -> None:
    x, y = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    session.handle(Kick(0.0, 0.0, 0.5), 1)
    run(session, 0.02)  # off the ground, whose friction slows a robot down that stands on it
    start = np.array(session.state().poses[:3])
    session.handle(Kick(x, y, 0.5), 1)
    run(session, 0.04)
    moved = np.array(session.state().poses[:3]) - start
    assert moved[:2] == pytest.approx((0.04 * x, 0.04 * y), abs=0.002)
    assert moved[2] == pytest.approx(0.04 * 0.5 - 9.81 * 0.04**2 / 2, abs=0.003)


def test_other_robots_and_objects_can_be_pushed(session: Session) -> None:
    session.handle(Spawn("robot", 1.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1), 1)
    session.handle(Spawn("box", -1.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1), 1)
    run(session, 0.3)
    session.handle(Push("robot_2/base_link", 30.0, 0.0, 0.0, 0.2), 1)
    session.handle(Push("box_1", 0.0, 200.0, 0.0, 0.2), 1)
    run(session, 0.4)
    poses = np.array(session.state().bodies).reshape(-1, 7)
    names = [body.name for body in session.scene.bodies]
    assert poses[names.index("robot_2/base_link"), 0] > 1.02
    assert poses[names.index("box_1"), 1] > 0.02
    assert abs(session.state().poses[0]) < 1e-3  # the robot on display was not pushed


def test_faults_are_listed_and_can_be_ended(session: Session) -> None:
    session.handle(Disturb("payload", "base_link", 0.5, 3.0), 1)
    session.handle(Disturb("blocked", "left_wheel_joint", 0.0, 1.0), 1)
    session._motion._sim.disturbances.schedule(LostCommands(0.25), at=2.0)
    reported = session.state().faults
    assert [(entry.words, entry.start, entry.stop) for entry in reported] == [
        ("base_link carries 0.5 kg", 0.0, 3.0),
        ("left_wheel_joint is blocked", 0.0, 1.0),
        ("25% of commands are lost", 2.0, None),
    ]
    assert json.loads(encode(session.state()))["faults"][0] == {
        "number": reported[0].number,
        "words": "base_link carries 0.5 kg",
        "start": 0.0,
        "stop": 3.0,
    }
    session.handle(EndFault(reported[0].number), 1)
    run(session, 1.1)
    assert [entry.number for entry in session.state().faults] == [reported[2].number]
    with pytest.raises(KbotError, match="no fault has the number 1"):
        session.handle(EndFault(reported[0].number), 1)


def test_a_run_restarts_with_another_seed() -> None:
    def scans(session: Session) -> list[float]:
        received: list[float] = []
        session.topics.bus.subscribe("/scan", LaserScan, lambda m: received.extend(m.ranges[:20]))
        run(session, 0.2)
        return [value for value in received if value < inf]

    session = open_session("kbot", simulate=True, world="maze:size=3", arguments={"lidar": "true"}, seed=4)
    assert session.about().seed == 4
    first = scans(session)
    session.handle(SetWorld("maze:size=3", 5), 1)
    assert session.about().seed == 5
    other = scans(session)
    session.handle(SetWorld("maze:size=3", 4), 1)
    assert scans(session) == first
    assert other != first
    assert other == pytest.approx(first, abs=0.05)  # the same walls, with other noise
