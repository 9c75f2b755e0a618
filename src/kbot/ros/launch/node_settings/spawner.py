"""Reads the settings of controller_manager's spawners: the controllers that start, and their parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from kbot.kinematics.controller_files import node_parameters
from kbot.model.spawned import Setting, SpawnedController
from kbot.ros import names
from kbot.ros.launch.node_arguments import Options, place_of, read_options
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.parameter_values import ROSPARAM
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, read_source
from kbot.text.span import Call
from kbot.text.suggest import did_you_mean
from kbot.text.yaml import YamlDocument, YamlError, read_yaml

_SPAWNER_1 = {"--stopped": 0, "--no-timeout": 0} | dict.fromkeys(
    ("--wait-for", "--namespace", "--timeout", "--shutdown-timeout"), 1
)
_SPAWNER_2 = {
    **dict.fromkeys(("--stopped", "--inactive", "--load-only", "--activate-as-group"), 0),
    **dict.fromkeys(("-u", "--unload-on-kill"), 0),
    **dict.fromkeys(("-c", "--controller-manager", "-p", "--param-file", "-t", "--controller-type"), 1),
    **dict.fromkeys(("-n", "--namespace", "--controller-manager-timeout", "--switch-timeout"), 1),
    **dict.fromkeys(("--service-call-timeout", "--controller-ros-args"), 1),
    "--fallback_controllers": -1,
}
_COMMAND_2 = {"-c": 1, "--controller-manager": 1, "--set-state": 1, "--spin-time": 1}


@dataclass(frozen=True, slots=True)
class _Request:
    """A controller that a node spawns. `files` and `kind` come from the arguments of ROS 2's spawner."""

    name: str
    manager: str
    is_active: bool
    origin: Origin
    files: tuple[str, ...] = ()
    kind: str = ""


@dataclass(frozen=True, slots=True)
class _File:
    """A ROS 2 parameter file, and where it is loaded."""

    document: YamlDocument
    call: Call


def read_controllers(
    plan: Plan, nodes: Iterable[PlannedNode]
) -> tuple[tuple[SpawnedController, ...], list[Diagnostic]]:
    """The controllers that `nodes` spawn, each once, and findings about their files."""
    notes: list[Diagnostic] = []
    requests: dict[str, _Request] = {}
    shared: list[_File] = []
    for node in nodes:
        if runs_hardware(node):
            shared += _files(node.parameter_files, node.origin, notes)
        for request in _requests(node, plan.is_ros_2):
            requests[names.join(request.manager, request.name)] = request
    spawned = []
    for full, request in requests.items():
        if plan.is_ros_2:
            settings = _settings_2(
                plan, full, request, [*shared, *_files(request.files, request.origin, notes)]
            )
        else:
            settings = {
                name.removeprefix(f"{full}/").replace("/", "."): Setting(param.value, param.origin)
                for name, param in plan.params.items()
                if name.startswith(f"{full}/")
            }
            if not settings:
                notes.append(_without_parameters(plan, full, request))
                continue
        ros = 2 if plan.is_ros_2 else 1
        spawned.append(SpawnedController(full, settings, request.is_active, ros, request.origin))
    return tuple(spawned), notes


def _without_parameters(plan: Plan, full: str, request: _Request) -> Diagnostic:
    """The finding for a ROS 1 controller without parameters. In ROS 2, the description can have them."""
    known = [name.removesuffix("/type") for name in plan.params if name.endswith("/type")]
    message = f"the controller {full} is not loaded: it has no parameters"
    hint = did_you_mean(full, known) or (
        f"the launch file sets parameters for {', '.join(known)}" if known else ""
    )
    return Diagnostic("L064", Severity.WARNING, message, request.origin, hint)


def runs_hardware(node: PlannedNode) -> bool:
    """Whether a node is ROS 2's controller manager for the hardware of a robot, real or mocked."""
    return (node.package, node.type) == ("controller_manager", "ros2_control_node")


def _requests(node: PlannedNode, is_ros_2: bool) -> Iterator[_Request]:
    if not node.package:
        yield from _command(node)
    elif node.type == "spawner" and not is_ros_2:
        options = read_options(node, _SPAWNER_1)
        below = options.text("--namespace")
        manager = names.as_namespace(names.join(node.namespace, below) if below else node.namespace)
        for word in _controller_names(options.rest):
            yield _Request(word, manager, not options.has("--stopped"), place_of(node, word))
    elif node.type in ("spawner", "spawner.py"):
        options = read_options(node, _SPAWNER_2)
        is_active = not options.has("--stopped", "--inactive", "--load-only")
        kind = options.text("-t", "--controller-type") or ""
        files = (*options.given.get("-p", ()), *options.given.get("--param-file", ()))
        files = (*node.parameter_files, *files)  # newer spawners pass their own parameters on
        for word in _controller_names(options.rest):
            yield _Request(word, _manager(node, options), is_active, place_of(node, word), files, kind)
    elif node.type == "controller_manager" and not is_ros_2:
        action, *rest = node.args.split() or [""]
        if action in ("spawn", "load"):
            for word in _controller_names(rest):
                yield _Request(word, node.namespace, action == "spawn", place_of(node, word))


def _command(node: PlannedNode) -> Iterator[_Request]:
    """The controllers of a process `ros2 control load_controller --set-state active NAME`."""
    options = read_options(node, _COMMAND_2)
    verb, *rest = options.rest[1:] or ("",)
    states = ("active", "start")
    if verb in ("load_controller", "load_start_controller") and rest:
        is_active = verb == "load_start_controller" or options.text("--set-state") in states
        origin = place_of(node, rest[0])
        yield _Request(rest[0], _manager(node, options), is_active, origin, tuple(rest[1:2]))
    elif verb == "set_controller_state" and len(rest) == 2:
        yield _Request(rest[0], _manager(node, options), rest[1] in states, place_of(node, rest[0]))


def _controller_names(words: Iterable[str]) -> list[str]:
    """The words that name controllers: not options, remappings, or anything after `--ros-args`."""
    found: list[str] = []
    for word in words:
        if word == "--ros-args":
            break
        if ":=" not in word and not word.startswith("-"):
            found.append(word)
    return found


def _manager(node: PlannedNode, options: Options) -> str:
    """The namespace of the controller manager whose services a ROS 2 spawner calls."""
    below = options.text("-n", "--namespace") or ""
    here = names.as_namespace(names.join(node.namespace, below)) if below else node.namespace
    manager = names.join(here, options.text("-c", "--controller-manager") or "controller_manager")
    return names.as_namespace(manager.rpartition("/")[0])


def _files(paths: Iterable[str], origin: Origin, notes: list[Diagnostic]) -> list[_File]:
    found = []
    for path in paths:
        try:
            document = read_yaml(read_source(path), ROSPARAM)
        except DescriptionError as error:
            first = error.diagnostics[0]
            notes.append(Diagnostic("L059", Severity.WARNING, first.message, origin, first.hint))
            continue
        except YamlError as error:
            message = f"the controllers' file is not YAML: {error.problem}"
            place = Origin(error.span, Call("include", path, origin.span, origin.call))
            notes.append(Diagnostic("L059", Severity.WARNING, message, place))
            continue
        found.append(_File(document, Call("include", path, origin.span, origin.call)))
    return found


def _settings_2(plan: Plan, full: str, request: _Request, files: Iterable[_File]) -> dict[str, Setting]:
    """The parameters of a ROS 2 controller, from files and the launch. Its type is a parameter of its
    manager."""
    manager = names.join(request.manager, "controller_manager")
    found: dict[str, Setting] = {}
    for file in files:
        kind = node_parameters(file.document, manager, file.call).get(f"{request.name}.type")
        found |= {"type": kind} if kind else {}
        found |= node_parameters(file.document, full, file.call)
    for node in plan.nodes:
        if runs_hardware(node) and (param := plan.params.get(f"{node.full_name}/{request.name}.type")):
            found.setdefault("type", Setting(param.value, param.origin))
    if request.kind:
        found["type"] = Setting(request.kind, request.origin)
    return found
