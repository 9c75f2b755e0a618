"""ROS 1 launch files: XML in, a Plan out, with everything that is wrong told in one run."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from kbot.ros import names
from kbot.ros.launch import known_packages
from kbot.ros.launch.includes import charge_file, require_end
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import Argument, Included, Machine, Param, Plan, PlannedNode
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros1.attributes import TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.ros1.include_tags import Passed, read_passed, tell_unused
from kbot.ros.launch.ros1.machine_tags import read_machine
from kbot.ros.launch.ros1.node_tags import read_env, read_node, read_remap
from kbot.ros.launch.ros1.param_tags import ParameterStore
from kbot.ros.launch.ros1.schema import CHILDREN
from kbot.text import DescriptionError, Element, Origin, Related, Source, parse_xml, read_source
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
    """What a ROS 1 launch file would do, `arguments` given as on roslaunch's command line.

    Never raises for faults of the file: they are the plan's diagnostics. `source` is its text
    where that is not (yet) what the disk holds. `resolve_anonymous=False` leaves `$(anon …)` as
    it is. `allow_commands` lets `command=` run any program.
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
            problems=tuple(self.reporter.problems),
            findings=tuple(self.reporter.findings),
        )

    def _root(self, source: Source) -> Element:
        self.files.append(os.path.normpath(source.path))
        charge_file(self.reporter.budget, source)
        root = parse_xml(source)
        if root.tag != "launch":
            hint = "a ROS 1 launch file starts with <launch>"
            self.reporter.problem("L001", f"this is a <{root.tag}>, no launch file", root.origin, hint)
            raise DescriptionError(self.reporter.problems)
        return root

    def _elements(self, parent: Element, context: LaunchScope) -> None:
        for element in parent.elements():
            if element.tag not in CHILDREN["launch"]:
                hint = did_you_mean(element.tag, CHILDREN["launch"])
                origin = context.origin(element)
                self.reporter.problem("L002", f"there is no tag <{element.tag}>", origin, hint, warning=True)
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
            self.reporter.problem("L020", f"the argument '{name}' has a value and a default", origin)
        elif name in context.declared and not context.forgiving:
            self.reporter.problem("L021", f"the argument '{name}' is declared twice", origin)
        elif value is not None and name in context.args and not context.forgiving:
            message = f"the argument '{name}' has a fixed value, and another one was given"
            hint = "default= lets it be set from outside"
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
            related = [Related("the other one", twin.origin)]
            message = f"two nodes have the name {node.full_name}"
            self.reporter.problem("L050", message, node.origin, "names are unique", related=related)
            return
        if node.machine and node.machine in self.machines and not self.machines[node.machine].is_local:
            message = f"the machine '{node.machine}' is another one: KBot runs here only"
            self.reporter.problem("L061", message, node.origin, "the node is run here", warning=True)
        self.nodes[node.full_name] = node

    def _machine(self, element: Element, context: LaunchScope) -> None:
        machine = read_machine(element, context, self.tags)
        if machine is None:
            return
        twin = self.machines.setdefault(machine.name, machine)
        if twin.settings != machine.settings:
            related = [Related("the other one", twin.origin)]
            message = f"two machines have the name '{machine.name}'"
            self.reporter.problem("L050", message, machine.origin, "names are unique", related=related)

    def _group(self, element: Element, context: LaunchScope) -> None:
        found = self.tags.attributes(element, context)
        if not found.ok or not self.tags.namespace(element, found, context):
            return
        inner = context.child(found.get("ns"))
        self._clear(element, context, inner, self.tags.flag(element, found, "clear_params", context))
        self._elements(element, inner)
        context.machine = inner.machine  # as roslaunch has it: the default machine outlives its group

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
        stand_in = known_packages.stand_in_file(file)
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
            tell_unused(passed, inner.declared, Path(file).name, self.reporter)

    def _stand_in(
        self,
        element: Element,
        context: LaunchScope,
        inner: LaunchScope,
        package: str,
        file: str,
        passed: Passed,
    ) -> None:
        """A file of a package that is not here: what it would start is stood in for."""
        name = Path(file).name
        defaults = known_packages.LAUNCH_FILES.get((package, name))
        origin = context.attribute_origin(element, "file")
        if defaults is None:
            names_ = [f for p, f in known_packages.LAUNCH_FILES if p == package]
            hint = did_you_mean(name, names_) or "install the package, or leave the include out"
            message = f"the package '{package}' is not here, and KBot has nothing in place of its {name}"
            self.reporter.problem("L012", message, origin, hint)
            return
        tell_unused(passed, set(defaults), name, self.reporter)
        arguments = {**defaults, **{key: value for key, (value, _) in passed.items()}}
        self.included.append(Included(package, name, arguments, inner.namespace, context.origin(element)))
        use_sim_time = arguments["use_sim_time"].lower() in ("true", "1")
        self.parameters.add(Param("/use_sim_time", use_sim_time, context.origin(element)))
