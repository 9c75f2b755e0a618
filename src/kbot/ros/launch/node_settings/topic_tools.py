"""Reads the settings of nodes that pass topics on: topic_tools/relay and twist_mux."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from kbot.ros.launch.node_arguments import full_name, full_remaps, split
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.nodes.relays import Relayed
from kbot.ros.nodes.twist_mux import MuxInput, MuxSettings
from kbot.text import Diagnostic, Severity


def read_relays(plan: Plan, nodes: Iterable[PlannedNode]) -> tuple[tuple[Relayed, ...], list[Diagnostic]]:
    """The topics that the relays of a launch republish, and a warning for each relay without topics."""
    found: list[Relayed] = []
    notes: list[Diagnostic] = []
    for node in nodes:
        words = [word for word in split(node) if ":=" not in word and not word.startswith("-")]
        params = plan.params_of(node)
        topics = [str(params[name].value) for name in ("input_topic", "output_topic") if name in params]
        topics = words[:2] or topics
        if len(topics) == 2:
            remaps = full_remaps(node)
            source, target = (remaps.get(full, full) for full in (full_name(t, node) for t in topics))
            found.append(Relayed(source, target, node.origin))
        else:
            message = f"{node.full_name} relays nothing: it needs an input topic and an output topic"
            notes.append(Diagnostic("L062", Severity.WARNING, message, node.origin))
    return tuple(found), notes


def read_muxes(plan: Plan, nodes: Iterable[PlannedNode]) -> tuple[tuple[MuxSettings, ...], list[Diagnostic]]:
    """The settings of each twist_mux, and a warning for each entry that is not valid."""
    found: list[MuxSettings] = []
    notes: list[Diagnostic] = []
    for node in nodes:
        params = {name.replace("/", "."): param.value for name, param in plan.params_of(node).items()}
        remaps = full_remaps(node)
        output, is_stamped = full_name("cmd_vel_out", node), params.get("use_stamped")
        found.append(
            MuxSettings(
                _inputs(params, "topics", node, remaps, notes),
                _inputs(params, "locks", node, remaps, notes),
                remaps.get(output, output),
                None if is_stamped is None else str(is_stamped).lower() == "true",
                node.origin,
            )
        )
    return tuple(found), notes


def _inputs(
    params: Mapping[str, Any],
    kind: str,
    node: PlannedNode,
    remaps: Mapping[str, str],
    notes: list[Diagnostic],
) -> tuple[MuxInput, ...]:
    """The inputs of a kind: a list of mappings in ROS 1, parameters `topics.NAME.topic` in ROS 2."""
    entries: dict[str, dict[str, Any]] = {}
    listed = params.get(kind)
    for number, entry in enumerate(listed if isinstance(listed, list) else ()):
        given = entry if isinstance(entry, Mapping) else {}
        entries[str(number)] = {str(key): value for key, value in given.items()}
    for name, value in params.items():
        first, _, rest = name.partition(".")
        if first == kind and "." in rest:
            input_name, _, key = rest.rpartition(".")
            entries.setdefault(input_name, {})[key] = value
    found = []
    for entry in entries.values():
        try:
            topic = full_name(str(entry["topic"]), node)
            found.append(
                MuxInput(remaps.get(topic, topic), float(entry["timeout"]), float(entry["priority"]))
            )
        except (KeyError, TypeError, ValueError):
            message = (
                f"{node.full_name}: an entry of {kind} needs a topic, and numbers as timeout and priority"
            )
            notes.append(Diagnostic("L062", Severity.WARNING, message, node.origin))
    return tuple(found)
