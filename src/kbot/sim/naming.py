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
    """`name` is the model's, as Gazebo's services speak of it, empty for the description's own. `namespace`
    holds its topics, `a/b` without slashes around it, empty for the root. `frame_prefix` stands before its
    frames, as `tb3_0/` does."""

    name: str = ""
    namespace: str = ""
    frame_prefix: str = ""

    def __post_init__(self) -> None:
        if not (isinstance(self.namespace, str) and _NAMESPACE.fullmatch(self.namespace)):
            raise KbotError(f"{reprlib.repr(self.namespace)} is no namespace, as tb3_0 and fleet/tb3_0 are")
        if not isinstance(self.frame_prefix, str):
            raise KbotError(
                f"{reprlib.repr(self.frame_prefix)} is no text to stand before frames, as tb3_0/ is"
            )

    def topic(self, name: str) -> str:
        """The full name of a topic: `odom` and, where a description has the namespace in it already, also
        `tb3_0/odom` are `/tb3_0/odom`."""
        has_it = bool(self.namespace) and name.startswith(f"{self.namespace}/")
        return absolute(name, "" if has_it else self.namespace)


ROOT_NAMING = Naming()


def is_model_name(name: object) -> bool:
    """Whether a robot or a thing may be called so: letters, digits and _ only, a letter first."""
    return isinstance(name, str) and bool(_NAME.fullmatch(name))
