"""What `kbot expand` shares with the `xacro` command."""

from __future__ import annotations

from kbot.text.errors import KbotError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping


def xacro_arguments(arguments: Mapping[str, str]) -> dict[str, str]:
    """The arguments as the `xacro` command takes them: trimmed; empty ones and `_name:=` are not for it.

    Raises:
        KbotError: a word with more than one `:=`, or with no name before it.
    """
    given = {}
    for name, value in arguments.items():
        if ":=" in value:
            raise KbotError(f"'{name}:={value}' has more than one ':='")
        key, text = name.strip(), value.strip()
        if not key:
            raise KbotError(f"'{name}:={value}' has no name before ':='; an argument is written name:=value")
        is_remapping = len(key) > 1 and key[0] == "_" and key[1] != "_"
        if text and not is_remapping:
            given[key] = text
    return given
