"""ROS's standard nodes as plain objects with inputs, outputs and a rate."""

from kbot.ros.nodes.joint_state_publisher import JointStatePublisher, with_dependent_joints
from kbot.tf.robot_state_publisher import RobotStatePublisher

__all__ = ["JointStatePublisher", "RobotStatePublisher", "with_dependent_joints"]
