"""Evaluates Python expressions of launch files: `$(eval …)` and PythonExpression."""

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
"""The built-in functions that expressions may call. They only compute."""


def joined(parts: Sequence[str], budget: Budget) -> str:
    """The texts joined.

    Raises:
        LaunchError: L015, the result exceeds the limit, alone or together with all earlier substitutions.
    """
    try:
        return budget.joined(parts)
    except LimitFault as error:
        raise LaunchError("L015", error.message, error.hint, is_limit=True) from None


def evaluated(expression: str, names: Environment) -> str:
    """The value of a Python expression, as text. The expression can only compute, within the budget of
    `names`.

    Raises:
        LaunchError: L014, or the error of a name's lookup.
    """
    try:
        return names.budget.text(value_of(expression, names))
    except LaunchError as fault:
        fault.piece = fault.piece or expression
        raise
    except ExpressionFault as error:
        is_limit = isinstance(error, LimitFault)
        raise LaunchError("L014", error.message, error.hint, expression, is_limit=is_limit) from None
