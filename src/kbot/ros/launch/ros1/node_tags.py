"""`<node>` and `<test>`, and what a ROS would stumble over in them."""

from __future__ import annotations

from kbot.ros import names
from kbot.ros.launch.known_packages import NODES, RENAMED, SPAWN_MODEL_VALUES
from kbot.ros.launch.node_arguments import place_of
from kbot.ros.launch.plan import Param, PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros1.attributes import Attributes, TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.ros1.param_tags import ParameterStore
from kbot.ros.launch.ros1.schema import CHILDREN
from kbot.text import Diagnostic, Edit, Element, Fix, Severity
from kbot.text.suggest import did_you_mean


def read_node(
    element: Element, context: LaunchScope, tags: TagReader, parameters: ParameterStore, clear: list[str]
) -> PlannedNode | None:
    """The node of a `<node>` or `<test>`; None where it cannot be made out."""
    found = tags.attributes(element, context)
    surroundings = _children(element, context, found, tags, parameters)
    if not found.ok or not tags.namespace(element, found, context):
        return None
    name = found.get("name") or found.get("test-name", "")
    named = context.attribute_origin(element, "name" if "name" in found else "test-name")
    if not name.startswith("$(anon") and ("/" in name or name.startswith("~")):
        hint = "the attribute 'ns' says the namespace"
        tags.reporter.problem("L051", f"a node's name has no namespace in it, and '{name}' has", named, hint)
    elif not names.is_legal(name) and not name.startswith("$(anon"):
        hint = "a name holds letters, digits and _, and starts with a letter"
        tags.reporter.problem("L051", f"'{name}' is no ROS name", named, hint, warning=True)
    namespace = context.child(found.get("ns")).namespace
    if tags.flag(element, found, "clear_params", context):
        clear.append(names.as_namespace(names.join(namespace, name)))
    delay = None
    if "respawn_delay" in found:
        delay = tags.number(element, found, "respawn_delay", context, signed=True)
    node = PlannedNode(
        package=found["pkg"],
        type=found["type"],
        name=name,
        namespace=namespace,
        args=found.get("args", ""),
        origin=context.origin(element),
        spans={key: context.attribute_origin(element, key) for key in found},
        remaps=tuple(surroundings.remaps.items()),
        env=tuple(surroundings.env),
        output=found.get("output", "log"),
        cwd=found.get("cwd"),
        respawn=tags.flag(element, found, "respawn", context),
        respawn_delay=delay or 0.0,
        required=tags.flag(element, found, "required", context),
        launch_prefix=found.get("launch-prefix"),
        machine=found.get("machine") or context.machine,
        is_test=element.tag == "test",
    )
    _check(element, found, context, tags)
    _review(node, tags.reporter)
    return node


_CHOICES = {"output": ("log", "screen"), "cwd": ("ROS_HOME", "ros_home", "node")}
_NOT_OF_TESTS = ("respawn", "respawn_delay", "output")


def _check(element: Element, found: Attributes, context: LaunchScope, tags: TagReader) -> None:
    """What roslaunch refuses to start with."""
    for key, choices in _CHOICES.items():
        if key in found and found[key] not in choices:
            hint = did_you_mean(found[key], choices)
            message = f"'{key}' is {' or '.join(c for c in choices if c != 'ros_home')}, not '{found[key]}'"
            tags.reporter.problem("L005", message, context.attribute_origin(element, key), hint)
    for key in ("pkg", "type"):
        if not found[key].strip():
            tags.reporter.problem("L005", f"'{key}' is empty", context.attribute_origin(element, key))
    if element.tag == "test":
        _check_test(element, found, context, tags)
    elif all(found.get(key, "").lower() == "true" for key in ("respawn", "required")):
        message = "a node is either started again or required: 'respawn' and 'required' are both true"
        tags.reporter.problem("L006", message, context.attribute_origin(element, "required"))


def _check_test(element: Element, found: Attributes, context: LaunchScope, tags: TagReader) -> None:
    for key in _NOT_OF_TESTS:
        if key in found:
            origin = context.attribute_origin(element, key)
            tags.reporter.problem("L003", f"<test> has no attribute '{key}'", origin, "it is one of <node>")
    if found.get("time-limit"):
        tags.number(element, found, "time-limit", context)
    if found.get("retry"):
        tags.number(element, found, "retry", context, whole=True, signed=True)


def _children(
    element: Element, context: LaunchScope, found: Attributes, tags: TagReader, parameters: ParameterStore
) -> LaunchScope:
    """Reads what stands within a node; the node's own remaps and environment."""
    surroundings = context.child()
    name = found.get("name") or found.get("test-name") or "unnamed"
    own = context.child(found.get("ns")).child(name)
    own.private = {}
    private = dict(context.private)
    for child in element.elements():
        if child.tag not in CHILDREN["node"]:
            hint = did_you_mean(child.tag, CHILDREN["node"])
            message = f"<{child.tag}> has no place in <{element.tag}>"
            tags.reporter.problem("L002", message, context.origin(child), hint, warning=True)
        elif not tags.applies(child, context):
            continue
        elif child.tag == "param":
            param = parameters.param(child, own)
            if param is not None:
                private.pop(param.name, None)
                private[param.name] = param
        elif child.tag == "rosparam":
            parameters.rosparam(child, own)
        elif child.tag == "remap":
            read_remap(child, surroundings, tags)
        else:
            read_env(child, surroundings, tags)
    for param in private.values():
        key = names.canonical(own.namespace + param.name.removeprefix("~"))
        parameters.add(Param(key, param.value, param.origin, param.description))
    return surroundings


def read_remap(element: Element, context: LaunchScope, tags: TagReader) -> None:
    """A `<remap>`; a later one of the same name replaces an earlier one."""
    found = tags.attributes(element, context)
    if not found.ok:
        return
    pair = [names.canonical(found[key]) for key in ("from", "to")]
    for key, name in zip(("from", "to"), pair, strict=True):
        if not name or not names.is_legal(name):
            origin = context.attribute_origin(element, key)
            tags.reporter.problem("L060", f"'{name}' is no ROS name", origin)
            return
    context.remaps.pop(pair[0], None)
    context.remaps[pair[0]] = pair[1]


def read_env(element: Element, context: LaunchScope, tags: TagReader) -> None:
    """An `<env>`, for the nodes that follow."""
    found = tags.attributes(element, context)
    if not found.ok:
        return
    if not found["name"]:
        origin = context.attribute_origin(element, "name")
        tags.reporter.problem("L005", "an environment variable needs a name", origin)
        return
    context.env.append((found["name"], found["value"]))


def _review(node: PlannedNode, reporter: Reporter) -> None:
    origin = node.spans["type"]
    renamed = RENAMED.get((node.package, node.type))
    if renamed:
        new = renamed.new_type
        package = f" in {renamed.new_package}" if renamed.new_package != node.package else ""
        message = f"the node {node.package}/{node.type} is gone: it is {new}{package} since {renamed.since}"
        hint = f"roslaunch cannot start it and runs the others: {renamed.missing}"
        edits = []
        for key, value in (("pkg", renamed.new_package), ("type", new)):
            if node.spans[key].span.text != value:
                edits.append(Edit(node.spans[key].span, value))
        fix = Fix(f'write type="{new}"{package}', tuple(edits), safe=True)
        reporter.finding(Diagnostic("L053", Severity.ERROR, message, origin, hint, fix=fix))
    elif node.package in NODES and node.type not in NODES[node.package]:
        hint = did_you_mean(node.type, NODES[node.package])
        if hint:
            message = f"the package {node.package} has no node '{node.type}'"
            reporter.finding(Diagnostic("L054", Severity.ERROR, message, origin, hint))
    if (node.package, node.type) == ("gazebo_ros", "spawn_model"):
        _review_spawn_model(node, reporter)


def _review_spawn_model(node: PlannedNode, reporter: Reporter) -> None:
    """spawn_model refuses to start over one option that it does not know."""
    try:
        words = split_words(node.args)
    except ValueError as error:
        reporter.finding(Diagnostic("L056", Severity.ERROR, f"args: {error}", node.spans.get("args")))
        return
    rest = iter(words)
    for word in rest:
        count = SPAWN_MODEL_VALUES.get(word)
        if count is None:
            near = did_you_mean(word, SPAWN_MODEL_VALUES)
            hint = f"{near} drop it; " if near else "drop it; "
            hint += f"there are {' '.join(SPAWN_MODEL_VALUES)}"
            message = f"spawn_model has no option '{word}': it refuses to start, and the robot never appears"
            reporter.finding(Diagnostic("L056", Severity.ERROR, message, place_of(node, word), hint))
            continue
        for _ in range(count):
            next(rest, None)
