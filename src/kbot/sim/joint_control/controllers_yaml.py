"""The controllers of a robot and their parameters: from the YAML files that the description names, and
from the launch that spawned them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from kbot.model import Robot
from kbot.model.controller_files import controller_files
from kbot.model.spawned import SpawnedController, spawned_controllers
from kbot.sim.joint_control.kinds import DIFF_DRIVE, OTHERS_NEED
from kbot.text import Origin, Severity
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings


@dataclass(frozen=True, slots=True)
class Parameters:
    """A controller's parameters by dotted name; `origin` is where the description names the file, or the
    launch the controller, and `places` tells where each parameter, and its type, was written."""

    kind: str
    controller: str
    values: Mapping[str, object]
    origin: Origin
    ros: int = 2
    is_active: bool = True
    is_spawned: bool = False
    places: Mapping[str, Origin] = field(default_factory=dict)

    def place(self, *names: str) -> Origin:
        """Where the first of these parameters that is given was written, else the controller's type."""
        return next((self.places[n] for n in (*names, "type") if n in self.places), self.origin)

    def lacking(self, *needed: str) -> list[str]:
        """Those of the parameters that are needed, and of those that its type does not start without, that a
        controller that is spawned was not given; of one in the description all is taken to be there."""
        every = (*needed, *OTHERS_NEED.get((self.ros, self.kind), ()))
        return [name for name in every if name not in self.values] if self.is_spawned else []


def diff_drive_parameters(robot: Robot, findings: Findings) -> Parameters | None:
    """Those of the first differential-drive controller that runs, None where the robot names none."""
    for found in controller_parameters(robot, findings):
        if found.kind == DIFF_DRIVE and found.is_active and not found.lacking():
            return found
    return None


def controller_parameters(robot: Robot, findings: Findings) -> Iterator[Parameters]:
    """Those of every controller that the controller manager is told of; where a launch spawns some of them,
    of those alone. One that nobody knows the type of is said at the place that spawns it."""
    written = {found.controller: found for found in _of_description(robot, findings)}
    spawned = spawned_controllers(robot)
    if not spawned:
        yield from written.values()
    for controller in spawned:
        file = written.get(controller.name.rpartition("/")[2])
        values = {name: setting.value for name, setting in controller.settings.items()}
        places = dict(file.places) if file else {}
        places |= {name: setting.origin for name, setting in controller.settings.items()}
        kind = str(values.get("type") or (file.kind if file else ""))
        if not kind:
            if controller.settings or not any(d.code == "W132" for d in findings.diagnostics):
                _say_unknown(controller, spawned, written, findings)
            continue
        values = {**file.values, **values} if file else values
        ros, is_active = controller.ros, controller.is_active
        yield Parameters(kind, controller.name, values, controller.origin, ros, is_active, True, places)


def _say_unknown(
    controller: SpawnedController,
    spawned: Iterable[SpawnedController],
    written: Mapping[str, Parameters],
    findings: Findings,
) -> None:
    known = [*(other.name for other in spawned if "type" in other.settings), *written]
    if controller.settings:
        what = f"the controller {controller.name} has parameters and no type: it is not loaded"
        where = next(iter(controller.settings.values())).origin
        findings.warning("W137", what, where, "give it a type, as effort_controllers/JointPositionController")
        return
    what = f"the controller {controller.name} has no parameters: it is not loaded"
    findings.warning("W137", what, controller.origin, did_you_mean(controller.name, known))


def _of_description(robot: Robot, findings: Findings) -> Iterator[Parameters]:
    for file in controller_files(robot):
        findings.diagnostics += (replace(fault, severity=Severity.WARNING) for fault in file.faults)
        for controller, (kind, origin) in file.types().items():
            found = file.parameters(controller)
            values = {name: setting.value for name, setting in found.items()}
            places = {"type": origin} | {name: setting.origin for name, setting in found.items()}
            yield Parameters(kind, controller, values, file.named, places=places)
