"""The robot's path: it breaks where the robot was moved, live and in recordings."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.kinematics.transform import Transform
from kbot.messages import Header, Odometry, String, TFMessage, Twist, TwistWithCovariance
from kbot.messages.navigation import PoseWithCovarianceStamped
from kbot.messages.types import Time, TransformStamped, Vector3
from kbot.messages.types import Transform as TransformMessage
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.workbench.protocol import MoveModel, ResetPart, Trail
from kbot.workbench.serve import open_session
from kbot.workbench.serving.hub import Hub
from kbot.workbench.serving.past import Past
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

from .test_foreign_recordings import write

pytestmark = pytest.mark.usefixtures("keeps_up")

Act = Callable[[Session], object]


def sim(session: Session) -> Simulation:
    return session._motion._sim


def aside(session: Session) -> Transform:
    """Return a position beside the robot that is closer than it drives in half a second."""
    here = sim(session).models.get_model_state("kbot").pose
    return Transform.from_xyz_rpy((0.0, 0.04, 0.0), (0.0, 0.0, 0.0)) @ here


PUT: dict[str, Act] = {
    "a peer": lambda s: sim(s).models.set_model_state("kbot", aside(s)),
    "the page": lambda s: s.handle(MoveModel("kbot", 0.1, 0.04, 0.0, 0.0), 1),
    "2D pose estimate": lambda s: s.topics.bus.publish("initialpose", PoseWithCovarianceStamped()),
    "a peer's reset": lambda s: sim(s).snapshots.reset_world(),
    "the page's reset of the world": lambda s: s.handle(ResetPart("world"), 1),
}


def driven(session: Session, put: Act, is_paused: bool) -> Trail:
    """The trail of a robot that drives, is moved, and drives again."""
    past = Past(session, Hub())

    def drive(count: int) -> None:
        sim(session).cmd_vel(0.3, 0.0)
        for _ in range(count):
            session.advance(0.05)
            past.send_state(session.state())

    drive(20)
    session.paused = is_paused
    put(session)
    session.advance(0.05)
    past.send_state(session.state())
    session.paused = False
    drive(20)
    making = past.trail(session.state().resets, -1.0)
    with pytest.raises(StopIteration) as done:
        next(making)
    trail: Trail = done.value.value
    return trail


@pytest.mark.parametrize("is_paused", [False, True])
@pytest.mark.parametrize("who", PUT)
def test_the_trail_breaks_where_the_robot_is_moved(who: str, is_paused: bool) -> None:
    session = open_session("kbot", simulate=True)
    trail = driven(session, PUT[who], is_paused)
    if who == "the page's reset of the world":
        assert trail.jumps == ()  # a separate path
        assert max(trail.x) < 0.35
        return
    (jump,) = trail.jumps
    places = np.column_stack((trail.x, trail.y))
    lengths = np.hypot(*np.diff(places, axis=0).T)
    assert lengths.argmax() == jump - 1  # the piece without a line is the one that was not driven
    assert np.delete(lengths, jump - 1).max() < 0.02


def test_driving_and_pushes_do_not_break_the_trail() -> None:
    session = open_session("kbot", simulate=True)
    trail = driven(
        session, lambda s: sim(s).models.set_twist((0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), is_paused=False
    )
    assert len(trail.x) > 30
    assert trail.jumps == ()


@pytest.mark.parametrize("file", ["run.mcap", "run.bag", "run"])
@pytest.mark.parametrize("at", [1.0, 1.013])  # at the time of a pose, and between two
def test_a_recording_of_kbot_has_the_moves(tmp_path: Path, file: str, at: float) -> None:
    robot = Simulation(kbot.load("kbot"))
    path = str(tmp_path / file)
    with Recorder(robot, Feed(robot.bus, lambda: robot.clock.nanoseconds), path):
        robot.cmd_vel(0.3, 0.0)
        robot.run(at)
        robot.models.set_pose(robot.ground_truth.pose.x, 0.04, 0.0)
        robot.run(1.0)
        other = robot.models.spawn_model("kbot", "other", x=2.0)
        robot.models.set_pose(2.0, 1.0, 0.0, other.name)
        robot.run(1.0)
    pieces = pieces_of(played_session(path))
    assert [len(piece) > 10 for piece in pieces if len(piece) > 1] == [True, True]
    assert {round(y, 2) for _, y in pieces[0]} == {0.0}
    assert {round(y, 2) for _, y in pieces[-1]} == {0.04}


def test_too_long_distances_in_foreign_recordings_are_moves(tmp_path: Path) -> None:
    """At 10 m/s, and after 3 s beside its path."""

    def messages(at: float, x: float, y: float) -> tuple[str, float, TFMessage]:
        header = Header(Time.from_nanoseconds(round(at * 1e9)), "odom")
        return "/tf", at, TFMessage((TransformStamped(header, "base", TransformMessage(Vector3(x, y))),))

    path = write(
        tmp_path / "real.mcap",
        ("/robot_description", 0.0, String('<robot name="one"><link name="base"/></robot>')),
        *(messages(0.1 * t, 1.0 * t, 0.0 if t < 30 else 5.0) for t in range(60)),
    )
    first, second = pieces_of(played_session(path))
    assert (len(first), len(second)) == (30, 30)
    assert second[0] == (30.0, 5.0)


@pytest.mark.parametrize(
    ("speed", "late", "jump", "pieces"), [(1.0, 0.0, True, 2), (0.0, 0.0, True, 1), (1.0, 0.8, False, 1)]
)
def test_distances_beyond_odometry_in_foreign_recordings_are_moves(
    tmp_path: Path, speed: float, late: float, jump: bool, pieces: int
) -> None:
    """A robot that drives 1 m/s is half a metre aside within 0.1 s.

    It is unknown whether it was moved if its odometry has no speed, or if messages arrive late and in a
    burst.
    """

    def messages(at: float) -> list[tuple[str, float, object]]:
        received = max(at, 3.0 + late) if at >= 3.0 else at
        header = Header(Time.from_nanoseconds(round(at * 1e9)), "odom")
        moved = TransformStamped(
            header, "base", TransformMessage(Vector3(at, 0.5 if jump and at >= 3.0 else 0.0))
        )
        twist = TwistWithCovariance(Twist(Vector3(speed)))
        return [
            ("/odom", received, Odometry(header, "base", twist=twist)),
            ("/tf", received, TFMessage((moved,))),
        ]

    path = write(
        tmp_path / "real.mcap",
        ("/robot_description", 0.0, String('<robot name="one"><link name="base"/></robot>')),
        *(entry for t in range(60) for entry in messages(0.1 * t)),
    )
    found = pieces_of(played_session(path))
    assert len(found) == pieces
    if pieces == 2:
        assert found[1][0] == (3.0, 0.5)


def test_a_message_of_another_clock_does_not_block_the_path(tmp_path: Path) -> None:
    """One was stamped 50 years before the others."""

    def messages(at: float, x: float) -> tuple[str, float, TFMessage]:
        return "/tf", at, TFMessage((TransformStamped(Header(), "base", TransformMessage(Vector3(x))),))

    now = 1.6e9
    path = write(
        tmp_path / "real.mcap",
        ("/robot_description", now, String('<robot name="one"><link name="base"/></robot>')),
        messages(0.0, 0.0),
        *(messages(now + 0.1 * t, 0.1 * t) for t in range(60)),
    )
    steps = sum(1 for _ in Past(played_session(path), Hub()).trail(0, -1.0))
    assert steps < 1000


def pieces_of(session: Session) -> list[list[tuple[float, float]]]:
    """Return the points of a recording's path, split where it breaks."""
    past = Past(session, Hub())
    making = past.trail(0, -1.0)
    while True:
        try:
            next(making)
        except StopIteration as done:
            trail: Trail = done.value
            break
    places = list(zip(trail.x, trail.y, strict=True))
    cuts = [0, *trail.jumps, len(places)]
    return [places[a:b] for a, b in pairwise(cuts) if a < b]
