"""What every part of the reader needs: attributes with their substitutions made, and faults collected."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.launch.context import Context
from kbot.launch.schema import ATTRIBUTES, REQUIRED
from kbot.launch.substitution import Fault, Scope
from kbot.launch.values import convert
from kbot.text import Diagnostic, Element, Origin, Related, Severity, Span
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import Packages


class Attributes(dict[str, str]):
    """An element's attributes with their substitutions made. `ok`: all could be made."""

    ok = True


class Reporter:
    """Collects what is wrong; the same fault at the same place is reported once."""

    def __init__(self, packages: Packages, anonymous: dict[str, str] | None) -> None:
        self.packages = packages
        self.anonymous = anonymous
        self.problems: list[Diagnostic] = []
        self.findings: list[Diagnostic] = []
        self._seen: set[tuple[str, str, str, int]] = set()

    def problem(
        self,
        code: str,
        message: str,
        origin: Origin,
        hint: str = "",
        *,
        warning: bool = False,
        related: Iterable[Related] = (),
    ) -> None:
        """Report what keeps the file from being read as it is meant."""
        severity = Severity.WARNING if warning else Severity.ERROR
        key = (code, message, origin.span.file, origin.span.start)
        if key not in self._seen:
            self._seen.add(key)
            self.problems.append(Diagnostic(code, severity, message, origin, hint, tuple(related)))

    def finding(self, diagnostic: Diagnostic) -> None:
        """Report what a ROS would stumble over."""
        if diagnostic not in self.findings:
            self.findings.append(diagnostic)

    def attributes(self, element: Element, context: Context) -> Attributes:
        """An element's attributes, checked against its tag's and with their substitutions made."""
        known = ATTRIBUTES[element.tag]
        found = Attributes()
        for name, raw in element.attributes.items():
            if name in ("if", "unless"):
                continue
            if name not in known:
                spans = element.attribute_spans().get(name)
                origin = Origin(spans[0], context.call) if spans else context.origin(element)
                hint = did_you_mean(name, known) or f"it may have {', '.join(known)}"
                self.problem("L003", f"<{element.tag}> has no attribute '{name}'", origin, hint, warning=True)
                continue
            value = self.resolve(element, name, raw, context)
            if value is None:
                found.ok = False
            else:
                found[name] = value
        for name in REQUIRED.get(element.tag, ()):
            if name not in element.attributes:
                found.ok = False
                self.problem("L004", f"<{element.tag}> lacks its attribute '{name}'", context.origin(element))
        return found

    def resolve(self, element: Element, name: str, raw: str, context: Context) -> str | None:
        """An attribute's value with its substitutions made; None, and a problem, where that fails."""
        scope = Scope(context.file, self.packages.beside(context.file), context.args, self.anonymous)
        try:
            return scope.resolve(raw)
        except Fault as fault:
            origin = part_of(context.attribute_origin(element, name), fault.piece)
            self.problem(fault.code, fault.message, origin, fault.hint)
            return None

    def resolve_text(self, text: str, element: Element, context: Context) -> str | None:
        """The text within an element with its substitutions made, as `subst_value` asks for."""
        scope = Scope(context.file, self.packages.beside(context.file), context.args, self.anonymous)
        try:
            return scope.resolve(text)
        except Fault as fault:
            self.problem(fault.code, fault.message, context.origin(element), fault.hint)
            return None

    def applies(self, element: Element, context: Context) -> bool:
        """Whether an element's `if` and `unless` let it stand."""
        given = [name for name in ("if", "unless") if name in element.attributes]
        if not given:
            return True
        if len(given) == 2:
            self.problem("L006", "a tag cannot have both 'if' and 'unless'", context.origin(element))
            return False
        value = self.resolve(element, given[0], element.attributes[given[0]], context)
        if value is None:
            return False
        try:
            return bool(convert(value, "bool")) is (given[0] == "if")
        except ValueError as error:
            hint = "true, false, 1 and 0 are understood"
            self.problem("L005", str(error), context.attribute_origin(element, given[0]), hint)
            return False

    def flag(self, element: Element, found: Attributes, name: str, context: Context) -> bool:
        """A yes-or-no attribute, false where it is not given."""
        word = found.get(name, "false").lower()
        if word not in ("true", "false"):
            origin = context.attribute_origin(element, name)
            self.problem("L005", f"'{name}' is true or false, not '{found[name]}'", origin)
        return word == "true"


def part_of(origin: Origin, piece: str) -> Origin:
    """The part of an attribute's value that holds a piece of its text; all of it where it is not found."""
    span = origin.span
    at = span.source.data.find(piece.encode(), span.start, span.end) if piece else -1
    if at < 0:
        return origin
    return Origin(Span(span.source, at, at + len(piece.encode())), origin.call)
