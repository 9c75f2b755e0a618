"""An endpoint of a ROS 1 topic: its name, type, definition and connection header."""

from __future__ import annotations

from kbot.record.encodings.types import ros1_definition
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.ros1.tcpros import check_header


class TopicEndpoint:
    """The base class of publishers and subscribers of a topic."""

    def __init__(self, link: PeerLink, topic: Topic, node: str) -> None:
        self.topic = topic
        self.type_name = topic.type_name.replace("/msg/", "/")
        self._definition, self._md5 = ros1_definition(topic.type_name)
        self._link, self._node = link, node

    def header(self, **more: str) -> dict[str, str]:
        """The fields of the connection header."""
        return {
            "callerid": self._node,
            "md5sum": self._md5,
            "message_definition": self._definition,
            "topic": self.topic.name,
            "type": self.type_name,
            **more,
        }

    def check(self, header: dict[str, str]) -> None:
        """Raises ProtocolError: the other side has another topic, type or definition."""
        check_header(header, self.topic.name, self.type_name, self._md5)
