# ruff: noqa: E501 - XML and patterns are easier to read on one line
"""Clean robots for tests to damage: a rover with sensors and an arm, in three sizes and with three drives."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Rover:
    """Sizes in metres; `driver` is "classic", "gz" or "ros2_control"."""

    name: str = "rover"
    length: float = 0.4
    width: float = 0.3
    height: float = 0.1
    radius: float = 0.08
    tread: float = 0.04
    density: float = 600.0
    driver: str = "classic"


ROVERS = (
    Rover(),
    Rover("small", 0.2, 0.16, 0.04, 0.03, 0.015, 900.0, "gz"),
    Rover("large", 1.0, 0.7, 0.25, 0.2, 0.1, 300.0, "ros2_control"),
)


def _box(mass: float, x: float, y: float, z: float) -> str:
    return (
        f'<inertia ixx="{mass * (y * y + z * z) / 12:.9g}" ixy="0" ixz="0" '
        f'iyy="{mass * (x * x + z * z) / 12:.9g}" iyz="0" izz="{mass * (x * x + y * y) / 12:.9g}"/>'
    )


def _roller(mass: float, r: float, h: float) -> str:
    across = mass * (3 * r * r + h * h) / 12
    return f'<inertia ixx="{across:.9g}" ixy="0" ixz="0" iyy="{across:.9g}" iyz="0" izz="{mass * r * r / 2:.9g}"/>'


def _ball(mass: float, r: float) -> str:
    i = 0.4 * mass * r * r
    return f'<inertia ixx="{i:.9g}" ixy="0" ixz="0" iyy="{i:.9g}" iyz="0" izz="{i:.9g}"/>'


def rover(robot: Rover = ROVERS[0]) -> str:
    """The rover's xacro: flat, so that each line of it is the line of a finding."""
    r, tread = robot.radius, robot.tread
    base_mass = robot.density * robot.length * robot.width * robot.height
    wheel_mass = 1200.0 * math.pi * r * r * tread
    ball = r / 2
    ball_mass = 1100.0 * 4 / 3 * math.pi * ball**3
    separation = robot.width + tread + 0.01
    bottom = r + 0.2 * robot.height  # of the chassis, above the ground
    middle = bottom + robot.height / 2
    arm = 0.4 * robot.length
    arm_mass = 800.0 * arm * 0.02 * 0.02
    total = base_mass + 2 * wheel_mass + 2 * ball_mass
    effort = 9.81 * total * r
    wheels = "\n".join(_wheel(robot, side, sign) for side, sign in (("left", 1), ("right", -1)))
    casters = "\n".join(
        f"""  <link name="{end}_ball">
    <visual>
      <geometry> <sphere radius="{ball:.6g}"/> </geometry>
    </visual>
    <collision>
      <geometry> <sphere radius="{ball:.6g}"/> </geometry>
    </collision>
    <inertial>
      <mass value="{ball_mass:.6g}"/>
      {_ball(ball_mass, ball)}
    </inertial>
  </link>
  <joint name="{end}_ball_joint" type="fixed">
    <origin xyz="{sign * 0.4 * robot.length:.6g} 0 {ball - middle:.9g}" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="{end}_ball"/>
  </joint>
  <gazebo reference="{end}_ball">
    <mu1>0.0</mu1>
    <mu2>0.0</mu2>
  </gazebo>"""
        for end, sign in (("front", 1), ("rear", -1))
    )
    return f"""<?xml version="1.0"?>
<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="{robot.name}">
  <xacro:arg name="arm_speed" default="1.5"/>
  <xacro:property name="radius" value="{r:.6g}"/>
  <xacro:property name="has_arm" value="true"/>
  <material name="grey">
    <color rgba="0.5 0.5 0.5 1"/>
  </material>
  <xacro:macro name="marker" params="on size">
    <link name="${{on}}_marker">
      <visual>
        <geometry> <box size="${{size}} ${{size}} ${{size}}"/> </geometry>
      </visual>
    </link>
    <joint name="${{on}}_marker_joint" type="fixed">
      <parent link="${{on}}"/>
      <child link="${{on}}_marker"/>
    </joint>
  </xacro:macro>
  <link name="base_footprint"/>
  <link name="base_link">
    <visual>
      <geometry> <box size="{robot.length:.6g} {robot.width:.6g} {robot.height:.6g}"/> </geometry>
      <material name="grey"/>
    </visual>
    <collision>
      <geometry> <box size="{robot.length:.6g} {robot.width:.6g} {robot.height:.6g}"/> </geometry>
    </collision>
    <inertial>
      <mass value="{base_mass:.6g}"/>
      {_box(base_mass, robot.length, robot.width, robot.height)}
    </inertial>
  </link>
  <joint name="base_joint" type="fixed">
    <origin xyz="0 0 {middle:.9g}" rpy="0 0 0"/>
    <parent link="base_footprint"/>
    <child link="base_link"/>
  </joint>
  <xacro:marker on="base_link" size="0.01"/>
{wheels.replace("@SEPARATION@", f"{separation / 2:.9g}").replace("@DROP@", f"{r - middle:.9g}").replace("@EFFORT@", f"{effort:.6g}").replace("@MASS@", f"{wheel_mass:.6g}")}
{casters}
  <xacro:if value="${{has_arm}}">
  <link name="arm_link">
    <visual>
      <origin xyz="0 0 {arm / 2:.6g}" rpy="0 0 0"/>
      <geometry> <box size="0.02 0.02 {arm:.6g}"/> </geometry>
    </visual>
    <collision>
      <origin xyz="0 0 {arm / 2:.6g}" rpy="0 0 0"/>
      <geometry> <box size="0.02 0.02 {arm:.6g}"/> </geometry>
    </collision>
    <inertial>
      <origin xyz="0 0 {arm / 2:.6g}" rpy="0 0 0"/>
      <mass value="{arm_mass:.6g}"/>
      {_box(arm_mass, 0.02, 0.02, arm)}
    </inertial>
  </link>
  <joint name="arm_joint" type="revolute">
    <origin xyz="{0.3 * robot.length:.6g} 0 {robot.height / 2 + 0.01:.6g}" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="arm_link"/>
    <axis xyz="0 1 0"/>
    <limit lower="-0.2" upper="1.57" effort="10" velocity="$(arg arm_speed)"/>
    <dynamics damping="0.1" friction="0.01"/>
  </joint>
  </xacro:if>
  <link name="slider_link">
    <visual>
      <geometry> <box size="0.03 0.02 0.02"/> </geometry>
    </visual>
    <collision>
      <geometry> <box size="0.03 0.02 0.02"/> </geometry>
    </collision>
    <inertial>
      <mass value="0.01"/>
      {_box(0.01, 0.03, 0.02, 0.02)}
    </inertial>
  </link>
  <joint name="slider_joint" type="prismatic">
    <origin xyz="0 0 {robot.height / 2 + 0.02:.6g}" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="slider_link"/>
    <axis xyz="0 0 1"/>
    <limit lower="0" upper="0.01" effort="5" velocity="0.1"/>
    <mimic joint="arm_joint" multiplier="0.005" offset="0"/>
  </joint>
  <link name="camera_link"/>
  <joint name="camera_joint" type="fixed">
    <origin xyz="{robot.length / 2:.6g} 0 0" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="camera_link"/>
  </joint>
  <link name="camera_optical_link"/>
  <joint name="camera_optical_joint" type="fixed">
    <origin xyz="0 0 0" rpy="-1.570796327 0 -1.570796327"/>
    <parent link="camera_link"/>
    <child link="camera_optical_link"/>
  </joint>
  <gazebo reference="camera_link">
    <sensor name="camera" type="camera">
      <update_rate>30</update_rate>
      <gz_frame_id>camera_optical_link</gz_frame_id>
    </sensor>
  </gazebo>
  <link name="lidar_link"/>
  <joint name="lidar_joint" type="fixed">
    <origin xyz="{-0.3 * robot.length:.6g} 0 {robot.height / 2 + 0.9 * arm + 0.2:.6g}" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="lidar_link"/>
  </joint>
  <gazebo reference="lidar_link">
    <sensor name="lidar" type="gpu_lidar">
      <topic>scan</topic>
      <gz_frame_id>lidar_link</gz_frame_id>
      <lidar>
        <scan>
          <horizontal> <samples>360</samples> <min_angle>-3.14</min_angle> <max_angle>3.14</max_angle> </horizontal>
        </scan>
        <range> <min>0.05</min> <max>8</max> </range>
      </lidar>
    </sensor>
  </gazebo>
  <transmission name="arm_transmission">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="arm_joint">
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint>
    <actuator name="arm_motor"> <mechanicalReduction>1</mechanicalReduction> </actuator>
  </transmission>
{_driver(robot, separation)}
</robot>
"""


def _wheel(robot: Rover, side: str, sign: int) -> str:
    mass = 1200.0 * math.pi * robot.radius**2 * robot.tread
    return f"""  <link name="{side}_wheel">
    <visual>
      <origin xyz="0 0 0" rpy="1.570796327 0 0"/>
      <geometry> <cylinder radius="{robot.radius:.6g}" length="{robot.tread:.6g}"/> </geometry>
    </visual>
    <collision>
      <origin xyz="0 0 0" rpy="1.570796327 0 0"/>
      <geometry> <cylinder radius="${{radius}}" length="{robot.tread:.6g}"/> </geometry>
    </collision>
    <inertial>
      <origin xyz="0 0 0" rpy="1.570796327 0 0"/>
      <mass value="@MASS@"/>
      {_roller(mass, robot.radius, robot.tread)}
    </inertial>
  </link>
  <joint name="{side}_wheel_joint" type="continuous">
    <origin xyz="0 {"" if sign > 0 else "-"}@SEPARATION@ @DROP@" rpy="0 0 0"/>
    <parent link="base_link"/>
    <child link="{side}_wheel"/>
    <axis xyz="0 1 0"/>
    <limit effort="@EFFORT@" velocity="20"/>
    <dynamics damping="0.01" friction="0"/>
  </joint>"""


def _driver(robot: Rover, separation: float) -> str:
    if robot.driver == "ros2_control":
        joints = "\n".join(
            f"""    <joint name="{side}_wheel_joint">
      <command_interface name="velocity"/>
      <state_interface name="position"/>
    </joint>"""
            for side in ("left", "right")
        )
        return f"""  <ros2_control name="{robot.name}" type="system">
    <hardware> <plugin>gz_ros2_control/GazeboSimSystem</plugin> </hardware>
{joints}
  </ros2_control>"""
    if robot.driver == "gz":
        return f"""  <gazebo>
    <plugin name="gz::sim::systems::DiffDrive" filename="gz-sim-diff-drive-system">
      <left_joint>left_wheel_joint</left_joint>
      <right_joint>right_wheel_joint</right_joint>
      <wheel_separation>{separation:.9g}</wheel_separation>
      <wheel_radius>{robot.radius:.6g}</wheel_radius>
      <frame_id>odom</frame_id>
      <child_frame_id>base_footprint</child_frame_id>
    </plugin>
  </gazebo>"""
    return f"""  <gazebo>
    <plugin name="drive" filename="libgazebo_ros_diff_drive.so">
      <leftJoint>left_wheel_joint</leftJoint>
      <rightJoint>right_wheel_joint</rightJoint>
      <wheelSeparation>{separation:.9g}</wheelSeparation>
      <wheelDiameter>{2 * robot.radius:.6g}</wheelDiameter>
      <odometryFrame>odom</odometryFrame>
      <robotBaseFrame>base_footprint</robotBaseFrame>
      <publishWheelTF>false</publishWheelTF>
    </plugin>
  </gazebo>"""
