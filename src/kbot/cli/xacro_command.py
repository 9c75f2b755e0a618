"""Reads arguments as the `xacro` command does, for `kbot expand`."""

from __future__ import annotations

from kbot.text.errors import KbotError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping


def xacro_arguments(arguments: Mapping[str, str]) -> dict[str, str]:
    """The arguments as the `xacro` command reads them.

    Names and values are trimmed. Empty values and ROS remappings (`_name:=value`) are ignored.

    Raises:
        KbotError: a word has more than one `:=`, or no name before it.
    """
    given = {}
    for name, value in arguments.items():
        if ":=" in value:
            raise KbotError(f"'{name}:={value}' has more than one ':='")
        key, text = name.strip(), value.strip()
        if not key:
            raise KbotError(f"'{name}:={value}' has no name before ':='. Write name:=value")
        is_remapping = len(key) > 1 and key[0] == "_" and key[1] != "_"
        if text and not is_remapping:
            given[key] = text
    return given
