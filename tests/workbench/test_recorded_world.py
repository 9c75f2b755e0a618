"""A recording is displayed in its world, with everything that moved, appeared and disappeared."""

import json
from pathlib import Path

import numpy as np
import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.record import Recorder
from kbot.record.copy import copy_recording
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.workbench.protocol import Seek
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

START = PlanarPose(1.0, -0.5, 0.4)


def recorder(sim: Simulation, path: Path, **more: str) -> Recorder:
    return Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path), **more)


def seek(session: Session, seconds: float) -> None:
    start = session._motion._run.index.start
    session.handle(Seek(seconds - start * 1e-9), 1)


def moving(session: Session) -> dict[str, np.ndarray]:
    """Return where each movable object is displayed, as x, y, z."""
    names = [body.name for body in session.scene.bodies if body.moving]
    poses = np.reshape(session.state().bodies, (-1, 7))[:, :3]
    return dict(zip(names, poses, strict=True))


@pytest.fixture(scope="module", params=["run.mcap", "run.bag", "run"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Two seconds in a world with walls, and the true poses by time.

    At 0.5 s a box is added, at 1 s it is moved, at 1.5 s it is deleted and another robot is added.
    """
    sim = Simulation("kbot", "boxes", start=START)
    path = tmp_path_factory.mktemp("run") / request.param
    truth: dict[float, dict] = {}
    sim.cmd_vel(0.3, 0.3)
    with recorder(sim, path):
        for tenth in range(1, 21):
            sim.run(0.1)
            truth[tenth / 10] = {"robot": sim.link_pose(sim.robot.root).matrix, **sim.models.body_poses()}
            if tenth == 5:
                sim.models.spawn_thing("box", "crate", 3.0, 0.5, 0.3, 0.0, (0.2, 0.2, 0.2))
            if tenth == 10:
                sim.models.set_model_state("crate", Transform.from_xyz_rpy((3.0, -2.0, 0.1), (0, 0, 0.5)))
            if tenth == 15:
                sim.models.delete_model("crate")
                sim.models.spawn_model("kbot", "second", -2.0, 0.0, 0.0)
    return path, truth


def test_everything_is_displayed_at_its_true_pose(run: tuple[Path, dict]) -> None:
    path, truth = run
    session = played_session(str(path))
    for at in (1.9, 0.4, 1.2, 0.7, 2.0, 1.0):
        seek(session, at)
        session._send_changes()
        there = moving(session)
        for name, pose in truth[at].items():
            if name != "robot":
                assert np.allclose(there[name], pose.translation, atol=1e-3), (at, name)
        root = session._motion.moment().poses["base_footprint"].matrix
        assert np.allclose(root, truth[at]["robot"], atol=1e-3), at


def test_objects_appear_and_disappear_as_recorded(run: tuple[Path, dict]) -> None:
    session = played_session(str(run[0]))
    walls = {body.name for body in Simulation("kbot", "boxes").world.bodies} - {"ground_plane"}
    assert session.about().world == "boxes"
    for at, crate, second in ((1.9, False, True), (0.3, False, False), (1.2, True, False)):
        seek(session, at)
        session._send_changes()
        names = {body.name for body in session.scene.bodies}
        assert names >= walls
        assert ("crate" in names, "second/base_link" in names) == (crate, second)
    for _ in range(12):  # 1.2 s to 1.8 s, during playback
        session.advance(0.05)
    names = {body.name for body in session.scene.bodies}
    assert "crate" not in names
    assert np.allclose(moving(session)["second/base_footprint"][:2], (-2.0, 0.0), atol=0.01)


BALL = """<sdf version="1.7"><model name="ball"><link name="link"><pose>0 0 0.1 0 0 0</pose>
<inertial><mass>0.2</mass></inertial>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>
<visual name="v"><geometry><sphere><radius>0.1</radius></sphere></geometry></visual></link></model></sdf>"""


def test_sdf_models_are_displayed(tmp_path: Path) -> None:
    sim = Simulation("kbot")
    with recorder(sim, tmp_path / "run.mcap"):
        sim.run(0.5)
        sim.models.spawn_sdf(BALL, "ball", Transform.from_xyz_rpy((1.0, 0.5, 0.0), (0.0, 0.0, 0.0)))
        sim.run(0.5)
        rolled = sim.models.body_poses()
    session = played_session(str(tmp_path / "run.mcap"))
    assert "ball" not in " ".join(body.name for body in session.scene.bodies)
    seek(session, 1.0)
    session._send_changes()
    there = moving(session)
    assert there
    for name, pose in rolled.items():
        assert np.allclose(there[name], pose.translation, atol=1e-3)


def test_a_part_of_a_recording_is_shown_in_the_same_world(run: tuple[Path, dict], tmp_path: Path) -> None:
    path, truth = run
    copy_recording(str(path), str(tmp_path / "part.mcap"), start=1.1, end=1.9)
    session = played_session(str(tmp_path / "part.mcap"))
    seek(session, 1.4)
    session._send_changes()
    assert "crate" in {body.name for body in session.scene.bodies}
    root = session._motion.moment().poses["base_footprint"].matrix
    assert np.allclose(root, truth[1.4]["robot"], atol=1e-3)


def test_without_true_poses_the_robot_starts_at_its_start_pose(tmp_path: Path) -> None:
    sim = Simulation("kbot", "boxes", start=START)
    path = tmp_path / "few.mcap"
    feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
    with Recorder(sim, feed, str(path), topics=("/tf", "/joint_states")):
        sim.run(0.2)
    session = played_session(str(path))
    shown = session._motion.moment().poses["base_footprint"]
    assert shown.translation[:2] == pytest.approx((START.x, START.y), abs=1e-3)
    assert shown.yaw == pytest.approx(START.yaw, abs=1e-3)
    assert any(not body.moving for body in session.scene.bodies)


def test_a_missing_world_is_reported(tmp_path: Path) -> None:
    sim = Simulation("kbot")
    with recorder(sim, tmp_path / "run.mcap", world="hall.world"):
        sim.run(0.2)
    session = played_session(str(tmp_path / "run.mcap"))
    assert "The recording's world 'hall.world' cannot be displayed" in session.note
    assert "cannot be displayed" in json.dumps([getattr(m, "reason", "") for m in session.greeting(1)])
    assert session.scene.bodies == ()


@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "run"])
def test_an_incomplete_recording_is_displayed_with_a_notice(tmp_path: Path, name: str) -> None:
    sim, path = Simulation("kbot"), tmp_path / name
    lost = recorder(sim, path)
    sim.run(0.5)
    lost.flush()  # and then nothing more, as after kill -9
    session = played_session(str(path))
    assert session.note.startswith(f"{path} is incomplete: it was not closed")
    assert session.note.endswith("The readable part is shown.")
    lost.close()
    assert played_session(str(path)).note == ""
