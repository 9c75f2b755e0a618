"""The simulation as a ROS 1 node: it publishes, subscribes, and serves services."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from typing import Any

from kbot.net.hosts import host_and_port_of_uri, is_loopback, is_served_at
from kbot.record.encodings.types import ros1_types
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.loop import wait_for
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.master import Master
from kbot.ros.bridges.ros1.parameter_server import flat_parameters, is_plain
from kbot.ros.bridges.ros1.publisher import PublishedTopic
from kbot.ros.bridges.ros1.rpc import Reply, RpcFailed, RpcServer, call, why_not_sent
from kbot.ros.bridges.ros1.subscriber import SubscribedTopic
from kbot.ros.bridges.ros1.tcpros_server import TcprosServer
from kbot.ros.parameter_values import ParameterValue
from kbot.text import KbotError

NODE = "/kbot"
DEFAULT_PORT = 11311
DEFAULT_MASTER = f"http://localhost:{DEFAULT_PORT}/"
LOOPBACK = "127.0.0.1"
CHECK_SECONDS = 2.0
"""Seconds between two checks that the master still knows the node. A restarted master has forgotten it."""
LEAVE_SECONDS = 5.0
"""Seconds that `close` waits for the node to unregister."""


class Ros1Bridge:
    """The node /kbot, registered at the running master, or at its own master if none is running.

    If the master restarts, it registers again.
    """

    def __init__(
        self,
        link: PeerLink,
        host: str | None = None,
        master: str | None = None,
        *,
        node: str = NODE,
        own_master: bool = True,
        other_machines: bool = False,
    ) -> None:
        """Connect to the master, or start one.

        Args:
            link: the simulation's link.
            host: the address at which peers reach this node, else ROS_IP or ROS_HOSTNAME, else loopback.
            master: the master's URI, else ROS_MASTER_URI, else port 11311 of this machine.
            node: the node's full name.
            own_master: start a master if none answers on this machine.
            other_machines: contact nodes on other machines. This is also allowed if `host` is not loopback.

        Raises:
            KbotError: no master answers and KBot cannot start one, or an address cannot be used.
        """
        environment = os.environ.get
        self._host = host or environment("ROS_IP") or environment("ROS_HOSTNAME") or LOOPBACK
        self._link, self._node = link, node
        other_machines = other_machines or (host is not None and not is_loopback(host))
        self._allowed_nodes = AllowedNodes(self._host, link.report, other_machines)
        self._own_master: Master | None = None
        self.master = self._find_master(master or environment("ROS_MASTER_URI") or DEFAULT_MASTER, own_master)
        self._published: dict[str, PublishedTopic] = {}
        self._subscribed: dict[str, SubscribedTopic] = {}
        self._registered_services = frozenset[str]()
        self._synchronized: dict[str, ParameterValue] = {}
        """The parameters that the master has, as far as it is known."""
        self._lock = threading.Lock()
        self._changed, self._closed, self._registered = (threading.Event() for _ in range(3))
        try:
            self._tcpros = TcprosServer(self._host, link, self._node, self._published)
            self._server = RpcServer(self._host, 0, self._functions())
        except OSError as error:
            raise KbotError(f"ROS 1 cannot be served at {self._host}: {error.strerror or error}") from None
        self.uri = f"http://{self._host}:{self._server.port}/"
        self._services_uri = f"rosrpc://{self._host}:{self._tcpros.port}"
        link.watch(self._changed.set)
        self._changed.set()
        self._thread = threading.Thread(target=self._keep_registered, daemon=True, name="kbot-ros1")
        self._thread.start()

    def describe(self) -> str:
        """The node and its master, in one sentence."""
        whose = "its own master" if self._own_master else "the master"
        return f"ROS 1: node {self._node} with {whose} at {self.master}"

    @property
    def identity(self) -> str:
        """The `source` of this node's messages at the links of its peers."""
        return self._node

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        """Whether messages that this node `publishes` reach the node `peer`. A subscriber is always ready."""
        return not publishes or wait_for(self._reaches(topic, peer))

    async def _reaches(self, topic: str, peer: str) -> bool:
        published = self._published.get(topic)
        return published is not None and peer in published.peers

    def wait_until_registered(self, seconds: float) -> bool:
        """Wait until the master has the topics and parameters of the link. Returns whether it has."""
        return self._registered.wait(seconds)

    def has_peers(self) -> bool:
        """Whether other nodes are connected."""
        published, subscribed = list(self._published.values()), list(self._subscribed.values())
        return any(topic.peers for topic in published) or any(topic.peers for topic in subscribed)

    def close(self) -> None:
        """Unregister, and disconnect all peers."""
        self._closed.set()
        self._changed.set()
        self._thread.join(LEAVE_SECONDS)
        self._tcpros.close()
        self._server.close()
        if self._own_master is not None:
            self._own_master.close()

    def _find_master(self, uri: str, own_master: bool) -> str:
        try:
            call(uri, "getPid", self._node)
        except RpcFailed as failed:
            if not own_master:
                raise KbotError(
                    f"no ROS 1 master answers at {uri}: start roscore, or kbot sim kbot --ros1"
                ) from None
            host, port = host_and_port_of_uri(uri)
            if host is None or not is_served_at(host, self._host):
                raise KbotError(f"no ROS 1 master: {failed}") from None
            host = LOOPBACK if host == "localhost" else host
            try:
                self._own_master = Master(host, port or DEFAULT_PORT, self._allowed_nodes)
            except OSError as error:
                why = error.strerror or error
                raise KbotError(
                    f"no ROS 1 master answers at {uri}, and KBot cannot start one: {why}"
                ) from None
            return self._own_master.uri
        return uri

    # registration

    def _keep_registered(self) -> None:
        """Register at each change, and again if the master has forgotten the node."""
        known_to_master = False
        while True:
            changed = self._changed.wait(CHECK_SECONDS)
            self._changed.clear()
            if self._closed.is_set():
                self._unregister_all()
                return
            try:
                if not changed and known_to_master:
                    known_to_master = self._is_known()
                if not known_to_master:
                    self._synchronized.clear()  # the master may have restarted without parameters
                if changed or not known_to_master:
                    self._register()
                    known_to_master = True
                    self._registered.set()
            except RpcFailed as failed:
                known_to_master = False
                self._link.report(f"ROS 1: the master does not answer. KBot waits for it. {failed}")

    def _unregister_all(self) -> None:
        with self._lock:
            for published in self._published.values():
                self._try_call("unregisterPublisher", published.topic.name, self.uri)
                published.close()
            for subscribed in self._subscribed.values():
                self._try_call("unregisterSubscriber", subscribed.topic.name, self.uri)
                subscribed.close()
            for service in self._link.services:
                self._try_call("unregisterService", service, self._services_uri)
            self._published.clear()
            self._subscribed.clear()

    def _is_known(self) -> bool:
        try:
            return bool(call(self.master, "lookupNode", self._node, self._node) == self.uri)
        except RpcFailed:
            call(self.master, "getPid", self._node)  # raises if the master does not answer
            return False

    def _register(self) -> None:
        with self._lock:
            self._send_parameters()
            services = frozenset(self._link.services)
            for service in services:
                call(self.master, "registerService", self._node, service, self._services_uri, self.uri)
            for service in self._registered_services - services:
                self._try_call("unregisterService", service, self._services_uri)
            self._registered_services = services
            self._unregister_removed_topics()
            for topic in self._link.topics_of(1).values():
                if topic.type_name not in ros1_types().fielddefs:
                    continue  # ROS 1 has no such type
                if topic.is_input:
                    if topic.name not in self._subscribed:
                        self._subscribed[topic.name] = SubscribedTopic(
                            self._link, topic, self._node, self._allowed_nodes
                        )
                    subscribed = self._subscribed[topic.name]
                    kind = subscribed.type_name
                    uris = call(self.master, "registerSubscriber", self._node, topic.name, kind, self.uri)
                    subscribed.update([str(uri) for uri in uris])
                else:
                    if topic.name not in self._published:
                        self._published[topic.name] = PublishedTopic(self._link, topic, self._node)
                    kind = self._published[topic.name].type_name
                    call(self.master, "registerPublisher", self._node, topic.name, kind, self.uri)

    def _send_parameters(self) -> None:
        """Send changed parameters to the master, and subscribe to those that other nodes set."""
        parameters = self._link.parameters
        for name, value in parameters.items():
            if name not in self._synchronized or self._synchronized[name] != value:
                self._synchronized[name] = value
                if why_not := why_not_sent(value):
                    self._link.report(f"ROS 1: parameter {name} is not sent to the master: {why_not}")
                else:
                    call(self.master, "setParam", self._node, name, value)
        for name in self._synchronized.keys() - parameters.keys():
            del self._synchronized[name]
            self._try_call("deleteParam", name)
        call(self.master, "subscribeParam", self._node, self.uri, "/")

    def _unregister_removed_topics(self) -> None:
        topics = self._link.topics_of(1)
        for name in [n for n, published in self._published.items() if topics.get(n) != published.topic]:
            self._published.pop(name).close()
            self._try_call("unregisterPublisher", name, self.uri)
        for name in [n for n, subscribed in self._subscribed.items() if topics.get(n) != subscribed.topic]:
            self._subscribed.pop(name).close()
            self._try_call("unregisterSubscriber", name, self.uri)

    def _try_call(self, method: str, *arguments: object) -> None:
        """Remove something at the master. Failures are ignored: a master that exited has forgotten it."""
        with suppress(RpcFailed):
            call(self.master, method, self._node, *arguments)

    # the node's XML-RPC API, which other nodes and the master call

    def _functions(self) -> dict[str, Any]:  # Any: XML-RPC
        return {
            "getBusStats": lambda caller: (1, "", [[], [], []]),
            "getBusInfo": self._bus_info,
            "getMasterUri": lambda caller: (1, "", self.master),
            "getPid": lambda caller: (1, "", os.getpid()),
            "shutdown": self._shutdown,
            "getSubscriptions": lambda caller: (
                1,
                "",
                [[n, t.type_name] for n, t in self._subscribed.items()],
            ),
            "getPublications": lambda caller: (1, "", [[n, t.type_name] for n, t in self._published.items()]),
            "paramUpdate": self._parameter_update,
            "publisherUpdate": self._publisher_update,
            "requestTopic": self._request_topic,
        }

    def _shutdown(self, caller: str, reason: str = "") -> Reply:
        """A master sends this when another node takes the name; `rosnode kill` too."""
        self._link.report(
            f"ROS 1: {caller} has shut down the node {self._node} ({reason}). The simulation continues"
        )
        self._closed.set()
        self._changed.set()
        return 1, "the node shuts down, the simulation continues", 0

    def _parameter_update(self, caller: str, name: str, value: ParameterValue) -> Reply:
        """Another node has set a parameter. A tree is a dictionary, a deleted parameter an empty one."""
        if value == {}:
            self._synchronized.pop(f"/{name.strip('/')}", None)
            self._link.set_parameter(f"/{name.strip('/')}", None)
        for key, found in flat_parameters(f"/{name.strip('/')}", value):
            if is_plain(found):  # the other bridges cannot send dates and bytes
                self._synchronized[key] = found
                self._link.set_parameter(key, found)
        return 1, "", 0

    def _publisher_update(self, caller: str, topic: str, uris: list[str]) -> Reply:
        subscribed = self._subscribed.get(topic)
        if subscribed is not None:
            subscribed.update([str(uri) for uri in uris])
        return 1, "", 0

    def _request_topic(self, caller: str, topic: str, protocols: list[list[Any]]) -> Reply:
        if topic not in self._published:
            return -1, f"this node does not publish {topic}", []
        if not any(protocol and protocol[0] == "TCPROS" for protocol in protocols):
            return 0, "only TCPROS is supported", []
        return 1, f"ready on {self._host}:{self._tcpros.port}", ["TCPROS", self._host, self._tcpros.port]

    def _bus_info(self, caller: str) -> Reply:
        rows: list[list[Any]] = []
        for name, published in list(self._published.items()):
            rows += [[len(rows) + i, peer, "o", "TCPROS", name, 1] for i, peer in enumerate(published.peers)]
        for name, subscribed in list(self._subscribed.items()):
            rows += [[len(rows) + i, peer, "i", "TCPROS", name, 1] for i, peer in enumerate(subscribed.peers)]
        return 1, "bus info", rows
