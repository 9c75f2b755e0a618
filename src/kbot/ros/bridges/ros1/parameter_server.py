"""ROS 1's parameter server: a tree of values under names with slashes."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.messages.bus import absolute
from kbot.ros.parameter_values import ParameterValue

Tree = dict[str, ParameterValue]


class ParameterServer:
    """Values are numbers, strings, booleans, lists and, as inner nodes, dictionaries.

    Every method raises KeyError if there is no such parameter. Not thread-safe: the owner locks.
    """

    def __init__(self) -> None:
        self._tree: Tree = {}

    def get(self, name: str) -> ParameterValue:
        value: ParameterValue = self._tree
        for part in parts(name):
            if not isinstance(value, dict) or part not in value:
                raise KeyError(name)
            value = value[part]
        return value

    def set(self, name: str, value: ParameterValue) -> None:
        path = parts(name)
        if not path:
            if not isinstance(value, dict):
                raise KeyError(name)
            self._tree = value
            return
        folder = self._tree
        for part in path[:-1]:
            inner = folder.get(part)
            if not isinstance(inner, dict):
                inner = folder[part] = {}
            folder = inner
        folder[path[-1]] = value

    def delete(self, name: str) -> None:
        path = parts(name)
        if not path:
            self._tree = {}
            return
        folder = self.get("/" + "/".join(path[:-1])) if path[:-1] else self._tree
        if not isinstance(folder, dict):
            raise KeyError(name)
        del folder[path[-1]]

    def search(self, namespace: str, name: str) -> str:
        """The full name of a parameter, searched in `namespace` and then in each namespace above it.

        As in ROS, only the first part of `name` must exist.
        """
        if name.startswith("/"):
            self.get(name)
            return name
        first, scope = name.split("/")[0], parts(namespace)
        for depth in range(len(scope), -1, -1):
            base = "/" + "/".join(scope[:depth])
            full = f"{base.rstrip('/')}/{first}"
            try:
                self.get(full)
            except KeyError:
                continue
            return f"{base.rstrip('/')}/{name}"
        raise KeyError(name)

    def names(self) -> list[str]:
        """Full names of all parameters, without inner nodes."""
        found: list[str] = []

        def walk(tree: Tree, prefix: str) -> None:
            for key, value in tree.items():
                if isinstance(value, dict) and value:
                    walk(value, f"{prefix}/{key}")
                else:
                    found.append(f"{prefix}/{key}")

        walk(self._tree, "")
        return found


def flat_parameters(name: str, value: ParameterValue) -> Iterator[tuple[str, ParameterValue]]:
    """The full name and value of each parameter in a value, which may be a tree."""
    if not isinstance(value, dict):
        yield name, value
    for key, inner in value.items() if isinstance(value, dict) else ():
        yield from flat_parameters(f"{name.rstrip('/')}/{key}", inner)


def is_plain(value: ParameterValue) -> bool:
    """Whether it consists of numbers, strings and booleans, which every bridge can send."""
    if isinstance(value, list):
        return all(map(is_plain, value))
    return isinstance(value, bool | int | float | str)


def parts(name: str) -> list[str]:
    """The parts of a name; none for the root."""
    return [part for part in name.split("/") if part]


def resolve(name: str, caller: str) -> str:
    """The full name: `/a` is global, `~a` is in the namespace of the node, `a` in that around the node."""
    if not name.strip("/"):
        return "/"
    if name.startswith("~"):
        return absolute(f"{caller}/{name[1:].lstrip('/')}")
    return absolute(name, caller.rpartition("/")[0])
