"""The result of a trial, and the JSON of many."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kbot.brief import Brief, brief, counted
from kbot.text import Diagnostic
from kbot.text.diagnostic import Related
from kbot.trials.scans import Scans
from kbot.trials.trace import Trace

if TYPE_CHECKING:
    from kbot.trials.surroundings import Surroundings

SCHEMA = 1
"""Version of the JSON of `kbot try`."""


@dataclass(frozen=True, slots=True)
class MeasureResult:
    """The value of a measure, and the bounds that it must keep. A value that is NaN keeps none."""

    name: str
    value: float
    unit: str
    min: float | None = None
    max: float | None = None
    detail: str = ""
    """More about the value, for the sentence about a failure, such as the objects that were touched."""

    @property
    def passed(self) -> bool:
        if self.min is None and self.max is None:
            return True
        return (self.min is None or self.value >= self.min) and (self.max is None or self.value <= self.max)

    @property
    def failure(self) -> str:
        """One sentence about a bound that is not kept."""
        detail = f" ({self.detail})" if self.detail else ""
        if math.isnan(self.value):
            return f"{self.name} has no value{detail}"
        value = with_unit(self.value, self.unit)
        if self.max is not None and self.value > self.max:
            return f"{self.name} is {value}, above {with_unit(self.max, self.unit)}{detail}"
        low = "" if self.min is None else with_unit(self.min, self.unit)
        return f"{self.name} is {value}, below {low}{detail}"

    def to_json(self) -> dict[str, object]:
        return {
            "name": self.name,
            "value": _finite(self.value),
            "unit": self.unit,
            "min": _finite(self.min),
            "max": _finite(self.max),
            "passed": self.passed,
        }


@dataclass(frozen=True, repr=False)
class TrialResult(Brief):
    """The result of one scenario with one seed.

    error             why the scenario could not run, or ended early; empty if it ran
    measures          what the scenario expects
    all_values        the values of all measures, if they were requested
    state_sha256      digest of the simulation's last state; empty if there is none
    is_deterministic  False if a program that runs in real time took part
    findings          what KBot found about the run, such as a robot that does not drive as commanded
    recording         the file of the recording, if the run was recorded
    scans             what each lidar measured, if it was requested
    surroundings      the map that the path is drawn on; None without a trace
    source_lines      the lines of the robot that a failure concerns; empty without a trace
    film              the last seconds of the run as an animated picture, if it was requested
    film_problem      why there is no film, such as a missing extra
    failed_at         simulated time in s from which the run failed, None if it passed or did not run
    wall              seconds of wall-clock time
    """

    name: str
    seed: int
    measures: tuple[MeasureResult, ...] = ()
    error: str = ""
    state_sha256: str = ""
    findings: tuple[Diagnostic, ...] = ()
    is_deterministic: bool = True
    all_values: Mapping[str, float] = field(default_factory=dict)
    trace: Trace | None = None
    scans: Mapping[str, Scans] = field(default_factory=dict)
    robot: str = ""
    recording: str = ""
    surroundings: Surroundings | None = None
    source_lines: tuple[Related, ...] = ()
    film: bytes = b""
    film_problem: str = ""
    failed_at: float | None = None
    wall: float = 0.0

    @property
    def passed(self) -> bool:
        return not self.error and all(measure.passed for measure in self.measures)

    @property
    def reason(self) -> str | None:
        """Why it failed, in one line. None if it passed."""
        if self.error:
            return self.error
        return "; ".join(self.failures) or None

    @property
    def failures(self) -> tuple[str, ...]:
        """One sentence for each bound that is not kept."""
        return tuple(measure.failure for measure in self.measures if not measure.passed)

    @property
    def title(self) -> str:
        """The name, and the seed if it is not 0."""
        seed = f", seed {self.seed}" if self.seed else ""
        return f"{self.name}{seed}"

    def to_json(self) -> dict[str, object]:
        return {
            "name": self.name,
            "seed": self.seed,
            "passed": self.passed,
            "reason": self.reason,
            "measures": [measure.to_json() for measure in self.measures],
            "state_sha256": self.state_sha256,
        }

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield f"seed={self.seed}"
        yield "passed" if self.passed else f"failed: {brief(self.reason)}"
        yield counted(len(self.measures), "measure")


def to_json(results: Sequence[TrialResult]) -> dict[str, object]:
    """The object that `kbot try --json` prints."""
    passed = sum(result.passed for result in results)
    return {
        "schema": SCHEMA,
        "passed": passed,
        "failed": len(results) - passed,
        "scenarios": [result.to_json() for result in results],
    }


def with_unit(value: float, unit: str) -> str:
    """A value as reports show it: `0.25 m`, or `2` for a count."""
    return f"{value:.4g} {unit}".rstrip()


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
