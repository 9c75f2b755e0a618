"""Reads the attributes of tags: checks them and makes their substitutions."""

from __future__ import annotations

from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.reporter import Reporter, part_of
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.ros1.schema import ATTRIBUTES, REQUIRED
from kbot.ros.launch.ros1.substitutions import SubstitutionScope
from kbot.ros.parameter_values import convert
from kbot.text import Element, Origin
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import PackageNotFound


class Attributes(dict[str, str]):
    """The attributes of an element after substitution. `ok` is whether all substitutions could be made."""

    ok = True


class TagReader:
    """Reads tags and reports their errors.

    `anonymous` remembers the names that `$(anon …)` made. If it is None, such substitutions are not changed.
    """

    def __init__(self, reporter: Reporter, anonymous: dict[str, str] | None) -> None:
        self.reporter, self.anonymous = reporter, anonymous

    def attributes(self, element: Element, context: LaunchScope) -> Attributes:
        """The attributes of an element after substitution. Unknown and missing ones are reported."""
        known = ATTRIBUTES[element.tag]
        found = Attributes()
        for name, raw in element.attributes.items():
            if name in ("if", "unless"):
                continue
            if name not in known:
                spans = element.attribute_spans().get(name)
                origin = Origin(spans[0], context.call) if spans else context.origin(element)
                hint = did_you_mean(name, known) or f"use one of: {', '.join(known)}"
                self.reporter.problem(
                    "L003", f"<{element.tag}> has no attribute '{name}'", origin, hint, warning=True
                )
                continue
            value = self.resolve(element, name, raw, context)
            if value is None:
                found.ok = False
            else:
                found[name] = value
        for name in REQUIRED.get(element.tag, ()):
            if name not in element.attributes:
                found.ok = False
                self.reporter.problem(
                    "L004", f"<{element.tag}> needs the attribute '{name}'", context.origin(element)
                )
        return found

    def _scope(self, context: LaunchScope, origin: Origin) -> SubstitutionScope:
        """The values for a text at `origin`."""
        reporter = self.reporter

        def share_of(error: PackageNotFound) -> str:
            return reporter.absent.share_of(error, part_of(origin, f"$(find {error.name})"))

        packages = reporter.packages.beside(context.file)
        return SubstitutionScope(
            context.file, packages, context.args, reporter.budget, share_of, self.anonymous
        )

    def resolve(self, element: Element, name: str, raw: str, context: LaunchScope) -> str | None:
        """The value of an attribute after substitution. An error is reported, and None is returned."""
        if "$" not in raw:
            return raw
        origin = context.attribute_origin(element, name)
        try:
            return self._scope(context, origin).resolve(raw)
        except LaunchError as fault:
            self.reporter.fault(fault, part_of(origin, fault.piece))
            return None

    def resolve_text(self, text: str, element: Element, context: LaunchScope) -> str | None:
        """The text of an element after substitution, for `subst_value`. An error is reported, and None is
        returned."""
        origin = context.origin(element)
        try:
            return self._scope(context, origin).resolve(text)
        except LaunchError as fault:
            self.reporter.fault(fault, origin)
            return None

    def applies(self, element: Element, context: LaunchScope) -> bool:
        """Whether the `if` or `unless` of an element is fulfilled."""
        given = [name for name in ("if", "unless") if name in element.attributes]
        if not given:
            return True
        if len(given) == 2:
            self.reporter.problem("L006", "a tag cannot have both 'if' and 'unless'", context.origin(element))
            return False
        value = self.resolve(element, given[0], element.attributes[given[0]], context)
        if value is None:
            return False
        try:
            return bool(convert(value, "bool")) is (given[0] == "if")
        except ValueError as error:
            hint = "use true, false, 1 or 0"
            self.reporter.problem("L005", str(error), context.attribute_origin(element, given[0]), hint)
            return False

    def namespace(self, element: Element, found: Attributes, context: LaunchScope) -> bool:
        """Whether an element does not have `ns`, or a valid one."""
        given = found.get("ns", "/")
        if given and not given.startswith("~"):
            return True
        message = f"'ns' cannot be the private name '{given}'" if given else "'ns' is empty"
        self.reporter.problem("L005", message, context.attribute_origin(element, "ns"), "remove 'ns'")
        return False

    def flag(self, element: Element, found: Attributes, name: str, context: LaunchScope) -> bool:
        """The value of a true-or-false attribute; false if it is missing."""
        word = found.get(name, "false").lower()
        if name == "clear_params" and not word:  # roslaunch accepts an empty value only here
            return False
        if word not in ("true", "false"):
            origin = context.attribute_origin(element, name)
            self.reporter.problem("L005", f"'{name}' must be true or false, not '{found[name]}'", origin)
        return word == "true"

    def number(
        self,
        element: Element,
        found: Attributes,
        name: str,
        context: LaunchScope,
        *,
        whole: bool = False,
        signed: bool = False,
    ) -> float | None:
        """The number in an attribute, above 0 unless `signed`. An error is reported, and None is returned."""
        try:
            value = float(int(found[name]) if whole else found[name])
        except (ValueError, OverflowError):
            value = None
        if value is not None and (signed or value > 0.0):
            return value
        what = f"{'a whole number' if whole else 'a number'}{'' if signed else ' above 0'}"
        origin = context.attribute_origin(element, name)
        self.reporter.problem("L005", f"'{name}' must be {what}, not '{found[name]}'", origin)
        return None
