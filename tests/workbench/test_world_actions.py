"""What pages can do to a running world, and what they cannot."""

import pytest

from kbot.messages import String
from kbot.text import KbotError
from kbot.workbench.driving.world_actions import MOST_MODELS
from kbot.workbench.protocol import Delete, Disturb, JointSpeed, MoveModel, Publish, ResetPart, Spawn, Things
from kbot.workbench.protocol.codec import BadMessage, decode
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

pytestmark = pytest.mark.usefixtures("keeps_up")


@pytest.fixture
def session() -> Session:
    return open_session("kbot", simulate=True)


def spawn(what: str, x: float, y: float = 0.0) -> Spawn:
    return Spawn(what, x, y, 0.0, 0.0, 0.1, 0.2, 0.3)


def run(session: Session, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        session.advance(0.02)


def test_added_and_deleted_objects_are_sent_to_every_page(session: Session) -> None:
    reported: list[object] = []
    session.announce = reported.append
    session.handle(spawn("box", 0.5), 1)
    session.handle(spawn("robot", -0.5), 1)
    things = [message for message in reported if isinstance(message, Things)]
    assert [message.revision for message in things] == [2, 3]
    (box, *links) = things[-1].bodies
    assert box.name == "box_1"
    assert box.parts[0].size == (0.1, 0.2, 0.3)
    assert [link.name for link in links] == [f"robot_2/{link.name}" for link in session.scene.links]
    assert len(session.state().bodies) == 7 * len(things[-1].bodies)
    assert session.state().revision == session.scene.revision == 3
    session.handle(Delete("robot_2/left_wheel"), 1)
    session.handle(Delete("box_1"), 1)
    assert session.scene.bodies == ()
    assert session.state().bodies == ()


def test_changes_by_a_program_are_displayed(session: Session) -> None:
    session._motion._sim.models.spawn_thing("crate", x=1.0)
    assert session.advance(0.0)
    assert [body.name for body in session.scene.bodies] == ["crate_1"]


def test_a_moved_model_is_at_its_new_pose(session: Session) -> None:
    session.handle(spawn("crate", 0.5), 1)
    session.handle(MoveModel("crate_1", 0.8, 0.1, 0.0, 1.0), 1)
    session.handle(MoveModel(session.scene.robot, -0.3, 0.2, 5.0, 0.5), 1)
    run(session, 0.2)
    assert session.state().bodies[:2] == pytest.approx((0.8, 0.1), abs=1e-3)
    x, y, z = session.state().poses[:3]
    assert (x, y) == pytest.approx((-0.3, 0.2), abs=1e-3)
    assert z < 0.1  # a robot is placed on the ground


def test_the_map_contains_added_obstacles(session: Session) -> None:
    states: list[str] = []
    session.topics.bus.subscribe("navigation_status", String, lambda m: states.append(m.data))
    stamp = {"sec": 0, "nanosec": 0}
    pose = {
        "position": {"x": 1.0, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    goal = Publish(
        "goal_pose",
        "geometry_msgs/PoseStamped",
        {"header": {"stamp": stamp, "frame_id": "world"}, "pose": pose},
    )
    session.handle(goal, 1)
    cancel = Publish("move_base/cancel", "actionlib_msgs/GoalID", {"stamp": stamp, "id": ""})
    while "driving" not in states:
        run(session, 0.02)
    session.handle(cancel, 1)
    session.handle(spawn("barrel", 1.0), 1)
    session.handle(goal, 1)
    for _ in range(400):
        run(session, 0.02)
        if states[-1] not in ("accepted", "driving") and not states[-1].startswith("cancelled"):
            break
    assert "obstacle" in states[-1]


def test_faults_last_the_requested_time(session: Session) -> None:
    robot = session._motion._sim.robots.first
    model, _ = session._motion._sim.engine.current()
    before = model.body_mass[robot.body.index("base_link")]
    session.handle(Disturb("payload", "base_link", 0.5, 0.2), 1)
    run(session, 0.1)
    assert model.body_mass[robot.body.index("base_link")] == pytest.approx(before + 0.5)
    run(session, 0.2)
    assert model.body_mass[robot.body.index("base_link")] == before


def test_time_and_world_can_be_reset_separately(session: Session) -> None:
    session.handle(MoveModel(session.scene.robot, 1.0, 0.0, 0.0, 0.0), 1)
    run(session, 0.5)
    session.handle(ResetPart("time"), 1)
    assert session.state().time == 0.0
    assert session.state().poses[0] == pytest.approx(1.0, abs=1e-3)
    run(session, 0.5)
    session.handle(ResetPart("world"), 1)
    assert session.state().time == pytest.approx(0.5, abs=0.01)
    assert session.state().poses[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (spawn("castle", 1.0), "unknown object 'castle'"),
        (spawn("crate", 0.0), "in the way"),
        (Delete("nothing"), "unknown model 'nothing'"),
        (Delete("kbot"), "cannot be deleted"),
        (MoveModel("nothing", 0.0, 0.0, 0.0, 0.0), "unknown model 'nothing'"),
        (Disturb("slip", "nothing", 0.1, 1.0), "nothing"),
        (Disturb("slip", "left_wheel", -1.0, 1.0), "coefficient of friction"),
        (Disturb("silent", "/nothing", 0.0, 1.0), "no topic /nothing"),
        (JointSpeed("left_wheel_joint", 1.0), "no controller"),
    ],
)
def test_impossible_actions_are_reported(session: Session, message: object, expected: str) -> None:
    with pytest.raises(KbotError, match=expected):
        session.handle(message, 1)


def test_world_actions_are_refused_without_a_simulation() -> None:
    with pytest.raises(KbotError, match="kbot sim"):
        open_session("kbot", simulate=False).handle(spawn("crate", 1.0), 1)


def test_the_number_of_added_objects_is_limited(session: Session) -> None:
    for index in range(MOST_MODELS):
        session.handle(spawn("box", 1.0 + index), 1)
    with pytest.raises(KbotError, match="Delete some first"):
        session.handle(spawn("box", 0.0, 5.0), 1)
    session.handle(Delete("box_1"), 1)
    session.handle(spawn("box", 0.0, 5.0), 1)


@pytest.mark.parametrize(
    ("field", "value"),
    [("length", 0), ("height", 100), ("x", 1e9), ("yaw", "NaN"), ("what", '"' + "x" * 300 + '"')],
)
def test_sizes_and_ranges_are_checked(field: str, value: object) -> None:
    fields = {
        "what": '"box"',
        "x": 0,
        "y": 0,
        "z": 0,
        "yaw": 0,
        "length": 1,
        "width": 1,
        "height": 1,
        field: value,
    }
    with pytest.raises(BadMessage, match=field):
        decode('{"type": "spawn", ' + ", ".join(f'"{k}": {v}' for k, v in fields.items()) + "}")
