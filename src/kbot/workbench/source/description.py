"""Read a description for the workbench: a robot or none, and all findings."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.model import Mesh, RobotModel
from kbot.model.meshes import MeshPart
from kbot.text import DescriptionError, Diagnostic, Element
from kbot.text.files import reading_only
from kbot.workbench.meshes.roots import NOT_OWN, OwnFiles, confine
from kbot.xacro.packages import Packages

if TYPE_CHECKING:
    from kbot.xacro import Expansion


@dataclass(frozen=True, slots=True)
class DescriptionReading:
    """One reading of a description. `usable` means that it describes a robot without errors.

    `files` are all files that it was read from, the description first. `meshes` are its mesh files, existing
    or not, and `outside` those that the page may not load. `simplified` is what the page draws of files with
    very many triangles that the worker has read. `began` is the wall-clock time in ns after which changes of
    files may be missing.
    """

    robot: RobotModel | None
    usable: bool
    expansion: Expansion | None
    findings: tuple[Diagnostic, ...]
    files: tuple[str, ...]
    outside: frozenset[str] = frozenset()
    began: int = field(default_factory=time.time_ns)
    meshes: tuple[str, ...] = ()
    simplified: Mapping[str, tuple[MeshPart, ...]] = field(default_factory=dict)

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


@dataclass(frozen=True, slots=True)
class DescriptionInput:
    """What one reading of a description depends on, besides the content of the files.

    `given_properties` are those of the command line, and `properties` include those set in the page, which
    only affect what is displayed. `allowed` are the files outside the description's own folders and packages
    that may be read, or None if all may.
    """

    path: str
    arguments: Mapping[str, str]
    properties: Mapping[str, str]
    given_properties: Mapping[str, str]
    package_path: tuple[str, ...]
    allowed: frozenset[str] | None = None

    def read(self) -> DescriptionReading:
        """Expand, read and check the current file. Never raises for errors in the description."""
        from kbot.checks import check_file  # imported lazily, for a fast start-up
        from kbot.checks.settings import load_config
        from kbot.model.load import load_robot

        began = time.time_ns()
        packages = Packages(self.package_path, around=self.path)
        own = OwnFiles(self.path, packages)
        may_read = self._may_read(own)
        config = load_config(str(Path(self.path).parent))  # no page names its file
        why = f"it is {NOT_OWN}, and a page wrote its name"
        with nullcontext() if self.allowed is None else reading_only(may_read, why):
            loaded = load_robot(self.path, self.arguments, self.properties, packages)
            findings = check_file(
                self.path, self.arguments, packages, config, properties=self.given_properties
            )
        usable = loaded.robot is not None and not any(d.is_error for d in loaded.diagnostics)
        if not usable and not any(d.is_error for d in findings):
            findings = loaded.diagnostics  # the configuration ignores the error, which remains the reason
        if usable and loaded.robot is not None:
            findings = (*findings, *findings_of_sensors(loaded.robot))
        named = dict.fromkeys((self.path, *loaded.expansion.dependencies))
        # a name that was refused must not become one of the description's files
        files = tuple(named if self.allowed is None else filter(may_read, named))
        reading = DescriptionReading(
            loaded.robot, usable, loaded.expansion, tuple(findings), files, began=began
        )
        if loaded.robot is None:
            return reading
        confined = confine(loaded.robot, own)
        return replace(
            reading,
            robot=confined.robot,
            findings=(*reading.findings, *confined.findings),
            outside=confined.outside,
            meshes=_mesh_files(confined.robot, packages),
        )

    def _may_read(self, own: OwnFiles) -> Callable[[str], bool]:
        allowed = {os.path.realpath(file) for file in (self.path, *(self.allowed or ()))}
        return lambda file: os.path.realpath(file) in allowed or own.have_text(file)


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
