"""Single values as rviz writes them: colours as `255; 0; 0`, choices with a capital, topics as fields."""

from __future__ import annotations

from typing import Any

from kbot.text import KbotError
from kbot.workbench.displays.property import Property, Value
from kbot.workbench.displays.settings import checked_value

FIXED_FRAME = "<Fixed Frame>"
PLANES = ("XY", "XZ", "YZ")
SCHEMES = ("map", "costmap", "raw")
RENDERINGS = ("background and overlay", "background", "overlay")
AS_THEY_ARE = frozenset((*PLANES, *SCHEMES, *RENDERINGS))
"""Choices that rviz writes as they are called here."""
ALIKE = {"flat squares": "squares", "tiles": "squares"}
"""Styles of points that look the same here."""


def read_value(property: Property, value: Any) -> Value:  # noqa: ANN401 - what YAML holds
    """A property's value.

    Raises:
        KbotError: it is none; the text says what is meant.
    """
    if isinstance(value, dict) and "Value" in value:
        value = value["Value"]
    match property.kind:
        case "colour":
            return _colour(value)
        case "choice":
            by_name = {_bare(option): option for option in property.options}
            if _bare(str(value)) not in by_name:
                raise KbotError(f"one of {', '.join(property.options)} is known here")
            return by_name[_bare(str(value))]
        case "frame":
            return "" if value == FIXED_FRAME else checked_value(property, value)
        case "topic" | "text":
            return checked_value(property, value or "")
    return checked_value(property, value)


def write_value(property: Property, value: Value, ros1: bool) -> Any:  # noqa: ANN401 - what YAML holds
    """A property's value as rviz reads it."""
    match property.kind:
        case "colour":
            text = str(value) or "#a0a0a4"
            return "; ".join(str(int(text[at : at + 2], 16)) for at in (1, 3, 5))
        case "choice":
            return value if value in AS_THEY_ARE else str(value).capitalize()
        case "frame":
            return value or FIXED_FRAME
        case "topic":
            return value if ros1 else {"Value": value}
        case "number":
            number = float(value)
            return int(number) if number.is_integer() else number
    return value


def _bare(option: str) -> str:
    bare = option.lower().removesuffix(" (flat)").strip()
    return ALIKE.get(bare, bare)


def _colour(value: object) -> str:
    """`#rrggbb` of `r; g; b` in 0..255."""
    try:
        red, green, blue = (int(part) for part in str(value).split(";"))
    except ValueError:
        raise KbotError("a colour is meant, as in '255; 0; 0'") from None
    if not all(0 <= part <= 255 for part in (red, green, blue)):
        raise KbotError("numbers from 0 to 255 are meant")
    return f"#{red:02x}{green:02x}{blue:02x}"
