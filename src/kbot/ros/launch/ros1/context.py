"""The scope of a tag in a launch file: namespace, arguments, remaps, environment."""

from __future__ import annotations

from dataclasses import dataclass, field

from kbot.ros import names
from kbot.ros.launch.plan import Param, PlannedNode
from kbot.text import Call, Element, Origin


@dataclass
class LaunchScope:
    """The scope of an element. Groups, nodes and included files get a child scope.

    args       the values of `$(arg …)`
    declared   the arguments declared in this scope; a second declaration is an error
    private    `~name` parameters, which all later nodes get
    forgiving  whether a second declaration is allowed, because the file was included with pass_all_args.
               A group of that file does not allow it
    node       the node that the scope belongs to, if it is that of a node
    is_root    whether this is the scope of the launch file itself, not of a group or an included file
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
    node: PlannedNode | None = None
    is_root: bool = False

    def child(self, namespace: str | None = None) -> LaunchScope:
        """A copy in a namespace below this one, or in a global namespace. Changes of it do not affect this
        scope."""
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
        """The scope of a file that `at` includes. It has only the arguments `args`."""
        inner = self.child(namespace)
        inner.call = Call("include", file, at.origin.span, self.call)
        inner.file, inner.args, inner.declared = file, args, set()
        inner.private = (
            self.private or inner.private
        )  # roslaunch shares them with the file, unless there are none yet
        return inner

    def origin(self, element: Element) -> Origin:
        """Where an element was written, with the includes that lead to it."""
        return Origin(element.origin.span, self.call)

    def attribute_origin(self, element: Element, name: str) -> Origin:
        """Where the value of an attribute was written, with the includes that lead to it."""
        return Origin(element.attribute_origin(name).span, self.call)
