"""Reads a ROS 1 launch file into a Plan and reports all its errors at once."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from kbot.ros import names
from kbot.ros.launch.includes import charge_file, require_end
from kbot.ros.launch.known_packages import (
    LAUNCH_FILES,
    NODES,
    RENAMED,
    SPAWN_MODEL_VALUES,
    is_not_run,
    stand_in_file,
)
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.node_arguments import place_of
from kbot.ros.launch.plan import Argument, Included, Machine, Param, Plan, PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import Reporter, part_of, removal_of
from kbot.ros.launch.ros1.attributes import Attributes, TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.ros1.param_tags import ParameterStore
from kbot.ros.launch.ros1.schema import CHILDREN
from kbot.text import (
    DescriptionError,
    Diagnostic,
    Edit,
    Element,
    Fix,
    Origin,
    Related,
    Severity,
    Source,
    parse_xml,
    read_source,
)
from kbot.text.errors import reading
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import Packages


def read_launch(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    *,
    source: Source | None = None,
    resolve_anonymous: bool = True,
    allow_commands: bool = False,
) -> Plan:
    """The plan of a ROS 1 launch file. `arguments` are those of roslaunch's command line.

    Errors in the file are the plan's diagnostics, not exceptions. `source` is its text if that
    differs from the file on disk. With `resolve_anonymous=False`, `$(anon …)` is not changed.
    `allow_commands` lets `command=` run any program.
    """
    anonymous: dict[str, str] | None = {} if resolve_anonymous else None
    reader = _Reader(TagReader(Reporter(packages or Packages(around=path)), anonymous), allow_commands)
    with reading(path):
        return reader.read(path, dict(arguments or {}), source)


class _Reader:
    def __init__(self, tags: TagReader, allow_commands: bool) -> None:
        self.tags, self.reporter = tags, tags.reporter
        self.parameters = ParameterStore(tags, allow_commands)
        self.nodes: dict[str, PlannedNode] = {}
        self.arguments: dict[str, Argument] = {}
        self.declared: set[str] = set()
        self.included: list[Included] = []
        self.machines: dict[str, Machine] = {}
        self.files: list[str] = []
        self.clear: list[str] = []

    def read(self, path: str, given: dict[str, str], source: Source | None) -> Plan:
        context = LaunchScope(path, args=dict(given), is_root=True)
        try:
            root = self._root(source or read_source(path))
        except DescriptionError as error:
            return Plan(path, problems=error.diagnostics)
        self._elements(root, context)
        for name in given:
            if name not in self.declared:
                hint = did_you_mean(name, self.declared)
                message = f"the launch file has no argument '{name}'"
                self.reporter.problem("L024", message, context.origin(root), hint, warning=True)
        return Plan(
            path,
            nodes=tuple(self.nodes.values()),
            params=self.parameters.store,
            arguments=self.arguments,
            included=tuple(self.included),
            machines=tuple(self.machines.values()),
            files=tuple(self.files),
            clear=tuple(self.clear),
            store=tuple(self.parameters.others),
            problems=self.reporter.problems,
            findings=tuple(self.reporter.findings),
        )

    def _root(self, source: Source) -> Element:
        self.files.append(os.path.normpath(source.path))
        charge_file(self.reporter.budget, source)
        root = parse_xml(source)
        if root.tag != "launch":
            hint = "a ROS 1 launch file begins with <launch>"
            message = f"not a launch file: the root element is <{root.tag}>"
            raise DescriptionError([Diagnostic("L001", Severity.ERROR, message, root.origin, hint)])
        return root

    def _elements(self, parent: Element, context: LaunchScope) -> None:
        for element in parent.elements():
            if element.tag not in CHILDREN["launch"]:
                hint = did_you_mean(element.tag, CHILDREN["launch"])
                origin = context.origin(element)
                self.reporter.problem("L002", f"unknown tag <{element.tag}>", origin, hint, warning=True)
            elif self.tags.applies(element, context):
                self._element(element, context)

    def _element(self, element: Element, context: LaunchScope) -> None:
        match element.tag:
            case "arg":
                self._arg(element, context)
            case "param":
                self._param(element, context)
            case "rosparam":
                self.parameters.rosparam(element, context)
            case "node" | "test":
                self._node(element, context)
            case "include":
                self._include(element, context)
            case "group":
                self._group(element, context)
            case "remap":
                read_remap(element, context, self.tags)
            case "env":
                read_env(element, context, self.tags)
            case "machine":
                self._machine(element, context)

    def _arg(self, element: Element, context: LaunchScope) -> None:
        found = self.tags.attributes(element, context)
        name, value, default = found.get("name"), found.get("value"), found.get("default")
        if name is None:
            return
        origin = context.origin(element)
        if value is not None and default is not None:
            self.reporter.problem("L020", f"the argument '{name}' has both a value and a default", origin)
        elif name in context.declared and not context.forgiving:
            self.reporter.problem("L021", f"the argument '{name}' is declared twice", origin)
        elif value is not None and name in context.args and not context.forgiving:
            message = f"the argument '{name}' has a fixed value and cannot be set"
            hint = "use default= instead of value= to make it settable"
            self.reporter.problem("L022", message, context.attribute_origin(element, "value"), hint)
        elif value is not None:
            context.args[name] = value
        elif default is not None:
            context.args.setdefault(name, default)
        context.declared.add(name)
        if context.call is None:
            self.declared.add(name)
        if context.is_root and not value:
            current = context.args.get(name)
            self.arguments[name] = Argument(name, current, default, found.get("doc"), origin)

    def _param(self, element: Element, context: LaunchScope) -> None:
        param = self.parameters.param(element, context)
        if param is None:
            return
        if param.name.startswith("~"):
            context.private.pop(param.name, None)
            context.private[param.name] = param
        else:
            name = names.canonical(names.join(context.namespace, param.name))
            self.parameters.add(Param(name, param.value, param.origin, param.description))

    def _node(self, element: Element, context: LaunchScope) -> None:
        node = read_node(element, context, self.tags, self.parameters, self.clear)
        if node is None:
            return
        twin = self.nodes.get(node.full_name)
        if twin:
            related = [Related("the other node", twin.origin)]
            message = f"two nodes have the name {node.full_name}"
            self.reporter.problem("L050", message, node.origin, "rename one of them", related=related)
            return
        if node.machine and node.machine in self.machines and not self.machines[node.machine].is_local:
            message = (
                f"the machine '{node.machine}' is not this one: KBot runs {node.full_name} on this machine"
            )
            self.reporter.problem("L061", message, node.origin, warning=True)
        self.nodes[node.full_name] = node

    def _machine(self, element: Element, context: LaunchScope) -> None:
        machine = read_machine(element, context, self.tags)
        if machine is None:
            return
        twin = self.machines.setdefault(machine.name, machine)
        if twin.settings != machine.settings:
            related = [Related("the other machine", twin.origin)]
            message = f"two machines with different settings have the name '{machine.name}'"
            self.reporter.problem("L050", message, machine.origin, "rename one of them", related=related)

    def _group(self, element: Element, context: LaunchScope) -> None:
        found = self.tags.attributes(element, context)
        if not found.ok or not self.tags.namespace(element, found, context):
            return
        inner = context.child(found.get("ns"))
        self._clear(element, context, inner, self.tags.flag(element, found, "clear_params", context))
        self._elements(element, inner)
        context.machine = inner.machine  # as in roslaunch, the default machine stays set after its group

    def _clear(self, element: Element, context: LaunchScope, inner: LaunchScope, asked: bool) -> None:
        if not asked:
            return
        if "ns" not in element.attributes:
            message = "'clear_params' needs the attribute 'ns'"
            self.reporter.problem("L004", message, context.origin(element))
            return
        self.clear.append(inner.namespace)

    def _include(self, element: Element, context: LaunchScope) -> None:
        found = self.tags.attributes(element, context)
        passing_all = self.tags.flag(element, found, "pass_all_args", context)
        passed, env = read_passed(element, context, self.tags, passing_all)
        if not found.ok or not self.tags.namespace(element, found, context):
            return
        file = found["file"]
        args = {name: value for name, (value, _) in passed.items()}
        inner = context.included(found.get("ns"), file, args, element)
        inner.env += env
        inner.forgiving = passing_all
        self._clear(element, context, inner, self.tags.flag(element, found, "clear_params", context))
        stand_in = stand_in_file(file)
        if stand_in:
            self._stand_in(element, context, inner, *stand_in, passed)
            return
        levels = sum(1 for _ in inner.call.chain()) if inner.call is not None else 0
        try:
            require_end(file, levels, len(self.files))
            root = self._root(read_source(file))
        except LaunchError as fault:
            self.reporter.fault(fault, context.origin(element))
            return
        except DescriptionError as error:
            for diagnostic in error.diagnostics:
                where = context.attribute_origin(element, "file")
                at = diagnostic.origin if diagnostic.code[0] != "F" else None
                origin = Origin(at.span, inner.call) if at else where
                self.reporter.problem(diagnostic.code, diagnostic.message, origin, diagnostic.hint)
            return
        self._elements(root, inner)
        context.machine = inner.machine
        if not passing_all:
            report_unused(passed, inner.declared, Path(file).name, self.reporter)

    def _stand_in(
        self,
        element: Element,
        context: LaunchScope,
        inner: LaunchScope,
        package: str,
        file: str,
        passed: Passed,
    ) -> None:
        """Include a file of a package that KBot replaces."""
        name = Path(file).name
        defaults = LAUNCH_FILES.get((package, name))
        origin = context.attribute_origin(element, "file")
        if is_not_run(package, name):
            self.reporter.unneeded_include(package, name, part_of(origin, f"$(find {package})"))
            return
        if defaults is None:
            names_ = [f for p, f in LAUNCH_FILES if p == package]
            message, hint = self.reporter.absent.missing_include(package, name)
            where = part_of(origin, f"$(find {package})")
            self.reporter.problem("L012", message, where, did_you_mean(name, names_) or hint)
            return
        report_unused(passed, set(defaults), name, self.reporter)
        arguments = {**defaults, **{key: value for key, (value, _) in passed.items()}}
        self.included.append(Included(package, name, arguments, inner.namespace, context.origin(element)))
        use_sim_time = arguments["use_sim_time"].lower() in ("true", "1")
        self.parameters.add(Param("/use_sim_time", use_sim_time, context.origin(element)))


Passed = dict[str, tuple[str, Origin]]
"""The passed arguments by name: the value, and where it was written."""


def read_passed(
    element: Element, context: LaunchScope, tags: TagReader, passing_all: bool
) -> tuple[Passed, list[tuple[str, str]]]:
    """The arguments and the environment that an `<include>` passes to its file."""
    here = context.origin(element)
    passed: Passed = {name: (value, here) for name, value in context.args.items()} if passing_all else {}
    own: set[str] = set()
    surroundings = context.child()
    surroundings.env = []
    for child in element.elements():
        if child.tag not in CHILDREN["include"]:
            hint = did_you_mean(child.tag, CHILDREN["include"])
            message = f"<{child.tag}> is not allowed in <include>"
            tags.reporter.problem("L002", message, context.origin(child), hint, warning=True)
            continue
        if not tags.applies(child, context):
            continue
        if child.tag == "env":
            read_env(child, surroundings, tags)
            continue
        found = tags.attributes(child, context)
        if not found.ok:
            continue
        origin = Origin(child.attribute_origin("name").span, context.call)
        name, value, default = found["name"], found.get("value"), found.get("default")
        if value is not None and default is not None:
            tags.reporter.problem("L020", f"the argument '{name}' has both a value and a default", origin)
        elif name in own and not passing_all:
            tags.reporter.problem("L021", f"the argument '{name}' is passed twice", origin)
        elif value is not None:
            passed[name] = (value, origin)
        elif default is not None:
            passed.setdefault(name, (default, origin))
        elif name not in passed:
            tags.reporter.problem("L020", f"the argument '{name}' is passed without a value", origin)
        own.add(name)
    return passed, surroundings.env


def report_unused(passed: Passed, declared: set[str], file: str, reporter: Reporter) -> None:
    """Report arguments that the file does not declare."""
    for name, (_, origin) in passed.items():
        if name not in declared:
            hint = did_you_mean(name, declared)
            reporter.problem("L023", f"{file} has no argument '{name}'", origin, hint)


def read_node(
    element: Element, context: LaunchScope, tags: TagReader, parameters: ParameterStore, clear: list[str]
) -> PlannedNode | None:
    """The node of a `<node>` or `<test>`. None if it has an error, which is reported."""
    found = tags.attributes(element, context)
    surroundings = _children(element, context, found, tags, parameters)
    if not found.ok or not tags.namespace(element, found, context):
        return None
    name = found.get("name") or found.get("test-name", "")
    named = context.attribute_origin(element, "name" if "name" in found else "test-name")
    if not name.startswith("$(anon") and ("/" in name or name.startswith("~")):
        hint = "set the namespace with the attribute 'ns'"
        tags.reporter.problem("L051", f"the node name '{name}' must not contain a namespace", named, hint)
    elif not names.is_legal(name) and not name.startswith("$(anon"):
        hint = "use letters, digits and _, and begin with a letter"
        tags.reporter.problem("L051", f"'{name}' is not a valid ROS name", named, hint, warning=True)
    namespace = context.child(found.get("ns")).namespace
    if tags.flag(element, found, "clear_params", context):
        clear.append(names.as_namespace(names.join(namespace, name)))
    delay = None
    if "respawn_delay" in found:
        delay = tags.number(element, found, "respawn_delay", context, signed=True)
    node = PlannedNode(
        package=found["pkg"],
        type=found["type"],
        name=name,
        namespace=namespace,
        args=found.get("args", ""),
        origin=context.origin(element),
        spans={key: context.attribute_origin(element, key) for key in found},
        remaps=tuple(surroundings.remaps.items()),
        env=tuple(surroundings.env),
        output=found.get("output", "log"),
        cwd=found.get("cwd"),
        respawn=tags.flag(element, found, "respawn", context),
        respawn_delay=delay or 0.0,
        required=tags.flag(element, found, "required", context),
        launch_prefix=found.get("launch-prefix"),
        machine=found.get("machine") or context.machine,
        is_test=element.tag == "test",
    )
    _check(element, found, context, tags)
    _review(node, tags.reporter)
    return node


_CHOICES = {"output": ("log", "screen"), "cwd": ("ROS_HOME", "ros_home", "node")}
_ONLY_OF_NODES = ("respawn", "respawn_delay", "output")
"""Attributes that `<test>` does not have, unlike `<node>`."""


def _check(element: Element, found: Attributes, context: LaunchScope, tags: TagReader) -> None:
    """Report values with which roslaunch does not start."""
    for key, choices in _CHOICES.items():
        if key in found and found[key] not in choices:
            hint = did_you_mean(found[key], choices)
            message = (
                f"'{key}' must be {' or '.join(c for c in choices if c != 'ros_home')}, not '{found[key]}'"
            )
            tags.reporter.problem("L005", message, context.attribute_origin(element, key), hint)
    for key in ("pkg", "type"):
        if not found[key].strip():
            tags.reporter.problem("L005", f"'{key}' is empty", context.attribute_origin(element, key))
    if element.tag == "test":
        _check_test(element, found, context, tags)
    elif all(found.get(key, "").lower() == "true" for key in ("respawn", "required")):
        message = "a node cannot have both 'respawn' and 'required'"
        tags.reporter.problem("L006", message, context.attribute_origin(element, "required"))


def _check_test(element: Element, found: Attributes, context: LaunchScope, tags: TagReader) -> None:
    for key in _ONLY_OF_NODES:
        if key in found:
            origin = context.attribute_origin(element, key)
            tags.reporter.problem("L003", f"<test> has no attribute '{key}'", origin, "only <node> has it")
    if found.get("time-limit"):
        tags.number(element, found, "time-limit", context)
    if found.get("retry"):
        tags.number(element, found, "retry", context, whole=True, signed=True)


def _children(
    element: Element, context: LaunchScope, found: Attributes, tags: TagReader, parameters: ParameterStore
) -> LaunchScope:
    """Read the elements in a node, and return a scope with the node's own remaps and environment."""
    surroundings = context.child()
    name = found.get("name") or found.get("test-name") or "unnamed"
    own = context.child(found.get("ns")).child(name)
    own.private = {}
    if found.ok:
        here = context.origin(element)
        # `read_node` makes the node after its parameters. How severe an error in them is depends on whether
        # KBot runs the node, which these values decide
        own.node = PlannedNode(
            package=found["pkg"],
            type=found["type"],
            name=name,
            namespace=own.namespace,
            args=found.get("args", ""),
            origin=here,
            spans={"type": here},
        )
    private = dict(context.private)
    for child in element.elements():
        if child.tag not in CHILDREN["node"]:
            hint = did_you_mean(child.tag, CHILDREN["node"])
            message = f"<{child.tag}> is not allowed in <{element.tag}>"
            tags.reporter.problem("L002", message, context.origin(child), hint, warning=True)
        elif not tags.applies(child, context):
            continue
        elif child.tag == "param":
            param = parameters.param(child, own)
            if param is not None:
                private.pop(param.name, None)
                private[param.name] = param
        elif child.tag == "rosparam":
            parameters.rosparam(child, own)
        elif child.tag == "remap":
            read_remap(child, surroundings, tags)
        else:
            read_env(child, surroundings, tags)
    for param in private.values():
        key = names.canonical(own.namespace + param.name.removeprefix("~"))
        parameters.add(Param(key, param.value, param.origin, param.description))
    return surroundings


def read_remap(element: Element, context: LaunchScope, tags: TagReader) -> None:
    """Read a `<remap>`. A later one for the same name replaces an earlier one."""
    found = tags.attributes(element, context)
    if not found.ok:
        return
    pair = [names.canonical(found[key]) for key in ("from", "to")]
    for key, name in zip(("from", "to"), pair, strict=True):
        if not name or not names.is_legal(name):
            origin = context.attribute_origin(element, key)
            tags.reporter.problem("L060", f"'{name}' is not a valid ROS name", origin)
            return
    context.remaps.pop(pair[0], None)
    context.remaps[pair[0]] = pair[1]


def read_env(element: Element, context: LaunchScope, tags: TagReader) -> None:
    """Read an `<env>`, which applies to all later nodes."""
    found = tags.attributes(element, context)
    if not found.ok:
        return
    if not found["name"]:
        origin = context.attribute_origin(element, "name")
        tags.reporter.problem("L005", "'name' is empty", origin)
        return
    context.env.append((found["name"], found["value"]))


def _review(node: PlannedNode, reporter: Reporter) -> None:
    """Report a node that ROS renamed, or that its package does not have."""
    origin = node.spans["type"]
    renamed = RENAMED.get((node.package, node.type))
    if renamed:
        new = renamed.new_type
        package = f" in {renamed.new_package}" if renamed.new_package != node.package else ""
        replaced = f"was replaced by {renamed.new_package}/{new} in {renamed.since}"
        message = f"the node {node.package}/{node.type} {replaced}"
        hint = f"roslaunch starts the other nodes without it: {renamed.missing}"
        edits = []
        for key, value in (("pkg", renamed.new_package), ("type", new)):
            if node.spans[key].span.text != value:
                edits.append(Edit(node.spans[key].span, value))
        fix = Fix(f'set type="{new}"{package}', tuple(edits), safe=True)
        reporter.finding(Diagnostic("L053", Severity.ERROR, message, origin, hint, fix=fix))
    elif node.package in NODES and node.type not in NODES[node.package]:
        hint = did_you_mean(node.type, NODES[node.package])
        if hint:
            message = f"the package {node.package} has no node '{node.type}'"
            reporter.finding(Diagnostic("L054", Severity.ERROR, message, origin, hint))
    if (node.package, node.type) == ("gazebo_ros", "spawn_model"):
        _review_spawn_model(node, reporter)


def _review_spawn_model(node: PlannedNode, reporter: Reporter) -> None:
    """Report options that spawn_model does not know: with one, it does not start."""
    try:
        words = split_words(node.args)
    except ValueError as error:
        reporter.finding(Diagnostic("L056", Severity.ERROR, f"args: {error}", node.spans.get("args")))
        return
    rest = iter(words)
    for word in rest:
        count = SPAWN_MODEL_VALUES.get(word)
        if count is None:
            near = did_you_mean(word, SPAWN_MODEL_VALUES)
            hint = f"{near} " if near else "remove it; "
            hint += f"the options are {' '.join(SPAWN_MODEL_VALUES)}"
            message = f"spawn_model has no option '{word}': it does not start, and the robot does not appear"
            place = place_of(node, word)
            fix = None if near else removal_of(place, word)
            reporter.finding(Diagnostic("L056", Severity.ERROR, message, place, hint, fix=fix))
            continue
        for _ in range(count):
            next(rest, None)


_DEFAULTS = ("true", "false", "never")
_SSH_PORT = 22.0
"""The default port of SSH."""


def read_machine(element: Element, context: LaunchScope, tags: TagReader) -> Machine | None:
    """The machine of a `<machine>`. A default machine is set in the scope, for all later nodes."""
    found = tags.attributes(element, context)
    if not found.ok:
        return None
    default = found.get("default", "false").lower()
    if default not in _DEFAULTS:
        origin = context.attribute_origin(element, "default")
        tags.reporter.problem("L005", f"'default' must be {' or '.join(_DEFAULTS)}, not '{default}'", origin)
    if default == "true":
        context.machine = found["name"]
    port: float | None = _SSH_PORT
    if found.get("ssh-port"):
        port = tags.number(element, found, "ssh-port", context, whole=True)
    timeout = tags.number(element, found, "timeout", context) if "timeout" in found else None
    others = (found.get("env-loader"), found.get("user", ""), found.get("password", ""), default == "never")
    settings = (found["address"], port, timeout, *others)
    return Machine(found["name"], found["address"], context.origin(element), settings)
