"""Reads a ROS 2 launch file into a Plan. It runs the actions as far as the plan needs it."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from kbot.ros import names
from kbot.ros.launch import known_packages
from kbot.ros.launch.evaluation import joined
from kbot.ros.launch.includes import charge_file, require_end
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import Argument, Included, Param, Plan, PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros2 import actions as act
from kbot.ros.launch.ros2 import package_actions
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.handlers import EventHandler, RegisterEventHandler
from kbot.ros.launch.ros2.markup import read_xml, read_yaml_launch
from kbot.ros.launch.ros2.modules import PythonFiles
from kbot.ros.launch.ros2.parameters import (
    PlacedValue,
    parameters_of,
    parameters_of_file,
    plain,
)
from kbot.ros.launch.ros2.substitutions import CommandLine, is_true, performed
from kbot.ros.launch.user_program import is_run
from kbot.ros.parameter_values import ParameterValue
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, Source, read_source
from kbot.text.errors import reading
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import Packages


def read_launch_2(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    *,
    source: Source | None = None,
    allow_commands: bool = False,
    trusted: bool = False,
) -> Plan:
    """The plan of a ROS 2 launch file in Python, XML or YAML.

    Errors in the file are problems of the plan, not exceptions. A Python file is a program and runs only if
    `trusted`.
    """
    given = dict(arguments or {})
    try:
        source = source or read_source(path)
    except DescriptionError as error:
        return Plan(path, problems=error.diagnostics)
    reporter = Reporter(packages or Packages(around=path))
    start = Origin(source.whole())
    context = LaunchContext(
        path,
        reporter.packages,
        start,
        reporter.finding,
        reporter.budget,
        reporter.absent,
        allow_commands,
        dict(given),
    )
    python = PythonFiles(context)

    def load(file: Source, visitor: ActionVisitor) -> list[object]:
        if file.path.endswith((".yaml", ".yml")):
            return read_yaml_launch(file, reporter)
        if not file.path.endswith(".py"):
            return read_xml(file, reporter)
        if not trusted:
            message = "a Python launch file is a program, and was not run"
            hint = "if you trust it, run it with kbot launch FILE --trust"
            raise DescriptionError([Diagnostic("L080", Severity.ERROR, message, Origin(file.whole()), hint)])
        return python.load(file)

    visitor = ActionVisitor(context, reporter, given, load)
    with reading(path), python.modules_in_place():
        try:
            python.guarded(source, lambda: visitor.read(source))
        except DescriptionError as error:
            for found in error.diagnostics:
                where = found.origin or start
                reporter.problem(found.code, found.message, where, found.hint, related=found.related)
    for name in given:
        if name not in visitor.arguments and not any(p.is_error for p in reporter.problems):
            hint = did_you_mean(name, visitor.arguments)
            message = f"the launch file has no argument '{name}'"
            reporter.problem("L024", message, start, hint, warning=True)
    return visitor.plan(path)


Load = Callable[[Source, "ActionVisitor"], list[object]]


class ActionVisitor:
    """Runs actions in order. `plan()` returns the result."""

    def __init__(self, context: LaunchContext, reporter: Reporter, given: dict[str, str], load: Load) -> None:
        self.context, self.reporter, self.given, self.load = context, reporter, given, load
        self.nodes: list[PlannedNode] = []
        self.params: dict[str, Param] = {}
        context.launched = self.params
        self.arguments: dict[str, Argument] = {}
        self.included: list[Included] = []
        self.files: list[str] = []
        self.depth = 0
        self.environment: dict[str, str] = {}
        self._delay = 0.0
        self._pushed: list[dict[str, str]] = []
        self._after: tuple[str, str] | None = None
        self._names: dict[int, str] = {}
        """The full names of nodes, by the identity of the action that created them."""

    def plan(self, path: str) -> Plan:
        return Plan(
            path,
            nodes=tuple(self.nodes),
            params=self.params,
            arguments=self.arguments,
            included=tuple(self.included),
            files=tuple(self.files),
            problems=self.reporter.problems,
            findings=tuple(self.reporter.findings),
            is_ros_2=True,
            own_environment=self.environment,
        )

    def read(self, source: Source) -> None:
        """Run a launch file in the current context."""
        outer, self.context.file = self.context.file, source.path
        self.files.append(source.path)
        charge_file(self.context.budget, source)
        self.depth += 1
        try:
            self.visit_all(self.load(source, self))
        finally:
            self.context.file = outer
            self.depth -= 1

    def visit_all(self, entities: Iterable[object]) -> None:
        for entity in entities:
            if isinstance(entity, act.LaunchDescription):
                self.visit_all(entity.entities)
            elif isinstance(entity, act.Action):
                self.visit(entity)
            elif isinstance(entity, list | tuple):
                self.visit_all(entity)
            else:
                message = f"expected an action, not {type(entity).__name__}"
                self.reporter.problem("L081", message, self.context.here)

    def visit(self, action: act.Action) -> None:
        """Run one action. An error is reported at the line that created the action."""
        self.context.here = origin = action.origin or self.context.here
        try:
            if action.condition is None or action.condition.evaluate(self.context):
                self._visit(action, origin)
        except LaunchError as error:
            self.reporter.fault(error, origin)
        except DescriptionError as error:
            for diagnostic in error.diagnostics:
                kept = diagnostic.origin if diagnostic.code[0] != "F" else None
                self.reporter.problem(diagnostic.code, diagnostic.message, kept or origin, diagnostic.hint)

    def _visit(self, action: act.Action, origin: Origin) -> None:
        context = self.context
        match action:
            case act.DeclareLaunchArgument():
                self._declare(action, origin)
            case act.SetLaunchConfiguration():
                name = performed(action.name, context)
                context.launch_configurations[name] = performed(action.value, context)
            case act.PushLaunchConfigurations():
                self._pushed.append(dict(context.launch_configurations))
            case act.PopLaunchConfigurations():
                context.launch_configurations = self._pushed.pop() if self._pushed else {}
            case act.ResetLaunchConfigurations():
                given = action.launch_configurations.items()
                values = {performed(k, context): performed(v, context) for k, v in given}
                context.launch_configurations = values
            case act.UnsetLaunchConfiguration():
                context.launch_configurations.pop(performed(action.name, context), None)
            case act.AppendEnvironmentVariable():
                self._append_to_environment(action)
            case act.SetEnvironmentVariable():
                self._set_variable(performed(action.name, context), performed(action.value, context))
            case act.UnsetEnvironmentVariable():
                name = performed(action.name, context)
                context.environment.pop(name, None)
                self.environment.pop(name, None)
            case act.IncludeLaunchDescription():
                self._include(action, origin)
            case act.GroupAction():
                self._group(action)
            case act.PushRosNamespace():
                below = names.join(context.namespace, performed(action.namespace, context))
                context.namespace = names.as_namespace(below)
            case act.SetRemap():
                context.remaps.append(
                    (performed(action.pair[0], context), performed(action.pair[1], context))
                )
            case act.SetParameter():
                value = PlacedValue(plain(action.value, context), origin)
                context.parameters[performed(action.name, context)] = value
            case act.SetParametersFromFile():
                found = parameters_of_file(performed(action.filename, context), None, context)
                context.parameters.update(found)
            case act.Node():
                self._node(action, origin)
            case act.ExecuteProcess():
                self._process(action, origin)
            case act.TimerAction():
                self._timer(action)
            case RegisterEventHandler():
                self._handler(action.handler)
            case act.OpaqueFunction():
                self.visit_all(action.function(context, *action.args, **action.kwargs) or ())

    def _append_to_environment(self, action: act.AppendEnvironmentVariable) -> None:
        context = self.context
        name, value = performed(action.name, context), performed(action.value, context)
        parts = [context.environment[name], value] if name in context.environment else [value]
        first = is_true(performed(action.prepend, context))
        separator = performed(action.separator, context)
        ordered = parts[::-1] if first else parts
        pieces = [piece for part in ordered for piece in (separator, part)][1:]
        self._set_variable(name, joined(pieces, context.budget))

    def _set_variable(self, name: str, value: str) -> None:
        self.context.environment[name] = self.environment[name] = value

    def _declare(self, action: act.DeclareLaunchArgument, origin: Origin) -> None:
        context, name = self.context, action.name
        default = None if action.default is None else performed(action.default, context)
        if name not in context.launch_configurations:
            if default is None:
                hint = f"set it with {name}:=VALUE"
                raise LaunchError("L011", f"the launch argument '{name}' has no default and is not set", hint)
            context.launch_configurations[name] = default
        value = context.launch_configurations[name]
        if action.choices is not None and value not in action.choices:
            hint = did_you_mean(value, action.choices) or f"use one of: {', '.join(action.choices)}"
            raise LaunchError("L025", f"the launch argument '{name}' cannot be '{value}'", hint)
        if self.depth == 1 or name not in self.arguments:
            self.arguments[name] = Argument(name, value, default, action.description, origin)

    def _timer(self, action: act.TimerAction) -> None:
        outer, self._delay = self._delay, self._delay + seconds_of(action.period, self.context)
        try:
            self.visit_all(action.actions)
        finally:
            self._delay = outer

    def _handler(self, handler: EventHandler) -> None:
        """Run the actions for the end or start of a process. If KBot does not know the process, they run at
        once."""
        outer, target = self._after, self._names.get(id(handler.target))
        if target is not None:
            self._after = handler.event, target
            if handler.event == "exit" and ends_launch(handler.actions):
                self.nodes = [replace(n, required=True) if n.full_name == target else n for n in self.nodes]
        try:
            self.visit_all(handler.actions)
        finally:
            self._after = outer

    def _group(self, action: act.GroupAction) -> None:
        context = self.context
        given = action.launch_configurations.items()
        configurations = {performed(name, context): performed(value, context) for name, value in given}
        kept = (
            dict(context.launch_configurations),
            dict(context.environment),
            context.namespace,
            list(context.remaps),
            dict(context.parameters),
        )
        is_scoped = is_true(performed(action.scoped, context))
        if is_scoped and not is_true(performed(action.forwarding, context)):
            context.reset()
        context.launch_configurations.update(configurations)
        try:
            self.visit_all(action.actions)
        finally:
            if is_scoped:
                (
                    context.launch_configurations,
                    context.environment,
                    context.namespace,
                    context.remaps,
                    context.parameters,
                ) = kept

    def _include(self, action: act.IncludeLaunchDescription, origin: Origin) -> None:
        context = self.context
        path = performed(action.location, context)
        stand_in = known_packages.stand_in_file(path) or _not_built(path)
        package, name = (stand_in[0], Path(stand_in[1]).name) if stand_in else ("", "")
        if known_packages.is_not_run(package, name):
            self.reporter.unneeded_include(package, name, origin)
            return
        passed = {performed(k, context): performed(v, context) for k, v in action.launch_arguments}
        context.launch_configurations.update(passed)
        if stand_in:
            makers = package_actions.LAUNCH_FILES.get((package, name), ())
            for maker in makers:
                self.visit_all([maker(**passed)])
            if makers:
                return
            if (package, name) not in known_packages.LAUNCH_FILES_2:
                raise LaunchError("L012", *context.absent.missing_include(package, name))
            # Gazebo Classic's files read arguments of the file that includes them, such as `world`
            given = dict(context.launch_configurations) if package == "gazebo_ros" else passed
            self.included.append(Included(package, name, given, context.namespace, origin))
            return
        require_end(path, self.depth, len(self.files))
        self.read(read_source(path))

    def _node(self, action: act.Node, origin: Origin) -> None:
        context = self.context
        node = node_of(action, context, origin)
        self._names[id(action)] = full = node.full_name

        def unusable(error: DescriptionError, where: Origin) -> None:
            self._unusable_file(error, where, node)

        own, files = parameters_of(action.parameters, full, context, origin, unusable)
        for key, placed in {**context.parameters, **own}.items():
            self._set(f"{full}/{key}", placed.value, placed.origin or origin)
        known_nodes = known_packages.NODES.get(node.package, {})
        if known_nodes and node.type not in known_nodes:
            hint = did_you_mean(node.type, known_nodes)
            if hint:
                message = f"the package {node.package} has no executable '{node.type}'"
                self.reporter.finding(Diagnostic("L054", Severity.ERROR, message, origin, hint))
        self.nodes.append(replace(node, delay=self._delay, after=self._after, parameter_files=files))

    def _unusable_file(self, error: DescriptionError, origin: Origin, node: PlannedNode) -> None:
        """Report a parameter file that cannot be used. It is an error only for a node that KBot runs.

        launch_ros warns of a missing file and starts the node without it. With a file that is not YAML, the
        node does not start.
        """
        needs_file = is_run(node, self.context.packages)
        for found in error.diagnostics:
            is_missing = found.code.startswith("F")
            where = (None if is_missing else found.origin) or origin
            if needs_file:
                self.reporter.problem(found.code, found.message, where, found.hint)
            else:
                self.reporter.unneeded_file(found, where, node.full_name, stops_ros=not is_missing)

    def _set(self, name: str, value: ParameterValue, origin: Origin) -> None:
        description = self.context.described(value) if isinstance(value, str) else None
        self.params[name] = Param(names.canonical(name), value, origin, description)

    def _process(self, action: act.ExecuteProcess, origin: Origin) -> None:
        made = process_of(action, self.context, origin)
        node = replace(made, delay=self._delay, after=self._after)
        self._names[id(action)] = node.full_name
        self.nodes.append(node)


def _not_built(path: str) -> tuple[str, str] | None:
    """The package and name of a launch file that the build of a package would create. None if the file exists
    or KBot does not replace it."""
    package, file = Path(path).parts[-3:-2], Path(path).name
    known = package and (package[0], file) in known_packages.LAUNCH_FILES_2
    return (package[0], file) if known and not Path(path).exists() else None


def node_of(action: act.Node, context: LaunchContext, origin: Origin) -> PlannedNode:
    """The node that an action starts."""
    package = performed(action.package, context) if action.package is not None else ""
    executable = performed(action.executable, context)
    name = performed(action.name, context) if action.name is not None else executable
    own = performed(action.namespace, context) if action.namespace is not None else ""
    namespace = names.as_namespace(names.join(context.namespace, own)) if own else context.namespace
    return PlannedNode(
        package=package,
        type=executable,
        name=name,
        namespace=namespace,
        args=" ".join(_word(a, performed(a, context)) for a in action.arguments),
        origin=origin,
        spans={"type": origin, "args": origin},
        remaps=(
            *context.remaps,
            *((performed(a, context), performed(b, context)) for a, b in action.remappings),
        ),
        env=tuple((performed(k, context), performed(v, context)) for k, v in action.environment.items()),
        output=performed(action.output, context) if act.is_value(action.output) else "log",
        respawn=is_true(performed(action.respawn, context)),
        respawn_delay=seconds_of(action.respawn_delay or 0.0, context),
        required=ends_launch(action.on_exit),
        launch_prefix=performed(action.prefix, context) if action.prefix is not None else None,
    )


def process_of(action: act.ExecuteProcess, context: LaunchContext, origin: Origin) -> PlannedNode:
    """The process that an action starts, as a node without a package."""
    words = [word for written in action.command for word in _words(written, context)]
    if is_true(performed(action.shell, context)):
        words = split_words(" ".join(words))
    program = Path(words[0]).name if words else ""
    name = performed(action.name, context) if action.name is not None else program
    return PlannedNode(
        package="",
        type=program,
        name=name,
        namespace=context.namespace,
        args=shlex.join(words[1:]),
        origin=origin,
        spans={"type": origin, "args": origin},
        required=ends_launch(action.on_exit),
    )


def seconds_of(value: object, context: LaunchContext) -> float:
    """A delay or a period. Raises LaunchError: L005, it is not a number."""
    text = performed(value, context) if act.is_value(value) else str(value)
    try:
        return to_float(text)
    except ValueError:
        raise LaunchError("L005", f"'{text}' is not a number of seconds", "", text) from None


def ends_launch(on_exit: object) -> bool:
    """Whether `on_exit` of a process ends the launch."""
    reactions = on_exit if isinstance(on_exit, list | tuple) else [on_exit]
    return any(
        isinstance(reaction, act.Shutdown)
        or (isinstance(reaction, act.EmitEvent) and isinstance(reaction.event, act.Shutdown))
        for reaction in reactions
    )


def _words(written: object, context: LaunchContext) -> list[str]:
    """The words of one part of a command, which is a single word or a command line."""
    text = performed(written, context)
    return split_words(text) if isinstance(written, CommandLine) else [text]


def _word(argument: object, text: str) -> str:
    if isinstance(argument, CommandLine):
        return text
    return f"'{text}'" if " " in text or not text else text
