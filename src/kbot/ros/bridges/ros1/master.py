"""A small ROS 1 master, which KBot starts if none is running: registrations, look-ups and parameters."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable, Iterable

from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.parameter_server import ParameterServer, resolve
from kbot.ros.bridges.ros1.rpc import Reply, RpcFailed, RpcServer, call
from kbot.ros.parameter_values import ParameterValue

Graph = list[list[object]]


class RegistryTable:
    """Names of topics or services, with the nodes that are registered for each, in order of registration."""

    def __init__(self) -> None:
        self.entries: dict[str, dict[str, str]] = {}

    def add(self, name: str, node: str, uri: str) -> None:
        self.entries.setdefault(name, {})[node] = uri

    def remove(self, name: str, node: str, uri: str | None = None) -> bool:
        """Remove a registration. Returns whether it existed.

        A node that has restarted at another address is registered with another `uri`, and is not removed.
        """
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
        """Remove all registrations of a node. Returns the names it was registered for."""
        names = [name for name, nodes in self.entries.items() if node in nodes]
        for name in names:
            self.remove(name, node)
        return names

    def has_node(self, node: str) -> bool:
        return any(node in nodes for nodes in self.entries.values())

    def state(self) -> Graph:
        return [[name, list(nodes)] for name, nodes in self.entries.items()]


class Registry:
    """The nodes and their registrations. Not thread-safe: the owner locks."""

    def __init__(self) -> None:
        self.publishers, self.subscribers, self.services = RegistryTable(), RegistryTable(), RegistryTable()
        self.service_uris: dict[str, str] = {}
        self.nodes: dict[str, str] = {}
        self.topic_types: dict[str, str] = {}

    def add_node(self, node: str, uri: str) -> str | None:
        """Store a node's URI. Returns the URI of an earlier node with this name, which must shut down."""
        before = self.nodes.get(node)
        self.nodes[node] = uri
        if before is None or before == uri:
            return None
        for table in (self.publishers, self.subscribers, self.services):
            table.drop_node(node)
        return before

    def remove_unused_node(self, node: str) -> None:
        """Remove a node if it has no registration left."""
        if not any(t.has_node(node) for t in (self.publishers, self.subscribers, self.services)):
            self.nodes.pop(node, None)

    def set_type(self, topic: str, type_name: str, *, is_publisher: bool) -> None:
        """Store a topic's type. The first node sets it. A publisher overrides it, unless its type is `*`."""
        if topic not in self.topic_types or (is_publisher and type_name != "*"):
            self.topic_types[topic] = type_name

    def published(self, under: str) -> Graph:
        """Topics with a publisher in the namespace `under`, with their types."""
        prefix = under.rstrip("/") + "/"
        return [
            [name, self.topic_types[name]]
            for name in self.publishers.entries
            if name.startswith(prefix) and name in self.topic_types
        ]

    def types(self) -> Graph:
        known: Iterable[tuple[str, str]] = self.topic_types.items()
        return [[name, type_name] for name, type_name in known]


MOST_WAITING = 1000
"""Calls of nodes that wait to be sent. If there are more, they are dropped."""
NOTIFIERS = 4
"""Threads that call nodes, so that nodes that do not answer do not delay the others."""


class Master:
    """A master that answers like `roscore`, but without the log (`/rosout`)."""

    def __init__(self, host: str, port: int, allowed_nodes: AllowedNodes) -> None:
        """Start the master. Only `allowed_nodes` can register.

        Raises:
            OSError: the address is in use, or not one of this machine.
        """
        self._allowed_nodes = allowed_nodes
        self._lock = threading.RLock()
        self._registry, self._parameters = Registry(), ParameterServer()
        self._parameter_watchers: dict[str, dict[str, str]] = {}
        self._calls: queue.Queue[tuple[str, str, tuple[object, ...]] | None] = queue.Queue(MOST_WAITING)
        self._server = RpcServer(
            host, port, {name: self._locked(getattr(self, f"_{name}")) for name in METHODS}
        )
        self.uri = f"http://{host}:{self._server.port}/"
        self._notifiers = [threading.Thread(target=self._notify, daemon=True) for _ in range(NOTIFIERS)]
        for thread in self._notifiers:
            thread.start()

    def close(self) -> None:
        """Stop the master."""
        self._server.close()
        for _ in self._notifiers:
            self._later(None)

    def _locked(self, method: Callable[..., Reply]) -> Callable[..., Reply]:
        def answer(*arguments: ParameterValue) -> Reply:
            try:
                with self._lock:
                    return method(*arguments)
            except (TypeError, AttributeError, ValueError) as error:
                return -1, f"{method.__name__.lstrip('_')}: {error}", 0
            except KeyError as error:
                return -1, f"Parameter [{error.args[0]}] is not set", 0

        return answer

    def _later(self, item: tuple[str, str, tuple[object, ...]] | None) -> None:
        try:
            self._calls.put_nowait(item)
        except queue.Full:
            return  # nodes that do not answer have filled the queue

    def _notify(self) -> None:
        while (item := self._calls.get()) is not None:
            uri, method, arguments = item
            try:
                call(uri, method, *arguments)
            except RpcFailed:
                continue

    # registrations

    def _add_node(self, node: str, uri: str) -> None:
        """Raises ValueError: the node is not allowed, because it is on another machine."""
        if refusal := self._allowed_nodes.refusal_of_uri(uri):
            raise ValueError(refusal)
        earlier = self._registry.add_node(node, uri)
        if earlier is not None:
            self._later((earlier, "shutdown", ("/master", f"[{node}] has started elsewhere")))

    def _notify_subscribers(self, topic: str) -> None:
        publishers = self._registry.publishers.uris(topic)
        for uri in self._registry.subscribers.uris(topic):
            self._later((uri, "publisherUpdate", ("/master", topic, publishers)))

    def _registerPublisher(self, caller: str, topic: str, type_name: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        self._add_node(caller, uri)
        self._registry.publishers.add(topic, caller, uri)
        self._registry.set_type(topic, type_name, is_publisher=True)
        self._notify_subscribers(topic)
        return 1, f"Registered [{caller}] as publisher of [{topic}]", self._registry.subscribers.uris(topic)

    def _unregisterPublisher(self, caller: str, topic: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        removed = self._registry.publishers.remove(topic, caller, uri)
        self._registry.remove_unused_node(caller)
        if removed:
            self._notify_subscribers(topic)
        return 1, f"Unregistered [{caller}] as publisher of [{topic}]", int(removed)

    def _registerSubscriber(self, caller: str, topic: str, type_name: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        self._add_node(caller, uri)
        self._registry.subscribers.add(topic, caller, uri)
        self._registry.set_type(topic, type_name, is_publisher=False)
        return 1, f"Subscribed to [{topic}]", self._registry.publishers.uris(topic)

    def _unregisterSubscriber(self, caller: str, topic: str, uri: str) -> Reply:
        removed = self._registry.subscribers.remove(resolve(topic, caller), caller, uri)
        self._registry.remove_unused_node(caller)
        return 1, f"Unregistered [{caller}] as subscriber of [{topic}]", int(removed)

    def _registerService(self, caller: str, service: str, service_uri: str, uri: str) -> Reply:
        service = resolve(service, caller)
        self._add_node(caller, uri)
        self._registry.services.entries.pop(service, None)
        self._registry.services.add(service, caller, uri)
        self._registry.service_uris[service] = service_uri
        return 1, f"Registered [{caller}] as provider of [{service}]", 1

    def _unregisterService(self, caller: str, service: str, service_uri: str) -> Reply:
        service = resolve(service, caller)
        if self._registry.service_uris.get(service) != service_uri:
            return 1, f"[{caller}] is not a provider of [{service}]", 0
        removed = self._registry.services.remove(service, caller)
        self._registry.service_uris.pop(service, None)
        self._registry.remove_unused_node(caller)
        return 1, f"Unregistered [{caller}] as provider of [{service}]", int(removed)

    # look-ups

    def _lookupNode(self, caller: str, node: str) -> Reply:
        uri = self._registry.nodes.get(resolve(node, caller))
        return (1, "node api", uri) if uri else (-1, f"unknown node [{node}]", "")

    def _lookupService(self, caller: str, service: str) -> Reply:
        uri = self._registry.service_uris.get(resolve(service, caller))
        return (1, "rosrpc URI", uri) if uri else (-1, "no provider", "")

    def _getPublishedTopics(self, caller: str, under: str) -> Reply:
        return 1, "current topics", self._registry.published(under)

    def _getTopicTypes(self, caller: str) -> Reply:
        return 1, "current system state", self._registry.types()

    def _getSystemState(self, caller: str) -> Reply:
        r = self._registry
        return 1, "current system state", [r.publishers.state(), r.subscribers.state(), r.services.state()]

    def _getUri(self, caller: str) -> Reply:
        return 1, "", self.uri

    def _getPid(self, caller: str) -> Reply:
        return 1, "", os.getpid()

    # parameters

    def _getParam(self, caller: str, name: str) -> Reply:
        name = resolve(name, caller)
        return 1, f"Parameter [{name}]", self._parameters.get(name)

    def _setParam(self, caller: str, name: str, value: ParameterValue) -> Reply:
        name = resolve(name, caller)
        self._parameters.set(name, value)
        self._notify_watchers(name, value)
        return 1, f"parameter {name} set", 0

    def _deleteParam(self, caller: str, name: str) -> Reply:
        name = resolve(name, caller)
        self._parameters.delete(name)
        self._notify_watchers(name, {})
        return 1, f"parameter {name} deleted", 0

    def _hasParam(self, caller: str, name: str) -> Reply:
        name = resolve(name, caller)
        try:
            self._parameters.get(name)
        except KeyError:
            return 1, name, False
        return 1, name, True

    def _searchParam(self, caller: str, name: str) -> Reply:
        found = self._parameters.search(caller, name)
        return 1, f"Found [{found}]", found

    def _getParamNames(self, caller: str) -> Reply:
        return 1, "Parameter names", self._parameters.names()

    def _subscribeParam(self, caller: str, uri: str, name: str) -> Reply:
        name = resolve(name, caller)
        self._add_node(caller, uri)
        self._parameter_watchers.setdefault(name, {})[caller] = uri
        try:
            value = self._parameters.get(name)
        except KeyError:
            value = {}
        return 1, f"Subscribed to parameter [{name}]", value

    def _unsubscribeParam(self, caller: str, uri: str, name: str) -> Reply:
        watchers = self._parameter_watchers.get(resolve(name, caller), {})
        return 1, f"Unsubscribe to parameter [{name}]", int(watchers.pop(caller, None) is not None)

    def _notify_watchers(self, name: str, value: ParameterValue) -> None:
        for watched, nodes in self._parameter_watchers.items():
            if f"{name}/".startswith(f"{watched.rstrip('/')}/"):
                for uri in nodes.values():
                    self._later((uri, "paramUpdate", ("/master", f"{name.rstrip('/')}/", value)))


METHODS = (
    *("registerPublisher", "unregisterPublisher", "registerSubscriber", "unregisterSubscriber"),
    *("registerService", "unregisterService", "lookupNode", "lookupService"),
    *("getPublishedTopics", "getTopicTypes", "getSystemState", "getUri", "getPid"),
    *("getParam", "setParam", "deleteParam", "hasParam", "searchParam", "getParamNames"),
    *("subscribeParam", "unsubscribeParam"),
)
