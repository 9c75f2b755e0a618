"""Trials: a robot's behaviour as a test. Scenarios, batteries, and the comparison of two robots."""

from kbot.trials.actions import (
    AddObject,
    Command,
    DriveWithPolicy,
    Goal,
    InjectFault,
    JointCommand,
    MoveObject,
    Point,
    Push,
    RemoveObject,
    RunScript,
)
from kbot.trials.expectations import Bound, Check, NeverTouches, PassesThrough, Reaches, Settles, StaysUpright
from kbot.trials.measures import Measure
from kbot.trials.results import MeasureResult, TrialResult
from kbot.trials.scenario import Program, Range, RobotSource, Scenario, Step
from kbot.trials.trace import Trace
from kbot.trials.trial import run_trial

__all__ = [
    "AddObject",
    "Bound",
    "Check",
    "Command",
    "DriveWithPolicy",
    "Goal",
    "InjectFault",
    "JointCommand",
    "Measure",
    "MeasureResult",
    "MoveObject",
    "NeverTouches",
    "PassesThrough",
    "Point",
    "Program",
    "Push",
    "Range",
    "Reaches",
    "RemoveObject",
    "RobotSource",
    "RunScript",
    "Scenario",
    "Settles",
    "StaysUpright",
    "Step",
    "Trace",
    "TrialResult",
    "run_trial",
]
