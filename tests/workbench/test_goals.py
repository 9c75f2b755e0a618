"""Goals from a page: reached in a served simulation, cancelled by keys, kept over a save."""

import time
from pathlib import Path

import pytest

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.policies.driving import policy_goals
from kbot.learn.policies.policy import Policy
from kbot.messages import String
from kbot.messages.navigation import OccupancyGrid
from kbot.navigation.goals.goal_options import GoalOptions
from kbot.workbench.notebook import LoadedReader, reading_of
from kbot.workbench.protocol import Drive, Publish, Stop
from kbot.workbench.serve import open_session
from kbot.workbench.session.driven_session import driven_session
from kbot.workbench.source.description_file import DescriptionFile
from kbot.world import load_world

pytestmark = pytest.mark.usefixtures("keeps_up")


def _goal(x: float, y: float) -> Publish:
    pose = {"position": {"x": x, "y": y, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    stamp = {"sec": 0, "nanosec": 0}
    message = {"header": {"stamp": stamp, "frame_id": "map"}, "pose": pose}
    return Publish("goal_pose", "geometry_msgs/PoseStamped", message)


def _states(session):
    received = []
    session._motion.bus.subscribe("navigation_status", String, lambda m: received.append(m.data))
    return received


def _advance(session, seconds):
    for _ in range(round(seconds / 0.02)):
        session.advance(0.02)
        time.sleep(0.0005)


@pytest.fixture
def session(xacro: Path):
    return open_session(str(xacro), simulate=True, world="maze:size=3,seed=3")


def test_a_goal_of_a_page_is_reached(session):
    states = _states(session)
    session.handle(_goal(0.6, 0.6), 1)
    _advance(session, 14.0)
    assert states == ["accepted", "driving", "reached"]
    x, y, _ = session.state().odometry
    assert (x, y) == pytest.approx((0.6, 0.6), abs=0.02)
    assert session.state().command == (0.0, 0.0)


def test_keys_and_stop_cancel_the_goal(session):
    states = _states(session)
    session.handle(_goal(1.2, 1.2), 1)
    _advance(session, 1.5)
    assert session.state().command != (0.0, 0.0)
    session.handle(Drive(0.0, 0.5), 1)
    assert states[-1] == "cancelled: driven by hand"
    _advance(session, 0.2)
    assert session.state().command == (0.0, 0.5)
    session.handle(Stop(), 1)
    session.handle(_goal(1.2, 1.2), 1)
    _advance(session, 1.5)
    assert states[-1] == "driving"
    session.handle(Stop(), 2)
    assert states[-1] == "cancelled: stopped by hand"
    assert session.state().command == (0.0, 0.0)


def test_a_goal_continues_after_a_save(session):
    session.handle(_goal(0.6, 0.6), 1)
    _advance(session, 2.0)
    session.adopt(session.read())
    states = _states(session)
    _advance(session, 14.0)
    assert states[-1] == "reached"


def test_a_page_without_a_map_drives_to_its_first_goal_and_to_others(xacro: Path):
    description = DescriptionFile(str(xacro), {"lidar": "true"})
    options = GoalOptions(no_map=True, arrive=0.1)
    first = PlanarPose(0.6, 0.2)
    world = load_world("rooms")
    session = driven_session(description, world, "rooms", 0, "recipe", make_goals=options.goals, goal=first)
    states, costmaps = _states(session), []
    bus = session._motion.bus
    assert "/map" not in bus.topics
    bus.subscribe("move_base/local_costmap/costmap", OccupancyGrid, costmaps.append)
    _advance(session, 8.0)
    assert states[-1] == "reached"
    x, y, _ = session.state().odometry
    assert (x, y) == pytest.approx((0.6, 0.2), abs=0.1)
    assert costmaps
    session.handle(_goal(0.0, 0.0), 1)
    _advance(session, 10.0)
    assert states[-1] == "reached"
    x, y, _ = session.state().odometry
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.1)


def test_a_first_goal_that_is_refused_is_reported(xacro: Path):
    reports: list[str] = []
    session = driven_session(
        DescriptionFile(str(xacro)),
        load_world("empty"),
        "empty",
        0,
        "recipe",
        lambda simulation: simulation.journal.listeners.append(reports.append),
        make_goals=GoalOptions(no_map=True).goals,
        goal=PlanarPose(1.0, 0.0),
    )
    states = _states(session)
    assert states[-1].startswith("refused: ")
    assert len(reports) == 1
    assert "declares no level lidar" in reports[0]


def test_an_invalid_sensor_is_reported_at_its_line(tmp_path: Path):
    text = """<robot name="r"><link name="base_link"/>
<gazebo reference="base_link">
<sensor type="ray" name="scan"><ray><scan><horizontal>
<samples>many</samples></horizontal></scan></ray></sensor></gazebo></robot>"""
    (tmp_path / "r.urdf").write_text(text)
    session = open_session(str(tmp_path / "r.urdf"), simulate=False)
    (found,) = [f for f in session.findings().findings if f.code == "W141"]
    assert "finite number, not 'many'" in found.message
    assert found.place is not None
    assert found.place.line == 4


def test_a_policy_drives_to_the_first_goal_and_to_those_of_the_page(straight_policy: Path) -> None:
    policy = Policy.read(straight_policy)
    description = LoadedReader(reading_of(kbot.load("kbot", lidar=True)))
    session = driven_session(
        description,
        load_world("rooms"),
        "rooms",
        0,
        "recipe",
        make_goals=lambda simulation: policy_goals(simulation, policy),
        goal=PlanarPose(0.5, 0.0),
    )
    states = _states(session)
    _advance(session, 5.0)
    assert states == ["accepted", "driving", "reached"]
    topics = session._motion.bus.topics
    assert "/move_base/current_goal" in topics
    assert "/plan" not in topics  # the page would warn that it is silent
    session.handle(_goal(0.6, 0.5), 1)
    _advance(session, 6.0)
    assert states[-2:] == ["driving", "reached"]
    x, y, _ = session.state().odometry
    assert (x - 0.6) ** 2 + (y - 0.5) ** 2 < 0.2**2
    assert session.state().command == (0.0, 0.0)


def test_a_policy_that_does_not_fit_refuses_goals(straight_policy: Path) -> None:
    policy = Policy.read(straight_policy)
    session = driven_session(
        LoadedReader(reading_of(kbot.load("kbot"))),
        load_world("empty"),
        "empty",
        0,
        "recipe",
        make_goals=lambda simulation: policy_goals(simulation, policy),
        goal=PlanarPose(0.5, 0.0),
    )
    states = _states(session)
    session.handle(_goal(0.6, 0.5), 1)
    (state,) = set(states)
    assert state.startswith("refused: the policy sees obstacles with a lidar, but robot 'kbot' declares no")
    _advance(session, 0.5)
    assert session.state().odometry == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
