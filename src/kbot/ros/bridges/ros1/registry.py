"""What a ROS 1 master knows: who publishes, subscribes and serves what, and where each node is."""

from __future__ import annotations

from collections.abc import Iterable

Graph = list[list[object]]


class Table:
    """Names, and the nodes registered under each, in the order they came."""

    def __init__(self) -> None:
        self.entries: dict[str, dict[str, str]] = {}

    def add(self, name: str, node: str, uri: str) -> None:
        self.entries.setdefault(name, {})[node] = uri

    def remove(self, name: str, node: str, uri: str | None = None) -> bool:
        """Whether it was there; one that has started anew elsewhere is not where `uri` says, and stays."""
        nodes = self.entries.get(name, {})
        if node not in nodes or uri not in (None, nodes[node]):
            return False
        del nodes[node]
        if not nodes:
            del self.entries[name]
        return True

    def uris(self, name: str) -> list[str]:
        return list(self.entries.get(name, {}).values())

    def drop_node(self, node: str) -> list[str]:
        """Take a node out everywhere; the names it was registered under."""
        names = [name for name, nodes in self.entries.items() if node in nodes]
        for name in names:
            self.remove(name, node)
        return names

    def has_node(self, node: str) -> bool:
        return any(node in nodes for nodes in self.entries.values())

    def state(self) -> Graph:
        return [[name, list(nodes)] for name, nodes in self.entries.items()]


class Registry:
    """The whole graph. Not thread-safe: its owner locks."""

    def __init__(self) -> None:
        self.publishers, self.subscribers, self.services = Table(), Table(), Table()
        self.service_uris: dict[str, str] = {}
        self.nodes: dict[str, str] = {}
        self.topic_types: dict[str, str] = {}

    def join(self, node: str, uri: str) -> str | None:
        """Note where a node is; the address of one of the same name elsewhere, which must go."""
        before = self.nodes.get(node)
        self.nodes[node] = uri
        if before is None or before == uri:
            return None
        for table in (self.publishers, self.subscribers, self.services):
            table.drop_node(node)
        return before

    def leave(self, node: str) -> None:
        """Forget a node that is registered for nothing any more."""
        if not any(t.has_node(node) for t in (self.publishers, self.subscribers, self.services)):
            self.nodes.pop(node, None)

    def set_type(self, topic: str, type_name: str, *, is_spoken: bool) -> None:
        """A type that is said counts more than `*`, and who speaks knows better than who listens."""
        if topic not in self.topic_types or (is_spoken and type_name != "*"):
            self.topic_types[topic] = type_name

    def published(self, under: str) -> Graph:
        """Topics that have a publisher, with their types."""
        prefix = under.rstrip("/") + "/"
        return [
            [name, self.topic_types[name]]
            for name in self.publishers.entries
            if name.startswith(prefix) and name in self.topic_types
        ]

    def types(self) -> Graph:
        known: Iterable[tuple[str, str]] = self.topic_types.items()
        return [[name, type_name] for name, type_name in known]
