"""The moment of a failure in a run, for the recording that shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from kbot.trials.expectations import Expectation
from kbot.trials.trace import RATE, Trace

STRIDE = round(0.1 * RATE)
"""Samples between two times that are tried."""


def failure_time(expectations: Sequence[Expectation], trace: Trace) -> float:
    """The time in s from which a run fails: the earliest of its failed expectations.

    An expectation fails from the last time at which it was still fulfilled. One that never was fulfilled,
    such as a place that the robot never reaches, fails at the end.
    """
    end = float(trace["time"][-1])
    failed = (each for each in expectations if not _is_fulfilled(each, trace))
    return min((_failure_time(each, trace) for each in failed), default=end)


def _failure_time(expectation: Expectation, trace: Trace) -> float:
    for samples in range(len(trace) - STRIDE, 0, -STRIDE):
        if _is_fulfilled(expectation, _until(trace, samples)):
            return float(trace["time"][samples])
    return float(trace["time"][-1])


def _is_fulfilled(expectation: Expectation, trace: Trace) -> bool:
    return all(result.passed for result in expectation.results(trace))


def _until(trace: Trace, samples: int) -> Trace:
    """The first samples of a trace."""
    end = trace["time"][samples - 1]
    return replace(
        trace,
        columns={name: values[:samples] for name, values in trace.columns.items()},
        joints={name: values[:samples] for name, values in trace.joints.items()},
        support={name: values[:samples] for name, values in trace.support.items()},
        events=tuple(event for event in trace.events if event.time <= end),
        touched=trace.touched[: int(trace["touched"][samples - 1])],
        last_step=min(trace.last_step, float(end)),
    )
