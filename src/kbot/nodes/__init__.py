"""ROS's standard nodes as plain objects with inputs, outputs and a rate."""

from kbot.nodes.joint_state_publisher import JointStatePublisher, with_dependent_joints
from kbot.nodes.robot_state_publisher import RobotStatePublisher

__all__ = ["JointStatePublisher", "RobotStatePublisher", "with_dependent_joints"]
