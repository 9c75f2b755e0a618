"""Reads the settings of teleop_twist_keyboard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from kbot.ros import names
from kbot.ros.launch.node_arguments import split
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.nodes.teleop_twist_keyboard import SPEED, TURN, Keys
from kbot.text import Diagnostic, Severity


def read_keys(plan: Plan, nodes: Sequence[PlannedNode]) -> tuple[Keys | None, list[Diagnostic]]:
    """The settings of the first teleop_twist_keyboard, and findings about its parameters."""
    if not nodes:
        return None, []
    notes: list[Diagnostic] = []
    params = _Params(plan, nodes[0], notes)
    return Keys(params.topic("cmd_vel"), params.number("speed", SPEED), params.number("turn", TURN)), notes


class _Params:
    """The parameters of a node. In ROS 1 its command line can also set them."""

    def __init__(self, plan: Plan, node: PlannedNode, notes: list[Diagnostic]) -> None:
        self._node, self._notes = node, notes
        self._params = plan.params_of(node)
        self._words: dict[str, str] = {}
        for word in split(node):
            name, mark, value = word.partition(":=")
            if mark and name.startswith("_") and not name.startswith("__"):
                self._words[name[1:]] = value

    def topic(self, name: str) -> str:
        """The full name of a topic of the node, after its remaps."""
        words = dict(word.split(":=", 1) for word in split(self._node) if ":=" in word)
        remaps = {
            self._full(source): self._full(target)
            for source, target in (*self._node.remaps, *words.items())
            if not source.startswith("_")
        }
        return remaps.get(self._full(name), self._full(name))

    def _full(self, name: str) -> str:
        return names.canonical(names.join(self._node.namespace, name))

    def number(self, name: str, default: float) -> float:
        """A finite number; the default, with a note, if the value is not one."""
        param = self._params.get(name)
        # Any: float() rejects what is not a number
        found: Any = self._words.get(name, default if param is None else param.value)
        try:
            number = float(found)
        except (TypeError, ValueError):
            number = math.nan
        if math.isfinite(number) and not isinstance(found, bool):
            return number
        where = param.origin if param is not None else self._node.spans.get("args", self._node.origin)
        message = f"{name} must be a finite number, not {found!r}"
        self._notes.append(Diagnostic("L062", Severity.WARNING, message, where))
        return default
