"""Scopes: store properties, parameters and blocks, look them up, and evaluate them."""

from __future__ import annotations

from kbot.text.suggest import did_you_mean
from kbot.xacro.binding import BUSY, FAILED, LAZY, READY, Binding
from kbot.xacro.budget import Budget
from kbot.xacro.names import FUNCTIONS, GLOBAL, KNOWN, run_name
from kbot.xacro.templates import evaluate, expression
from kbot.xacro.values import Value, literal
from kbot.xacro.xacro_error import XacroError, consequence

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.run import Run

NO_VALUE = "${…}"
"""A value that is still to be filled in, as the page of X100 shows it. It is not a valid expression."""


class Scope:
    """The names of one file, macro call or namespace. They hide those of the enclosing scope."""

    __slots__ = ("budget", "is_namespace", "parent", "run", "values")

    def __init__(self, run: Run, parent: Scope | None = None, is_namespace: bool = False) -> None:
        self.run = run
        self.parent = parent
        self.is_namespace = is_namespace
        self.budget: Budget = run.budget
        self.values: dict[str, Binding] = {}

    def lookup(self, name: str) -> Value:
        """The value of a name, evaluated at its first use.

        Raises:
            XacroError: X103 not defined, X105 circular definition, or the consequence of another problem.
        """
        scope: Scope | None = self
        while scope is not None:
            binding = scope.values.get(name)
            if binding is not None:
                self.run.used.append(binding)
                return binding.value if binding.state == READY else scope._resolve(binding)
            scope = scope.parent
        try:
            return GLOBAL[name] if name in GLOBAL else run_name(self.run, name, self._constant)
        except KeyError:
            raise self._undefined(name) from None

    def substitute(self, content: str) -> str:
        """The value of `$(content)`."""
        from kbot.xacro.substitution import substitute  # small robots do not use it: start-up time

        try:
            return substitute(content, self.run)
        except XacroError as fault:
            key = fault.key
            binding = self.find(key[1]) if fault.code == "X112" and isinstance(key, tuple) else None
            if binding is None:
                raise
            from kbot.xacro.confused_names import property_as_argument  # only for an error: start-up time

            raise property_as_argument(binding, content) from None

    def _constant(self, text: str) -> Value:
        """The value of an expression that cannot use properties."""
        return expression(text, Scope(self.run))

    def assign(self, name: str, value: Value) -> None:
        """Define a property in an expression (`:=`)."""
        self.define(Binding(name, value, READY, None, "", None))

    def define(self, binding: Binding) -> None:
        """Add a binding to this scope. A text that spells a number or truth value becomes that value."""
        name, value = binding.name, binding.value
        if name in KNOWN:
            self.run.warn_at("X201", f"'{name}' hides a built-in name", binding.origin)
        if type(value) is str:
            binding.value = value = literal(value)
        if binding.state == LAZY and (type(value) is not str or "$" not in value):
            binding.state = READY
        self.values[name] = binding
        if self.run.log is not None:
            self.run.log("set", self, name, value)

    def remove(self, name: str) -> None:
        """Remove a name from this scope and all enclosing scopes."""
        scope: Scope | None = self
        while scope is not None:
            scope.values.pop(name, None)
            scope = scope.parent

    def find(self, name: str) -> Binding | None:
        """The binding of a name, without evaluating it."""
        scope: Scope | None = self
        while scope is not None:
            binding = scope.values.get(name)
            if binding is not None:
                return binding
            scope = scope.parent
        return None

    def __contains__(self, name: str) -> bool:
        return self.find(name) is not None or name in KNOWN

    def top(self) -> Scope:
        """The outermost scope."""
        scope = self
        while scope.parent is not None:
            scope = scope.parent
        return scope

    @property
    def depth(self) -> int:
        return 0 if self.parent is None else self.parent.depth + 1

    def xacro_attribute(self, name: str) -> Value:
        """`namespace.name` in an expression."""
        return self.lookup(name)

    __getitem__ = xacro_attribute

    def known(self) -> set[str]:
        """Every name with a value that is visible here, without functions."""
        names = set(KNOWN - FUNCTIONS)
        scope: Scope | None = self
        while scope is not None:
            names.update(name for name in scope.values if not name.startswith("*"))
            scope = scope.parent
        return names

    def blocks(self) -> list[str]:
        """Every block that can be inserted here."""
        found: list[str] = []
        scope: Scope | None = self
        while scope is not None:
            found += [name.lstrip("*") for name in scope.values if name.startswith("*")]
            scope = scope.parent
        return found

    def _resolve(self, binding: Binding) -> Value:
        if binding.state == BUSY:
            raise self._circular(binding)
        if binding.state == FAILED:
            raise _failed(binding)
        run = self.run
        binding.state = BUSY
        run.resolving.append(binding)
        mark = len(run.used)
        try:
            value = literal(evaluate(binding.value, self))
        except XacroError as error:
            fault = error
            if binding.value == NO_VALUE:
                hint = f"replace {NO_VALUE} by its value"
                fault = XacroError("X100", f"the property '{binding.name}' has no value", hint)
            binding.problem = run.report_value(fault, binding)
            binding.state = FAILED
            raise _failed(binding) from None
        finally:
            run.resolving.pop()
        binding.inputs = tuple(run.used[mark:])
        del run.used[mark:]
        binding.value = value
        binding.state = READY
        if run.log is not None:
            run.log("use", self, binding.name, value)
        return value

    def _circular(self, binding: Binding) -> XacroError:
        resolving = self.run.resolving
        chain = [b.name for b in resolving[resolving.index(binding) :]] + [binding.name]
        return XacroError(
            "X105",
            f"circular definition: {' -> '.join(chain)}",
            "give one of them a value that does not use the others, or evaluate it at once with "
            'lazy_eval="false"',
            key=("circular", frozenset(chain)),
        )

    def _undefined(self, name: str) -> XacroError:
        if name in self.run.arguments:
            from kbot.xacro.confused_names import argument_as_property  # only for an error: start-up time

            return argument_as_property(name, self.run.arguments[name])
        near = did_you_mean(name, self.known())
        hint = near or f'Define it with <xacro:property name="{name}" value="…"/>'
        fault = XacroError("X103", f"unknown property '{name}'", hint, key=("undefined", name))
        fault.near = bool(near)
        return fault


def _failed(binding: Binding) -> XacroError:
    if binding.problem is None:
        return XacroError("X100", f"'{binding.name}' has no value")
    return consequence(binding.problem)
