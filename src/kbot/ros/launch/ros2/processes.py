"""What a ROS 2 launch file runs: nodes, and other processes, with everything performed."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from kbot.ros import names
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.ros2 import actions as act
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.parameters import parameter_files
from kbot.ros.launch.ros2.substitutions import CommandLine, is_true, performed
from kbot.text import Origin
from kbot.text.numbers import to_float


def node_of(action: act.Node, context: LaunchContext, origin: Origin) -> PlannedNode:
    """The node that an action starts."""
    package = performed(action.package, context) if action.package is not None else ""
    executable = performed(action.executable, context)
    name = performed(action.name, context) if action.name is not None else executable
    own = performed(action.namespace, context) if action.namespace is not None else ""
    namespace = names.as_namespace(names.join(context.namespace, own)) if own else context.namespace
    return PlannedNode(
        package=package,
        type=executable,
        name=name,
        namespace=namespace,
        args=" ".join(_word(a, performed(a, context)) for a in action.arguments),
        origin=origin,
        spans={"type": origin, "args": origin},
        remaps=(
            *context.remaps,
            *((performed(a, context), performed(b, context)) for a, b in action.remappings),
        ),
        env=tuple((performed(k, context), performed(v, context)) for k, v in action.environment.items()),
        output=performed(action.output, context) if act.is_value(action.output) else "log",
        respawn=is_true(performed(action.respawn, context)),
        respawn_delay=seconds_of(action.respawn_delay or 0.0, context),
        required=ends_launch(action.on_exit),
        launch_prefix=performed(action.prefix, context) if action.prefix is not None else None,
        parameter_files=parameter_files(action.parameters, context),
    )


def process_of(action: act.ExecuteProcess, context: LaunchContext, origin: Origin) -> PlannedNode:
    """The process that an action starts, as a node without a package."""
    words = [word for written in action.command for word in _words(written, context)]
    if is_true(performed(action.shell, context)):
        words = split_words(" ".join(words))
    program = Path(words[0]).name if words else ""
    name = performed(action.name, context) if action.name is not None else program
    return PlannedNode(
        package="",
        type=program,
        name=name,
        namespace=context.namespace,
        args=shlex.join(words[1:]),
        origin=origin,
        spans={"type": origin, "args": origin},
        required=ends_launch(action.on_exit),
    )


def seconds_of(value: Any, context: LaunchContext) -> float:
    """A delay or a period. Raises LaunchError: L005, it is no number."""
    text = performed(value, context) if act.is_value(value) else str(value)
    try:
        return to_float(text)
    except ValueError:
        raise LaunchError("L005", f"'{text}' is no number of seconds", "", text) from None


def ends_launch(on_exit: Any) -> bool:
    """Whether what is done at a process's end is the end of all."""
    reactions = on_exit if isinstance(on_exit, list | tuple) else [on_exit]
    return any(
        isinstance(reaction, act.Shutdown)
        or (isinstance(reaction, act.EmitEvent) and isinstance(reaction.event, act.Shutdown))
        for reaction in reactions
    )


def _words(written: Any, context: LaunchContext) -> list[str]:
    """One word of a command, or all of a command line."""
    text = performed(written, context)
    return split_words(text) if isinstance(written, CommandLine) else [text]


def _word(argument: object, text: str) -> str:
    if isinstance(argument, CommandLine):
        return text
    return f"'{text}'" if " " in text or not text else text
