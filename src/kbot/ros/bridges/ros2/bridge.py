"""The simulation as a ROS 2 node over DDS."""

from __future__ import annotations

import dataclasses
import os
import struct
import threading
import time
import types
from functools import cache
from typing import Any

from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration
from rosbags.interfaces import Nodetype

from kbot.messages.types import Twist, TwistStamped
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros2_definition, ros2_types
from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import Batch, later, wait_for
from kbot.text import KbotError

Dds = Any
"""What the library gives and takes, which is not typed."""

array: Dds = idl.array
sequence: Dds = idl.sequence
PRIMITIVES: dict[str, Dds] = {
    "bool": bool,
    "string": str,
    "byte": idl.uint8,
    "char": idl.uint8,
    **{name: getattr(idl, name) for name in ("int8", "int16", "int32", "int64")},
    **{name: getattr(idl, name) for name in ("uint8", "uint16", "uint32", "uint64", "float32", "float64")},
}


@cache
def sample_type(name: str) -> Dds:
    """The class of samples of a ROS type such as `nav_msgs/msg/Odometry`.

    Its fields are there for DDS to know the type by; a sample itself is `sample_of` bytes.
    """
    package, _, last = name.partition("/msg/")
    fields = {field: _field(kind) for field, kind in ros2_types().fielddefs[name][1]}
    made = types.new_class(
        f"{last}_",
        (IdlStruct,),
        {"typename": f"{package}::msg::dds_::{last}_"},
        lambda space: space.update({"__annotations__": fields, "__module__": __name__}),
    )
    sample: Dds = dataclasses.dataclass(made)
    sample.serialize = _encoded
    sample.deserialize = classmethod(_taken)
    return sample


def sample_of(kind: Dds, data: bytes) -> Dds:
    """A sample that carries a message in CDR, with its header."""
    sample = object.__new__(kind)
    sample.encoded = data
    return sample


def _encoded(sample: Dds, **_: object) -> bytes:
    data: bytes = sample.encoded
    return data


def _taken(kind: Dds, /, data: bytes, **_: object) -> Dds:
    return sample_of(kind, bytes(data))


def _field(kind: Dds) -> Dds:
    match kind:
        case (Nodetype.BASE, (base, _)):
            return PRIMITIVES[base]
        case (Nodetype.NAME, name):
            return sample_type(name)
        case (Nodetype.ARRAY, (item, length)):
            return array[_field(item), length]
        case (Nodetype.SEQUENCE, (item, limit)):
            return sequence[_field(item), limit] if limit else sequence[_field(item)]
    raise TypeError(f"a field of an unknown kind: {kind!r}")


GRAPH_TOPIC = "ros_discovery_info"
GRAPH_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
GID_BYTES = 16
"""As from ROS 2 Iron on; Humble has 24."""


def node_message(participant: bytes, node: str, readers: list[bytes], writers: list[bytes]) -> bytes:
    """The message, in CDR, of a participant with one node of that full name; GUIDs are 16 bytes."""
    namespace, _, name = node.rpartition("/")
    body = _gid(participant) + struct.pack("<I", 1)
    body = _text(_text(body, namespace or "/"), name)
    for gids in (readers, writers):
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", len(gids)) + b"".join(map(_gid, gids))
    return b"\0\1\0\0" + body


def _gid(guid: bytes) -> bytes:
    return guid.ljust(GID_BYTES, b"\0")[:GID_BYTES]


def _text(body: bytes, text: str) -> bytes:
    body += b"\0" * (-len(body) % 4)
    return body + struct.pack("<I", len(text) + 1) + text.encode() + b"\0"


NODE = "/kbot"
LOOK_SECONDS = 0.25
MOST_AT_ONCE = 64
HIGHEST_DOMAIN = 232

LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
"""Configuration of a domain that stays on this machine."""


class Ros2Bridge:
    """A node /kbot: topics out reliably, latched ones also for those who come late, commands in by best
    effort. A thread of its own hears them, and finds out who is there."""

    def __init__(self, link: PeerLink, host: str | None = None, node: str = NODE) -> None:
        """The domain is ROS_DOMAIN_ID's, else 0. It stays on this machine unless `host` is the address of
        one of its networks. `node` is its full name.

        Raises:
            KbotError: the domain is none, or the address cannot be used.
        """
        self._link, self._host, self._node = link, host, node
        self.domain = _domain()
        config = LOOPBACK if host is None else _network(host)
        try:
            # a process has a domain but once: another bridge of this process shares it
            self._domain = _shared_domain(self.domain, config)
            self._participant: Dds = DomainParticipant(
                self.domain, qos=Qos(Policy.Userdata(data=b"enclave=/;"))
            )
        except DDSException as error:
            raise KbotError(f"ROS 2 cannot be served in domain {self.domain}: {error.msg}") from None
        self._outgoing: dict[str, _Outgoing] = {}
        self._batch = Batch(self._write)
        self._readers: dict[Dds, tuple[str, type]] = {}
        self._closed, self._changed = threading.Event(), threading.Event()
        latched = Qos(Policy.Durability.TransientLocal, _WAITS, Policy.History.KeepLast(1))
        graph = sample_type(GRAPH_TYPE)
        self._graph: Dds = DataWriter(
            self._participant, DdsTopic(self._participant, GRAPH_TOPIC, graph), qos=latched
        )
        self._waitset: Dds = WaitSet(self._participant)
        link.watch(self._changed.set)
        self._changed.set()
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-ros2")
        self._thread.start()

    def describe(self) -> str:
        """Where it is to be found, in one sentence."""
        where = "on this machine only" if self._host is None else f"at {self._host}"
        return f"ROS 2: node {self._node} in domain {self.domain}, {where}"

    def close(self) -> None:
        """Take leave of all peers."""
        self._closed.set()
        self._thread.join(5.0)
        wait_for(self._leave())
        self._waitset = None  # DDS takes leave when nothing holds its entities, and this one holds the others
        self._outgoing.clear()
        self._readers.clear()
        self._graph = self._participant = None

    async def _leave(self) -> None:
        for outgoing in self._outgoing.values():
            outgoing.close()

    def _run(self) -> None:
        """Hear, and now and then look who is there: DDS takes its time to tell."""
        look_at = 0.0
        while not self._closed.is_set():
            if self._changed.is_set():
                self._changed.clear()
                self._make_endpoints()
                look_at = 0.0
            if time.monotonic() >= look_at:
                for outgoing in self._outgoing.values():
                    outgoing.look()
                look_at = time.monotonic() + LOOK_SECONDS
            self._waitset.wait(duration(seconds=LOOK_SECONDS))
            self._hear()

    def _make_endpoints(self) -> None:
        for topic in self._link.topics.values():
            if topic.is_input:
                self._make_readers(topic)
            elif topic.name not in self._outgoing:
                kind = sample_type(topic.type_name)
                writer = DataWriter(self._participant, self._topic(topic.name, kind), qos=_writer_qos(topic))
                self._outgoing[topic.name] = _Outgoing(self._link, topic, writer, kind, self._batch)
        self._tell_graph()

    def _make_readers(self, topic: Topic) -> None:
        if topic.name in {name for name, _ in self._readers.values()}:
            return
        kinds = (Twist, TwistStamped) if topic.message_type is Twist else (topic.message_type,)
        for message_type in kinds:
            kind = sample_type(ros_name(message_type))
            reader = DataReader(
                self._participant, self._topic(topic.name, kind), qos=_reader_qos(message_type)
            )
            self._readers[reader] = topic.name, message_type
            self._waitset.attach(ReadCondition(reader, _ANY_NEW))

    def _topic(self, name: str, kind: Dds) -> Dds:
        return DdsTopic(self._participant, f"rt{name}", kind)

    def _tell_graph(self) -> None:
        writers = [outgoing.writer.guid.bytes for outgoing in self._outgoing.values()]
        readers = [reader.guid.bytes for reader in self._readers]
        data = node_message(self._participant.guid.bytes, self._node, readers, writers)
        self._graph.write(sample_of(sample_type(GRAPH_TYPE), data))

    def _hear(self) -> None:
        for reader, (topic, message_type) in list(self._readers.items()):
            for sample in reader.take(MOST_AT_ONCE):
                if sample.sample_info.valid_data:
                    self._deliver(topic, message_type, sample.encoded)

    def _write(self, batch: list[tuple[Dds, Dds]]) -> None:
        for writer, sample in batch:
            try:
                writer.write(sample)
            except DDSException as error:
                self._link.tell(f"ROS 2: a message was not sent: {error.msg}")

    def _deliver(self, topic: str, message_type: type, data: bytes) -> None:
        try:
            self._link.send(topic, decode_cdr(data, message_type))
        except KbotError as error:
            self._link.tell(f"ROS 2: a message on {topic} was refused: {error}")


class _Outgoing:
    """One topic. What is latched is kept by DDS for those who come late; else only what is heard is made."""

    def __init__(
        self, link: PeerLink, topic: Topic, writer: Dds, kind: Dds, batch: Batch[tuple[Dds, Dds]]
    ) -> None:
        self.writer = writer
        self._link, self._topic, self._kind, self._batch = link, topic, kind, batch
        self._is_open = False

    def look(self) -> None:
        """Open it when somebody came, close it when nobody is left."""
        is_heard = self._topic.is_latched or bool(self.writer.get_matched_subscriptions())
        if is_heard != self._is_open:
            self._is_open = is_heard
            fan_out = self._link.fan_out
            if is_heard:
                later(lambda: fan_out.want(self._topic.name, self._send, self._batch.flush))
            else:
                later(lambda: fan_out.leave(self._topic.name, self._send))

    def close(self) -> None:
        """On the loop: send nothing more."""
        self._link.fan_out.leave(self._topic.name, self._send)

    def _send(self, packet: Packet) -> None:
        if type(packet.message) is not self._topic.message_type:
            return
        self._batch.add((self.writer, sample_of(self._kind, packet.cdr)))


_domains: dict[int, Dds] = {}


def _shared_domain(number: int, config: str) -> Dds:
    if number not in _domains:
        _domains[number] = Domain(number, config)
    return _domains[number]


def _domain() -> int:
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal() or int(text) > HIGHEST_DOMAIN:
        raise KbotError(f"ROS_DOMAIN_ID is a whole number from 0 to {HIGHEST_DOMAIN}, not '{text}'")
    return int(text)


def _network(host: str) -> str:
    return (
        "<CycloneDDS><Domain><General><Interfaces>"
        f'<NetworkInterface address="{host}"/></Interfaces></General></Domain></CycloneDDS>'
    )


_WAITS = Policy.Reliability.Reliable(duration(milliseconds=100))
_NEVER_WAITS = Policy.Reliability.Reliable(0)
_ANY_NEW = ViewState.Any | InstanceState.Alive | SampleState.NotRead


def _type_hash(type_name: str) -> Dds:
    return Policy.Userdata(data=f"typehash={ros2_definition(type_name)[1]};".encode())


def _writer_qos(topic: Topic) -> Dds:
    """A peer that is slow to take what is latched is waited for a moment, lest it never gets it."""
    if topic.is_latched:
        kept = Policy.Durability.TransientLocal, _WAITS, Policy.History.KeepLast(1)
    else:
        kept = Policy.Durability.Volatile, _NEVER_WAITS, Policy.History.KeepLast(10)
    return Qos(*kept, _type_hash(topic.type_name))


def _reader_qos(message_type: type) -> Dds:
    return Qos(
        Policy.Durability.Volatile,
        Policy.Reliability.BestEffort,
        Policy.History.KeepLast(10),
        _type_hash(ros_name(message_type)),
    )
