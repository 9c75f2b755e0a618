"""Reads the description from disk for the workbench: a robot or none, and all findings."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kbot.model import Mesh, RobotModel
from kbot.text import DescriptionError, Diagnostic, Element
from kbot.workbench.source.overrides import Overrides
from kbot.xacro.packages import Packages

if TYPE_CHECKING:
    from kbot.xacro import Expansion


@dataclass(frozen=True, slots=True)
class DescriptionReading:
    """One reading: `usable` when it makes a robot without an error on the way; `findings` say more.

    `files` are all that it was read from, the description itself first; `meshes` the mesh files that it
    names, there or not; `outside` those that are not for the page. `began` is the wall time, in ns, from
    which on a change of a file may not be in it.
    """

    robot: RobotModel | None
    usable: bool
    expansion: Expansion | None
    findings: tuple[Diagnostic, ...]
    files: tuple[str, ...]
    outside: frozenset[str] = frozenset()
    began: int = field(default_factory=time.time_ns)
    meshes: tuple[str, ...] = ()

    @property
    def document(self) -> Element | None:
        """The root element of what the description was expanded to."""
        return self.expansion.document if self.expansion is not None else None

    def require(self) -> RobotModel:
        """The robot.

        Raises:
            DescriptionError: the reading is not usable.
        """
        if self.robot is None or not self.usable:
            raise DescriptionError(self.findings)
        return self.robot


class DescriptionFile:
    """A xacro or URDF file with the arguments it is expanded with.

    The findings are those of the file with the values given on the command line and the arguments set in the
    page. Only the picture shows the properties set in the page.
    """

    def __init__(
        self,
        path: str,
        arguments: Mapping[str, str] | None = None,
        package_path: Sequence[str] = (),
        alter: Callable[[RobotModel], RobotModel] = lambda robot: robot,
        properties: Mapping[str, str] | None = None,
    ) -> None:
        """`alter` makes of the robot that is written the one that is shown."""
        self.path = path
        self.overrides = Overrides(arguments, properties)
        self.package_path = tuple(package_path)
        self._alter = alter

    def read(self) -> DescriptionReading:
        """Expand, read and check the file as it is now. Never raises for faults of the description."""
        from kbot.checks import check_file  # lazy in this module: start-up time
        from kbot.model.load import load_robot
        from kbot.workbench.meshes.roots import MeshRoots, confine

        began = time.time_ns()
        packages = Packages(self.package_path, around=self.path)
        arguments = self.overrides.arguments
        loaded = load_robot(self.path, arguments, self.overrides.properties, packages)
        usable = loaded.robot is not None and not any(d.is_error for d in loaded.diagnostics)
        findings = loaded.diagnostics
        if usable:
            findings = check_file(self.path, arguments, packages, properties=self.overrides.given_properties)
        if usable and loaded.robot is not None:
            findings = (*findings, *findings_of_sensors(loaded.robot))
        files = dict.fromkeys((self.path, *loaded.expansion.dependencies))
        if loaded.robot is None:
            return DescriptionReading(
                None, usable, loaded.expansion, tuple(findings), tuple(files), began=began
            )
        confined = confine(self._alter(loaded.robot), MeshRoots(self.path, packages))
        findings = (*findings, *confined.findings)
        meshes = _mesh_files(confined.robot, packages)
        return DescriptionReading(
            confined.robot, usable, loaded.expansion, findings, tuple(files), confined.outside, began, meshes
        )


def _mesh_files(robot: RobotModel, packages: Packages) -> tuple[str, ...]:
    shapes = (part.geometry for link in robot.links.values() for part in link.shapes)
    meshes = (shape for shape in shapes if isinstance(shape, Mesh) and shape.uri.strip())
    files = (mesh.path or packages.expected(mesh.uri) for mesh in meshes)
    return tuple(dict.fromkeys(file for file in files if file is not None))


def findings_of_sensors(robot: RobotModel) -> tuple[Diagnostic, ...]:
    """What is wrong with the sensors that a robot declares."""
    tags = ("gazebo", "ros2_control")
    if not any(e.tag in tags and e.find("sensor") is not None for e in robot.extensions):
        return ()
    from kbot.sensors.declared import declared_sensors

    return tuple(declared_sensors(robot).diagnostics)
