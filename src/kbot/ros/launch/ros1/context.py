"""The context of a tag in a launch file: namespace, arguments, remaps, environment."""

from __future__ import annotations

from dataclasses import dataclass, field

from kbot.ros import names
from kbot.ros.launch.plan import Param
from kbot.text import Call, Element, Origin


@dataclass
class LaunchScope:
    """The surroundings of an element. Groups, nodes and included files get a child of it.

    args       values that `$(arg …)` gives here
    declared   arguments that were declared here, so that a second declaration is seen
    private    `~name` parameters, which the nodes that follow get
    forgiving  whether the file was included with pass_all_args, so that redeclaration is no error; in a group
               of the file it is one
    is_root    it is that of the launch file itself, not of a group or an included file
    """

    file: str
    namespace: str = "/"
    call: Call | None = None
    args: dict[str, str] = field(default_factory=dict)
    declared: set[str] = field(default_factory=set)
    remaps: dict[str, str] = field(default_factory=dict)
    env: list[tuple[str, str]] = field(default_factory=list)
    private: dict[str, Param] = field(default_factory=dict)
    forgiving: bool = False
    machine: str | None = None
    is_root: bool = False

    def child(self, namespace: str | None = None) -> LaunchScope:
        """A copy whose changes do not reach this one, in a namespace below (or a global one)."""
        below = self.namespace
        if namespace:
            below = names.as_namespace(names.join(below, namespace))
        return LaunchScope(
            self.file,
            below,
            self.call,
            dict(self.args),
            set(self.declared),
            dict(self.remaps),
            list(self.env),
            dict(self.private),
            machine=self.machine,
        )

    def included(self, namespace: str | None, file: str, args: dict[str, str], at: Element) -> LaunchScope:
        """The surroundings of a file that is included here: nothing is declared, `args` are passed."""
        inner = self.child(namespace)
        inner.call = Call("include", file, at.origin.span, self.call)
        inner.file, inner.args, inner.declared = file, args, set()
        inner.private = self.private or inner.private  # roslaunch shares those that there are with the file
        return inner

    def origin(self, element: Element) -> Origin:
        """Where an element was written, and the includes that brought it."""
        return Origin(element.origin.span, self.call)

    def attribute_origin(self, element: Element, name: str) -> Origin:
        """Where an attribute's value was written, and the includes that brought it."""
        return Origin(element.attribute_origin(name).span, self.call)
