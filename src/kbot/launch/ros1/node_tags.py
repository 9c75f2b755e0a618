"""`<node>` and `<test>`, and what a ROS would stumble over in them."""

from __future__ import annotations

from kbot.launch import names
from kbot.launch.known_packages import NODES, RENAMED, SPAWN_MODEL_VALUES
from kbot.launch.node_arguments import place_of
from kbot.launch.plan import Node, Param
from kbot.launch.quoting import split_words
from kbot.launch.ros1.attributes import Attributes, TagReporter
from kbot.launch.ros1.context import Context
from kbot.launch.ros1.parameters import Parameters
from kbot.launch.ros1.schema import CHILDREN
from kbot.text import Diagnostic, Edit, Element, Fix, Severity
from kbot.text.suggest import did_you_mean


def read_node(
    element: Element, context: Context, reporter: TagReporter, parameters: Parameters, clear: list[str]
) -> Node | None:
    """The node of a `<node>` or `<test>`; None where it cannot be made out."""
    found = reporter.attributes(element, context)
    surroundings = _children(element, context, found, reporter, parameters)
    if not found.ok:
        return None
    name = found.get("name") or found.get("test-name", "")
    if not names.is_legal(name) and not name.startswith("$(anon"):
        origin = context.attribute_origin(element, "name")
        hint = "a name holds letters, digits, _ and /, and starts with a letter"
        reporter.problem("L051", f"'{name}' is no ROS name", origin, hint, warning=True)
    namespace = context.child(found.get("ns")).namespace
    if reporter.flag(element, found, "clear_params", context):
        clear.append(names.as_namespace(names.join(namespace, name)))
    node = Node(
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
        respawn=reporter.flag(element, found, "respawn", context),
        respawn_delay=_seconds(element, found, context, reporter),
        required=reporter.flag(element, found, "required", context),
        launch_prefix=found.get("launch-prefix"),
        machine=found.get("machine") or context.machine,
        is_test=element.tag == "test",
    )
    _review(node, reporter)
    return node


def _children(
    element: Element, context: Context, found: Attributes, reporter: TagReporter, parameters: Parameters
) -> Context:
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
            reporter.problem("L002", message, context.origin(child), hint, warning=True)
        elif not reporter.applies(child, context):
            continue
        elif child.tag == "param":
            param = parameters.param(child, own)
            if param is not None:
                private.pop(param.name, None)
                private[param.name] = param
        elif child.tag == "rosparam":
            parameters.rosparam(child, own)
        elif child.tag == "remap":
            read_remap(child, surroundings, reporter)
        else:
            read_env(child, surroundings, reporter)
    for param in private.values():
        key = names.canonical(own.namespace + param.name.removeprefix("~"))
        parameters.add(Param(key, param.value, param.origin, param.description))
    return surroundings


def read_remap(element: Element, context: Context, reporter: TagReporter) -> None:
    """A `<remap>`; a later one of the same name replaces an earlier one."""
    found = reporter.attributes(element, context)
    if not found.ok:
        return
    pair = [names.canonical(found[key]) for key in ("from", "to")]
    for key, name in zip(("from", "to"), pair, strict=True):
        if not name or not names.is_legal(name):
            origin = context.attribute_origin(element, key)
            reporter.problem("L060", f"'{name}' is no ROS name", origin)
            return
    context.remaps.pop(pair[0], None)
    context.remaps[pair[0]] = pair[1]


def read_env(element: Element, context: Context, reporter: TagReporter) -> None:
    """An `<env>`, for the nodes that follow."""
    found = reporter.attributes(element, context)
    if not found.ok:
        return
    if not found["name"]:
        origin = context.attribute_origin(element, "name")
        reporter.problem("L005", "an environment variable needs a name", origin)
        return
    context.env.append((found["name"], found["value"]))


def _seconds(element: Element, found: Attributes, context: Context, reporter: TagReporter) -> float:
    try:
        return float(found.get("respawn_delay", "0"))
    except ValueError:
        origin = context.attribute_origin(element, "respawn_delay")
        reporter.problem("L005", f"'{found['respawn_delay']}' is no number of seconds", origin)
        return 0.0


def _review(node: Node, reporter: TagReporter) -> None:
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


def _review_spawn_model(node: Node, reporter: TagReporter) -> None:
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
