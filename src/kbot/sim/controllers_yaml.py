"""The parameters of a ros2_control controller: from the YAML file that the description names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from kbot.model import Robot
from kbot.text import DescriptionError, Element, Origin
from kbot.text.files import read_source
from kbot.world.findings import Findings

DIFF_DRIVE = "diff_drive_controller/DiffDriveController"


@dataclass(frozen=True, slots=True)
class Parameters:
    """A controller's parameters by dotted name; `origin` is where the description names the file."""

    kind: str
    controller: str
    values: Mapping[str, object]
    origin: Origin


def diff_drive_parameters(robot: Robot, findings: Findings) -> Parameters | None:
    """Those of the first differential-drive controller, None where the robot names none."""
    found = controller_parameters(robot, findings)
    return next((parameters for parameters in found if parameters.kind == DIFF_DRIVE), None)


def controller_parameters(robot: Robot, findings: Findings) -> Iterator[Parameters]:
    """Those of every controller that the controller manager is told of."""
    for element in _parameter_files(robot):
        document = _read(element, findings)
        for name, kind in _parameters(document, "controller_manager").items():
            if name.endswith(".type"):
                controller = name.removesuffix(".type")
                yield Parameters(str(kind), controller, _parameters(document, controller), element.origin)


def _parameter_files(robot: Robot) -> Iterator[Element]:
    """The `<parameters>` of Gazebo's ros2_control plugins."""
    for extension in robot.extensions:
        if extension.tag == "gazebo":
            for plugin in extension.elements("plugin"):
                yield from plugin.elements("parameters")


def _read(element: Element, findings: Findings) -> Mapping[str, object]:
    import yaml

    path = element.text.strip()
    try:
        document = yaml.safe_load(read_source(Path(path)).text)
    except DescriptionError as error:
        findings.warning("W132", f"the controllers' {error.diagnostics[0].message}", element.origin)
        return {}
    except yaml.YAMLError as error:
        findings.warning("W132", f"{path} is no YAML: {error}", element.origin)
        return {}
    return document if isinstance(document, dict) else {}


def _parameters(document: Mapping[str, object], node: str) -> dict[str, object]:
    """A node's parameters with nested names joined by dots; `/**` counts for every node."""
    found: dict[str, object] = {}
    for key in ("/**", node, f"/{node}"):
        entry = document.get(key)
        if isinstance(entry, dict):
            nested = entry.get("ros__parameters", entry.get(node, {}))
            if isinstance(nested, dict):
                found.update(_flat(nested))
    return found


def _flat(values: Mapping[object, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _flat(value, f"{name}.")
        else:
            yield name, value
