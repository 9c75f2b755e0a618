"""ROS graph names: join, normalise and check. `/a/b` is global, `~b` private, `b` relative."""

from __future__ import annotations

import re

_LEGAL = re.compile(r"[A-Za-z~/][\w/]*\Z", re.ASCII)


def join(namespace: str, name: str) -> str:
    """The name in the namespace. Global and private names are not changed."""
    if name.startswith(("~", "/")) or not namespace:
        return name
    if namespace == "~":
        return "~" + name
    return namespace + name if namespace.endswith("/") else f"{namespace}/{name}"


def canonical(name: str) -> str:
    """The name without doubled or trailing slashes."""
    if not name or name == "/":
        return name
    return ("/" if name.startswith("/") else "") + "/".join(part for part in name.split("/") if part)


def as_namespace(name: str) -> str:
    """A global namespace with a slash at both ends: `/` or `/robot/`."""
    return "/" + "".join(f"{part}/" for part in name.split("/") if part)


def is_legal(name: str) -> bool:
    """Whether ROS accepts a name for a node, topic or parameter. It accepts an empty one."""
    return not name or (bool(_LEGAL.match(name)) and "//" not in name)
