"""Read the description from disk for the workbench: a robot or none, and all findings."""

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
    """One reading of a description. `usable` means that it describes a robot without errors.

    `files` are all files that it was read from, the description first. `meshes` are its mesh files, existing
    or not, and `outside` those that the page may not load. `began` is the wall-clock time in ns after which
    changes of files may be missing.
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
        """The root element of the expanded description."""
        return self.expansion.document if self.expansion is not None else None

    def require(self) -> RobotModel:
        """Return the robot.

        Raises:
            DescriptionError: the reading is not usable.
        """
        if self.robot is None or not self.usable:
            raise DescriptionError(self.findings)
        return self.robot


class DescriptionFile:
    """A xacro or URDF file with the arguments it is expanded with.

    The findings are those of the file with the values given on the command line and the arguments set in the
    page. Properties set in the page only affect what is displayed.
    """

    def __init__(
        self,
        path: str,
        arguments: Mapping[str, str] | None = None,
        package_path: Sequence[str] = (),
        alter: Callable[[RobotModel], RobotModel] = lambda robot: robot,
        properties: Mapping[str, str] | None = None,
    ) -> None:
        """`alter` converts the robot in the file to the one that is displayed."""
        self.path = path
        self.overrides = Overrides(arguments, properties)
        self.package_path = tuple(package_path)
        self.read_only_reason = ""
        self._alter = alter

    def read(self) -> DescriptionReading:
        """Expand, read and check the current file. Never raises for errors in the description."""
        from kbot.checks import check_file  # imported lazily, for a fast start-up
        from kbot.model.load import load_robot
        from kbot.workbench.meshes.roots import MeshRoots, confine

        began = time.time_ns()
        packages = Packages(self.package_path, around=self.path)
        arguments = self.overrides.arguments
        loaded = load_robot(self.path, arguments, self.overrides.properties, packages)
        usable = loaded.robot is not None and not any(d.is_error for d in loaded.diagnostics)
        findings = check_file(self.path, arguments, packages, properties=self.overrides.given_properties)
        if not usable and not any(d.is_error for d in findings):
            findings = loaded.diagnostics  # the configuration ignores the error, which remains the reason
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
    """Return the findings about the sensors that a robot declares."""
    tags = ("gazebo", "ros2_control")
    if not any(e.tag in tags and e.find("sensor") is not None for e in robot.extensions):
        return ()
    from kbot.sensors.declared import declared_sensors

    return tuple(declared_sensors(robot).diagnostics)
