"""The simulation as a ROS 2 node over DDS."""

from __future__ import annotations

import os
import threading
import time

from cyclonedds.core import (
    DDSException,
    GuardCondition,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from kbot.messages.types import Twist, TwistStamped
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros2_definition
from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import Batch, later, wait_for
from kbot.ros.bridges.ros2.domain import discovery_range, domain_number
from kbot.ros.bridges.ros2.node_entry import MOST_AT_ONCE, NodeEntry, is_acknowledged
from kbot.ros.bridges.ros2.samples import Dds, sample_of, sample_type
from kbot.text import KbotError

NODE = "/kbot"
POLL_SECONDS = 0.25
"""Seconds between two checks for new and lost subscribers."""
SETTLE_SECONDS = 0.01
"""The same until the node's entry in the graph is acknowledged, because a new peer receives it until then."""


class Ros2Bridge:
    """The node /kbot.

    It publishes reliably, latched topics also for late subscribers. It subscribes with best effort, because a
    reliable subscriber receives nothing from a best-effort publisher. Its own thread receives messages and
    checks for subscribers.
    """

    def __init__(
        self,
        link: PeerLink,
        host: str | None = None,
        node: str = NODE,
        *,
        domain: int | None = None,
        lossless: bool = False,
    ) -> None:
        """Join the domain `domain`, else ROS_DOMAIN_ID, else 0.

        By default, only this machine can connect, see `discovery_range`. With `host`, this machine's address
        in a network, the machines in that network can connect. `node` is the node's full name. If it is
        `lossless`, it subscribes reliably and keeps every message for slow subscribers, as lockstep needs it.

        Raises:
            KbotError: a variable of ROS 2 is invalid, or the address cannot be used.
        """
        self._link, self._node = link, node
        self._lossless = lossless
        self.domain = domain_number(os.environ) if domain is None else domain
        self._range = discovery_range(host, os.environ)
        try:
            # a process can create each domain only once, so bridges of this process share it
            self._domain = _shared_domain(self.domain, self._range.config)
            self._participant: Dds = DomainParticipant(
                self.domain, qos=Qos(Policy.Userdata(data=b"enclave=/;"))
            )
        except DDSException as error:
            hint = f". Is {host} an address of this machine?" if host is not None else ""
            raise KbotError(f"ROS 2 cannot be served in domain {self.domain}: {error.msg}{hint}") from None
        self._published: dict[str, _PublishedTopic] = {}
        self._batch = Batch(self._write)
        self._readers: dict[Dds, tuple[str, type]] = {}
        self._closed, self._changed = threading.Event(), threading.Event()
        self._entry = NodeEntry(self._participant, node)
        self._probed, self._acknowledged = set[tuple[str, str]](), set[tuple[str, str]]()
        """The topics and peers to which something was written, and those that have acknowledged it."""
        self._sources: dict[Dds, str] = {}
        """The participants of the writers that messages came from."""
        self._waitset: Dds = WaitSet(self._participant)
        self._wake: Dds = GuardCondition(self._participant)
        self._waitset.attach(self._wake)
        self._waitset.attach(ReadCondition(self._entry.reader, _ANY_NEW))
        link.watch(self._update)
        self._update()
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-ros2")
        self._thread.start()

    def describe(self) -> str:
        """The node and its domain, in one sentence."""
        return f"ROS 2: node {self._node} in domain {self.domain}, {self._range.words}"

    @property
    def identity(self) -> str:
        """The `source` of this node's messages at the links of its peers."""
        identity: str = self._participant.guid.hex
        return identity

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        """Whether messages that this `lossless` node `publishes` reach a peer. A subscriber is always ready.

        A subscriber skips what was written before it received the writer's first heartbeat, also after both
        have found each other. It acknowledges nothing before.
        """
        if not publishes or (topic, peer) in self._acknowledged:
            return True
        self._wake.set(True)  # to open the topic
        if not wait_for(self._reaches(topic, peer)):
            return False
        published = self._published[topic]
        if (topic, peer) not in self._probed:
            self._probed.add((topic, peer))
            published.probe()
        if published.is_acknowledged():
            self._acknowledged.add((topic, peer))
        return (topic, peer) in self._acknowledged

    async def _reaches(self, topic: str, peer: str) -> bool:
        published = self._published.get(topic)
        return published is not None and published.is_open and peer in published.peers()

    def has_peers(self) -> bool:
        """Whether other nodes are connected."""
        return any(published.peers() for published in list(self._published.values())) or any(
            map(_peers_of, list(self._readers))
        )

    def _update(self) -> None:
        self._changed.set()
        self._wake.set(True)

    def close(self) -> None:
        """Leave the domain."""
        self._closed.set()
        self._wake.set(True)
        self._thread.join(5.0)
        wait_for(self._close_topics())
        # DDS deletes entities that nothing refers to, and the waitset refers to all others
        self._waitset = self._wake = None
        self._published.clear()
        self._readers.clear()
        self._entry.close()
        self._participant = None

    async def _close_topics(self) -> None:
        for published in self._published.values():
            published.close()

    def _run(self) -> None:
        """Receive messages, and check for subscribers every `POLL_SECONDS`."""
        check_at = 0.0
        while not self._closed.is_set():
            if self._changed.is_set():
                self._changed.clear()
                self._make_endpoints()
                check_at = 0.0
            if time.monotonic() >= check_at:
                for published in self._published.values():
                    published.check_subscribers()
                self._entry.publish()
                check_at = time.monotonic() + (POLL_SECONDS if self._entry.is_settled else SETTLE_SECONDS)
            self._waitset.wait(duration(seconds=POLL_SECONDS if self._entry.is_settled else SETTLE_SECONDS))
            if self._wake.take():
                check_at = 0.0
            if self._entry.receive():
                check_at = 0.0
            self._receive()

    def _make_endpoints(self) -> None:
        for topic in self._link.topics_of(2).values():
            if topic.is_input:
                self._make_readers(topic)
            elif topic.name not in self._published:
                kind = sample_type(topic.type_name)
                qos = _writer_qos(topic, self._lossless)
                writer = DataWriter(self._participant, self._topic(topic.name, kind), qos=qos)
                self._published[topic.name] = _PublishedTopic(self._link, topic, writer, kind, self._batch)
        self._entry.update(
            [reader.guid.bytes for reader in self._readers],
            [published.writer.guid.bytes for published in self._published.values()],
        )

    def _make_readers(self, topic: Topic) -> None:
        if topic.name in {name for name, _ in self._readers.values()}:
            return
        kinds = (Twist, TwistStamped) if topic.message_type is Twist else (topic.message_type,)
        for message_type in kinds:
            kind = sample_type(ros_name(message_type))
            qos = _reader_qos(message_type, self._lossless)
            reader = DataReader(self._participant, self._topic(topic.name, kind), qos=qos)
            self._readers[reader] = topic.name, message_type
            self._waitset.attach(ReadCondition(reader, _ANY_NEW))

    def _topic(self, name: str, kind: Dds) -> Dds:
        return DdsTopic(self._participant, f"rt{name}", kind)

    def _receive(self) -> None:
        for reader, (topic, message_type) in list(self._readers.items()):
            for sample in reader.take(MOST_AT_ONCE):
                if sample.sample_info.valid_data:  # others only report that a writer has left
                    source = self._source_of(reader, sample.sample_info.publication_handle)
                    self._deliver(topic, message_type, sample.encoded, source)

    def _source_of(self, reader: Dds, writer: Dds) -> str:
        if writer not in self._sources:
            data = reader.get_matched_publication_data(writer)
            if data is None:  # it has left
                return ""
            self._sources[writer] = data.participant_key.hex
        return self._sources[writer]

    def _write(self, batch: list[tuple[Dds, Dds]]) -> None:
        for writer, sample in batch:
            try:
                writer.write(sample)
            except DDSException as error:
                self._link.report(f"ROS 2: a message could not be sent: {error.msg}")

    def _deliver(self, topic: str, message_type: type, data: bytes, source: str) -> None:
        try:
            self._link.send(topic, decode_cdr(data, message_type), source=source)
        except KbotError as error:
            self._link.report(f"ROS 2: rejected a message on {topic}: {error}")


class _PublishedTopic:
    """A topic that KBot publishes, open while it is latched or has subscribers."""

    def __init__(
        self, link: PeerLink, topic: Topic, writer: Dds, kind: Dds, batch: Batch[tuple[Dds, Dds]]
    ) -> None:
        self.writer = writer
        self._link, self._topic, self._kind, self._batch = link, topic, kind, batch
        self._is_wanted = False
        self.is_open = False
        """Whether it is subscribed. Used on the loop."""

    def peers(self) -> set[str]:
        """The participants of the subscribers."""
        found = map(self.writer.get_matched_subscription_data, self.writer.get_matched_subscriptions())
        return {data.participant_key.hex for data in found if data is not None}

    def probe(self) -> None:
        """Write something that subscribers acknowledge and that is not a message."""
        self.writer.dispose(sample_of(self._kind, b""))

    def is_acknowledged(self) -> bool:
        """Whether all subscribers have acknowledged everything."""
        return is_acknowledged(self.writer)

    def check_subscribers(self) -> None:
        """Open the topic for its first subscriber, close it without one."""
        is_wanted = self._topic.is_latched or bool(self.writer.get_matched_subscriptions())
        if is_wanted != self._is_wanted:
            self._is_wanted = is_wanted
            later(self._open if is_wanted else self.close)

    def _open(self) -> None:
        self._link.fan_out.subscribe(self._topic.name, self._send, self._batch.flush)
        self.is_open = True

    def close(self) -> None:
        """Stop publishing. Must be called on the loop."""
        self.is_open = False
        self._link.fan_out.unsubscribe(self._topic.name, self._send)

    def _send(self, packet: Packet) -> None:
        if type(packet.message) is not self._topic.message_type:
            return
        self._batch.add((self.writer, sample_of(self._kind, packet.cdr)))


_domains: dict[int, Dds] = {}


def _shared_domain(number: int, config: str) -> Dds:
    if number not in _domains:
        _domains[number] = Domain(number, config)
    return _domains[number]


_RELIABLE_WAITING = Policy.Reliability.Reliable(duration(milliseconds=100))
"""A slow subscriber may block a write for this long."""
_RELIABLE = Policy.Reliability.Reliable(0)
_RELIABLE_LOSSLESS = Policy.Reliability.Reliable(duration(seconds=10))
"""A write waits for a slow subscriber, so that it receives every message."""
_ANY_NEW = ViewState.Any | InstanceState.Alive | SampleState.NotRead


def _type_hash(type_name: str) -> Dds:
    return Policy.Userdata(data=f"typehash={ros2_definition(type_name)[1]};".encode())


def _peers_of(reader: Dds) -> set[str]:
    """The participants of the writers that a reader has found."""
    found = map(reader.get_matched_publication_data, reader.get_matched_publications())
    return {data.participant_key.hex for data in found if data is not None}


def _writer_qos(topic: Topic, lossless: bool) -> Dds:
    """The writer's QoS. A write of a latched message waits for slow subscribers, because no other follows."""
    durability = Policy.Durability.TransientLocal if topic.is_latched else Policy.Durability.Volatile
    if lossless:
        policies = _RELIABLE_LOSSLESS, Policy.History.KeepAll
    elif topic.is_latched:
        policies = _RELIABLE_WAITING, Policy.History.KeepLast(1)
    else:
        policies = _RELIABLE, Policy.History.KeepLast(10)
    return Qos(durability, *policies, _type_hash(topic.type_name))


def _reader_qos(message_type: type, lossless: bool) -> Dds:
    if lossless:
        policies = _RELIABLE_LOSSLESS, Policy.History.KeepAll
    else:
        policies = Policy.Reliability.BestEffort, Policy.History.KeepLast(10)
    return Qos(Policy.Durability.Volatile, *policies, _type_hash(ros_name(message_type)))
