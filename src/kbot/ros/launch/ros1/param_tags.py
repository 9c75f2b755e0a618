"""Reads `<param>` and `<rosparam>`, which set parameters."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

from kbot.ros import names
from kbot.ros.launch import commands
from kbot.ros.launch.includes import charge_text, charge_yaml
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import Param, RobotDescription
from kbot.ros.launch.ros1.attributes import Attributes, TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.user_program import is_run
from kbot.ros.parameter_values import ROSPARAM, TYPES, ParameterValue, convert
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, Source, read_source
from kbot.text.files import read_bytes
from kbot.text.span import Call
from kbot.text.suggest import did_you_mean
from kbot.text.yaml import Keys, read_yaml

_SOURCES = ("value", "textfile", "binfile", "command")
_YAML_COMMANDS = ("load", "dump", "delete")


class ParameterStore:
    """The parameters that a launch file sets, in order. `others` are `rosparam dump` and `rosparam
    delete`."""

    def __init__(self, tags: TagReader, allow_commands: bool) -> None:
        self.tags, self.reporter = tags, tags.reporter
        self.allow_commands = allow_commands
        self.store: dict[str, Param] = {}
        self.others: list[tuple[str, str, str]] = []

    def add(self, param: Param) -> None:
        """Set a parameter. A later value replaces an earlier one."""
        parts = param.name.split("/")[1:-1]
        for count in range(1, len(parts) + 1):
            above = "/" + "/".join(parts[:count])
            if above in self.store:
                message = f"the parameter {param.name} is inside {above}, which already has a value"
                self.reporter.problem("L035", message, param.origin, warning=True)
        self.store[param.name] = param

    def param(self, element: Element, context: LaunchScope) -> Param | None:
        """The parameter of a `<param>`, with its name as written. None if it has an error, which is
        reported."""
        reporter = self.reporter
        found = self.tags.attributes(element, context)
        given = [name for name in _SOURCES if name in element.attributes]
        if len(given) != 1:
            what = f"exactly one of {', '.join(_SOURCES)}"
            has = " and ".join(given) or "none of them"
            reporter.problem("L030", f"<param> needs {what}, but has {has}", context.origin(element))
            return None
        if not found.ok:
            return None
        source = given[0]
        origin = context.attribute_origin(element, source)
        type_ = (found.get("type") or "auto").lower().strip()
        if type_ not in TYPES:
            hint = did_you_mean(type_, TYPES) or f"use one of: {', '.join(TYPES)}"
            where = context.attribute_origin(element, "type")
            reporter.problem("L031", f"unknown parameter type '{type_}'", where, hint)
            return None
        try:
            value, description = self._value(source, found, type_, origin)
        except LaunchError as fault:
            reporter.fault(fault, origin)
        except DescriptionError as error:
            self._unusable_file("L032", error.diagnostics[0], origin, context)
        except ValueError as error:
            reporter.problem("L031", str(error), origin)
        else:
            return Param(names.canonical(found["name"].strip()), value, context.origin(element), description)
        return None

    def _value(
        self, source: str, found: Attributes, type_: str, origin: Origin
    ) -> tuple[ParameterValue, RobotDescription | None]:
        text = found[source]
        budget = self.reporter.budget
        match source:
            case "value":
                return convert(text.strip(), type_), None
            case "textfile":
                content = read_source(text).text
                charge_text(budget, text, content)
                if type_ == "yaml":
                    charge_yaml(budget, text, content)
                return convert(content, type_), commands.description_of(text, content)
            case "binfile":
                data = _bytes(text)
                charge_text(budget, text, data)
                return data, None
        packages, note = self.reporter.packages, self.reporter.finding
        output, description = commands.run(
            text, packages, origin, note, budget, self.allow_commands, os.environ
        )
        return convert(output, type_), description

    def rosparam(self, element: Element, context: LaunchScope) -> None:
        """Read a `<rosparam>`: set the parameters of its YAML, or note a dump or deletion for the launch."""
        reporter = self.reporter
        found = self.tags.attributes(element, context)
        if not found.ok:
            return
        command = found.get("command") or "load"
        file = found.get("file")
        name = names.join(found.get("ns", ""), found.get("param", ""))
        full = names.join(context.namespace, name) if name else context.namespace
        if command not in _YAML_COMMANDS:
            hint = did_you_mean(command, _YAML_COMMANDS) or f"use one of: {', '.join(_YAML_COMMANDS)}"
            origin = context.attribute_origin(element, "command")
            reporter.problem("L033", f"unknown <rosparam> command '{command}'", origin, hint)
        elif command == "load":
            substituted = self.tags.flag(element, found, "subst_value", context)
            self._load(element, context, file, full, bool(name), substituted)
        elif command == "delete" and file is not None:
            origin = context.attribute_origin(element, "file")
            reporter.problem("L033", "command 'delete' does not take a file", origin, "remove 'file'")
        elif command == "dump" and file is None:
            reporter.problem("L004", "command 'dump' needs the attribute 'file'", context.origin(element))
        else:
            self.others.append((command, full, file or ""))

    def _load(
        self,
        element: Element,
        context: LaunchScope,
        file: str | None,
        full: str,
        named: bool,
        substituted: bool,
    ) -> None:
        reporter = self.reporter
        origin = context.attribute_origin(element, "file") if file else context.origin(element)
        try:
            source = read_source(file) if file else None
        except DescriptionError as error:
            self._unusable_file("L032", error.diagnostics[0], origin, context)
            return
        text: str | None = source.text if source else element.text
        if substituted:
            text = self.tags.resolve_text(text or "", element, context)
            if text is None:
                return
        try:
            charge_yaml(reporter.budget, file or context.file, text or "")
            is_whole_file = source is not None and source.text == text
            document = read_yaml(source if source and is_whole_file else Source("", text or ""), ROSPARAM)
        except LaunchError as fault:
            reporter.fault(fault, origin)
            return
        except ValueError as error:
            where = f" in {file}" if file else ""
            found = Diagnostic("L033", Severity.ERROR, f"the YAML{where} cannot be read: {error}")
            self._unusable_file("L033", found, origin, context)
            return
        data = {} if document.data is None else document.data
        if not isinstance(data, dict) and not named:
            message = 'YAML that is not a mapping needs a parameter name: add param="NAME"'
            reporter.problem("L034", message, context.origin(element))
            return
        call = Call("include", file or "", context.origin(element).span, context.call)

        def place(keys: Keys) -> Origin:
            return Origin(document.span(*keys), call) if is_whole_file and keys else context.origin(element)

        self._spread(full, data, place)

    def _unusable_file(self, code: str, found: Diagnostic, origin: Origin, context: LaunchScope) -> None:
        """Report parameters that cannot be read. roslaunch stops, and KBot only if it runs the node."""
        node = context.node
        if node is None or is_run(node, self.reporter.packages.beside(context.file)):
            self.reporter.problem(code, found.message, origin, found.hint)
        else:
            self.reporter.unneeded_file(replace(found, code=code), origin, node.name, stops_ros=True)

    def _spread(
        self,
        name: str,
        value: ParameterValue,
        place: Callable[[Keys], Origin],
        keys: Keys = (),
    ) -> None:
        """Set the parameters of a mapping, each with the origin that `place` gives for its keys."""
        if isinstance(value, dict):
            for key, item in value.items():
                if isinstance(key, str):
                    self._spread(names.join(name, key), item, place, (*keys, key))
                else:  # YAML reads `on:` as a truth value and `1:` as a number
                    message = f"the YAML key {key!r} is not a string"
                    self.reporter.problem("L033", message, place(keys), "put the key in quotes")
        else:
            self.add(Param(names.canonical(name), value, place(keys)))


def _bytes(path: str) -> bytes:
    try:
        return read_bytes(path)
    except OSError as error:
        message = f"{path} cannot be read: {error.strerror}"
        raise DescriptionError([Diagnostic("L032", Severity.ERROR, message)]) from None
