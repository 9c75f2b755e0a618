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
    """Do one thing that `Simulation.journal` told of, now.

    Raises:
        KbotError: it cannot be done again.
    """
    if what in _PLAIN:
        getattr(simulation, what)(**note)
    elif what in _OTHERS:
        _OTHERS[what](simulation, note)
    else:
        told = f"at {simulation.time:g} s something was done to the run that cannot be done again"
        raise KbotError(f"{told}: {what}")


_PLAIN = frozenset(
    {
        "attach", "clear_body_wrenches", "command_joints", "detach", "end_fault",
        "follow_trajectory", "release_joint", "reset", "reset_time", "reset_world", "set_joint", "set_pose",
        "set_twist", "spawn_thing",
    }
)  # fmt: skip
"""Methods of a simulation that are called with just what is noted."""


def _twist(simulation: Simulation, note: Note) -> None:
    robot, deadline = simulation.named(note["robot"]), note["deadline"]
    watchdog = None if deadline is None else (deadline - simulation.steps) * simulation.timestep
    simulation.take_command(robot, note["linear"], note["angular"], watchdog)


def _place(simulation: Simulation, note: Note) -> None:
    simulation.place(PlanarPose(note["x"], note["y"], note["yaw"]), note["joints"])


def _wrench(simulation: Simulation, note: Note) -> None:
    duration = (note["until"] - simulation.steps) * simulation.timestep
    simulation.apply_body_wrench(note["link"], note["force"], duration, note["torque"], note["robot"])


def _spawn(simulation: Simulation, note: Note) -> None:
    robot = load_robot_text(note["description"], f"{note['robot']}.urdf").require()
    simulation.spawn_model(
        robot,
        note["robot"],
        note["x"],
        note["y"],
        note["yaw"],
        namespace=note.get("namespace"),
        frame_prefix=note.get("frame_prefix"),
    )


_OTHERS: Mapping[str, Callable[[Simulation, Note], object]] = {
    "apply_body_wrench": _wrench,
    "delete_model": lambda simulation, note: simulation.delete_model(note["robot"]),
    "place": _place,
    "schedule": lambda simulation, note: simulation.schedule(
        from_journal(note), note["at"], note["duration"]
    ),
    "set_model_state": lambda simulation, note: simulation.set_model_state(
        note["model"], Transform(note["matrix"]), note["linear"], note["angular"]
    ),
    "spawn_model": _spawn,
    "spawn_sdf": lambda simulation, note: simulation.spawn_sdf(
        note["sdf"], note["name"], Transform(note["matrix"]), note.get("is_confined", False)
    ),
    "twist": _twist,
}
