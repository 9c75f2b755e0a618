"""The outputs of a run: transforms, a recording, and messages to peers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from kbot.messages import ClockMessage, String, Timer
from kbot.messages.live import Live
from kbot.model.writer import to_urdf
from kbot.record.feed import Feed
from kbot.record.record_options import RecordOptions
from kbot.record.recorder import NODES, STATE_PUBLISHER, TRANSFORMS, Recorder
from kbot.text import KbotError
from kbot.tf.state_publishers import StatePublishers
from kbot.tf.static_transforms import StaticTransform, publish_static_transforms, to_json

if TYPE_CHECKING:
    from kbot.sim import Simulation

CLOCK_RATE = 50.0
"""Hz of /clock if no simulation publishes it."""


class Peers(Protocol):
    """The other programs that receive a run's messages. One feed serves them and the recording, so that each
    message is encoded once."""

    def join(self, simulation: Simulation, feed: Feed, description: str, world: str) -> None: ...

    def show(
        self, shown: Live, feed: Feed, description: str, name: str, *, publishes_clock: bool
    ) -> None: ...

    def leave(self) -> None: ...

    def close(self) -> None: ...


class RunOutputs:
    """The outputs of one command. `join` also accepts a simulation that replaces another."""

    def __init__(
        self,
        report: Callable[[str], None],
        record: RecordOptions | None = None,
        peers: Peers | None = None,
        transforms: Sequence[StaticTransform] = (),
    ) -> None:
        """`report` receives messages for the user. `transforms` are published in addition to the robots'
        own."""
        self._report, self._peers = report, peers
        self._record = record or RecordOptions()
        self._transforms = tuple(transforms)
        self.failure: KbotError | None = None
        """Why the recording ended early, if it did."""
        self._recorder: Recorder | None = None
        self._publishers: StatePublishers | None = None
        self._timer: Timer | None = None
        self._joined = 0
        self._first_world = ""

    def join(self, simulation: Simulation, description: str, world: str) -> None:
        """Publish and record a simulation from now on. `description` is its URDF, generated if empty. `world`
        is the name of its world.

        Raises:
            KbotError: the recording cannot be created, or a bridge cannot be opened.
        """
        self._leave()
        description = description or to_urdf(simulation.robot)
        self._first_world = self._first_world or simulation.world.name
        if simulation.world.name != self._first_world:
            world = simulation.world.name
        feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
        self._publishers = StatePublishers(simulation, description)
        if self._transforms:
            publish_static_transforms(simulation.bus, simulation.clock, self._transforms)
        if self._record.path:
            self._recorder = Recorder(
                simulation,
                feed,
                _numbered(self._record.path, self._joined),
                topics=self._record.topics,
                description=description,
                world=world,
                facts={NODES: STATE_PUBLISHER, TRANSFORMS: to_json(self._transforms)},
                on_failure=self._report_failure,
            )
        self._joined += 1
        if self._peers is not None:
            try:
                self._peers.join(simulation, feed, description, world)
            except KbotError:
                self.close()
                raise

    def show(self, shown: Live, description: str, name: str, *, publishes_clock: bool = True) -> None:
        """Publish a robot that is shown but not simulated, without a recording.

        `shown` publishes its joints and transforms. `description` is its URDF, empty if there is none. `name`
        is the name of the run for peers. Without `publishes_clock`, peers use wall-clock time.

        Raises:
            KbotError: a bridge cannot be opened.
        """
        self._leave()
        # a recording may have its own /clock
        if publishes_clock and "/clock" not in shown.bus.topics:
            clock = shown.bus.advertise("/clock", ClockMessage, rate=CLOCK_RATE)
            self._timer = shown.clock.every(
                CLOCK_RATE, lambda: clock.publish_plain(ClockMessage(shown.clock.stamp))
            )
        if description:
            shown.bus.advertise("/robot_description", String, latched=True).publish(String(description))
        if self._transforms:
            publish_static_transforms(shown.bus, shown.clock, self._transforms)
        if self._peers is not None:
            feed = Feed(shown.bus, lambda: shown.clock.nanoseconds)
            self._peers.show(shown, feed, description, name, publishes_clock=publishes_clock)

    def interrupt(self, error: BaseException) -> None:
        """Raise an error from outside, such as Ctrl-C, at a time when the recording stays complete."""
        if self._recorder is None:
            raise error
        self._recorder.interrupt(error)

    def close(self) -> None:
        """Finish the recording and disconnect all peers."""
        self._leave()
        if self._peers is not None:
            self._peers.close()

    def _leave(self) -> None:
        if self._recorder is not None:
            self._recorder.close()
            if self._recorder.failure is None:
                self._report(f"{self._recorder.path}: {self._recorder.count} messages recorded")
            self._recorder = None
        if self._publishers is not None:
            self._publishers.close()
            self._publishers = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._peers is not None:
            self._peers.leave()

    def _report_failure(self, failure: KbotError) -> None:
        self.failure = failure
        self._report(f"error: {failure}")


def _numbered(path: str, number: int) -> str:
    """`run.mcap` for the first simulation, `run-2.mcap` for the second."""
    target = Path(path)
    return path if number == 0 else str(target.with_name(f"{target.stem}-{number + 1}{target.suffix}"))
