"""Typed messages with ROS's names, a bus for topics within the process, and the simulated clock."""

from kbot.messages.bus import Bus, Publisher, Subscription
from kbot.messages.clock import Clock, Timer
from kbot.messages.types import (
    ClockMessage,
    Header,
    JointState,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    String,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    Vector3,
)

__all__ = [
    "Bus",
    "Clock",
    "ClockMessage",
    "Header",
    "JointState",
    "Odometry",
    "Point",
    "Pose",
    "PoseWithCovariance",
    "Publisher",
    "Quaternion",
    "String",
    "Subscription",
    "TFMessage",
    "Time",
    "Timer",
    "Transform",
    "TransformStamped",
    "Twist",
    "TwistStamped",
    "TwistWithCovariance",
    "Vector3",
]
