"""Names of topics of Gazebo Classic's plugins, as gazebo_ros of ROS 1 and ROS 2 makes them."""

from __future__ import annotations

from kbot.sim.naming import Naming
from kbot.text import Element


def is_of_gazebo_ros(plugin: Element) -> bool:
    """Whether a `<plugin>` speaks ROS itself, unlike those of gz, whose topics a bridge carries."""
    return "gazebo_ros" in plugin.attributes.get("filename", "")


class PluginNames:
    """The names of a `<plugin>`'s topics, in the simulation where its robot is called `naming`.

    ROS 1: `<robotNamespace>`, by which spawn_model's own is not heeded; empty it is the model's name. ROS 2:
    `<ros><namespace>`, where spawn_entity names none, and `<ros><remapping>`.
    """

    def __init__(self, plugin: Element, naming: Naming) -> None:
        self._naming = naming
        self._node = plugin.attributes.get("name", "").strip()
        own, ros = plugin.find("robotNamespace"), plugin.find("ros")
        self.is_ros_2 = ros is not None
        self._namespace: str | None = None
        """Where its topics are, with slashes around it; None where they are in the robot's namespace."""
        if own is not None:
            self._namespace = _around(own.text.strip() or naming.name)
        elif ros is not None and not naming.namespace:
            namespace = ros.find("namespace")
            self._namespace = _around(namespace.text) if namespace is not None else None
        self._remappings: dict[str, str] = {}
        for tag in ("remapping", "argument"):
            for element in ros.elements(tag) if ros is not None else ():
                inner, arrow, outer = element.text.partition(":=")
                if arrow and inner.strip() and outer.strip():
                    self._remappings[self._full(inner)] = self._full(outer)

    def topic(self, name: str) -> str:
        """The full name of what the plugin itself calls so: `odom`, `/odom` or `~/out`."""
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


def _around(namespace: str) -> str:
    parts = "/".join(filter(None, namespace.strip().split("/")))
    return f"/{parts}/" if parts else "/"
