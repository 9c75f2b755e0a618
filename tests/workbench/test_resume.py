"""Resuming a simulation from an earlier time: the state is restored, and its recording stays valid."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.record.replay import replay
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.workbench.protocol import RecordRun, Reset, State, Trail
from kbot.workbench.serve import open_session
from kbot.workbench.serving.hub import Client, Hub
from kbot.workbench.serving.past import Past
from kbot.workbench.session.session import Session
from kbot.workbench.timeline import saved
from kbot.workbench.timeline.saved import SavedStates

pytestmark = pytest.mark.usefixtures("keeps_up")


class Desk:
    """A session whose messages to pages are collected, and a page that looks back."""

    def __init__(self, **options: object) -> None:
        self.session: Session = open_session("kbot", simulate=True, **options)
        self.hub = Hub()
        self.past = Past(self.session, self.hub)
        self.client: Client = self.hub.join()
        self.session.announce = self.hub.publish
        self.states: dict[float, State] = {}

    @property
    def sim(self) -> Simulation:
        return self.session._motion._sim

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.session.advance(0.02)
            state = self.session.state()
            self.states[round(state.time, 2)] = state
            self.past.send_state(state)

    def trail(self, resets: int | None = None) -> Trail:
        making = self.past.trail(self.session.state().resets if resets is None else resets, -1.0)
        try:
            next(making)
        except StopIteration as done:
            trail: Trail = done.value
            return trail
        raise AssertionError("a simulation's way is known at once")

    def resume(self, at: float) -> str:
        self.past.seek(self.client, at)
        self.past.resume(self.client)
        waiting = self.client._waiting.items()
        return next(str(frame) for key, frame in reversed(waiting) if key.startswith("notice:"))


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    desk = Desk(world="boxes", seed=3)
    desk.session.recording.folder = str(tmp_path)
    return desk


def test_the_resumed_robot_has_its_earlier_pose_and_is_not_driven(desk: Desk) -> None:
    desk.sim.cmd_vel(0.3, 0.6)
    desk.run(4.0)
    then = dict(desk.states)
    notice = desk.resume(2.1)
    state = desk.session.state()
    assert f"continues from {state.time:.2f} s" in notice
    assert state.time == pytest.approx(2.1, abs=0.11)
    before = then[round(state.time, 2)]
    assert state.poses == before.poses
    assert state.positions == before.positions
    assert desk.client.displayed_time is None
    assert not desk.session.paused
    assert before.command == (0.3, 0.6)
    assert state.command == (0.0, 0.0)
    desk.run(0.5)
    assert desk.session.state().at == pytest.approx(4.5, abs=0.03)  # the timeline continues
    braked = desk.session.state()
    assert np.allclose(braked.twist, 0.0, atol=0.01)
    desk.run(1.0)
    assert np.allclose(desk.session.state().poses, braked.poses, atol=2e-3)


def test_the_trail_continues_the_path_to_the_resumed_state(desk: Desk) -> None:
    desk.sim.cmd_vel(0.3, 0.0)
    desk.run(4.0)
    then = {state.at: state for state in desk.states.values()}
    first = desk.trail()
    desk.resume(2.0)
    went_on_at = desk.session.state().odometry[0]
    desk.sim.cmd_vel(0.0, 1.0)
    desk.run(1.0)
    desk.sim.cmd_vel(0.3, 0.0)
    desk.run(2.0)
    second = desk.trail()
    assert second.resets == first.resets + 1
    led = [x for at, x in zip(second.at, second.x, strict=True) if at <= 2.1]
    assert led == list(first.x[: len(led)])
    assert max(led) == pytest.approx(went_on_at, abs=0.02)
    for at, x in zip(first.at, first.x, strict=True):
        assert x == pytest.approx(then[at].poses[0], abs=1e-3)
    assert min(at for at in second.at if at > 2.1) > 3.9  # the undone part is missing
    assert second.y[-1] > 0.2
    assert desk.trail(first.resets) == first


def test_a_reset_starts_another_trail(desk: Desk) -> None:
    desk.sim.cmd_vel(0.3, 0.0)
    desk.run(2.0)
    desk.session.handle(Reset(), 1)
    desk.run(0.5)
    assert (desk.trail().x, desk.trail().y) == ((0.0,), (0.0,))
    assert len(desk.trail(0).x) > 20
    assert desk.trail(7).x == ()


def test_resuming_a_later_state_does_not_advance_the_timeline(desk: Desk) -> None:
    desk.run(9.0)
    desk.resume(1.0)
    desk.run(1.0)
    desk.resume(8.0)
    assert desk.session.state().time == pytest.approx(8.0, abs=0.11)
    desk.run(1.0)
    assert desk.session.state().at == pytest.approx(11.0, abs=0.1)


def test_objects_added_later_disappear_and_deleted_ones_return(desk: Desk) -> None:
    desk.run(1.5)
    desk.sim.models.spawn_thing("box", "early", 2.0, 2.0, 0.2, 0.0, (0.1, 0.1, 0.1))
    desk.run(2.0)
    desk.sim.models.delete_model("early")
    desk.sim.models.spawn_thing("box", "late", -2.0, 2.0, 0.2, 0.0, (0.1, 0.1, 0.1))
    desk.run(2.0)
    desk.resume(3.2)
    names = {body.name for body in desk.session.scene.bodies}
    assert "early" in names
    assert "late" not in names
    desk.run(0.5)
    desk.resume(1.0)
    assert "early" not in {body.name for body in desk.session.scene.bodies}


@pytest.mark.parametrize("kind", ["page", "command line"])
def test_a_resumed_run_replays_bit_for_bit(desk: Desk, tmp_path: Path, kind: str) -> None:
    sim = desk.sim
    if kind == "page":
        desk.session.handle(RecordRun(True), 1)
        path = str(desk.session.recording.view().file)
        end: Callable[[], None] = desk.session.recording.end
    else:
        path = str(tmp_path / "run.mcap")
        end = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path, world="boxes").close
    desk.sim.cmd_vel(0.3, 0.4)
    desk.run(2.5)
    desk.sim.models.spawn_thing("box", "crate", 2.0, 2.0, 0.2, 0.0, (0.1, 0.1, 0.1))
    desk.run(1.5)
    notice = desk.resume(2.0)
    assert ("The recording contains both runs" in notice) == (kind == "page")
    desk.sim.cmd_vel(-0.2, 0.0)
    desk.run(2.2)
    desk.resume(desk.session.state().at - 1.0)  # back on the second run
    desk.sim.cmd_vel(0.0, 1.0)
    desk.run(1.5)
    desk.resume(1.0)  # and on the first one again
    desk.sim.disturbances.apply_body_wrench("base_link", (1.0, 0.0, 0.0), 0.1)
    desk.run(1.0)
    digest = sim.state_sha256()
    end()
    again = replay(path)
    assert again.difference == ""
    assert again.same_state
    assert again.simulation.state_sha256() == digest


def test_a_bag_that_cannot_store_a_resumed_run_is_reported(desk: Desk, tmp_path: Path) -> None:
    sim, path = desk.sim, str(tmp_path / "run.bag")
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        desk.run(2.0)
        desk.resume(1.0)
        desk.run(0.5)
    with pytest.raises(KbotError, match=r"record it as \.mcap"):
        replay(path)


def test_a_page_that_displays_the_present_cannot_resume(desk: Desk) -> None:
    desk.run(1.0)
    with pytest.raises(KbotError, match="go back in time first"):
        desk.past.resume(desk.client)


def test_resuming_does_not_cross_a_reset(desk: Desk) -> None:
    desk.sim.cmd_vel(0.3, 0.0)
    desk.run(3.3)
    desk.session._motion.reset()
    desk.run(1.4)
    reset_at = desk.session.state().at - 1.4
    desk.resume(reset_at - 0.1)
    assert desk.session.state().time == pytest.approx(3.2, abs=0.11)
    desk.resume(reset_at + 0.05)
    assert desk.session.state().time < 0.1


def test_another_robot_cannot_resume_an_earlier_state(desk: Desk) -> None:
    desk.run(3.0)
    desk.session._enter("empty", 0)
    desk.run(2.0)
    desk.past.seek(desk.client, 1.0)
    with pytest.raises(KbotError, match="no state of this robot and world is saved for that time"):
        desk.past.resume(desk.client)
    desk.past.seek(desk.client, 4.5)
    desk.past.resume(desk.client)
    assert 0.9 < desk.session.state().time < 1.6


def test_robots_added_later_are_reported_as_the_reason(desk: Desk) -> None:
    desk.run(2.0)
    desk.sim.models.spawn_model(desk.sim.robot, "second", -2.0, 0.0, 0.0)
    desk.run(0.5)
    desk.past.seek(desk.client, 1.0)
    before = desk.session.state()
    with pytest.raises(KbotError, match="other robots or another world"):
        desk.past.resume(desk.client)
    assert desk.session.state() == before


def test_states_are_saved_in_bounded_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saved, "MOST_BYTES", 400 * 1000)
    states = SavedStates()
    for step in range(50 * 400):
        states.keep(step / 50, step / 50, "run", lambda step=step: (step, 1000))
    assert states.size <= 400 * 1000
    end = 400.0
    for at in np.arange(end - 50, end - 1, 0.37):
        assert abs(states.nearest(float(at), "run").at - at) <= 0.11
    assert abs(states.nearest(end - 100.0, "run").at - (end - 100.0)) <= 2.6
