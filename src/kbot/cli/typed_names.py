"""`name:=value` words of the verbs that read a robot: values of arguments, or else of properties."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from kbot.text.notes import note

if TYPE_CHECKING:
    from kbot.xacro.assignments import Assignments


def resolve_typed_names(file: str, values: Mapping[str, str], package_path: Sequence[str]) -> Assignments:
    """What typed names mean for FILE, or for `kbot`; a note for each property that is overridden.

    Raises:
        DescriptionError: a name is neither an argument nor a top-level property of the file.
    """
    from kbot.model.load import resolve_robot_path  # lazy in this module: -h is fast
    from kbot.xacro import Packages
    from kbot.xacro.assignments import resolve_names

    found = resolve_names(resolve_robot_path(file), values, Packages(package_path)).require()
    for text in found.notes:
        note(text)
    return found
