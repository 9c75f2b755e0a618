"""Objects that are spawned into and deleted from a running world."""

import pytest

from kbot.model import RobotModel
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.things import DENSITY, MODELS


@pytest.fixture
def sim(kbot_robot: RobotModel) -> Simulation:
    return Simulation(kbot_robot, "boxes")


def test_spawned_crate_falls_and_is_pushed_by_the_robot(sim: Simulation) -> None:
    sim.cmd_vel(0.3, 0.0)
    sim.run(0.5)
    before, odometry = sim.ground_truth.pose, sim.odometry.pose
    sim.models.spawn_thing("box", "carton", x=0.4, z=0.05, size=(0.05, 0.1, 0.04))
    assert sim.ground_truth.pose == before
    assert sim.odometry.pose == odometry
    assert sim.models.body_poses()["carton"].translation == pytest.approx((0.4, 0.0, 0.05))
    mass = sim.engine.model.body("/carton").mass[0]
    assert mass == pytest.approx(DENSITY * 0.05 * 0.1 * 0.04)
    sim.run(0.3)
    assert sim.models.body_poses()["carton"].translation[2] == pytest.approx(0.0, abs=1e-3)
    sim.run(1.0)
    assert sim.models.body_poses()["carton"].translation[0] > 0.45  # the robot pushed it


def test_run_with_a_spawned_object_does_not_depend_on_chunks(sim: Simulation) -> None:
    """A run in which an object was spawned does not depend on how it is split into calls."""
    ends = []
    for parts in (1, 4):
        sim.reset()
        sim.cmd_vel(0.2, 0.3)
        timer = sim.clock.every(2.0, lambda: sim.models.spawn_thing("crate", "late", x=1.0, z=0.2))
        for _ in range(parts):
            sim.run(0.8 / parts)
        timer.cancel()
        ends.append((sim.state_sha256(), sim.odometry.pose))
        sim.models.delete_model("late")
    assert ends[0] == ends[1]
    assert ends[0][1].x > 0.05


def test_journal_keeps_only_what_changed_in_the_end(sim: Simulation) -> None:
    """A program may spawn and delete all the time. Each change of the world is recorded with all of them."""
    built = next(body.name for body in sim.world.bodies if body.name.startswith("box"))
    sim.models.delete_model(built)
    for _ in range(3):
        sim.models.spawn_thing("crate", built, x=3.0)
        sim.models.spawn_model(sim.robot, "other", y=3.0)
        sim.models.delete_model("other")
        sim.models.delete_model(built)
    sim.models.spawn_thing("crate", "last", x=3.0)
    assert [(what, note.get("name", note.get("robot"))) for what, note in sim.journal.changes] == [
        ("delete_model", built),
        ("spawn_thing", "last"),
    ]


def test_every_library_model_is_placed_at_its_pose(sim: Simulation) -> None:
    for index, model in enumerate(MODELS):
        body = sim.models.spawn_thing(model, x=4.0 * index + 5.0, y=3.0, yaw=0.5)
        assert body.name == f"{model}_1"
        assert body.pose.translation == pytest.approx((4.0 * index + 5.0, 3.0, 0.0))
    sim.run(0.5)
    for name, pose in sim.models.body_poses().items():
        assert abs(pose.translation[2]) < 0.01, name


def test_deleting_an_object_does_not_disturb_the_others(sim: Simulation) -> None:
    alone = Simulation(sim.robot, "boxes")
    for run in (sim, alone):
        run.cmd_vel(0.2, 0.1)
        run.run(0.5)
    sim.models.spawn_thing("crate", x=5.0)
    sim.disturbances.apply_body_wrench("crate_1", (1.0, 0.0, 0.0), 10.0)
    sim.models.delete_model("crate_1")
    sim.models.delete_model("box_0")
    assert "crate_1" not in sim.models.body_poses()
    assert not any(body.name == "box_0" for body in sim.world.bodies)
    for run in (sim, alone):
        run.run(0.3)
    assert sim.ground_truth.pose.x == pytest.approx(alone.ground_truth.pose.x, abs=1e-9)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"kind": "crat"}, "did you mean 'crate'"),
        ({"kind": "crate", "name": "box_0"}, "the name 'box_0' is taken"),
        ({"kind": "crate", "name": "a/b"}, "not a valid object name"),
        ({"kind": "crate", "x": float("nan")}, "three finite numbers"),
        ({"kind": "crate", "size": (1, 1, 1)}, "size of a crate cannot be set"),
        ({"kind": "box", "size": (1, 1, 0)}, "edges of a box"),
        ({"kind": "crate"}, "'kbot' is in the way"),
    ],
)
def test_rejected_object_leaves_the_world_unchanged(
    sim: Simulation, wrong: dict[str, object], message: str
) -> None:
    world, digest = sim.world, sim.state_sha256()
    with pytest.raises(KbotError, match=message):
        sim.models.spawn_thing(**wrong)
    assert sim.world is world
    assert sim.state_sha256() == digest


@pytest.mark.parametrize(
    ("name", "message"),
    [("ground_plane", "cannot be deleted"), ("kbot", "cannot be deleted"), ("x", "unknown model")],
)
def test_ground_and_first_robot_cannot_be_deleted(sim: Simulation, name: str, message: str) -> None:
    with pytest.raises(KbotError, match=message):
        sim.models.delete_model(name)
