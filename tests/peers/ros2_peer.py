"""A ROS 2 node with rclpy. It drives until it has received everything, and prints what it found as JSON."""

import ctypes
import json
import sys
import time
from collections import Counter

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import ByteMultiArray, String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SPEED = 0.2


def tf_message() -> type:
    """A type with the name of tf2_msgs/TFMessage, which the wheels lack: ByteMultiArray under another name.

    Only raw messages can be received with it. The first two fields of rosidl's
    message_type_support_callbacks_t are the names of the package and of the message.
    """

    class TypeSupport(ctypes.Structure):
        _fields_ = (("identifier", ctypes.c_char_p), ("names", ctypes.POINTER(ctypes.c_char_p * 2)))

    library = ctypes.CDLL("libstd_msgs__rosidl_typesupport_fastrtps_c.so")
    package = "rosidl_typesupport_fastrtps_c"
    handle = getattr(library, f"{package}__get_message_type_support_handle__std_msgs__msg__ByteMultiArray")
    handle.restype = ctypes.POINTER(TypeSupport)
    handle().contents.names.contents[:] = [b"tf2_msgs::msg", b"TFMessage"]
    return ByteMultiArray


def main(seconds: float) -> None:
    rclpy.init()
    node = Node("rclpy_peer")
    found: dict = {"speed": 0.0, "tf_static": "", "description": ""}
    counts: Counter[str] = Counter()

    def moved(message: Odometry) -> None:
        counts["/odom"] += 1
        found["speed"] = max(found["speed"], message.twist.twist.linear.x)

    def joints(message: JointState) -> None:
        counts["/joint_states"] += 1
        found["joints"] = list(message.name)

    def clock(_: Clock) -> None:
        counts["/clock"] += 1

    node.create_subscription(Odometry, "/odom", moved, 10)
    node.create_subscription(JointState, "/joint_states", joints, 10)
    node.create_subscription(Clock, "/clock", clock, qos_profile_sensor_data)
    node.create_subscription(
        String, "/robot_description", lambda message: found.update(description=message.data), LATCHED
    )
    node.create_subscription(
        tf_message(), "/tf_static", lambda data: found.update(tf_static=data.hex()), LATCHED, raw=True
    )
    drive = node.create_publisher(Twist, "/cmd_vel", 10)
    command = Twist()
    command.linear.x = SPEED
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.02)
        drive.publish(command)
        found["nodes"] = [
            f"{space.rstrip('/')}/{name}" for name, space in node.get_node_names_and_namespaces()
        ]
        is_moving = found["speed"] > SPEED / 2 and found["tf_static"] and found["description"]
        if is_moving and len(counts) == 3 and "/kbot" in found["nodes"]:
            break
    found["topics"] = dict(node.get_topic_names_and_types())
    found["by_kbot"] = {}
    if "/kbot" in found["nodes"]:
        found["by_kbot"] = dict(node.get_publisher_names_and_types_by_node("kbot", "/"))
    found["counts"] = counts
    sys.stdout.write(json.dumps(found))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(float(sys.argv[1]))
