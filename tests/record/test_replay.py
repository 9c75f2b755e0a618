"""Replaying a recorded run gives the same messages, and a changed recording does not."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from kbot.kinematics.transform import Transform
from kbot.messages import String
from kbot.record import Recorder, Recording, open_writer
from kbot.record.feed import Feed, Packet
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.record.replay import repeat_action, replay
from kbot.sim import Simulation
from kbot.sim.injected_faults import Kick, LostCommands, Slip
from kbot.text import KbotError

from .conftest import record


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_replayed_motion_is_the_same_bit_for_bit(runs: dict[str, Path], kind: str) -> None:
    again = replay(str(runs[kind]))
    assert again.difference == ""
    assert again.same_state is True
    assert again.compared == 4 * 76


def test_resets_placements_pushes_and_kicks_are_replayed(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.cmd_vel(0.5, 0.1)
        sim.run(0.777)
        sim.reset()
        sim.models.set_pose(0.5, -0.25, 1.0)
        sim.cmd_vel(0.2, 0.0)
        sim.run(0.333)
        sim.disturbances.apply_body_wrench("base_link", (0.0, 3.0, 0.0), 0.25)
        sim.run(0.5)
        sim.models.set_twist((0.5, 0.0, 0.2))
        sim.run(0.5)

    record(tmp_path / "run.mcap", drive)
    again = replay(str(tmp_path / "run.mcap"))
    assert again.is_same
    assert again.same_state is True
    record(tmp_path / "run.bag", drive)
    with pytest.raises(KbotError, match=r"the run was reset.*record it as \.mcap"):
        replay(str(tmp_path / "run.bag"))


def test_numpy_numbers_are_recorded(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.cmd_vel(np.float32(0.3), np.int64(1))  # type: ignore[arg-type]  # as a script may have them
        sim.run(0.3)

    record(tmp_path / "run.mcap", drive)
    assert replay(str(tmp_path / "run.mcap")).same_state is True


BALL = """<sdf version="1.7"><model name="m"><link name="l"><inertial><mass>1</mass></inertial>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model>
</sdf>"""


def test_all_world_actions_are_replayed(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.disturbances.schedule(Slip("left_wheel", 0.2), at=0.1, duration=0.5)
        sim.disturbances.schedule(Kick((0.0, 0.2, 0.0)), at=0.3)
        sim.cmd_vel(0.2, 0.1)
        sim.run(0.333)
        other = sim.models.spawn_model(sim.robot, "b", x=-0.6, yaw=0.1)
        other.cmd_vel(0.1, 0.0)
        sim.models.attach("base_link", "base_link", to_robot="b")
        sim.run(0.5)
        sim.models.detach("base_link")
        pose = Transform.from_xyz_rpy((1.0, 1.0, 0.05), (0.1, 0.0, 1.0))
        sim.models.set_model_state("b", pose, (0.1, 0.0, 0.0))
        sim.disturbances.apply_body_wrench("base_link", (1.0, 0.0, 0.0), 0.5, robot="b")
        sim.run(0.2)
        sim.disturbances.clear_body_wrenches("base_link", "b")
        sim.models.set_pose(0.4, 0.4, 0.4, "b")
        sim.snapshots.reset_world()
        other.command(0.3, 0.5)
        sim.run(0.7)
        sim.models.delete_model("b")
        sim.models.spawn_thing("crate", x=0.5, z=0.1)
        sim.models.spawn_thing("box", "carton", 0.3, 0.4, yaw=0.2, size=(0.1, 0.2, 0.05))
        sim.run(0.1)
        sim.models.delete_model("carton")
        sim.models.spawn_sdf(BALL, "ball", Transform.from_xyz_rpy((0.0, 1.0, 0.3), (0.0, 0.0, 0.2)))
        sim.run(0.2)

    record(tmp_path / "run.mcap", drive)
    again = replay(str(tmp_path / "run.mcap"))
    assert again.difference == ""
    assert again.same_state is True


def test_reset_of_time_is_replayed(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.cmd_vel(0.2, 0.1)
        sim.run(0.333)
        sim.snapshots.reset_time()
        sim.cmd_vel(0.1, 0.0)
        sim.run(0.5)

    record(tmp_path / "run.mcap", drive)
    assert replay(str(tmp_path / "run.mcap")).is_same


def test_added_robot_is_recorded_although_time_is_reset(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.run(0.51)
        sim.models.spawn_model(sim.robot, "b", x=-0.6)
        sim.run(0.2)
        sim.snapshots.reset_time()
        sim.run(0.5)

    record(tmp_path / "run.mcap", drive)
    assert replay(str(tmp_path / "run.mcap")).difference == ""
    first = next(e for e in Recording(str(tmp_path / "run.mcap")).entries() if e.topic == "/b/odom")
    assert first.nanoseconds == 520_000_000  # at the end of the control period in which it was received


def edited(
    run: Path,
    target: Path,
    commands: Mapping[str, object] | None = None,
    notes: Mapping[str, Mapping[str, str]] | None = None,
) -> str:
    """Copy a recording with other values in its command of 0.1 m/s, and in its metadata."""
    recording = Recording(str(run))
    writer = open_writer(str(target))
    for name, values in recording.summary().notes.items():
        writer.annotate(name, {**values, **(notes or {}).get(name, {})})
    for entry in recording.entries():
        if entry.topic == COMMANDS_TOPIC and '"linear": 0.1' in entry.message().data:
            text = json.dumps({**json.loads(entry.message().data), **(commands or {})})
            writer.write(Packet(COMMANDS_TOPIC, String(text), entry.nanoseconds))
        else:
            writer.write(entry)
    writer.close()
    return str(target)


def test_changed_command_is_found(runs: dict[str, Path], tmp_path: Path) -> None:
    again = replay(edited(runs["mcap"], tmp_path / "other.mcap", {"linear": 0.1 + 1e-12}))
    assert not again.is_same
    assert again.same_state is False


@pytest.mark.parametrize(
    "commands",
    [
        {"step": 10**12},
        {"step": "1"},
        {"step": None},
        {"do": []},
        {"do": "reset", "after": 10**12},
        {"do": "reset", "after": "x"},
        {"linear": "fast"},
        {"linear": [1]},
        {"linear": 10**400},
        {"robot": {}},
        {"deadline": "soon"},
        {"do": "attach"},
        {"do": "place"},
        {"do": "spawn_thing", "kind": 3},
        {"do": "restore", "noted": 10**30, "to": 5},
    ],
)
def test_a_damaged_command_is_one_error(
    commands: dict[str, object], runs: dict[str, Path], tmp_path: Path
) -> None:
    with pytest.raises(KbotError) as raised:
        replay(edited(runs["mcap"], tmp_path / "other.mcap", commands))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("note", "key", "value"),
    [
        ("kbot.end", "steps", "many"),
        ("kbot.end", "steps", "1" * 30),
        ("kbot", "timestep", "0"),
        ("kbot", "timestep", "nan"),
        ("kbot", "seed", "x"),
        ("kbot", "start", "[1, 2, 3, 4]"),
        ("kbot", "start", '["a", "b", "c"]'),
        ("kbot", "naming", "{"),
        ("kbot", "naming", "[[], 1, 2]"),
        ("kbot", "contacts", "glue"),
        ("kbot", "world", "nowhere"),
        ("kbot", "static_transforms", '[{"parent": 1}]'),
    ],
)
def test_damaged_metadata_is_one_error(
    note: str, key: str, value: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    with pytest.raises(KbotError) as raised:
        replay(edited(runs["mcap"], tmp_path / "other.mcap", notes={note: {key: value}}))
    assert "\n" not in str(raised.value)


def test_an_end_long_after_the_last_message_is_damaged(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stated number of steps must not simulate for ever. That of an hour of silence is valid, here 1 s."""
    monkeypatch.setattr("kbot.record.replay._LONGEST_SILENCE", 1.0)
    summary = Recording(str(runs["mcap"])).summary()
    timestep = float(summary.notes["kbot"]["timestep"])
    for seconds, is_damaged in ((0.9, False), (1.1, True)):
        steps = round((summary.end * 1e-9 + seconds) / timestep)
        end = {"kbot.end": {"steps": str(steps), "time": str(steps * timestep)}}
        path = edited(runs["mcap"], tmp_path / f"{seconds}.mcap", notes=end)
        if is_damaged:
            with pytest.raises(KbotError, match="cannot be replayed: its metadata is damaged"):
                replay(path)
        else:
            assert replay(path).simulation.steps == steps


def test_return_to_an_earlier_state_is_replayed(tmp_path: Path) -> None:
    def drive(sim: Simulation) -> None:
        sim.cmd_vel(0.3, 0.2)
        sim.run(0.333)
        before = sim.state()
        sim.run(0.1)
        sim.cmd_vel(0.0, 1.0)
        sim.run(0.1)
        sim.restore(before)
        sim.run(0.5)

    record(tmp_path / "run.mcap", drive)
    again = replay(str(tmp_path / "run.mcap"))
    assert again.is_same
    assert again.same_state


def test_return_to_a_state_before_the_recording_is_refused(tmp_path: Path) -> None:
    sim = Simulation("kbot")
    sim.cmd_vel(0.3, 0.0)
    sim.run(0.1)
    before = sim.state()
    sim.reset()
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.mcap")):
        sim.run(0.3)
        sim.restore(before)
        sim.run(0.1)
    with pytest.raises(KbotError, match="it returned to step 50, which is not in the recording"):
        replay(str(tmp_path / "run.mcap"))


def test_recording_of_another_program_is_refused(tmp_path: Path) -> None:
    writer = open_writer(str(tmp_path / "strange.mcap"))
    writer.write(Packet("/chatter", String("hello"), 5))
    writer.close()
    with pytest.raises(KbotError, match="not a recording by KBot"):
        replay(str(tmp_path / "strange.mcap"))


def test_lost_commands_are_lost_again(tmp_path: Path) -> None:
    def lose_some(sim: Simulation) -> None:
        sim.disturbances.schedule(LostCommands(0.5), 0.1, 1.0)
        for number in range(20):
            sim.robots.first.command(0.3, 0.2 * (number % 3))
            sim.run(0.1)

    record(tmp_path / "run.mcap", lose_some)
    again = replay(str(tmp_path / "run.mcap"))
    assert again.is_same, again.difference


@pytest.mark.parametrize("command", ["load_controller", "switch_controllers", "unload_controller"])
def test_commands_to_the_controller_manager_in_old_recordings_cannot_be_replayed(command: str) -> None:
    with pytest.raises(KbotError, match=f"cannot be replayed: unknown action '{command}'"):
        repeat_action(Simulation("kbot"), command, {"robot": None})
