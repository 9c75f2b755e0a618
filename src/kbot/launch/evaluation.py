"""Python expressions of launch files: `$(eval …)`, PythonExpression."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kbot.launch.faults import Fault
from kbot.xacro.expressions.compiler import compiled
from kbot.xacro.expressions.operations import InvalidExpression
from kbot.xacro.faults import Fault as ExpressionFault

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

BUILTINS: Mapping[str, Callable[..., Any]] = {function.__name__: function for function in _HARMLESS}
"""Python's own functions that expressions may call: they compute and nothing more."""


MOST_CHARACTERS = 1 << 24
"""Of a text that is put together: one that doubles another, time and again, would fill all memory."""


def joined(parts: Sequence[str]) -> str:
    """Texts one after the other.

    Raises:
        Fault: L015, they are too much.
    """
    count = sum(map(len, parts))
    if count > MOST_CHARACTERS:
        raise Fault("L015", f"a text of {count:,} characters (the bound is {MOST_CHARACTERS:,})")
    return "".join(parts)


def evaluated(expression: str, names: object) -> str:
    """A Python expression's value as text; it can compute and nothing more. `names` is an environment of
    `kbot.xacro.expressions`: with `lookup`, `assign` and a `budget`.

    Raises:
        Fault: L014, or what looking up a name raised.
    """
    try:
        return str(compiled(expression)(names))
    except Fault as fault:
        fault.piece = fault.piece or expression
        raise
    except InvalidExpression as error:
        raise Fault("L014", f"the expression cannot be read: {error}", "", expression) from None
    except ExpressionFault as error:
        raise Fault("L014", error.message, error.hint, expression) from None
    except (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError) as error:
        raise Fault("L014", f"the expression cannot be computed: {error}", "", expression) from None
