"""Resolves the topic names of Gazebo Classic's plugins as gazebo_ros does in ROS 1 and ROS 2."""

from __future__ import annotations

from kbot.sim.naming import Naming
from kbot.text import Element


def is_of_gazebo_ros(plugin: Element) -> bool:
    """Whether a `<plugin>` publishes to ROS itself. Plugins of gz need a bridge."""
    return "gazebo_ros" in plugin.attributes.get("filename", "")


class PluginNames:
    """The topic names of a `<plugin>` whose robot has the names in `naming`.

    ROS 1: `<robotNamespace>` overrides the namespace of spawn_model. An empty one means the model's name.
    ROS 2: `<ros><namespace>` applies if spawn_entity gives no namespace. `<ros><remapping>` always applies.
    """

    def __init__(self, plugin: Element, naming: Naming) -> None:
        self._naming = naming
        self._node = plugin.attributes.get("name", "").strip()
        own, ros = plugin.find("robotNamespace"), plugin.find("ros")
        self.is_ros_2 = ros is not None
        self._namespace: str | None = None
        """The namespace of the topics with outer slashes. None: the robot's namespace."""
        if own is not None:
            self._namespace = _with_slashes(own.text.strip() or naming.name)
        elif ros is not None and not naming.namespace:
            namespace = ros.find("namespace")
            self._namespace = _with_slashes(namespace.text) if namespace is not None else None
        self._remappings: dict[str, str] = {}
        for tag in ("remapping", "argument"):
            for element in ros.elements(tag) if ros is not None else ():
                inner, arrow, outer = element.text.partition(":=")
                if arrow and inner.strip() and outer.strip():
                    self._remappings[self._full(inner)] = self._full(outer)

    def topic(self, name: str) -> str:
        """The full name of a topic that the plugin calls `odom`, `/odom` or `~/out`."""
        full = self._full(name)
        return self._remappings.get(full, full)

    def _full(self, name: str) -> str:
        name = name.strip()
        if name.startswith("~"):
            name = f"{self._node}/{name[1:]}"
        own = "/".join(filter(None, name.split("/")))
        if name.startswith("/"):
            return f"/{own}"
        return self._naming.topic(own) if self._namespace is None else f"{self._namespace}{own}"


def _with_slashes(namespace: str) -> str:
    parts = "/".join(filter(None, namespace.strip().split("/")))
    return f"/{parts}/" if parts else "/"
