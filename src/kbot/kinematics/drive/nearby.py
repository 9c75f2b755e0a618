"""Finds the parameters of a drive controller in the packages beside a description that does not name them.

In ROS 1 only launch files name such a file: `husky_control/config/control.yaml` beside `husky_description`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kbot.kinematics.controller_files import DIFF_DRIVE
from kbot.kinematics.drive.declared import declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, find_drive
from kbot.model import RobotModel
from kbot.model.extensions import gazebo_plugins
from kbot.model.spawned import Setting, SpawnedController, spawned_controllers, with_controllers
from kbot.text import DescriptionError, DiagnosticCollector, Origin, read_source
from kbot.text.files import unsaved_files
from kbot.text.yaml import YamlDocument, YamlError, read_yaml

_DESCRIPTION = "_description"
_MOST_FILES = 100
"""Files that are read. A package of controllers has a few."""


def with_nearby_drive(robot: RobotModel, findings: DiagnosticCollector) -> RobotModel:
    """The robot with the drive controller of a file beside its description, which is reported (W148).

    This applies only to a robot with gazebo_ros_control, without another drive, and if exactly one controller
    in these files turns just those joints that KBot would drive without it.
    """
    if (
        not any(
            "gazebo_ros_control" in plugin.attributes.get("filename", "") for plugin in gazebo_plugins(robot)
        )
        or spawned_controllers(robot)
        or drive_controller(declared_drives(robot)) is not None
    ):
        return robot
    drive = find_drive(robot)
    if not isinstance(drive, DifferentialDrive):
        return robot
    found = [found for path in files_beside(robot) for found in _controllers(path, set(drive.joints))]
    if len(found) != 1:
        return robot
    controller = found[0]
    file = controller.origin.span.source.path
    what = (
        f"the description does not name a file of controllers: KBot drives with '{controller.name}' of {file}"
    )
    findings.info("W148", what, controller.origin)
    return with_controllers(robot, found)


def files_beside(robot: RobotModel) -> list[Path]:
    """The YAML files of the robot's package, and of packages beside it that have its name."""
    folders = Path(robot.origin.span.source.path).absolute().parents
    package = next((folder for folder in folders if (folder / "package.xml").is_file()), None)
    if package is None:
        return []
    name = package.name.removesuffix(_DESCRIPTION)
    packages = [package] if package.name == name else [package, *package.parent.glob(f"{name}_*")]
    configs = {folder / "config" for folder in packages if (folder / "package.xml").is_file()}
    found = {path for folder in configs for path in folder.glob("*.yaml")}
    found |= {
        path for path in map(Path, unsaved_files()) if path.suffix == ".yaml" and path.parent in configs
    }
    return sorted(found)[:_MOST_FILES]


def _controllers(path: Path, driven: set[str]) -> Iterator[SpawnedController]:
    """The differential drives in a file of ROS 1 parameters that turn the `driven` joints."""
    try:
        document = read_yaml(read_source(str(path)))
    except (DescriptionError, YamlError):
        return
    for name, values in document.data.items() if isinstance(document.data, dict) else ():
        if not isinstance(values, dict) or values.get("type") != DIFF_DRIVE:
            continue
        if driven == {joint for side in ("left_wheel", "right_wheel") for joint in _names(values.get(side))}:
            settings = dict(_settings(document, values, (str(name),)))
            origin = Origin(document.span(str(name)))
            yield SpawnedController(str(name), settings, is_active=True, ros=1, origin=origin)


def _names(value: object) -> list[str]:
    return [str(name) for name in (value if isinstance(value, list) else [value])]


# Any: what YAML holds
def _settings(
    document: YamlDocument, values: dict[Any, Any], keys: tuple[str, ...]
) -> Iterator[tuple[str, Setting]]:
    """The values below `keys` by dotted name, without the first key."""
    for key, value in values.items():
        below = (*keys, str(key))
        if isinstance(value, dict):
            yield from _settings(document, value, below)
        else:
            yield ".".join(below[1:]), Setting(value, Origin(document.span(*below)))
