"""What an `<include>` gives the file that it names."""

from __future__ import annotations

from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros1.attributes import TagReader
from kbot.ros.launch.ros1.context import LaunchScope
from kbot.ros.launch.ros1.node_tags import read_env
from kbot.ros.launch.ros1.schema import CHILDREN
from kbot.text import Element, Origin
from kbot.text.suggest import did_you_mean

Passed = dict[str, tuple[str, Origin]]
"""Arguments by name, each with where it is given."""


def read_passed(
    element: Element, context: LaunchScope, tags: TagReader, passing_all: bool
) -> tuple[Passed, list[tuple[str, str]]]:
    """The arguments and the environment that an `<include>` gives the file."""
    here = context.origin(element)
    passed: Passed = {name: (value, here) for name, value in context.args.items()} if passing_all else {}
    own: set[str] = set()
    surroundings = context.child()
    surroundings.env = []
    for child in element.elements():
        if child.tag not in CHILDREN["include"]:
            hint = did_you_mean(child.tag, CHILDREN["include"])
            message = f"<{child.tag}> has no place in <include>"
            tags.reporter.problem("L002", message, context.origin(child), hint, warning=True)
            continue
        if not tags.applies(child, context):
            continue
        if child.tag == "env":
            read_env(child, surroundings, tags)
            continue
        found = tags.attributes(child, context)
        if not found.ok:
            continue
        origin = Origin(child.attribute_origin("name").span, context.call)
        name, value, default = found["name"], found.get("value"), found.get("default")
        if value is not None and default is not None:
            tags.reporter.problem("L020", f"the argument '{name}' has a value and a default", origin)
        elif name in own and not passing_all:
            tags.reporter.problem("L021", f"the argument '{name}' is passed twice", origin)
        elif value is not None:
            passed[name] = (value, origin)
        elif default is not None:
            passed.setdefault(name, (default, origin))
        elif name not in passed:
            tags.reporter.problem("L020", f"the argument '{name}' is passed without a value", origin)
        own.add(name)
    return passed, surroundings.env


def tell_unused(passed: Passed, declared: set[str], file: str, reporter: Reporter) -> None:
    """Tell of arguments that the file does not declare."""
    for name, (_, origin) in passed.items():
        if name not in declared:
            hint = did_you_mean(name, declared)
            reporter.problem("L023", f"{file} has no argument '{name}'", origin, hint)
