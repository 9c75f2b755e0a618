"""The node's entry in the graph of ROS 2: its bytes in each distribution, and when it is published."""

import os
import struct
import time
from collections.abc import Callable, Iterator

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_typestore

from kbot.ros.bridges.ros2.bridge import Ros2Bridge
from kbot.ros.bridges.ros2.node_entry import GRAPH_TYPE, NO_NODE, gid_size, node_message
from kbot.ros.bridges.ros2.samples import sample_of, sample_type

from .conftest import Running, wait_until

# rmw_dds_common/msg/Gid is char[24] up to Humble, and uint8[16] from Iron on
STORES = {24: get_typestore(Stores.ROS2_HUMBLE), 16: get_typestore(Stores.ROS2_JAZZY)}
SIZES = pytest.mark.parametrize("size", STORES)


def nodes_in(data: bytes, size: int) -> list[str]:
    """The full names of the nodes, as a peer reads them whose GIDs have this size."""
    message = STORES[size].deserialize_cdr(data, GRAPH_TYPE)
    assert all(
        len(gid.data) == size for node in message.node_entities_info_seq for gid in node.writer_gid_seq
    )
    return [f"{node.node_namespace.rstrip('/')}/{node.node_name}" for node in message.node_entities_info_seq]


def peer_message(size: int, *names: str, order: str = "<") -> bytes:
    """What a node of ROS 2 publishes, by the message's definition: the participant's GID, and for each node
    its namespace, its name, and the GIDs of its readers and writers."""

    def text(body: bytes, value: str) -> bytes:
        body += bytes(-len(body) % 4)
        return body + struct.pack(f"{order}I", len(value) + 1) + value.encode() + b"\0"

    def gid(number: int) -> bytes:
        return bytes([1, 15, 7, number]).ljust(16, b"\x55").ljust(size, b"\0")  # a GUID fills 16 bytes

    body = gid(0) + struct.pack(f"{order}I", len(names))
    for name in names:
        body = text(text(body, "/"), name)
        for gids in ([gid(1)], [gid(2), gid(3)]):
            body += bytes(-len(body) % 4) + struct.pack(f"{order}I", len(gids)) + b"".join(gids)
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + body


@SIZES
def test_the_entry_is_encoded_as_in_ros(size: int) -> None:
    data = node_message(b"p" * 16, "/robots/kbot", [b"r" * 16], [b"v" * 16, b"w" * 16], size)
    message = STORES[size].deserialize_cdr(data, GRAPH_TYPE)
    assert bytes(STORES[size].serialize_cdr(message, GRAPH_TYPE)) == data
    node = message.node_entities_info_seq[0]
    assert (node.node_namespace, node.node_name) == ("/robots", "kbot")
    assert [bytes(gid.data)[:16] for gid in node.writer_gid_seq] == [b"v" * 16, b"w" * 16]


@SIZES
def test_the_length_of_a_name_counts_bytes(size: int) -> None:
    """A name of other letters than ROS allows must not shift what follows: Humble's nodes would crash."""
    data = node_message(b"p" * 16, "/röböter/küche_ü", [b"r" * 16], [b"w" * 16], size)
    assert nodes_in(data, size) == ["/röböter/küche_ü"]


@SIZES
@pytest.mark.parametrize("order", ["<", ">"])
def test_the_size_of_gids_is_read_from_a_message(size: int, order: str) -> None:
    for names in ((), ("n",), ("rviz2", "a_name_of_21_letters_"), ("ab", "abc", "abcd")):
        data = peer_message(size, *names, order=order)
        if order == "<":
            assert nodes_in(data, size) == [f"/{name}" for name in names]
        assert gid_size(data) == size
        assert gid_size(data + bytes(-len(data) % 4)) == size  # some vendors pad samples


@pytest.mark.parametrize("data", [b"", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 60, peer_message(20, "node")])
def test_other_messages_have_no_size(data: bytes) -> None:
    assert gid_size(data) == 0


@SIZES
def test_late_subscribers_of_both_sizes_read_no_node(size: int) -> None:
    whole = 4 + size + 4  # CDR's header, the participant's GID, the number of nodes
    assert nodes_in(NO_NODE[:whole], size) == []
    assert set(NO_NODE[4:]) == {0}


class Peer:
    """A participant that reads KBot's entries, and publishes its own when told to."""

    def __init__(self, bridge: Ros2Bridge) -> None:
        self.bridge = bridge
        self.participant = DomainParticipant(bridge.domain)
        self.kind = sample_type(GRAPH_TYPE)
        topic = Topic(self.participant, "ros_discovery_info", self.kind)
        reliable = Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal
        self.reader = DataReader(self.participant, topic, qos=Qos(*reliable, Policy.History.KeepAll))
        self.writer = DataWriter(self.participant, topic, qos=Qos(*reliable, Policy.History.KeepLast(1)))
        self.received: list[bytes] = []

    def publish(self, data: bytes) -> None:
        self.writer.write(sample_of(self.kind, data))

    def receive(self) -> list[bytes]:
        """All messages of KBot so far."""
        for sample in self.reader.take(100):
            source = self.reader.get_matched_publication_data(sample.sample_info.publication_handle)
            if source.participant_key.hex == self.bridge.identity:
                self.received.append(sample.encoded)
        return self.received

    def is_found(self) -> bool:
        return self.participant.guid.hex in self.bridge._entry._peers()

    def reads_kbot(self, size: int) -> bool:
        return any(gid_size(data) == size and "/kbot" in nodes_in(data, size) for data in self.receive())

    def sizes(self) -> set[int]:
        """The sizes of the entries with nodes that were received."""
        return {gid_size(data) for data in self.receive() if data != NO_NODE}


@pytest.fixture
def bridge(running: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ros2Bridge]:
    """Each test process has its own domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    bridge = Ros2Bridge(running.link)
    try:
        yield bridge
    finally:
        bridge.close()


@pytest.fixture
def join(bridge: Ros2Bridge) -> Iterator[Callable[[], Peer]]:
    """Makes peers, and ends them after the test."""
    peers: list[Peer] = []

    def make() -> Peer:
        peers.append(Peer(bridge))
        return peers[-1]

    yield make
    for peer in peers:
        vars(peer).clear()  # DDS deletes what nothing refers to


TWO_CHECKS = 0.6
"""Seconds in which the bridge looks for changes twice."""


@SIZES
def test_the_entry_has_the_size_that_the_peer_uses(join: Callable[[], Peer], size: int) -> None:
    peer = join()
    wait_until(peer.is_found)
    time.sleep(TWO_CHECKS)
    assert peer.receive() == []
    peer.publish(peer_message(size, "peer"))
    wait_until(lambda: peer.reads_kbot(size))
    wait_until(lambda: peer.receive()[-1] == NO_NODE)
    assert peer.sizes() == {size}
    late = join()
    wait_until(late.receive)
    assert set(late.received) == {NO_NODE}


def test_a_message_of_neither_size_is_not_answered(bridge: Ros2Bridge, join: Callable[[], Peer]) -> None:
    peer = join()
    peer.publish(peer_message(20, "peer"))
    wait_until(lambda: peer.is_found() and bridge._entry._sizes)
    time.sleep(TWO_CHECKS)
    assert peer.receive() == []


def test_a_node_of_humble_beside_a_later_one_receives_only_its_own_size(
    bridge: Ros2Bridge, join: Callable[[], Peer]
) -> None:
    jazzy = join()
    jazzy.publish(peer_message(16, "jazzy"))
    wait_until(lambda: jazzy.reads_kbot(16) and jazzy.receive()[-1] == NO_NODE)
    humble = join()
    wait_until(humble.is_found)
    bridge._update()  # as if a topic had appeared
    time.sleep(TWO_CHECKS)
    assert humble.sizes() == set()
    humble.publish(peer_message(24, "humble"))
    wait_until(lambda: humble.reads_kbot(24))
    assert humble.sizes() == {24}
    wait_until(lambda: jazzy.sizes() == {16, 24})


def test_two_kbots_do_not_wait_for_each_other(
    running: Running, bridge: Ros2Bridge, join: Callable[[], Peer]
) -> None:
    other = Ros2Bridge(running.link, node="/other", domain=bridge.domain)
    try:
        peer = join()
        peer.publish(peer_message(16, "peer"))
        wait_until(lambda: peer.reads_kbot(16))
    finally:
        other.close()
