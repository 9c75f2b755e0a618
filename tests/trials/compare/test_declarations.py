"""What robots declare differently: sensors, topics and frames."""

from __future__ import annotations

import math
from typing import TypeAlias

import pytest

from kbot.model import RobotModel
from kbot.model.load import load_robot_text
from kbot.trials.compare.declarations import Setting, declarations
from kbot.trials.compare.model_equality import behaviour, is_same

INERTIA = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'


def link(name: str, shape: str = "") -> str:
    return f'<link name="{name}"><inertial><mass value="1"/>{INERTIA}</inertial>{shape}</link>'


def wheel(side: str, y: float) -> str:
    tyre = (
        f'<collision><origin rpy="{math.pi / 2} 0 0"/><geometry><cylinder radius="0.05" length="0.02"/>'
        "</geometry></collision>"
    )
    return (
        f'<joint name="{side}_joint" type="continuous"><parent link="base_link"/><child link="{side}"/>'
        f'<origin xyz="0 {y} 0.05"/><axis xyz="0 1 0"/></joint>{link(side, tyre)}'
    )


LASER = """<gazebo reference="mast"><sensor name="laser" type="ray"><pose>0.1 0 0.2 0 0 0</pose>
  <update_rate>10</update_rate><visualize>false</visualize>
  <ray><scan><horizontal><samples>181</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal></scan>
  <range><min>0.1</min><max>8</max></range><noise><type>gaussian</type><stddev>0.01</stddev></noise></ray>
  <plugin filename="libgazebo_ros_ray_sensor.so" name="laser"><ros><remapping>~/out:=scan</remapping></ros>
  <frame_name>mast</frame_name></plugin></sensor></gazebo>"""
ROBOT = f"""<robot name="r">
{link("base_link", '<collision><geometry><box size="0.2 0.1 0.05"/></geometry></collision>')}
{wheel("left", 0.1)}{wheel("right", -0.1)}
<joint name="mast_joint" type="fixed"><parent link="base_link"/><child link="mast"/><origin xyz="0.2 0 0.3"/></joint>
{link("mast")}
{LASER}
<gazebo reference="mast"><sensor name="eye" type="camera"><camera><horizontal_fov>1.2</horizontal_fov>
  <image><width>320</width><height>240</height></image></camera></sensor></gazebo>
<gazebo reference="base_link"><sensor name="imu" type="imu"><update_rate>100</update_rate><imu><angular_velocity>
  <x><noise type="gaussian"><stddev>0.001</stddev></noise></x></angular_velocity></imu></sensor>
  <sensor name="gps" type="gps"><update_rate>5</update_rate></sensor>
  <sensor name="bumper" type="contact"><update_rate>50</update_rate></sensor>
  <sensor name="sonar" type="sonar"><sonar><min>0.02</min><max>2</max><radius>0.5</radius></sonar></sensor>
  <sensor name="compass" type="magnetometer"><update_rate>50</update_rate></sensor></gazebo>
<gazebo reference="mast_joint"><sensor name="wrench" type="force_torque"><update_rate>99</update_rate></sensor></gazebo>
<ros2_control name="c" type="system"><sensor name="range"><state_interface name="range"/>
  <param name="frame_id">mast</param><param name="update_rate">20</param></sensor></ros2_control>
<gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so"><leftJoint>left_joint</leftJoint>
  <rightJoint>right_joint</rightJoint><wheelSeparation>0.2</wheelSeparation><wheelDiameter>0.1</wheelDiameter>
  <commandTopic>cmd_vel</commandTopic><odometryTopic>odom</odometryTopic><odometryFrame>odom</odometryFrame>
  <robotBaseFrame>base_link</robotBaseFrame></plugin></gazebo>
</robot>"""  # noqa: E501

Row: TypeAlias = "tuple[str, str, Setting | None, Setting | None]"
QUARTER = math.pi / 2.0
CHANGES: dict[str, tuple[str, str, set[Row]]] = {
    "the lidar is turned on its link": (
        "<pose>0.1 0 0.2 0 0 0</pose>", f"<pose>0.1 0 0.2 0 0 {QUARTER}</pose>",
        {("sensor laser", "yaw", 0.0, QUARTER)},
    ),
    "its link is turned, and with it all its sensors": (
        '<origin xyz="0.2 0 0.3"/>', f'<origin xyz="0.2 0 0.3" rpy="0 0 {QUARTER}"/>',
        # the lidar is 0.1 m ahead of the mast's axis: at (0.3, 0), then at (0.2, 0.1)
        {
            ("sensor laser", "x", 0.3, 0.2), ("sensor laser", "y", 0.0, 0.1),
            ("sensor laser", "yaw", 0.0, QUARTER), ("sensor eye", "yaw", 0.0, QUARTER),
            ("sensor range", "yaw", 0.0, QUARTER), ("sensor wrench", "yaw", 0.0, QUARTER),
            ("frame mast", "yaw", 0.0, QUARTER),
        },
    ),
    "field of view": ("<max_angle>1.5<", "<max_angle>1.2<", {("sensor laser", "angle_max", 1.5, 1.2)}),
    "beams": ("<samples>181<", "<samples>91<", {("sensor laser", "samples", 181.0, 91.0)}),
    "range": ("<max>8<", "<max>4<", {("sensor laser", "range_max", 8.0, 4.0)}),
    "rate": ("<update_rate>10<", "<update_rate>5<", {("sensor laser", "rate", 10.0, 5.0)}),
    "noise": ("<stddev>0.01<", "<stddev>0.02<", {("sensor laser", "noise stddev", 0.01, 0.02)}),
    "topic": ("~/out:=scan", "~/out:=front", {("sensor laser", "topic", "/scan", "/front")}),
    "frame": (
        "<frame_name>mast<", "<frame_name>base_link<", {("sensor laser", "frame", "mast", "base_link")}
    ),
    "a setting of the lidar that KBot does not use": (
        "<visualize>false<", "<visualize>true<", {("sensor laser", "visualize", "false", "true")}
    ),
    "no lidar": (LASER, "", {("sensor laser", "exists", "yes", "no")}),
    "camera": ("<horizontal_fov>1.2<", "<horizontal_fov>1.4<", {("sensor eye", "fov", 1.2, 1.4)}),
    "picture": ("<width>320<", "<width>640<", {("sensor eye", "width", 320.0, 640.0)}),
    "IMU": (
        "<stddev>0.001<", "<stddev>0.002<", {("sensor imu", "gyroscope stddev", 0.001, 0.002)}
    ),
    "IMU's rate": ("<update_rate>100<", "<update_rate>200<", {("sensor imu", "rate", 100.0, 200.0)}),
    "GPS": (
        'type="gps"><update_rate>5<', 'type="gps"><update_rate>1<', {("sensor gps", "rate", 5.0, 1.0)}
    ),
    "contacts": (
        'type="contact"><update_rate>50<', 'type="contact"><update_rate>25<',
        {("sensor bumper", "rate", 50.0, 25.0)},
    ),
    # the cone's full angle is 2 atan(radius / max)
    "sonar": (
        "<radius>0.5<", "<radius>2<",
        {("sensor sonar", "field_of_view", 2.0 * math.atan(0.25), QUARTER)},
    ),
    "force-torque": ("<update_rate>99<", "<update_rate>9<", {("sensor wrench", "rate", 99.0, 9.0)}),
    "a sensor of ros2_control": (
        '"update_rate">20<', '"update_rate">30<', {("sensor range", "rate", 20.0, 30.0)}
    ),
    "a kind of sensor that KBot does not simulate": (
        'type="magnetometer"><update_rate>50<', 'type="magnetometer"><update_rate>60<',
        {("sensor compass", "update_rate", 50.0, 60.0)},
    ),
    "odometry's topic": (
        "<odometryTopic>odom<", "<odometryTopic>wheel_odom<",
        {("topic /odom", "exists", "yes", "no"), ("topic /wheel_odom", "exists", "no", "yes")},
    ),
    "odometry's frame": (
        "<odometryFrame>odom<", "<odometryFrame>map<",
        {("topic /odom", "frame", "odom", "map"),
         ("odometry on /tf", "frames", "base_link in odom", "base_link in map")},
    ),
    # robot_state_publisher publishes on /tf in both
    "odometry's transform": (
        "<odometryFrame>", "<publishOdomTF>false</publishOdomTF><odometryFrame>",
        {("odometry on /tf", "exists", "yes", "no")},
    ),
    "command's topic": (
        "<commandTopic>cmd_vel<", "<commandTopic>drive<",
        {("topic /cmd_vel", "exists", "yes", "no"), ("topic /drive", "exists", "no", "yes")},
    ),
}  # fmt: skip


def robot(text: str = ROBOT) -> RobotModel:
    return load_robot_text(text, "robot.urdf").require()


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_a_declaration_is_listed(name: str) -> None:
    old, new, expected = CHANGES[name]
    assert ROBOT.count(old) == 1
    before, after = robot(), robot(ROBOT.replace(old, new))
    assert not is_same(behaviour(before), behaviour(after))
    found = {
        (each.part, each.setting): (each.before, each.after)
        for each in declarations(before).differences(declarations(after))
    }
    assert found.keys() == {(part, setting) for part, setting, _, _ in expected}
    for part, setting, *values in expected:
        for value, expected_value in zip(found[part, setting], values, strict=True):
            close = isinstance(expected_value, float)
            assert value == (pytest.approx(expected_value, abs=1e-9) if close else expected_value)


def test_equal_declarations_do_not_differ() -> None:
    # 3.141592653589793 and its negative are the same angle
    half = f'<origin xyz="0.2 0 0.3" rpy="0 0 {math.pi}"/>'
    one = ROBOT.replace('<origin xyz="0.2 0 0.3"/>', half)
    other = one.replace(f'"0 0 {math.pi}"', f'"0.0 0 -{math.pi}"').replace("<max>8<", "<max>8.0<")
    assert declarations(robot(one)).differences(declarations(robot(other))) == ()
