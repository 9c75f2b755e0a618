"""`<machine>`: names for computers. KBot runs on this one only, and reads them as roslaunch does."""

from __future__ import annotations

from kbot.ros.launch.plan import Machine
from kbot.ros.launch.ros1.attributes import TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.text import Element

_DEFAULTS = ("true", "false", "never")
_SSH = 22.0
"""The usual port."""


def read_machine(element: Element, context: LaunchScope, tags: TagReader) -> Machine | None:
    """The machine of a `<machine>`, which becomes the surroundings' own where it is the default."""
    found = tags.attributes(element, context)
    if not found.ok:
        return None
    default = found.get("default", "false").lower()
    if default not in _DEFAULTS:
        origin = context.attribute_origin(element, "default")
        tags.reporter.problem("L005", f"'default' is one of {', '.join(_DEFAULTS)}, not '{default}'", origin)
    if default == "true":
        context.machine = found["name"]
    port: float | None = _SSH
    if found.get("ssh-port"):
        port = tags.number(element, found, "ssh-port", context, whole=True)
    timeout = tags.number(element, found, "timeout", context) if "timeout" in found else None
    others = (found.get("env-loader"), found.get("user", ""), found.get("password", ""), default == "never")
    settings = (found["address"], port, timeout, *others)
    return Machine(found["name"], found["address"], context.origin(element), settings)
