"""A small ROS 1 master, started if none is running: registrations, look-ups and parameters."""

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
        self.publishers, self.subscribers, self.services = RegistryTable(), RegistryTable(), RegistryTable()
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


MOST_WAITING = 1000
NOTIFIERS = 4


class Master:
    """Answers as `roscore` does, but for the log."""

    def __init__(self, host: str, port: int, contacts: AllowedNodes) -> None:
        """Only nodes that `contacts` allows can register.

        Raises:
            OSError: the address is taken, or not this machine's.
        """
        self._contacts = contacts
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
        """Answer no more."""
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
            return  # peers that answer nothing have filled it; they learn of the change when they ask

    def _notify(self) -> None:
        while (item := self._calls.get()) is not None:
            uri, method, arguments = item
            try:
                call(uri, method, *arguments)
            except RpcFailed:
                continue

    # who is there

    def _join(self, node: str, uri: str) -> None:
        """Raises ValueError: the node is on a machine that is not contacted."""
        if refusal := self._contacts.refusal_of_uri(uri):
            raise ValueError(refusal)
        other = self._registry.join(node, uri)
        if other is not None:
            self._later((other, "shutdown", ("/master", f"[{node}] has started elsewhere")))

    def _tell_subscribers(self, topic: str) -> None:
        publishers = self._registry.publishers.uris(topic)
        for uri in self._registry.subscribers.uris(topic):
            self._later((uri, "publisherUpdate", ("/master", topic, publishers)))

    def _registerPublisher(self, caller: str, topic: str, type_name: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        self._join(caller, uri)
        self._registry.publishers.add(topic, caller, uri)
        self._registry.set_type(topic, type_name, is_spoken=True)
        self._tell_subscribers(topic)
        return 1, f"Registered [{caller}] as publisher of [{topic}]", self._registry.subscribers.uris(topic)

    def _unregisterPublisher(self, caller: str, topic: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        gone = self._registry.publishers.remove(topic, caller, uri)
        self._registry.leave(caller)
        if gone:
            self._tell_subscribers(topic)
        return 1, f"Unregistered [{caller}] as publisher of [{topic}]", int(gone)

    def _registerSubscriber(self, caller: str, topic: str, type_name: str, uri: str) -> Reply:
        topic = resolve(topic, caller)
        self._join(caller, uri)
        self._registry.subscribers.add(topic, caller, uri)
        self._registry.set_type(topic, type_name, is_spoken=False)
        return 1, f"Subscribed to [{topic}]", self._registry.publishers.uris(topic)

    def _unregisterSubscriber(self, caller: str, topic: str, uri: str) -> Reply:
        gone = self._registry.subscribers.remove(resolve(topic, caller), caller, uri)
        self._registry.leave(caller)
        return 1, f"Unregistered [{caller}] as subscriber of [{topic}]", int(gone)

    def _registerService(self, caller: str, service: str, service_uri: str, uri: str) -> Reply:
        service = resolve(service, caller)
        self._join(caller, uri)
        self._registry.services.entries.pop(service, None)
        self._registry.services.add(service, caller, uri)
        self._registry.service_uris[service] = service_uri
        return 1, f"Registered [{caller}] as provider of [{service}]", 1

    def _unregisterService(self, caller: str, service: str, service_uri: str) -> Reply:
        service = resolve(service, caller)
        if self._registry.service_uris.get(service) != service_uri:
            return 1, f"[{caller}] is no provider of [{service}]", 0
        gone = self._registry.services.remove(service, caller)
        self._registry.service_uris.pop(service, None)
        self._registry.leave(caller)
        return 1, f"Unregistered [{caller}] as provider of [{service}]", int(gone)

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
        self._tell_watchers(name, value)
        return 1, f"parameter {name} set", 0

    def _deleteParam(self, caller: str, name: str) -> Reply:
        name = resolve(name, caller)
        self._parameters.delete(name)
        self._tell_watchers(name, {})
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
        self._join(caller, uri)
        self._parameter_watchers.setdefault(name, {})[caller] = uri
        try:
            value = self._parameters.get(name)
        except KeyError:
            value = {}
        return 1, f"Subscribed to parameter [{name}]", value

    def _unsubscribeParam(self, caller: str, uri: str, name: str) -> Reply:
        watchers = self._parameter_watchers.get(resolve(name, caller), {})
        return 1, f"Unsubscribe to parameter [{name}]", int(watchers.pop(caller, None) is not None)

    def _tell_watchers(self, name: str, value: ParameterValue) -> None:
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
