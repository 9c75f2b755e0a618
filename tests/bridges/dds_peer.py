"""A DDS peer in its own process. It declares its own types, and the DDS library encodes them.

It drives until the odometry shows that the robot moves, and prints what it received as JSON.
"""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant, BuiltinTopicDcpsPublication
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

GEOMETRY, STD, NAV = "geometry_msgs::msg::dds_::", "std_msgs::msg::dds_::", "nav_msgs::msg::dds_::"


@dataclass
class Vector3(IdlStruct, typename=GEOMETRY + "Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Point(IdlStruct, typename=GEOMETRY + "Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename=GEOMETRY + "Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Twist(IdlStruct, typename=GEOMETRY + "Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename=STD + "Header_"):
    stamp: Time
    frame_id: str


@dataclass
class TwistStamped(IdlStruct, typename=GEOMETRY + "TwistStamped_"):
    header: Header
    twist: Twist


@dataclass
class Pose(IdlStruct, typename=GEOMETRY + "Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename=GEOMETRY + "PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class TwistWithCovariance(IdlStruct, typename=GEOMETRY + "TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename=NAV + "Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class String(IdlStruct, typename=STD + "String_"):
    data: str


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


def main(number: int, config: str, stamped: bool) -> None:
    domain = Domain(number, config)
    participant = DomainParticipant(number)
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    late = Qos(reliable, Policy.Durability.TransientLocal)
    odometry = DataReader(participant, Topic(participant, "rt/odom", Odometry), qos=Qos(reliable))
    description = DataReader(participant, Topic(participant, "rt/robot_description", String), qos=late)
    every = Qos(reliable, Policy.Durability.TransientLocal, Policy.History.KeepAll)  # as in rmw
    graph = DataReader(
        participant, Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo), qos=every
    )
    # a node of ROS 2 publishes its own entry; KBot waits for it
    entry = DataWriter(
        participant, Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo), qos=late
    )
    own = NodeEntitiesInfo("/", "dds_peer", [], [])
    entry.write(ParticipantEntitiesInfo(Gid(list(participant.guid.bytes)), [own]))
    kind = TwistStamped if stamped else Twist
    drive = DataWriter(
        participant, Topic(participant, "rt/cmd_vel", kind), qos=Qos(Policy.Reliability.BestEffort)
    )
    command = Twist(Vector3(0.3, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))
    found: dict = {}
    end = time.monotonic() + 60
    while time.monotonic() < end and not (
        found.get("speed", 0.0) > 0.1 and found.get("description") and found.get("node")
    ):
        drive.write(TwistStamped(Header(Time(0, 0), ""), command) if stamped else command)
        time.sleep(0.05)
        for message in odometry.take(10):
            found["speed"] = message.twist.twist.linear.x
            found["frames"] = [message.header.frame_id, message.child_frame_id]
            found["variance"] = message.pose.covariance[35]
        for message in description.take(10):
            found["description"] = message.data
        for message in graph.take(10):
            for node in message.node_entities_info_seq:
                if node.node_name != own.node_name:
                    found["node"] = node.node_namespace + node.node_name
                    found["writers"] = [bytes(gid.data).hex() for gid in node.writer_gid_seq]
                    found["readers"] = len(node.reader_gid_seq)
    publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication).take(100)
    participants = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant).take(100)
    found["topics"] = {
        p.topic_name: bytes(p.qos[Policy.Userdata].data).decode()
        for p in publications
        if p.qos[Policy.Userdata]
    }
    found["guids"] = {p.topic_name: p.key.bytes.hex() for p in publications}
    found["enclaves"] = [
        bytes(p.qos[Policy.Userdata].data).decode() for p in participants if p.qos[Policy.Userdata]
    ]
    sys.stdout.write(json.dumps(found))
    del domain


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], sys.argv[3] == "stamped")
