"""The plan of a launch file: nodes and parameters, each with the line that it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.ros import names
from kbot.ros.parameter_values import ParameterValue
from kbot.text import DescriptionError, Diagnostic, Origin


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """The robot file that a parameter is filled from, with the xacro arguments.

    `environment`: variables that a wrapper sets for xacro.
    """

    path: str
    arguments: Mapping[str, str]
    environment: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter: its global name and its value."""

    name: str
    value: ParameterValue
    origin: Origin
    description: RobotDescription | None = None


@dataclass(frozen=True, slots=True)
class Argument:
    """A declared argument. `value` is None if it is required and was not given."""

    name: str
    value: str | None
    default: str | None
    doc: str | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine that nodes can be started on."""

    name: str
    address: str
    origin: Origin
    settings: tuple[object, ...] = ()
    """All other settings. Two machines of one name must have the same."""

    @property
    def is_local(self) -> bool:
        return self.address in ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True, slots=True)
class PlannedNode:
    """A process to run. `namespace` has a slash at both ends. `remaps` are pairs of (from, to)."""

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
    """Whether it is a `<test>`, which only a test runner runs."""
    parameter_files: tuple[str, ...] = ()
    """The parameter files of a ROS 2 node."""
    delay: float = 0.0
    """Seconds from the start of the launch, or from `after`, to the start of the node."""
    after: tuple[str, str] | None = None
    """The event that starts the node: `exit` or `start`, and the full name of the other node."""

    @property
    def full_name(self) -> str:
        """Namespace and name, for example `/robot/camera`."""
        return self.name if self.name.startswith("$") else names.join(self.namespace, self.name)

    @property
    def file(self) -> str:
        """The launch file that names the node."""
        return self.origin.span.file


@dataclass(frozen=True, slots=True)
class Included:
    """An included launch file of a ROS package that is not installed and that KBot replaces."""

    package: str
    name: str
    arguments: Mapping[str, str]
    namespace: str
    origin: Origin


@dataclass(frozen=True)
class Plan:
    """What a launch file would do, in the order in which it is written.

    problems     errors in the file itself; with an error, the plan cannot be used
    findings     errors that ROS would raise, each with a fix; KBot can continue
    clear        namespaces whose parameters are deleted before the launch
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
    own_environment: Mapping[str, str] = field(default_factory=dict)
    """Variables that actions of a ROS 2 launch file set."""

    @property
    def environment(self) -> Mapping[str, str]:
        """The variables that descriptions and worlds read, besides those of KBot's own environment."""
        found = dict(self.own_environment)
        for param in self.params.values():
            found |= param.description.environment if param.description else {}
        return found

    def params_of(self, node: PlannedNode) -> dict[str, Param]:
        """The parameters of a node, by their names in the node."""
        prefix = f"{node.full_name}/"
        return {n.removeprefix(prefix): p for n, p in self.params.items() if n.startswith(prefix)}

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Problems and findings."""
        return self.problems + self.findings

    def require(self) -> Plan:
        """This plan.

        Raises:
            DescriptionError: the launch file cannot be used. The error holds all diagnostics.
        """
        if any(problem.is_error for problem in self.problems):
            raise DescriptionError(self.diagnostics)
        return self
