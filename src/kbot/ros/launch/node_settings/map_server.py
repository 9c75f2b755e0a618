"""Reads the settings of map servers: the map files that they publish."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from kbot.ros.launch.node_arguments import split
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.text import Diagnostic, Severity


def read_maps(plan: Plan, servers: Iterable[PlannedNode]) -> tuple[tuple[str, ...], list[Diagnostic]]:
    """The map.yaml files, from arguments in ROS 1 or a parameter in ROS 2, and an error for each missing
    file."""
    found: list[str] = []
    notes: list[Diagnostic] = []
    for node in servers:
        param = plan.params.get(f"{node.full_name}/yaml_filename")
        words = [word for word in split(node) if ":=" not in word and not word.startswith("-")]
        path = str(param.value) if param is not None else (words[0] if words else "")
        if Path(path).is_file():
            found.append(path)
        else:
            what = f"the map {path} does not exist" if path else f"{node.full_name} does not name a map"
            where = param.origin if param is not None else node.spans.get("args", node.origin)
            notes.append(Diagnostic("L059", Severity.ERROR, f"{what}: /map is not published", where))
    return tuple(found), notes
