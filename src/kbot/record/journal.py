"""What was done to a simulation from outside, done again as its journal has it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from kbot.kinematics.odometry import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model.load import load_robot_text
from kbot.record.entry import Entry
from kbot.record.formats import read_fields
from kbot.sim import Simulation
from kbot.sim.faults import from_journal
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

Note = Mapping[str, Any]


def read_command(entry: Entry) -> dict[str, Any]:
    """What was done, and at which step. Raises KbotError: the message is none of KBot's."""
    command = read_fields(entry)
    is_told = isinstance(command.get("do"), str) and isinstance(command.get("step"), int)
    if command.get("do") == "restore":
        is_told = is_told and all(isinstance(command.get(key), int) for key in ("noted", "to"))
    if not is_told:
        raise KbotError(f"{entry.place} is not a valid command record")
    return command


def do_again(simulation: Simulation, what: str, note: Note) -> None:
    """Do one action of a simulation's journal again, now.

    Raises:
        KbotError: it cannot be done again.
    """
    if what not in _ACTIONS:
        told = f"at {simulation.time:g} s something was done to the run that cannot be done again"
        raise KbotError(f"{told}: {what}")
    _ACTIONS[what](simulation, note)


def _twist(simulation: Simulation, note: Note) -> None:
    robot, deadline = simulation.robots.named(note["robot"]), note["deadline"]
    watchdog = None if deadline is None else (deadline - simulation.steps) * simulation.timestep
    robot.send_twist(note["linear"], note["angular"], watchdog)


def _place(simulation: Simulation, note: Note) -> None:
    simulation.models.place(PlanarPose(note["x"], note["y"], note["yaw"]), note["joints"])


def _wrench(simulation: Simulation, note: Note) -> None:
    duration = (note["until"] - simulation.steps) * simulation.timestep
    simulation.disturbances.apply_body_wrench(
        note["link"], note["force"], duration, note["torque"], note["robot"]
    )


def _spawn_model(simulation: Simulation, note: Note) -> None:
    robot = load_robot_text(note["description"], f"{note['robot']}.urdf").require()
    simulation.models.spawn_model(
        robot,
        note["robot"],
        note["x"],
        note["y"],
        note["yaw"],
        namespace=note.get("namespace"),
        frame_prefix=note.get("frame_prefix"),
    )


def _spawn_sdf(simulation: Simulation, note: Note) -> None:
    simulation.models.spawn_sdf(
        note["sdf"], note["name"], Transform(note["matrix"]), note.get("is_confined", False)
    )


def _model_state(simulation: Simulation, note: Note) -> None:
    pose = Transform(note["matrix"])
    simulation.models.set_model_state(note["model"], pose, note["linear"], note["angular"])


_ACTIONS: Mapping[str, Callable[[Simulation, Note], object]] = {
    "apply_body_wrench": _wrench,
    "attach": lambda sim, note: sim.models.attach(**note),
    "clear_body_wrenches": lambda sim, note: sim.disturbances.clear_body_wrenches(**note),
    "command_joints": lambda sim, note: _robot(sim, note).command_joints(note["values"], note["interface"]),
    "delete_model": lambda sim, note: sim.models.delete_model(note["robot"]),
    "detach": lambda sim, note: sim.models.detach(**note),
    "end_fault": lambda sim, note: sim.disturbances.end_fault(**note),
    "follow_trajectory": lambda sim, note: _robot(sim, note).follow_trajectory(
        note["joints"], note["points"]
    ),
    "place": _place,
    "release_joint": lambda sim, note: _robot(sim, note).release_joint(note["joint"]),
    "reset": lambda sim, note: sim.reset(),
    "reset_time": lambda sim, note: sim.snapshots.reset_time(),
    "reset_world": lambda sim, note: sim.snapshots.reset_world(),
    "schedule": lambda sim, note: sim.disturbances.schedule(from_journal(note), note["at"], note["duration"]),
    "set_joint": lambda sim, note: _robot(sim, note).set_joint(note["joint"], note["position"]),
    "set_model_state": _model_state,
    "set_pose": lambda sim, note: sim.models.set_pose(**note),
    "set_twist": lambda sim, note: sim.models.set_twist(**note),
    "spawn_model": _spawn_model,
    "spawn_sdf": _spawn_sdf,
    "spawn_thing": lambda sim, note: sim.models.spawn_thing(**note),
    "twist": _twist,
}
"""What repeats each action, by its name in the journal. The names are part of the format of recordings."""


def _robot(simulation: Simulation, note: Note) -> SimulatedRobot:
    """The robot of a note; older recordings do not name the first."""
    return simulation.robots.named(note.get("robot"))
