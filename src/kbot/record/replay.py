"""Replays a recorded run: simulates it again from the recorded commands, and compares the messages."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isclose
from typing import Any

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages.program_topics import is_program_topic
from kbot.model.load import load_robot_text
from kbot.record.entry import RecordedMessage
from kbot.record.feed import Feed, Packet
from kbot.record.formats import FIRST_TIME, read_fields, read_text
from kbot.record.reader import Recording, Summary
from kbot.record.recorder import COMMANDS_TOPIC, DESCRIPTION_TOPIC, NODES, STATE_PUBLISHER, TRANSFORMS
from kbot.sim import Simulation
from kbot.sim.injected_faults import from_journal
from kbot.sim.naming import Naming
from kbot.sim.robot import SimulatedRobot
from kbot.sim.snapshots import Snapshot
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.tf.state_publishers import StatePublishers
from kbot.tf.static_transforms import from_json, publish_static_transforms
from kbot.xacro import Packages

Note = Mapping[str, Any]  # Any: JSON
_NOT_OF_KBOT = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What is raised for values that KBot does not record: wrong types, missing keys, too large numbers."""


def read_command(entry: RecordedMessage) -> dict[str, Any]:
    """The action and its step from a message on COMMANDS_TOPIC. Raises KbotError: KBot did not write it."""
    command = read_fields(entry)
    is_valid = isinstance(command.get("do"), str) and isinstance(command.get("step"), int)
    if command.get("do") == "restore":
        is_valid = is_valid and all(isinstance(command.get(key), int) for key in ("noted", "to"))
    if not is_valid:
        raise KbotError(f"{entry.place} is not a valid command record")
    return command


def repeat_action(simulation: Simulation, what: str, note: Note) -> None:
    """Repeat one action of a simulation's journal now.

    Raises:
        KbotError: the action is unknown.
    """
    if what not in _ACTIONS:
        raise KbotError(f"the run cannot be replayed: unknown action '{what}' at {simulation.time:g} s")
    _ACTIONS[what](simulation, note)


def _twist(simulation: Simulation, note: Note) -> None:
    robot, deadline = simulation.robots.named(note["robot"]), note["deadline"]
    watchdog = None if deadline is None else (deadline - simulation.steps) * simulation.timestep
    robot.send_twist(note["linear"], note["angular"], watchdog, note.get("lateral", 0.0))


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
"""The functions that repeat actions, by the action's name in the journal. The names are part of the recording
format.
"""


def _robot(simulation: Simulation, note: Note) -> SimulatedRobot:
    """The robot of a note. Older recordings do not name the first robot."""
    return simulation.robots.named(note.get("robot"))


_LONGEST_SILENCE = 3600.0
"""Seconds without a message before an action or the end. A damaged step must not simulate for ever."""
_LONGEST_REASON = 200
"""Characters of a reason. It may quote any text of the recording."""


class ReturnStates:
    """The earlier states that a run returned to, saved when the replay reaches them.

    A state is identified by the number of journal entries when it was saved, and by its step.
    """

    def __init__(self, recording: Recording, summary: Summary) -> None:
        self._path = recording.path
        self._first = int(summary.notes.get("kbot", {}).get("first_note", "0"))
        self._wanted: dict[int, set[int]] = defaultdict(set)
        for entry in recording.entries():
            if entry.topic == COMMANDS_TOPIC:
                command = read_command(entry)
                if command["do"] == "restore":
                    self._wanted[command["noted"] - self._first].add(command["to"])
        self._states: dict[tuple[int, int], Snapshot] = {}
        self._count = 0

    def save(self, simulation: Simulation) -> None:
        """Step to the states that were saved before the next action, and save them. Call this before each
        action."""
        for step in sorted(self._wanted[self._count]):
            if step >= simulation.steps:
                simulation.step(step - simulation.steps)
                self._states[self._count, step] = simulation.state()
        self._count += 1

    def restore(self, simulation: Simulation, noted: int, step: int) -> None:
        """Return to an earlier state. Raises KbotError: the state is from before the recording."""
        state = self._states.get((noted - self._first, step))
        if state is None:
            reason = f"it returned to step {step}, which is not in the recording"
            raise KbotError(f"{self._path} cannot be replayed: {reason}")
        simulation.restore(state)


MADE_BY_SIMULATION = frozenset({"/clock", "/tf", "/tf_static"})
MADE_BY_ROBOTS = frozenset({"odom", "joint_states"})
"""Last parts of topic names, in the namespace of each robot."""
REPLAYED_FROM = frozenset({COMMANDS_TOPIC, DESCRIPTION_TOPIC})
"""Inputs of the replay."""
RESETS_TIME = frozenset({"reset", "reset_time", "restore"})
"""Actions after which the simulated time is earlier."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """The result of a replay.

    `difference` describes the first message that differs, empty if there is none. `same_state` is whether the
    engine ended in the recorded state, None if the recording does not contain it. `left_out` is the number of
    messages by topic that were not compared, such as those of sensors, nodes and programs.
    """

    simulation: Simulation
    compared: int
    left_out: Mapping[str, int]
    difference: str
    same_state: bool | None

    @property
    def is_same(self) -> bool:
        return not self.difference and self.same_state is not False


def replay(path: str, packages: Packages | None = None) -> Replayed:
    """Repeat the run of a recording and compare all messages, bit for bit.

    Raises:
        KbotError: it is not a recording by KBot from the start of a run, or its robot cannot be read.
    """
    recording = Recording(path)
    summary = recording.summary()
    simulation = _simulation(path, recording, summary, packages)
    comparison = _Comparison(recording, frozenset(filter(_is_repeated, summary.topics)))
    comparison.subscribe(Feed(simulation.bus, lambda: simulation.clock.nanoseconds))
    most = round(((summary.end or 0) * 1e-9 + _LONGEST_SILENCE) / simulation.timestep)
    last = 0
    if summary.kind != "MCAP":
        _refuse_resets(recording, summary)
    states = ReturnStates(recording, summary)
    for entry in recording.entries():
        if entry.topic == COMMANDS_TOPIC:
            command = read_command(entry)
            states.save(simulation)
            try:
                if max(command["step"], command.get("after", 0)) > most:
                    raise ValueError("its step is after the end of the recording")
                _repeat(simulation, command, round(last / (simulation.timestep * 1e9)), states)
            except _NOT_OF_KBOT as error:
                what = " ".join(repr(error).split())[:_LONGEST_REASON]
                raise KbotError(f"{entry.place} is not a valid command record: {what}") from None
            comparison.subscribe_new()
            last = simulation.clock.nanoseconds
        else:
            last = entry.nanoseconds
    end = summary.notes.get("kbot.end", {})
    try:
        final = int(end["steps"]) if "steps" in end else round(last / (simulation.timestep * 1e9))
        seconds = final * simulation.timestep
        if final > most or not isclose(seconds, float(end.get("time", seconds))):
            raise ValueError
    except (ValueError, OverflowError):
        raise _damaged(path) from None
    simulation.step(max(0, final - simulation.steps))
    state = simulation.state_sha256() == end["state_sha256"] if "state_sha256" in end else None
    difference = comparison.finish(bool(end))
    return Replayed(simulation, comparison.count, comparison.left_out, difference, state)


def _is_repeated(topic: str) -> bool:
    if is_program_topic(topic):  # it may plot a value called odom
        return False
    return topic in MADE_BY_SIMULATION or topic.rpartition("/")[2] in MADE_BY_ROBOTS


def _simulation(path: str, recording: Recording, summary: Summary, packages: Packages | None) -> Simulation:
    facts = summary.notes.get("kbot")
    text = next((read_text(e) for e in recording.entries() if e.topic == DESCRIPTION_TOPIC), None)
    if "kbot.cut" in summary.notes:
        raise KbotError(f"{path} was cut from a recording: only a whole recording can be replayed")
    if facts is None or text is None:
        raise KbotError(f"{path} cannot be replayed: it is not a recording by KBot with robot and world")
    if (first := facts.get("first_step", "0")) != "0":
        raise KbotError(f"{path} begins at step {first} of its run, so it cannot be replayed")
    robot = load_robot_text(text, f"{path}.urdf", packages=packages).require()
    try:
        seed, timestep = int(facts["seed"]), float(facts["timestep"])
        start = PlanarPose(*parse_json(facts.get("start", "[0, 0, 0]")))
        naming = Naming(*parse_json(facts.get("naming", "[]")))
        transforms = from_json(facts.get(TRANSFORMS, "[]"))
        simulation = Simulation(
            robot,
            facts["world"],
            seed,
            timestep=timestep,
            contacts=facts["contacts"],
            start=start,
            naming=naming,
        )
    except _NOT_OF_KBOT:
        raise _damaged(path) from None
    if facts.get(NODES) == STATE_PUBLISHER:
        StatePublishers(simulation)
    if transforms:
        publish_static_transforms(simulation.bus, simulation.clock, transforms)
    return simulation


def _damaged(path: str) -> KbotError:
    return KbotError(f"{path} cannot be replayed: its metadata is damaged")


def _refuse_resets(recording: Recording, summary: Summary) -> None:
    """Raise a KbotError if the run was reset: ROS formats sort messages by time, and a reset sets time
    back."""
    for entry in recording.entries():
        if entry.topic == COMMANDS_TOPIC and read_command(entry)["do"] in RESETS_TIME:
            kind = summary.kind
            raise KbotError(
                f"the run was reset, and a {kind} does not keep the order of messages: record it as .mcap"
            )


def _repeat(simulation: Simulation, command: dict[str, Any], last_step: int, states: ReturnStates) -> None:
    """Repeat an action at its recorded step."""
    what, step = command.pop("do"), command.pop("step")
    if what in RESETS_TIME:
        step = command.pop("after", last_step)
    simulation.step(max(0, step - simulation.steps))
    if what == "restore":
        states.restore(simulation, command["noted"], command["to"])
    else:
        repeat_action(simulation, what, command)


class _Comparison:
    """Compares the messages of the replay with the recorded ones, by topic."""

    def __init__(self, recording: Recording, topics: frozenset[str]) -> None:
        self.count = 0
        self._others: Counter[str] = Counter()
        self._waiting = set(topics)
        self._feed: Feed | None = None
        self._recorded: dict[str, list[RecordedMessage]] = defaultdict(list)
        for entry in recording.entries():
            if entry.topic in topics:
                self._recorded[entry.topic].append(entry)
            elif entry.topic not in REPLAYED_FROM:
                self._others[entry.topic] += 1
        self._at: dict[str, int] = defaultdict(int)
        self._difference = ""

    @property
    def left_out(self) -> dict[str, int]:
        """The number of messages by topic that were not compared, in descending order."""
        unpublished = {topic: len(recorded) for topic in self._waiting if (recorded := self._recorded[topic])}
        return dict(sorted({**self._others, **unpublished}.items(), key=lambda item: (-item[1], item[0])))

    def subscribe(self, feed: Feed) -> None:
        """Compare the messages of this feed with the recording."""
        self._feed = feed
        self.subscribe_new()

    def subscribe_new(self) -> None:
        """Subscribe also to topics that were added since, with a robot."""
        feed = self._feed
        if feed is None or not self._waiting:
            return
        for topic in self._waiting & feed.offered().keys():
            self._waiting.remove(topic)
            feed.open(topic, self.compare)

    def compare(self, packet: Packet) -> None:
        recorded, at = self._recorded[packet.topic], self._at[packet.topic]
        if at == 0 and max(FIRST_TIME, packet.nanoseconds) < recorded[0].nanoseconds:
            return  # from a robot that was added during the run: the recorder subscribed a little later
        self._at[packet.topic] += 1
        if self._difference or at >= len(recorded):
            return
        self.count += 1
        if recorded[at].cdr != packet.cdr:
            self._difference = (
                f"{packet.topic} at {recorded[at].nanoseconds * 1e-9:.3f} s differs from the recording"
            )

    def finish(self, is_whole: bool) -> str:
        """The first difference, empty if there is none."""
        for topic, recorded in self._recorded.items():
            if topic in self._waiting:
                continue  # published by another node, for example a playback
            if not self._difference and is_whole and self._at[topic] != len(recorded):
                return f"{topic} has {self._at[topic]} messages, not {len(recorded)}"
        return self._difference
