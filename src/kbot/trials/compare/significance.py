"""Decides which measures differ between two robots.

A difference counts if it exceeds both its spread between seeds and the floor of its measure: see `Measure`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from kbot.trials.measures import Measure, find_measure
from kbot.trials.results import TrialResult

COMPLETED = "completed"
"""The name under which a comparison lists whether a scenario ran to its end: 1 or 0."""
SCANS = (("scan_difference", "m", 0.02), ("scan_share", "", 0.05))
"""What a comparison lists for each lidar: the name, the unit, and the smallest change that counts, above what
two recordings with different noise of 1 cm show. See `Scans.difference`. Each is 0 for the first robot."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A measure of a scenario before and after, each the mean over the seeds. NaN: the run does not show it.

    threshold   the difference from which it counts, in the unit
    """

    scenario: str
    measure: str
    unit: str
    before: float
    after: float
    threshold: float

    @property
    def is_significant(self) -> bool:
        if math.isnan(self.before) or math.isnan(self.after):
            return math.isnan(self.before) is not math.isnan(self.after)
        return abs(self.after - self.before) > self.threshold

    @property
    def size(self) -> float:
        """The difference as a multiple of its threshold. It is infinite if a value appears or disappears."""
        if not self.is_significant:
            return 0.0
        difference = abs(self.after - self.before)
        return difference / self.threshold if math.isfinite(difference) and self.threshold > 0.0 else math.inf

    @property
    def key(self) -> tuple[str, str]:
        return self.scenario, self.measure

    @property
    def label(self) -> str:
        return f"{self.scenario} {self.measure}"

    def to_json(self) -> dict[str, object]:
        return {
            "scenario": self.scenario,
            "measure": self.measure,
            "unit": self.unit,
            "before": self.before if math.isfinite(self.before) else None,
            "after": self.after if math.isfinite(self.after) else None,
            "significant": self.is_significant,
        }


def differences(before: Sequence[TrialResult], after: Sequence[TrialResult]) -> list[Difference]:
    """The measures of one scenario, run with the same seeds before and after, with all values."""
    name = before[0].name
    completed = Difference(name, COMPLETED, "", _completed(before), _completed(after), 0.0)
    if min(completed.before, completed.after) < 1.0:
        return [completed]
    found = [completed]
    known = dict.fromkeys(key for result in (*before, *after) for key in result.all_values)
    for key in known:
        found.append(_difference(name, find_measure(key), _values(before, key), _values(after, key)))
    return found + _scan_differences(name, before, after)


def _scan_differences(
    scenario: str, before: Sequence[TrialResult], after: Sequence[TrialResult]
) -> list[Difference]:
    """The differences of the scans of the lidars that both robots have."""
    found = []
    for lidar in (name for name in before[0].scans if name in after[0].scans):
        pairs = zip(before, after, strict=True)
        values = [one.scans[lidar].difference(other.scans[lidar]) for one, other in pairs]
        for (name, unit, floor), own in zip(SCANS, zip(*values, strict=True), strict=True):
            mean, spread = _mean(own), _uncertainty(own)
            zero = math.nan if math.isnan(mean) else 0.0
            threshold = floor if math.isnan(spread) else max(floor, spread)
            found.append(Difference(scenario, f"{name}/{lidar}", unit, zero, mean, threshold))
    return found


def _completed(results: Sequence[TrialResult]) -> float:
    """The share of the results without an error."""
    return sum(not result.error for result in results) / len(results)


def _values(results: Sequence[TrialResult], key: str) -> list[float]:
    return [result.all_values.get(key, math.nan) for result in results]


def _difference(scenario: str, measure: Measure, before: list[float], after: list[float]) -> Difference:
    mean_before, mean_after = _mean(before), _mean(after)
    paired = [after - before for before, after in zip(before, after, strict=True)]
    floors = (measure.floor, measure.relative * abs(mean_before), _uncertainty(paired))
    threshold = max(floor for floor in floors if math.isfinite(floor))
    return Difference(scenario, measure.name, measure.unit, mean_before, mean_after, threshold)


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _uncertainty(differences: Sequence[float]) -> float:
    """Twice the standard error of the mean difference over the seeds, which both robots share.

    Without an effect, 95 % of mean differences are smaller. It is 0 for one seed: a run has no noise.
    """
    count = len(differences)
    if count == 1:
        return 0.0
    mean = _mean(differences)
    return 2.0 * math.sqrt(math.fsum((each - mean) ** 2 for each in differences) / (count - 1) / count)
