"""The state of one expansion: files, arguments, remaining budget, and problems."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cached_property

from kbot.text.errors import DescriptionError
from kbot.text.files import read_source
from kbot.text.span import Call, Origin, Source, Span
from kbot.text.suggest import did_you_mean
from kbot.text.xml import Element, Text
from kbot.xacro.budget import Budget
from kbot.xacro.files import parsed
from kbot.xacro.location import locate
from kbot.xacro.serialise import written_size
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import LimitFault, Problem, XacroError, consequence

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic, Fix
    from kbot.text.xml import XmlDocument
    from kbot.xacro.binding import Binding
    from kbot.xacro.limits import Limits
    from kbot.xacro.packages import Packages

Log = Callable[[str, Value, str, Value], None]
"""Called with `set` or `use`, the scope, the name and the value."""

_DEFINED = frozenset({"undefined", "macro", "block", "argument"})
"""The keys of faults about names that an included file may define."""
_MESSAGE_CODES = {"message": ("X301", "info"), "warning": ("X302", "warning"), "error": ("X303", "warning")}


class Run:
    """The state of one expansion that all its parts share.

    `files` is the stack of files being read. `used` are the bindings looked up since it was last cleared.
    `resolving` are the bindings being evaluated, innermost last.
    """

    def __init__(
        self,
        path: str,
        arguments: Mapping[str, str],
        packages: Packages | None,
        limits: Limits,
        root_dir: str,
        lenient: bool = False,
    ) -> None:
        self.lenient = lenient
        self.files = [path]
        self.given = dict(arguments)
        self.arguments = dict(arguments)
        self.failed_arguments: dict[str, Problem] = {}
        self.declared: set[str] = set()
        self.defaults: dict[str, Binding] = {}
        """Each argument at its first default, with its value. Later defaults have no effect."""
        self._packages = packages
        self.limits = limits
        self.root_dir = root_dir
        self.budget = Budget(limits)
        self.nodes = limits.nodes
        self.characters = limits.text
        self.deepest = 0
        """The deepest nesting of elements, macro calls and includes so far."""
        self.copied = 0
        """An upper bound of the characters copied unchanged from files and macros."""
        self.source_nodes = self.source_depth = 0
        """The elements and comments of all files, and the nesting of the deepest file."""
        self.depth = 0
        self.macro_depth = 0
        self.used: list[Binding] = []
        self.resolving: list[Binding] = []
        self.dependencies: dict[str, None] = {}
        self.problems: list[Problem] = []
        self.incomplete: Problem | None = None
        """A file that could not be included. Names that it may have defined are not reported as undefined."""
        self.absent: list[tuple[str, Problem]] = []
        """Each include of a package that is not found, by its file. A warning, until its names are used."""
        self.log: Log | None = None
        self.pending: list[tuple[str, str, str, str]] = []
        """Warnings of the text being evaluated. `flush` adds their place."""
        self._known: dict[object, Problem] = {}
        self._errors = 0

    @property
    def file(self) -> str:
        """The file being read, as it was named."""
        return self.files[-1]

    @cached_property
    def packages(self) -> Packages:
        """Finds packages: also around the file, unless the caller set another place."""
        from kbot.xacro.packages import Packages  # not every description has packages: start-up time

        return (self._packages or Packages()).beside(self.files[0] or os.curdir)

    def absolute(self, name: str) -> str:
        """The path of a file name that is relative to the file being read."""
        if os.path.isabs(name):
            return name
        return os.path.join(os.path.dirname(self.file) if self.file else ".", name)

    def read(self, name: str) -> Source:
        """Read a file that the description names. Only the description itself may come from a pipe.

        Raises:
            DescriptionError: it is missing or unreadable.
        """
        path = name if self.root_dir == os.curdir else os.path.join(self.root_dir, name)
        source = read_source(path, self.limits.file_bytes, from_pipe=name == self.files[0])
        self.budget.charge(len(source.text) >> 8)  # a file may be read any number of times
        return source if path == name else Source(name, source.text)

    def parsed(self, source: Source, *, lenient: bool = False) -> XmlDocument:
        """Parse a file to expand."""
        document = parsed(source, self.limits.nesting, self.limits.nodes, lenient=lenient)
        self.copied += len(source.text)
        self.source_nodes += document.nodes
        self.source_depth = max(self.source_depth, document.depth)
        return document

    def check_result(self, root: Element) -> None:
        """Check the size of the result.

        Raises:
            LimitFault: the result is too long to be written.
        """
        nodes = self.limits.nodes - self.nodes + self.source_nodes
        evaluated = self.limits.text - self.characters
        indentation = 2 * nodes * (self.deepest + self.source_depth)
        most = self.limits.text
        # computing the exact size takes a walk, so it is done only if the bound is exceeded
        if evaluated + self.copied + indentation > most and written_size([root], most) > most:
            fault = self.budget.exceeded("text", "the result is too long")
            fault.origin = root.origin
            raise fault

    def argument(self, name: str) -> str:
        """The value of `$(arg name)`.

        Raises:
            XacroError: X112, the argument is neither declared nor given.
        """
        try:
            value = self.arguments[name]
        except (KeyError, TypeError):
            if name in self.failed_arguments:
                raise consequence(self.failed_arguments[name]) from None
            hint = did_you_mean(str(name), self.arguments) or (
                f'declare it first: <xacro:arg name="{name}" default="…"/>, or pass {name}:=…'
            )
            fault = XacroError("X112", f"the argument '{name}' is not defined", hint, key=("argument", name))
            fault.near = hint.startswith("did")
            raise fault from None
        self.declared.add(name)
        if name in self.defaults:
            self.used.append(self.defaults[name])
        return value

    def load_yaml(self, filename: str, constant: Callable[[str], Value]) -> Value:
        """`xacro.load_yaml`. `constant` evaluates the expressions after units such as `!degrees`."""
        from kbot.xacro import yaml  # most robots read no YAML: start-up time

        name = self.absolute(str(filename))
        self.dependencies[name] = None
        try:
            source = self.read(name)
        except DescriptionError as error:
            cause = error.diagnostics[0]
            fault = XacroError("X117", cause.message, cause.hint, key=("file", name))
            raise fault from None
        self.files.append(name)
        try:
            return yaml.load(source, constant, self.budget)
        finally:
            self.files.pop()

    # --- errors and warnings -----------------------------------------------------------------

    def report(self, fault: XacroError, node: Element | Text, attribute: str, call: Call | None) -> Problem:
        """Report a fault of an attribute's value or of a text, or of a tag if `attribute` is empty.

        Raises:
            LimitFault: the fault is a LimitFault, or there are too many errors. Expansion stops.
        """
        if fault.origin is None:
            fault.origin = locate(node, attribute, call, fault.part)
        if isinstance(fault, LimitFault):
            raise fault
        problem = self._add(fault, fault.origin)
        if fault.is_elsewhere:
            problem.also("needed here", locate(node, attribute, call, fault.part))
        return problem

    def report_value(self, fault: XacroError, binding: Binding) -> Problem:
        """Report a fault of a property's own value."""
        if binding.node is not None:
            return self.report(fault, binding.node, binding.attribute, binding.call)
        fault.origin = fault.origin or self._start()
        return self._add(fault, fault.origin)

    def _add(self, fault: XacroError, origin: Origin) -> Problem:
        if fault.problem is not None:
            fault.problem.also("needed here", origin)
            return fault.problem
        if self.incomplete is not None and fault.key is not None and not fault.near:
            self.incomplete.also(fault.message, origin)
            return self.incomplete
        from kbot.text.diagnostic import Severity  # only for an error: start-up time

        if self.absent and isinstance(fault.key, tuple) and fault.key[0] in _DEFINED and not fault.near:
            causes = self._absent_in(origin.span.file)
            for cause in causes:
                cause.severity = Severity.ERROR
                cause.also(fault.message, origin)
            return causes[0]
        key = fault.key or (fault.code, fault.message, origin.span.file, origin.span.start)
        problem = self._known.get(key)
        if problem is not None:
            problem.severity = Severity.ERROR  # it may be an include that was skipped
            problem.also("needed here", origin)
            return problem
        problem = Problem(fault.code, Severity.ERROR, fault.message, origin, fault.hint)
        problem.fix = fault.fix
        self._known[key] = problem
        self.problems.append(problem)
        self._errors += 1
        if self._errors >= self.limits.errors:
            raise LimitFault("X199", f"stopped after {self._errors} errors", origin=origin)
        return problem

    def skip_include(self, fault: XacroError, origin: Origin) -> None:
        """Report an include of a package that is not found. It is an error if something else needs it."""
        from kbot.text.diagnostic import Severity  # only for a warning: start-up time

        problem = self._known.get(fault.key)
        if problem is None:
            message = f"{fault.message}, so this file is not included"
            problem = Problem(fault.code, Severity.WARNING, message, origin, fault.hint)
            self._known[fault.key] = problem
            self.problems.append(problem)
        problem.also("included here too", origin)
        self.absent.append((origin.span.file, problem))

    def _absent_in(self, file: str) -> list[Problem]:
        """The packages that a file includes but that are not found; all of them if it includes none."""
        return [p for name, p in self.absent if name == file] or [p for _, p in self.absent]

    def adopt(self, diagnostics: tuple[Diagnostic, ...], call: Call | None) -> Problem | None:
        """Report the diagnostics of a file, and return the first of the errors."""
        first: Problem | None = None
        for d in diagnostics:
            origin = Origin(d.origin.span, call) if d.origin else self._start()
            if not d.is_error:
                self._warning(d.code, d.severity, d.message, origin, d.hint, d.fix)
                continue
            fault = XacroError(d.code, d.message, d.hint, origin=origin)
            problem = self._add(fault, origin)
            problem.fix = d.fix
            first = first or problem
        return first

    def warn(self, code: str, message: str, hint: str = "", severity: str = "warning") -> None:
        """Add a warning about the text being evaluated."""
        self.pending.append((code, severity, message, hint))

    def warn_at(self, code: str, message: str, origin: Origin | None, hint: str = "") -> None:
        """Add a warning about a place, once."""
        self._warning(code, "warning", message, origin or self._start(), hint)

    def flush(self, node: Element | Text, attribute: str, call: Call | None) -> None:
        """Report the pending warnings at the text that was just evaluated."""
        pending, self.pending = self.pending, []
        for code, severity, message, hint in pending:
            self._warning(code, severity, message, locate(node, attribute, call, None), hint)

    def _warning(
        self, code: str, severity: str, message: str, origin: Origin, hint: str, fix: Fix | None = None
    ) -> None:
        key = (code, message, origin.span.file, origin.span.start)
        if key not in self._known and len(self._known) < 10_000:
            from kbot.text.diagnostic import Severity

            problem = self._known[key] = Problem(code, Severity(severity), message, origin, hint)
            problem.fix = fix
            self.problems.append(problem)

    def add_message(self, kind: str, text: str) -> None:
        """Add a message of `xacro.message`, `xacro.warning` or `xacro.error`."""
        code, severity = _MESSAGE_CODES[kind]
        self.warn(code, text, severity=severity)

    def location(self) -> str:
        """The files being read, innermost first."""
        return "when processing file: " + "\nincluded from: ".join(reversed(self.files))

    def point_at_later_definitions(self, find: Callable[[str], Binding | None]) -> None:
        """Change the texts of undefined names that the file defines later, or as the other kind of name."""
        for key, problem in self._known.items():
            kind, name, *known = key if isinstance(key, tuple) and len(key) in (2, 3) else ("", "")
            if kind not in ("undefined", "argument"):
                continue
            binding, argument = find(name), self.defaults.get(name)
            later = binding.origin if binding is not None else None
            if later is not None and kind == "undefined":
                problem.message = f"unknown property '{name}'"
                problem.hint = "it is defined only further down. Define it before its first use"
                problem.also("defined here", later)
            elif later is not None and not known:
                problem.message = f"'{name}' is a property, not an argument"
                problem.hint = f"define it before its first use, and write ${{{name}}}"
                problem.also("defined here", later)
            elif kind == "undefined" and argument is not None and argument.origin is not None:
                if not known:
                    from kbot.xacro.confused_names import argument_as_property  # only for an error

                    fault = argument_as_property(name, self.arguments.get(name, ""))
                    problem.message = fault.message
                    problem.hint = f"declare it before its first use, and {fault.hint}"
                problem.also("declared here", argument.origin)

    def point_at_unprefixed(self, root: Element) -> None:
        """Change the hint of undefined properties and macros that `root` defines without `xacro:`."""
        for key, problem in self._known.items():
            kind, name = key if isinstance(key, tuple) and len(key) == 2 else ("", "")
            tag = {"undefined": "property", "macro": "macro"}.get(kind)
            for element in root.elements(tag) if tag else ():
                if element.attributes.get("name") == name:
                    problem.hint = f"write <xacro:{tag} …> where it is defined"
                    problem.also("this tag has no 'xacro:'", element.origin)

    def _start(self) -> Origin:
        return Origin(Span(Source(self.files[0], ""), 0, 0))

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        return tuple(problem.diagnostic() for problem in self.problems)
