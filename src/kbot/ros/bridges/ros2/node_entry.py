"""The node's entry in the graph of ROS 2, which peers read on the topic `ros_discovery_info`."""

from __future__ import annotations

import struct

from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from kbot.ros.bridges.ros2.samples import Dds, sample_of, sample_type

GRAPH_TOPIC = "ros_discovery_info"
GRAPH_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
GID_SIZES = 16, 24
"""Bytes of a GID from ROS 2 Iron on, and up to Humble (rmw_dds_common 5ab4f59)."""
_HEADER = b"\0\1\0\0"
"""CDR, little-endian."""
NO_NODE = _HEADER + bytes(GID_SIZES[-1] + 4)
"""A message of a participant without nodes, in both sizes: readers of the shorter one ignore the rest."""
_MARK = b"kbot=1;"
"""The user data of KBot's endpoints. KBot does not wait for the entries of other nodes of KBot."""
MOST_AT_ONCE = 64


def node_message(
    participant: bytes, node: str, readers: list[bytes], writers: list[bytes], size: int
) -> bytes:
    """The message, in CDR, of a participant with one node. `node` is its full name, GUIDs have 16 bytes, and
    GIDs `size` bytes."""
    namespace, _, name = node.rpartition("/")
    body = participant.ljust(size, b"\0") + struct.pack("<I", 1)
    body = _with_text(_with_text(body, namespace or "/"), name)
    for guids in (readers, writers):
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", len(guids))
        body += b"".join(guid.ljust(size, b"\0") for guid in guids)
    return _HEADER + body


def _with_text(body: bytes, text: str) -> bytes:
    body += b"\0" * (-len(body) % 4)
    data = text.encode() + b"\0"
    return body + struct.pack("<I", len(data)) + data


def gid_size(data: bytes) -> int:
    """The size of the GIDs in a peer's message, which follows from the message's length. 0 if neither size
    fits."""
    return next((size for size in GID_SIZES if _ends(data, size)), 0)


def _ends(data: bytes, size: int) -> bool:
    """Whether a message with GIDs of this size has the length of the data, up to padding."""
    order = "<" if data[1:2] == b"\1" else ">"
    body = data[len(_HEADER) :]

    def number(at: int) -> tuple[int, int]:
        at += -at % 4
        (value,) = struct.unpack_from(f"{order}I", body, at)
        return value, at + 4

    try:
        nodes, at = number(size)
        for _ in range(nodes):
            for scale in (1, 1, size, size):  # namespace, name, readers, writers
                count, at = number(at)
                at += count * scale
                if at > len(body):
                    return False
    except struct.error:
        return False
    return 0 <= len(body) - at < 4


class NodeEntry:
    """Publishes the node's entry with GIDs of the size that its peers use. Belongs to one thread.

    A node of ROS 2 Humble that receives GIDs of 16 bytes takes a text for the number of nodes, asks for 56 GB
    of memory and crashes (rmw_fastrtps#733, #797). Therefore nothing is published before each subscriber has
    published its own entry. If their sizes differ, Humble's is used: later distributions read it as a
    participant without nodes. A late subscriber receives `NO_NODE`, and the entry after its own is known.
    """

    def __init__(self, participant: Dds, node: str) -> None:
        self._participant, self._node = participant, node
        kind = sample_type(GRAPH_TYPE)
        topic = DdsTopic(participant, GRAPH_TOPIC, kind)
        mark = Policy.Userdata(data=_MARK)
        reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
        qos = Policy.Durability.TransientLocal, reliable, mark
        self._writer: Dds = DataWriter(participant, topic, qos=Qos(*qos, Policy.History.KeepLast(1)))
        self.reader: Dds = DataReader(participant, topic, qos=Qos(*qos, Policy.History.KeepAll))
        self._sizes: dict[str, int] = {}
        """By participant; 0 if its message has neither size."""
        self._endpoints: tuple[list[bytes], list[bytes]] = [], []
        self._published: object = None
        """What the published entry depends on."""
        self.is_settled = True
        """Whether late subscribers receive `NO_NODE`, and not the entry."""

    def update(self, readers: list[bytes], writers: list[bytes]) -> None:
        """The GUIDs of the node's endpoints, for the next `publish`."""
        self._endpoints = readers, writers

    def receive(self) -> bool:
        """Receive the entries of peers. Returns whether there were any."""
        has_received = False
        for sample in self.reader.take(MOST_AT_ONCE):
            if sample.sample_info.valid_data:
                source = self.reader.get_matched_publication_data(sample.sample_info.publication_handle)
                if source is not None and not _is_kbot(source):
                    self._sizes[source.participant_key.hex] = gid_size(sample.encoded)
                    has_received = True
        return has_received

    def publish(self) -> None:
        """Publish the entry if it or its subscribers have changed."""
        peers = self._peers()
        self._sizes = {peer: size for peer, size in self._sizes.items() if peer in peers}
        if peers and all(self._sizes.get(peer) for peer in peers):
            size = max(self._sizes.values())
            state = size, peers, self._endpoints
            if state != self._published:
                self._published, self.is_settled = state, False
                self._write(node_message(self._participant.guid.bytes, self._node, *self._endpoints, size))
        if not self.is_settled and is_acknowledged(self._writer):
            self.is_settled = True
            self._write(NO_NODE)

    def _peers(self) -> set[str]:
        """The participants that subscribe, except other nodes of KBot."""
        found = map(self._writer.get_matched_subscription_data, self._writer.get_matched_subscriptions())
        return {data.participant_key.hex for data in found if data is not None and not _is_kbot(data)}

    def _write(self, data: bytes) -> None:
        self._writer.write(sample_of(sample_type(GRAPH_TYPE), data))

    def close(self) -> None:
        """Delete the endpoints: DDS deletes what nothing refers to."""
        self._participant = self._writer = self.reader = None


def is_acknowledged(writer: Dds) -> bool:
    """Whether all subscribers have acknowledged everything."""
    try:
        return bool(writer.wait_for_acks(duration(milliseconds=1)))
    except AttributeError:
        return False  # cyclonedds 11.0.1 looks for the code of a timeout in the wrong class


def _is_kbot(endpoint: Dds) -> bool:
    mark = endpoint.qos[Policy.Userdata]
    return mark is not None and bytes(mark.data) == _MARK
