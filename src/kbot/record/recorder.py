"""Records a simulation: its messages and the commands that it receives, as they occur."""

from __future__ import annotations

import errno
import json
import platform
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import astuple
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.messages.bus import absolute
from kbot.messages.types import String
from kbot.model.writer import to_urdf
from kbot.record.feed import Feed, Packet
from kbot.record.reader import kept
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
"""What a recording's facts say of nodes that ran beside the simulation."""
FLUSH_SECONDS = 1.0
"""Wall time after which what was said is in the file, at the latest."""
LOOK_RATE = 5.0
"""Hz of simulated time at which what was said is written down."""
MOST_AT_ONCE = 1000
"""Messages that wait to be written down."""


class Recorder:
    """Records a simulation from where it stands until `close`; what is recorded does not change the run.

    `failure` is set when the disk takes no more: the recording has ended then, and the run goes on.
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
        """`topics` empty means all. `description` is the URDF that the robot was read from, `world` the
        text that named the world, `facts` what else is to be known of the run.

        Raises:
            KbotError: the file cannot be made, a topic is asked for that nobody speaks on, or the run has
                diverged.
        """
        if simulation.engine.has_diverged:
            raise KbotError("the run has diverged: reset it first")
        self.path = path
        self._place = Path(path).absolute()
        self.failure: KbotError | None = None
        self.count = 0
        self._simulation, self._feed = simulation, feed
        self._wanted = frozenset(absolute(topic) for topic in topics)
        self._refuse_unknown()
        self._on_failure = on_failure
        self._open: set[str] = set()
        self._waiting: list[Packet] = []
        """What was said since it was written down last: many at once cost a fraction of each by itself."""
        self._inputs: frozenset[str] = frozenset()
        self._seen = -1
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
                self._timer = simulation.clock.every(LOOK_RATE, self._look)
                simulation.robots.when_changed.append(self._look)
                self._look()
        except BaseException:
            self._detach()
            self._writer.abandon()
            remove_recording(Path(path))
            raise

    def flush(self) -> None:
        """Let the file have what was said until now, whatever happens next."""
        self._guarded(self._write_down)
        self._guarded(self._writer.flush)
        self._guarded(self._require_file)

    def close(self) -> None:
        """Finish the file: readable whole, with the state that the run ended in."""
        if self._is_open:
            try:
                self._guarded(self._write_down)
            finally:
                self._guarded(self._require_file)
                self._guarded(self._finish)
                self._detach()

    def interrupt(self, error: BaseException) -> None:
        """Raise an error that comes from outside, as Ctrl-C does: now, or when what is being written is."""
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
        is_said = DESCRIPTION_TOPIC in simulation.bus.topics
        if not is_said or (self._wanted and DESCRIPTION_TOPIC not in self._wanted):
            self._write(Packet(DESCRIPTION_TOPIC, text, simulation.clock.nanoseconds))
        self.flush()

    def _finish(self) -> None:
        simulation = self._simulation
        end = {"steps": simulation.steps, "time": simulation.time, "state_sha256": simulation.state_sha256()}
        self._writer.annotate("kbot.end", {name: str(value) for name, value in end.items()})
        self._writer.close()

    def _refuse_unknown(self) -> None:
        known = self._feed.offered()
        for topic in sorted(self._wanted - known.keys()):
            hint = did_you_mean(topic, known)
            raise KbotError(f"there is no topic {topic} to record" + (f": {hint}" if hint else ""))

    def _look(self) -> None:
        """Hear topics that are new, and let the file have what waits for it."""
        bus = self._simulation.bus
        if bus.changes != self._seen:
            for topic in self._feed.offered().keys() - self._open:
                if not self._wanted or topic in self._wanted:
                    self._open.add(topic)
                    self._feed.open(topic, self._write)
            self._inputs = bus.inputs
            self._seen = bus.changes
        self._guarded(self._write_down)
        now = time.monotonic()
        if now - self._flushed > FLUSH_SECONDS:
            self._flushed = now
            self.flush()

    def _write(self, packet: Packet) -> None:
        self._waiting.append(packet)
        # what comes from outside is refused where it is given, if it is
        if packet.topic in self._inputs or len(self._waiting) > MOST_AT_ONCE:
            self._guarded(self._write_down)

    def _write_down(self) -> None:
        """Raises KbotError: a message is not what its type says; the others are written."""
        waiting, self._waiting = self._waiting, []
        refused: KbotError | None = None
        for packet in waiting:
            try:
                self._writer.write(packet)
                self.count += 1
            except KbotError as error:
                refused = refused or KbotError(f"{packet.topic}: a message cannot be recorded: {error}")
        if refused is not None:
            raise refused

    def _require_file(self) -> None:
        """Raises OSError: what is written would go where nobody finds it."""
        if not self._place.exists():
            raise OSError(errno.ENOENT, "it was moved or deleted, or its disk was taken away")

    def _note(self, what: str, numbers: dict[str, object]) -> None:
        text = json.dumps({"step": self._simulation.steps, "do": what, **numbers})
        self._write(Packet(COMMANDS_TOPIC, String(text), self._simulation.clock.nanoseconds))
        if self._world_recorder is not None:
            self._world_recorder.look()

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
            told = f"the recording ended at {at:.2f} s: {kept(self.path)}"
            self.failure = KbotError(f"{self.path}: {reason}; {told}")
        if self._on_failure is not None:
            self._on_failure(self.failure)

    def _detach(self) -> None:
        self._is_open = False
        self._waiting.clear()
        self._simulation.journal.write = None
        if self._look in self._simulation.robots.when_changed:
            self._simulation.robots.when_changed.remove(self._look)
        if hasattr(self, "_timer"):
            self._timer.cancel()
        if self._world_recorder is not None:
            self._world_recorder.close()
        for topic in self._open:
            self._feed.close(topic, self._write)


def run_facts(simulation: Simulation, world: str = "") -> dict[str, str]:
    """What a run depends on, and what made it."""
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
    import mujoco  # slow to import; a view is recorded without it

    return str(mujoco.__version__)
