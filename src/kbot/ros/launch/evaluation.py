"""Evaluates Python expressions of launch files: `$(eval …)`, PythonExpression."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from kbot.ros.launch.launch_error import LaunchError
from kbot.xacro.budget import Budget
from kbot.xacro.templates import expression as value_of
from kbot.xacro.xacro_error import LimitFault
from kbot.xacro.xacro_error import XacroError as ExpressionFault

if TYPE_CHECKING:
    from kbot.xacro.expressions.operations import Environment

_HARMLESS = (
    abs,
    all,
    any,
    bool,
    dict,
    float,
    int,
    len,
    list,
    map,
    max,
    min,
    round,
    sorted,
    str,
    sum,
    tuple,
)

BUILTINS: Mapping[str, Callable[..., object]] = {function.__name__: function for function in _HARMLESS}
"""Python's own functions that expressions may call: they compute and nothing more."""


def joined(parts: Sequence[str], budget: Budget) -> str:
    """Texts one after the other.

    Raises:
        LaunchError: L015, they are too long, alone or with all that the file's substitutions made before.
    """
    try:
        return budget.joined(parts)
    except LimitFault as error:
        raise LaunchError("L015", error.message, error.hint, is_limit=True) from None


def evaluated(expression: str, names: Environment) -> str:
    """A Python expression's value as text. The expression can compute, within the budget of `names`, and
    nothing more.

    Raises:
        LaunchError: L014, or what looking up a name raised.
    """
    try:
        return names.budget.text(value_of(expression, names))
    except LaunchError as fault:
        fault.piece = fault.piece or expression
        raise
    except ExpressionFault as error:
        is_limit = isinstance(error, LimitFault)
        raise LaunchError("L014", error.message, error.hint, expression, is_limit=is_limit) from None
