"""The plan of a launch file: nodes with their parameters, each with the line it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.ros import names
from kbot.ros.parameter_values import ParameterValue
from kbot.text import DescriptionError, Diagnostic, Origin


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """The robot file that a parameter's `command=` expands, with its xacro arguments."""

    path: str
    arguments: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter of the store: a global name and its value."""

    name: str
    value: ParameterValue
    origin: Origin
    description: RobotDescription | None = None


@dataclass(frozen=True, slots=True)
class Argument:
    """A declared `<arg>`; `value` is None where one is required and none was given."""

    name: str
    value: str | None
    default: str | None
    doc: str | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Machine:
    name: str
    address: str
    origin: Origin
    settings: tuple[object, ...] = ()
    """All by which two of one name are told apart."""

    @property
    def is_local(self) -> bool:
        return self.address in ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True, slots=True)
class PlannedNode:
    """A process to run. `namespace` has a slash at both ends; `remaps` are (from, to)."""

    package: str
    type: str
    name: str
    namespace: str
    args: str
    origin: Origin
    spans: Mapping[str, Origin]
    """Where each attribute's value was written."""
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    output: str = "log"
    cwd: str | None = None
    respawn: bool = False
    respawn_delay: float = 0.0
    required: bool = False
    launch_prefix: str | None = None
    machine: str | None = None
    is_test: bool = False
    """It is run by a test runner, never by a launch."""
    parameter_files: tuple[str, ...] = ()
    """Files of parameters that a node of ROS 2 is given."""
    delay: float = 0.0
    """Seconds after the launch's start, or after `after`, at which it is started."""
    after: tuple[str, str] | None = None
    """It is started once that node (a full name) did this: `exit` or `start`."""

    @property
    def full_name(self) -> str:
        """Namespace and name, as `/robot/camera`."""
        return self.name if self.name.startswith("$") else names.join(self.namespace, self.name)

    @property
    def file(self) -> str:
        """The launch file it was written in."""
        return self.origin.span.file


@dataclass(frozen=True, slots=True)
class Included:
    """A launch file of a ROS package that is not here and that KBot stands in for."""

    package: str
    name: str
    arguments: Mapping[str, str]
    namespace: str
    origin: Origin


@dataclass(frozen=True)
class Plan:
    """What a launch file would do, in the order it was written.

    problems     what keeps the file from being read as it is meant; with an error it is unusable
    findings     what a ROS would stumble over, each with the mend; KBot can go on
    clear        namespaces whose parameters are deleted first
    store        (command, parameter, file) of `rosparam dump` and `rosparam delete`
    """

    path: str
    nodes: tuple[PlannedNode, ...] = ()
    params: Mapping[str, Param] = field(default_factory=dict)
    arguments: Mapping[str, Argument] = field(default_factory=dict)
    included: tuple[Included, ...] = ()
    machines: tuple[Machine, ...] = ()
    files: tuple[str, ...] = ()
    clear: tuple[str, ...] = ()
    store: tuple[tuple[str, str, str], ...] = ()
    problems: tuple[Diagnostic, ...] = ()
    findings: tuple[Diagnostic, ...] = ()
    is_ros_2: bool = False

    def params_of(self, node: PlannedNode) -> dict[str, Param]:
        """A node's own parameters, by their names within the node."""
        prefix = f"{node.full_name}/"
        return {n.removeprefix(prefix): p for n, p in self.params.items() if n.startswith(prefix)}

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Problems and findings."""
        return self.problems + self.findings

    def require(self) -> Plan:
        """This plan.

        Raises:
            DescriptionError: the launch file cannot be used; carries all diagnostics.
        """
        if any(problem.is_error for problem in self.problems):
            raise DescriptionError(self.diagnostics)
        return self
