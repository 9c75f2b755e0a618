"""A node of zenoh-ros2-sdk that subscribes, drives and calls a service.

It prints the results as JSON. Arguments: the router's port, and the hashes of Twist and Odometry.
"""

import json
import sys
import time

from zenoh_ros2_sdk import ROS2Publisher, ROS2ServiceClient, ROS2Subscriber
from zenoh_ros2_sdk.qos import QosDurability, QosProfile

from kbot.record.encodings.types import ros2_definition

port, twist_hash, odometry_hash = int(sys.argv[1]), sys.argv[2], sys.argv[3]
place = {"router_ip": "127.0.0.1", "router_port": port}
odometry, descriptions = [], []
# the library computes the hashes of types without nested types: String, and the service's
first = ROS2Subscriber(
    "/odom",
    "nav_msgs/msg/Odometry",
    odometry.append,
    msg_definition=ros2_definition("nav_msgs/msg/Odometry")[0],
    type_hash=odometry_hash,
    **place,
)
late = ROS2Subscriber(
    "/robot_description",
    "std_msgs/msg/String",
    descriptions.append,
    msg_definition="string data",
    qos=QosProfile(durability=QosDurability.TRANSIENT_LOCAL),
    **place,
)
driver = ROS2Publisher(
    "/cmd_vel",
    "geometry_msgs/msg/Twist",
    msg_definition=ros2_definition("geometry_msgs/msg/Twist")[0],
    type_hash=twist_hash,
    **place,
)
vector = driver.session_mgr.store.types["geometry_msgs/msg/Vector3"]
end = time.monotonic() + 60
while time.monotonic() < end and not (odometry and descriptions and odometry[-1].twist.twist.linear.x > 0.15):
    driver.publish(linear=vector(x=0.2, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))
    time.sleep(0.05)
client = ROS2ServiceClient(
    "/gazebo/delete_model",
    "gazebo_msgs/srv/DeleteModel",
    request_definition="string model_name",
    response_definition="bool success\nstring status_message",
    **place,
)
answer = client.call(model_name="ghost")
tokens = [str(reply.ok.key_expr) for reply in driver.session_mgr.session.liveliness().get("@ros2_lv/**")]
sys.stdout.write(
    json.dumps(
        {
            "speed": odometry[-1].twist.twist.linear.x if odometry else None,
            "frame": odometry[-1].header.frame_id if odometry else None,
            "description": descriptions[0].data if descriptions else None,
            "answer": [answer.success, answer.status_message] if answer else None,
            "tokens": tokens,
        }
    )
)
for entity in (first, late, driver, client):
    entity.close()
driver.session_mgr.session.close()
