"""The simulation as a ROS 1 node: publishes, subscribes and serves."""

from __future__ import annotations

import os
import threading
from typing import Any

from kbot.net.hosts import host_and_port_of_uri, is_loopback, is_served_at
from kbot.record.encodings.types import ros1_types
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.master import Master
from kbot.ros.bridges.ros1.parameter_server import flat_parameters, is_plain
from kbot.ros.bridges.ros1.publisher import Outgoing
from kbot.ros.bridges.ros1.rpc import Reply, RpcFailed, RpcServer, call, why_not_sent
from kbot.ros.bridges.ros1.subscriber import Incoming
from kbot.ros.bridges.ros1.tcpros_server import TcprosServer
from kbot.ros.parameter_values import ParameterValue
from kbot.text import KbotError

NODE = "/kbot"
DEFAULT_PORT = 11311
DEFAULT_MASTER = f"http://localhost:{DEFAULT_PORT}/"
LOOPBACK = "127.0.0.1"
CHECK_SECONDS = 2.0
LEAVE_SECONDS = 5.0


class Ros1Bridge:
    """A node named /kbot, with the master that answers, or one of its own.

    It registers anew when a master comes back after it was gone.
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
        """`host` is the address that peers reach this node at: as given, else ROS_IP or ROS_HOSTNAME, else
        loopback. `master` as given, else ROS_MASTER_URI, else port 11311 here; where none
        answers it is one of its own, unless `own_master` is false. `node` is its full name. Nodes of other
        machines are contacted with `other_machines`, and if `host` is an address that they can reach.

        Raises:
            KbotError: the master is another machine's and does not answer, or an address cannot be used.
        """
        environment = os.environ.get
        self._host = host or environment("ROS_IP") or environment("ROS_HOSTNAME") or LOOPBACK
        self._link, self._node = link, node
        other_machines = other_machines or (host is not None and not is_loopback(host))
        self._contacts = AllowedNodes(self._host, link.tell, other_machines)
        self._own_master: Master | None = None
        self.master = self._find_master(master or environment("ROS_MASTER_URI") or DEFAULT_MASTER, own_master)
        self._outgoing: dict[str, Outgoing] = {}
        self._incoming: dict[str, Incoming] = {}
        self._offered = frozenset[str]()
        """Services that the master was told of."""
        self._given: dict[str, ParameterValue] = {}
        """Parameters as the master has them from here, or told of them."""
        self._lock = threading.Lock()
        self._changed, self._closed = threading.Event(), threading.Event()
        try:
            self._tcpros = TcprosServer(self._host, link, self._node, self._outgoing)
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
        """Where it is to be found, in one sentence."""
        whose = "its own master" if self._own_master else "the master"
        return f"ROS 1: node {self._node} with {whose} at {self.master}"

    def close(self) -> None:
        """Take leave of the master and of all peers."""
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
                self._own_master = Master(host, port or DEFAULT_PORT, self._contacts)
            except OSError as error:
                why = error.strerror or error
                raise KbotError(f"no ROS 1 master answers at {uri}, and there can be none: {why}") from None
            return self._own_master.uri
        return uri

    # registration

    def _keep_registered(self) -> None:
        """Tell the master what there is, and again when it forgot."""
        known_to_master = False
        while True:
            changed = self._changed.wait(CHECK_SECONDS)
            self._changed.clear()
            if self._closed.is_set():
                self._leave()
                return
            try:
                if not changed and known_to_master:
                    known_to_master = self._is_known()
                if not known_to_master:
                    self._given.clear()  # it may have started anew, knowing nothing
                if changed or not known_to_master:
                    self._register()
                    known_to_master = True
            except RpcFailed as failed:
                known_to_master = False
                self._link.tell(f"ROS 1: the master is gone, and waited for: {failed}")

    def _leave(self) -> None:
        with self._lock:
            for said in self._outgoing.values():
                self._quietly("unregisterPublisher", said.topic.name, self.uri)
                said.close()
            for heard in self._incoming.values():
                self._quietly("unregisterSubscriber", heard.topic.name, self.uri)
                heard.close()
            for service in self._link.services:
                self._quietly("unregisterService", service, self._services_uri)
            self._outgoing.clear()
            self._incoming.clear()

    def _is_known(self) -> bool:
        try:
            return bool(call(self.master, "lookupNode", self._node, self._node) == self.uri)
        except RpcFailed:
            call(self.master, "getPid", self._node)  # raises where the master is gone
            return False

    def _register(self) -> None:
        with self._lock:
            self._give_parameters()
            services = frozenset(self._link.services)
            for service in services:
                call(self.master, "registerService", self._node, service, self._services_uri, self.uri)
            for service in self._offered - services:
                self._quietly("unregisterService", service, self._services_uri)
            self._offered = services
            self._drop_what_is_gone()
            for topic in self._link.topics.values():
                if topic.type_name not in ros1_types().fielddefs:
                    continue  # ROS 1 has no such type
                if topic.is_input:
                    if topic.name not in self._incoming:
                        self._incoming[topic.name] = Incoming(self._link, topic, self._node, self._contacts)
                    heard = self._incoming[topic.name]
                    uris = call(
                        self.master, "registerSubscriber", self._node, topic.name, heard.type_name, self.uri
                    )
                    heard.update([str(uri) for uri in uris])
                else:
                    if topic.name not in self._outgoing:
                        self._outgoing[topic.name] = Outgoing(self._link, topic, self._node)
                    said = self._outgoing[topic.name]
                    call(self.master, "registerPublisher", self._node, topic.name, said.type_name, self.uri)

    def _give_parameters(self) -> None:
        """Those that the master has not from here yet; it tells of what others set."""
        parameters = self._link.parameters
        for name, value in parameters.items():
            if name not in self._given or self._given[name] != value:
                self._given[name] = value
                if why_not := why_not_sent(value):
                    self._link.tell(f"ROS 1: parameter {name} is not on the master: {why_not}")
                else:
                    call(self.master, "setParam", self._node, name, value)
        for name in self._given.keys() - parameters.keys():
            del self._given[name]
            self._quietly("deleteParam", name)
        call(self.master, "subscribeParam", self._node, self.uri, "/")

    def _drop_what_is_gone(self) -> None:
        topics = self._link.topics
        for name in [n for n, out in self._outgoing.items() if topics.get(n) != out.topic]:
            self._outgoing.pop(name).close()
            self._quietly("unregisterPublisher", name, self.uri)
        for name in [n for n, heard in self._incoming.items() if topics.get(n) != heard.topic]:
            self._incoming.pop(name).close()
            self._quietly("unregisterSubscriber", name, self.uri)

    def _quietly(self, method: str, *arguments: object) -> None:
        try:
            call(self.master, method, self._node, *arguments)
        except RpcFailed:
            return  # a master that is gone has forgotten it anyway

    # what other nodes may ask of this one

    def _functions(self) -> dict[str, Any]:  # Any: XML-RPC
        return {
            "getBusStats": lambda caller: (1, "", [[], [], []]),
            "getBusInfo": self._bus_info,
            "getMasterUri": lambda caller: (1, "", self.master),
            "getPid": lambda caller: (1, "", os.getpid()),
            "shutdown": self._shutdown,
            "getSubscriptions": lambda caller: (1, "", [[n, t.type_name] for n, t in self._incoming.items()]),
            "getPublications": lambda caller: (1, "", [[n, t.type_name] for n, t in self._outgoing.items()]),
            "paramUpdate": self._parameter_update,
            "publisherUpdate": self._publisher_update,
            "requestTopic": self._request_topic,
        }

    def _shutdown(self, caller: str, reason: str = "") -> Reply:
        """A master sends this when another node takes the name; `rosnode kill` too."""
        self._link.tell(
            f"ROS 1: {caller} asked {self._node} to go ({reason}); the simulation goes on without it"
        )
        self._closed.set()
        self._changed.set()
        return 1, "the node goes, the simulation stays", 0

    def _parameter_update(self, caller: str, name: str, value: ParameterValue) -> Reply:
        """What others set at the master; a tree comes as a dictionary, what is gone as an empty one."""
        if value == {}:
            self._given.pop(f"/{name.strip('/')}", None)
            self._link.set_parameter(f"/{name.strip('/')}", None)
        for key, found in flat_parameters(f"/{name.strip('/')}", value):
            if is_plain(found):  # dates and bytes stay at the master
                self._given[key] = found
                self._link.set_parameter(key, found)
        return 1, "", 0

    def _publisher_update(self, caller: str, topic: str, uris: list[str]) -> Reply:
        heard = self._incoming.get(topic)
        if heard is not None:
            heard.update([str(uri) for uri in uris])
        return 1, "", 0

    def _request_topic(self, caller: str, topic: str, protocols: list[list[Any]]) -> Reply:
        if topic not in self._outgoing:
            return -1, f"there is no topic {topic} here", []
        if not any(protocol and protocol[0] == "TCPROS" for protocol in protocols):
            return 0, "only TCPROS is spoken", []
        return 1, f"ready on {self._host}:{self._tcpros.port}", ["TCPROS", self._host, self._tcpros.port]

    def _bus_info(self, caller: str) -> Reply:
        rows: list[list[Any]] = []
        for name, said in list(self._outgoing.items()):
            rows += [[len(rows) + i, peer, "o", "TCPROS", name, 1] for i, peer in enumerate(said.peers)]
        for name, heard in list(self._incoming.items()):
            rows += [[len(rows) + i, peer, "i", "TCPROS", name, 1] for i, peer in enumerate(heard.peers)]
        return 1, "bus info", rows
