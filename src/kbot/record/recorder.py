"""Records a simulation: its messages, and the commands that it receives."""

from __future__ import annotations

import errno
import json
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import astuple
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.brief import Brief, counted
from kbot.messages.bus import absolute
from kbot.messages.clock import Timer
from kbot.messages.program_topics import is_program_topic
from kbot.messages.types import String
from kbot.model.writer import to_urdf
from kbot.record.feed import Feed, Packet
from kbot.record.reader import readable_part
from kbot.record.world_recorder import WorldRecorder
from kbot.record.writer import open_writer, remove_recording
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.sim import Simulation

COMMANDS_TOPIC = "/kbot/commands"
DESCRIPTION_TOPIC = "/robot_description"
NODES = "nodes"
STATE_PUBLISHER = "robot_state_publisher"
TRANSFORMS = "static_transforms"
"""Metadata about the nodes that ran beside the simulation."""
FLUSH_SECONDS = 0.5
"""Wall-clock time after which messages are in the file. A killed run loses at most a second: this time, the
time until the next look at the clock, and the time that writing takes."""
LOOK_RATE = 20.0
"""Hz of simulated time at which the recorder looks at the clock."""
UPDATE_RATE = 5.0
"""Hz of simulated time at which queued messages are written."""
MOST_QUEUED = 1000
"""Messages in the queue before they are written, which bounds its memory."""


class Recorder(Brief):
    """Records a simulation from now until `close`, without influence on the run.

    `failure` is set if the file cannot be written any more. The recording has then ended, and the run
    continues.
    """

    def __init__(
        self,
        simulation: Simulation,
        feed: Feed,
        path: str,
        *,
        topics: Iterable[str] = (),
        description: str = "",
        world: str = "",
        facts: Mapping[str, str] | None = None,
        compress: bool = True,
        on_failure: Callable[[KbotError], None] | None = None,
    ) -> None:
        """Create the file and start to record.

        `topics` selects topics, all if empty. `description` is the URDF of the robot, `world` the text that
        selected the world, and `facts` is further metadata of the run.

        Raises:
            KbotError: the file cannot be created, a topic does not exist, or the run has diverged.
        """
        if simulation.engine.has_diverged:
            raise KbotError("the run has diverged: reset it first")
        self.path = path
        self._place = Path(path).absolute()
        self.failure: KbotError | None = None
        self.count = 0
        self._simulation, self._feed = simulation, feed
        self._wanted = frozenset(absolute(topic) for topic in topics)
        self._require_topics()
        self._on_failure = on_failure
        self._open: set[str] = set()
        self._queued: list[Packet] = []
        """Messages that are not written yet. Writing many at once costs a fraction of writing each alone."""
        self._inputs: frozenset[str] = frozenset()
        self._seen = -1
        self._timers: list[Timer] = []
        self._is_open = True
        self._world_recorder: WorldRecorder | None = None
        self._is_writing = False
        self._interruption: BaseException | None = None
        self._flushed = time.monotonic()
        self._writer = open_writer(path, compress=compress)
        try:
            self._guarded(lambda: self._begin(description, {**run_facts(simulation, world), **(facts or {})}))
            if self._is_open:
                self._world_recorder = None if self._wanted else WorldRecorder(simulation, self._write)
                simulation.journal.write = self._note
                self._timers = [
                    simulation.clock.every(UPDATE_RATE, self._update),
                    simulation.clock.every(LOOK_RATE, self._flush_in_time),
                ]
                simulation.robots.when_changed.append(self._update)
                simulation.bus.when_announced.append(self._update)
                self._update()
        except BaseException:
            self._detach()
            self._writer.abandon()
            remove_recording(Path(path))
            raise

    def flush(self) -> None:
        """Make all messages until now readable in the file, even after a crash."""
        self._guarded(self._write_queued)
        self._guarded(self._writer.flush)
        self._guarded(self._require_file)

    def close(self) -> None:
        """Finish the file, with the final state of the run."""
        if self._is_open:
            try:
                self._guarded(self._write_queued)
            finally:
                self._guarded(self._require_file)
                self._guarded(self._finish)
                self._detach()

    def interrupt(self, error: BaseException) -> None:
        """Raise an error from outside, such as Ctrl-C: now, or after the current write is complete."""
        if self._is_writing:
            self._interruption = error
        else:
            raise error

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _begin(self, description: str, facts: dict[str, str]) -> None:
        simulation = self._simulation
        self._writer.annotate("kbot", facts)
        text = String(description or to_urdf(simulation.robot))
        is_published = DESCRIPTION_TOPIC in simulation.bus.topics
        if not is_published or (self._wanted and DESCRIPTION_TOPIC not in self._wanted):
            self._write(Packet(DESCRIPTION_TOPIC, text, simulation.clock.nanoseconds, is_latched=True))
        self.flush()

    def _finish(self) -> None:
        simulation = self._simulation
        end = {"steps": simulation.steps, "time": simulation.time, "state_sha256": simulation.state_sha256()}
        self._writer.annotate("kbot.end", {name: str(value) for name, value in end.items()})
        self._writer.close()

    def _require_topics(self) -> None:
        known = self._feed.offered()
        for topic in sorted(self._wanted - known.keys()):
            if is_program_topic(topic):  # it appears when the program first uses it
                continue
            hint = did_you_mean(topic, known)
            raise KbotError(f"cannot record {topic}: there is no such topic" + (f": {hint}" if hint else ""))

    def _update(self) -> None:
        """Subscribe to new topics, and write the queued messages."""
        bus = self._simulation.bus
        if bus.changes != self._seen:
            for topic in self._feed.offered().keys() - self._open:
                if not self._wanted or topic in self._wanted:
                    self._open.add(topic)
                    self._feed.open(topic, self._write)
            self._inputs = bus.inputs
            self._seen = bus.changes
        self._guarded(self._write_queued)

    def _flush_in_time(self) -> None:
        now = time.monotonic()
        if now - self._flushed > FLUSH_SECONDS:
            self._flushed = now
            self.flush()

    def _write(self, packet: Packet) -> None:
        self._queued.append(packet)
        # write messages from outside at once, so that an error is raised to their sender
        if packet.topic in self._inputs or len(self._queued) > MOST_QUEUED:
            self._guarded(self._write_queued)

    def _write_queued(self) -> None:
        """Write the queued messages. Raises KbotError: a message does not match its type; the others are
        written."""
        queued, self._queued = self._queued, []
        refused: KbotError | None = None
        for packet in queued:
            try:
                self._writer.write(packet)
                self.count += 1
            except KbotError as error:
                refused = refused or KbotError(f"{packet.topic}: a message cannot be recorded: {error}")
        if refused is not None:
            raise refused

    def _require_file(self) -> None:
        """Check that the file still exists. Raises OSError if not: data written to it would be lost."""
        if not self._place.exists():
            raise OSError(errno.ENOENT, "the file was moved or deleted, or its disk was removed")

    def _note(self, what: str, numbers: dict[str, object]) -> None:
        text = json.dumps({"step": self._simulation.steps, "do": what, **numbers})
        self._write(Packet(COMMANDS_TOPIC, String(text), self._simulation.clock.nanoseconds))
        if self._world_recorder is not None:
            self._world_recorder.record_changes()

    def _guarded(self, work: Callable[[], None]) -> None:
        if not self._is_open:
            return
        self._is_writing = True
        try:
            work()
        except OSError as error:
            self._fail(error)
        finally:
            self._is_writing = False
        if self._interruption is not None:
            interruption, self._interruption = self._interruption, None
            raise interruption

    def _fail(self, error: OSError) -> None:
        self._detach()
        self._writer.abandon()
        reason = error.strerror or str(error)
        at = self._simulation.time
        if self.count == 0:
            remove_recording(Path(self.path))
            self.failure = KbotError(f"{self.path} cannot be written: {reason}")
        else:
            consequence = f"the recording ended at {at:.2f} s: {readable_part(self.path)}"
            self.failure = KbotError(f"{self.path}: {reason}; {consequence}")
        if self._on_failure is not None:
            self._on_failure(self.failure)

    def _detach(self) -> None:
        self._is_open = False
        self._queued.clear()
        self._simulation.journal.write = None
        if self._update in self._simulation.robots.when_changed:
            self._simulation.robots.when_changed.remove(self._update)
            self._simulation.bus.when_announced.remove(self._update)
        for timer in self._timers:
            timer.cancel()
        if self._world_recorder is not None:
            self._world_recorder.close()
        for topic in self._open:
            self._feed.close(topic, self._write)

    def _shown(self) -> Iterator[str]:
        yield repr(self.path)
        yield counted(self.count, "message")


def run_facts(simulation: Simulation, world: str = "") -> dict[str, str]:
    """The metadata of a run: all inputs that it depends on, and the versions that made it."""
    return {
        "robot": simulation.robot.name,
        "world": world or simulation.world.name,
        "seed": str(simulation.seed),
        "timestep": repr(simulation.timestep),
        "contacts": str(simulation.contacts),
        "start": json.dumps(astuple(simulation.start)),
        "naming": json.dumps(astuple(simulation.robots.first.naming)),
        "first_step": str(simulation.steps),
        "first_note": str(simulation.journal.count),
        "kbot": version("kbot"),
        "mujoco": _engine_version(),
        "python": platform.python_version(),
        "machine": platform.platform(),
    }


def _engine_version() -> str:
    import mujoco  # imported lazily: it is slow to import

    return str(mujoco.__version__)
