"""A recorded run done again: the same robot, world, seed and commands, and whether the motion is the same."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kbot.kinematics.odometry import PlanarPose
from kbot.model.load import load_robot_text
from kbot.record.branches import Branches
from kbot.record.entry import Entry
from kbot.record.feed import Feed, Packet
from kbot.record.formats import FIRST_MOMENT, read_text
from kbot.record.journal import do_again, read_command
from kbot.record.reader import Recording, Summary
from kbot.record.recorder import COMMANDS_TOPIC, DESCRIPTION_TOPIC, NODES, STATE_PUBLISHER, TRANSFORMS
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.tf.state_publishers import StatePublishers
from kbot.tf.static_transforms import from_json, publish_static_transforms
from kbot.xacro import Packages

MADE_BY_SIMULATION = frozenset({"/clock", "/tf", "/tf_static"})
MADE_BY_ROBOTS = frozenset({"odom", "joint_states"})
"""In the namespace of each."""
REPLAYED_FROM = frozenset({COMMANDS_TOPIC, DESCRIPTION_TOPIC})
"""What the run is done again from."""
TURNS_TIME_BACK = frozenset({"reset", "reset_time", "restore"})


@dataclass(frozen=True, slots=True)
class Replayed:
    """How a run came out when it was done again.

    `difference` names the first message that was not the same, empty when all were; `same_state` says
    whether the engine ended in the recorded state, None where the recording does not tell. `left_out` has the
    number of messages by topic that were held against nothing, as those of sensors, nodes and programs.
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
    """Do the run of a recording again and compare, message by message, bit for bit.

    Raises:
        KbotError: it is no recording of a run by KBot from its start, or its robot cannot be read.
    """
    recording = Recording(path)
    summary = recording.summary()
    simulation = _simulation(path, recording, summary, packages)
    comparison = _Comparison(recording, frozenset(filter(_is_made_again, summary.topics)))
    comparison.hear(Feed(simulation.bus, lambda: simulation.clock.nanoseconds))
    last = 0
    if summary.kind != "MCAP":
        _refuse_resets(recording, summary)
    branches = Branches(recording, summary)
    for entry in recording.entries():
        if entry.topic == COMMANDS_TOPIC:
            command = read_command(entry)
            branches.pass_by(simulation)
            _obey(simulation, command, round(last / (simulation.timestep * 1e9)), branches)
            comparison.hear_new()
            last = simulation.clock.nanoseconds
        else:
            last = entry.nanoseconds
    end = summary.notes.get("kbot.end", {})
    final = int(end["steps"]) if "steps" in end else round(last / (simulation.timestep * 1e9))
    simulation.step(max(0, final - simulation.steps))
    state = simulation.state_sha256() == end["state_sha256"] if "state_sha256" in end else None
    difference = comparison.finish(bool(end))
    return Replayed(simulation, comparison.count, comparison.left_out, difference, state)


def _is_made_again(topic: str) -> bool:
    return topic in MADE_BY_SIMULATION or topic.rpartition("/")[2] in MADE_BY_ROBOTS


def _simulation(path: str, recording: Recording, summary: Summary, packages: Packages | None) -> Simulation:
    facts = summary.notes.get("kbot")
    text = next((read_text(e) for e in recording.entries() if e.topic == DESCRIPTION_TOPIC), None)
    if "kbot.cut" in summary.notes:
        raise KbotError(f"{path} is a part of a recording: only one that is whole can be done again")
    if facts is None or text is None:
        raise KbotError(f"{path} is no recording by KBot: its robot and world are not in it")
    if facts["first_step"] != "0":
        raise KbotError(f"{path} begins at step {facts['first_step']} of its run, so it cannot be done again")
    robot = load_robot_text(text, f"{path}.urdf", packages=packages).require()
    try:
        seed, timestep = int(facts["seed"]), float(facts["timestep"])
        start = PlanarPose(*parse_json(facts.get("start", "[0, 0, 0]")))
        naming = Naming(*parse_json(facts.get("naming", "[]")))
        transforms = from_json(facts.get(TRANSFORMS, "[]"))
    except (LookupError, TypeError, ValueError):
        raise KbotError(f"{path} cannot be run again: the facts of its run are damaged") from None
    simulation = Simulation(
        robot,
        facts["world"],
        seed,
        timestep=timestep,
        contacts=facts["contacts"],
        start=start,
        naming=naming,
    )
    if facts.get(NODES) == STATE_PUBLISHER:
        StatePublishers(simulation)
    if transforms:
        publish_static_transforms(simulation.bus, simulation.clock, transforms)
    return simulation


def _refuse_resets(recording: Recording, summary: Summary) -> None:
    """ROS sorts its recordings by time, and a reset starts it anew."""
    for entry in recording.entries():
        if entry.topic == COMMANDS_TOPIC and read_command(entry)["do"] in TURNS_TIME_BACK:
            kind = summary.kind
            raise KbotError(f"the run was reset, and a {kind} does not keep the order: record it as .mcap")


def _obey(simulation: Simulation, command: dict[str, Any], last_step: int, branches: Branches) -> None:
    """Do what was done, at the step at which it was done."""
    what, step = command.pop("do"), command.pop("step")
    if what in TURNS_TIME_BACK:
        step = command.pop("after", last_step)
    simulation.step(max(0, step - simulation.steps))
    if what == "restore":
        branches.go_back(simulation, command["noted"], command["to"])
    else:
        do_again(simulation, what, command)


class _Comparison:
    """Holds what is made now against what was recorded, topic by topic."""

    def __init__(self, recording: Recording, topics: frozenset[str]) -> None:
        self.count = 0
        self._others: Counter[str] = Counter()
        self._waiting = set(topics)
        self._feed: Feed | None = None
        self._recorded: dict[str, list[Entry]] = defaultdict(list)
        for entry in recording.entries():
            if entry.topic in topics:
                self._recorded[entry.topic].append(entry)
            elif entry.topic not in REPLAYED_FROM:
                self._others[entry.topic] += 1
        self._at: dict[str, int] = defaultdict(int)
        self._difference = ""

    @property
    def left_out(self) -> dict[str, int]:
        """How many messages of which topics were held against nothing, most of them first."""
        unsaid = {topic: len(recorded) for topic in self._waiting if (recorded := self._recorded[topic])}
        return dict(sorted({**self._others, **unsaid}.items(), key=lambda one: (-one[1], one[0])))

    def hear(self, feed: Feed) -> None:
        """Hold what comes from this feed against the recording."""
        self._feed = feed
        self.hear_new()

    def hear_new(self) -> None:
        """Hear those topics too that came up since, with a robot."""
        feed = self._feed
        if feed is None or not self._waiting:
            return
        for topic in self._waiting & feed.offered().keys():
            self._waiting.remove(topic)
            feed.open(topic, self.made)

    def made(self, packet: Packet) -> None:
        recorded, at = self._recorded[packet.topic], self._at[packet.topic]
        if at == 0 and max(FIRST_MOMENT, packet.nanoseconds) < recorded[0].nanoseconds:
            return  # of a robot that came in the midst of the run: it was not heard at once
        self._at[packet.topic] += 1
        if self._difference or at >= len(recorded):
            return
        self.count += 1
        if recorded[at].cdr != packet.cdr:
            self._difference = f"{packet.topic} at {recorded[at].nanoseconds * 1e-9:.3f} s is not as recorded"

    def finish(self, is_whole: bool) -> str:
        """The first difference, empty when there is none."""
        for topic, recorded in self._recorded.items():
            if topic in self._waiting:
                continue  # said by others than robots, as a recording that was played
            if not self._difference and is_whole and self._at[topic] != len(recorded):
                return f"{topic} came {self._at[topic]} times, not {len(recorded)}"
        return self._difference
