"""The name, namespace and frame prefix of a simulated robot."""

from __future__ import annotations

import re
import reprlib
from dataclasses import dataclass

from kbot.messages.bus import absolute
from kbot.text import KbotError

_NAME = re.compile(r"[A-Za-z]\w*")
_NAMESPACE = re.compile(r"(?:[A-Za-z_]\w*(?:/\w+)*)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class Naming:
    """How a simulation names a robot.

    `name` is the model name that Gazebo's services use. If empty, it is the name in the description.
    `namespace` contains the robot's topics: `a/b` without outer slashes, or empty for the root.
    `frame_prefix` starts the names of its frames, for example `tb3_0/`.
    """

    name: str = ""
    namespace: str = ""
    frame_prefix: str = ""

    def __post_init__(self) -> None:
        if not (isinstance(self.namespace, str) and _NAMESPACE.fullmatch(self.namespace)):
            raise KbotError(
                f"{reprlib.repr(self.namespace)} is not a valid namespace: write it like tb3_0 or fleet/tb3_0"
            )
        if not isinstance(self.frame_prefix, str):
            raise KbotError(
                f"a frame prefix must be a string such as tb3_0/, not {reprlib.repr(self.frame_prefix)}"
            )

    def topic(self, name: str) -> str:
        """The full name of a topic: `/tb3_0/odom` for `odom`.

        Some descriptions write the namespace themselves, so `tb3_0/odom` is `/tb3_0/odom` too.
        """
        is_full = bool(self.namespace) and name.startswith(f"{self.namespace}/")
        return absolute(name, "" if is_full else self.namespace)


ROOT_NAMING = Naming()


def is_model_name(name: object) -> bool:
    """Whether a string is a valid name of a robot or object: letters, digits and _, a letter first."""
    return isinstance(name, str) and bool(_NAME.fullmatch(name))
