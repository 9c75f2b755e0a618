"""Trials: a robot's behaviour as a test. Scenarios, batteries, and the comparison of two robots."""

from kbot.lazy_names import lazy_names, public_names
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

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.trials.batteries import battery
    from kbot.trials.films import run_filmed
    from kbot.trials.reports.html import write_html

_HOMES = {
    "battery": "batteries",
    "run_filmed": "films",
    "write_html": "reports.html",
}

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
    "battery",
    "run_filmed",
    "run_trial",
    "write_html",
]

# imported on first use, for start-up time
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
