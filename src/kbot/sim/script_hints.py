"""Suggests what to change in a script, if its error has a likely cause."""

from __future__ import annotations

import inspect
import re
from types import FrameType, FunctionType

from kbot.text.suggest import did_you_mean, nearest

_TOO_MANY = re.compile(r"(?<!\w)(\w+)\(\) takes (?:from \d+ to )?(\d+) positional arguments? but (\d+) ")
"""Python's message for a call with too many arguments: the function, how many it takes, how many it got."""
_DECIMAL_COMMA = re.compile(r"(?<![\w.,])(\d++),(\d++)(?![\w.]|,\d)")


def hint_for(error: BaseException, frame: FrameType | None, code: str) -> str:
    """Return what to change, or an empty string. The script raised the error in the frame, at the code."""
    if isinstance(error, AttributeError) and error.name:
        # as Python's own prompt suggests
        return _did_you_mean(error.name, _attributes(error.obj))
    if isinstance(error, NameError) and frame is not None:
        return _did_you_mean(error.name or "", [*frame.f_locals, *frame.f_globals, *frame.f_builtins])
    return _decimal_comma(str(error), code) if isinstance(error, TypeError) else ""


def misnamed_drive(names: dict[str, object]) -> FunctionType | None:
    """The function of a script without `drive` that was probably meant to be it."""
    functions = {name: value for name, value in names.items() if inspect.isfunction(value)}
    near = nearest("drive", functions)
    return functions[near[0]] if len(near) == 1 else None


def takes_a_simulation(drive: object) -> bool:
    """Whether a function can be called with one argument."""
    if not inspect.isfunction(drive):
        return True
    try:
        inspect.signature(drive).bind(None)
    except TypeError:
        return False
    return True


def _did_you_mean(name: str, known: list[str]) -> str:
    return did_you_mean(name, (other for other in known if not other.startswith("__")))


def _attributes(value: object) -> list[str]:
    """The attributes of the user's object, whose own code may fail."""
    try:
        return dir(value)
    except Exception:  # noqa: BLE001 - the user's code
        return []


def _decimal_comma(message: str, code: str) -> str:
    """A hint if decimal commas explain all arguments that are too many: `sim.run(0,5)`."""
    call = _TOO_MANY.search(message)
    if call is None:
        return ""
    name, taken, given = call.groups()
    arguments = re.search(rf"\b{name}\(([^()]*)\)", code)
    numbers = _DECIMAL_COMMA.findall(arguments[1]) if arguments else []
    if len(numbers) != int(given) - int(taken):
        return ""
    whole, part = numbers[0]
    return f"write {whole}.{part} with a point, not {whole},{part}"
