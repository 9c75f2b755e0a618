"""Attributes of tags: checked, and with their substitutions made."""

from __future__ import annotations

from kbot.ros.launch.faults import Fault
from kbot.ros.launch.reporter import Reporter, part_of
from kbot.ros.launch.ros1.context import Context
from kbot.ros.launch.ros1.schema import ATTRIBUTES, REQUIRED
from kbot.ros.launch.ros1.substitutions import Scope
from kbot.ros.parameter_values import convert
from kbot.text import Element, Origin
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import Packages


class Attributes(dict[str, str]):
    """An element's attributes with their substitutions made. `ok`: all could be made."""

    ok = True


class TagReporter(Reporter):
    """A reporter that reads tags. `anonymous` remembers the names that `$(anon …)` gave; None leaves such
    substitutions as they are."""

    def __init__(self, packages: Packages, anonymous: dict[str, str] | None) -> None:
        super().__init__(packages)
        self.anonymous = anonymous

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

    def _scope(self, context: Context) -> Scope:
        packages = self.packages.beside(context.file)
        return Scope(context.file, packages, context.args, self.budget, self.anonymous)

    def resolve(self, element: Element, name: str, raw: str, context: Context) -> str | None:
        """An attribute's value with its substitutions made; None, and a problem, where that fails."""
        scope = self._scope(context)
        try:
            return scope.resolve(raw)
        except Fault as fault:
            origin = part_of(context.attribute_origin(element, name), fault.piece)
            self.fault(fault, origin)
            return None

    def resolve_text(self, text: str, element: Element, context: Context) -> str | None:
        """The text within an element with its substitutions made, as `subst_value` asks for."""
        scope = self._scope(context)
        try:
            return scope.resolve(text)
        except Fault as fault:
            self.fault(fault, context.origin(element))
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

    def namespace(self, element: Element, found: Attributes, context: Context) -> bool:
        """Whether what an element gives as `ns` can be one; it may give none."""
        given = found.get("ns", "/")
        if given and not given.startswith("~"):
            return True
        says = "an empty 'ns' says nothing" if not given else f"'{given}' is private to a node, no namespace"
        self.problem("L005", says, context.attribute_origin(element, "ns"), "leave it out")
        return False

    def flag(self, element: Element, found: Attributes, name: str, context: Context) -> bool:
        """A yes-or-no attribute, false where it is not given."""
        word = found.get(name, "false").lower()
        if name == "clear_params" and not word:  # roslaunch passes over this one alone
            return False
        if word not in ("true", "false"):
            origin = context.attribute_origin(element, name)
            self.problem("L005", f"'{name}' is true or false, not '{found[name]}'", origin)
        return word == "true"

    def number(
        self,
        element: Element,
        found: Attributes,
        name: str,
        context: Context,
        *,
        whole: bool = False,
        signed: bool = False,
    ) -> float | None:
        """The number that an attribute says, above 0 unless it may be `signed`; None where it says none."""
        try:
            value = float(int(found[name]) if whole else found[name])
        except (ValueError, OverflowError):
            value = None
        if value is not None and (signed or value > 0.0):
            return value
        what = f"{'a whole number' if whole else 'a number'}{'' if signed else ' above 0'}"
        origin = context.attribute_origin(element, name)
        self.problem("L005", f"'{name}' is {what}, not '{found[name]}'", origin)
        return None
