"""Watches a simulation that a program drives, and describes the run as the result of a trial."""

from __future__ import annotations

from contextlib import suppress

from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import RunOutputs
from kbot.render.film import Tape, draw_film
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.trials.films import SECONDS
from kbot.trials.results import TrialResult
from kbot.trials.surroundings import surroundings
from kbot.trials.trace import Sampler

_RATE = 10.0
"""Samples per second of simulated time. At 50 Hz, sampling takes longer than simulating."""


class WatchedRun:
    """Samples a run. `record` is a file for a recording, and `film` keeps what a film of the end needs."""

    def __init__(
        self, simulation: Simulation, name: str, world: str, *, record: str = "", film: bool = False
    ) -> None:
        self._simulation, self._name, self._record = simulation, name, record
        self._sampler = Sampler(simulation, with_clearance=False, rate=_RATE)
        self._timer = simulation.clock.every(_RATE, self._sampler.sample)
        self._tape = Tape(simulation, SECONDS) if film else None
        self._outputs: RunOutputs | None = None
        if record:
            self._outputs = RunOutputs(lambda _: None, RecordOptions(record))
            self._outputs.join(simulation, "", world)

    def result(self, *, film: bool) -> TrialResult:
        """The run until now. Drawing a `film` may take a few seconds."""
        simulation = self._simulation
        with suppress(ValueError):  # a state after a divergence is not finite
            self._sampler.sample()
        drawn, problem = b"", ""
        if film and self._tape is not None:
            try:
                drawn = draw_film(self._tape.moments)
            except KbotError as error:
                problem = str(error)
        return TrialResult(
            self._name,
            simulation.seed,
            state_sha256=simulation.state_sha256(),
            findings=simulation.findings,
            trace=self._sampler.trace(),
            robot=simulation.robot.name,
            recording=self._record,
            surroundings=surroundings(simulation),
            film=drawn,
            film_problem=problem,
        )

    def close(self) -> None:
        """Complete the recording, and stop to watch."""
        self._timer.cancel()
        if self._tape is not None:
            self._tape.close()
        if self._outputs is not None:
            self._outputs.close()
