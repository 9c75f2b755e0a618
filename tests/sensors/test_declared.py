"""Sensors declared in descriptions for Gazebo Classic, gz and ros2_control."""

import math

import numpy as np
import pytest

from kbot.messages.sensing import Image, LaserScan
from kbot.model.load import load_robot, load_robot_text
from kbot.sensors import Contact, ForceTorque, Gps, GroundTruth, Imu, Lidar, Range
from kbot.sensors.declared import declared_sensors, mount_declared, mount_on_others
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import DescriptionError, KbotError

CLASSIC = """
<gazebo reference="{link}">
  <sensor type="ray" name="head_hokuyo_sensor">
    <pose>0 0 0.1 0 0 0</pose>
    <visualize>false</visualize>
    <update_rate>40</update_rate>
    <ray>
      <scan><horizontal>
        <samples>720</samples><resolution>1</resolution>
        <min_angle>-1.570796</min_angle><max_angle>1.570796</max_angle>
      </horizontal></scan>
      <range><min>0.10</min><max>30.0</max><resolution>0.01</resolution></range>
      <noise><type>gaussian</type><mean>0.0</mean><stddev>0.01</stddev></noise>
    </ray>
    <plugin name="gazebo_ros_head_hokuyo_controller" filename="libgazebo_ros_laser.so">
      <topicName>/laser/scan</topicName><frameName>base_link</frameName>
    </plugin>
  </sensor>
  <sensor type="imu" name="imu_sensor">
    <update_rate>100</update_rate>
    <imu>
      <angular_velocity><x><noise type="gaussian"><stddev>0.02</stddev>
        <bias_stddev>0.001</bias_stddev></noise></x>
      </angular_velocity>
      <linear_acceleration><x><noise type="gaussian"><stddev>0.3</stddev></noise></x></linear_acceleration>
    </imu>
  </sensor>
  <sensor type="ray" name="ir_front">
    <ray><scan><horizontal><samples>5</samples><min_angle>-0.1</min_angle><max_angle>0.1</max_angle></horizontal>
    </scan><range><min>0.02</min><max>0.4</max></range></ray>
    <plugin name="ir" filename="libgazebo_ros_range.so">
      <radiation>infrared</radiation><topicName>ir</topicName></plugin>
  </sensor>
  <sensor type="sonar" name="sonar"><sonar><min>0.02</min><max>2.0</max><radius>0.3</radius></sonar></sensor>
  <sensor type="contact" name="bumper"><contact><collision>c</collision></contact></sensor>
</gazebo>
"""

GZ = """
<gazebo reference="base_link">
  <sensor name="lidar" type="gpu_lidar">
    <topic>scan</topic><update_rate>10</update_rate><gz_frame_id>base_link</gz_frame_id>
    <lidar>
      <scan><horizontal><samples>640</samples>
        <min_angle>-1.4</min_angle><max_angle>1.4</max_angle></horizontal>
      <vertical><samples>16</samples><min_angle>-0.26</min_angle><max_angle>0.26</max_angle></vertical></scan>
      <range><min>0.08</min><max>inf</max></range>
    </lidar>
  </sensor>
  <sensor name="gps" type="navsat"><update_rate>1</update_rate></sensor>
  <sensor name="ros2" type="ray"><update_rate>5</update_rate>
    <plugin name="p" filename="libgazebo_ros_ray_sensor.so"><ros>
    <remapping>~/out:=front/scan</remapping></ros>
    <frame_name>base_link</frame_name></plugin></sensor>
</gazebo>
<ros2_control name="r" type="system">
  <sensor name="imu_control">
    <state_interface name="orientation.x"/><state_interface name="angular_velocity.x"/>
  <param name="frame_id">base_link</param></sensor>
  <sensor name="fts"><state_interface name="force.x"/></sensor>
  <sensor name="tof"><state_interface name="range"/><param name="min_range">0.1</param>
    <param name="max_range">3.0</param><param name="update_rate">20</param></sensor>
  <sensor name="mocap"><state_interface name="position.x"/><state_interface name="orientation.w"/></sensor>
  <sensor name="fix"><state_interface name="latitude"/><state_interface name="longitude"/></sensor>
  <sensor name="wet"><state_interface name="humidity"/></sensor>
</ros2_control>
"""


def _robot(inside):
    text = f"""<robot name="r"><link name="base_link">
      <inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><box size=".2 .2 .1"/></geometry></collision></link>{inside}</robot>"""
    return load_robot_text(text, "r.urdf").require()


def test_sensors_of_gazebo_classic_are_read():
    declared = declared_sensors(_robot(CLASSIC.format(link="base_link")))
    assert not declared.diagnostics
    scan, imu, infrared, sonar, bumper = declared.specs
    assert isinstance(scan, Lidar)
    assert (scan.samples, scan.rate, scan.range_min, scan.range_max) == (720, 40.0, 0.1, 30.0)
    assert (scan.topic, scan.frame, scan.noise.stddev) == ("/laser/scan", "base_link", 0.01)
    assert scan.pose.translation.tolist() == [0.0, 0.0, 0.1]
    assert scan.increment == pytest.approx(math.pi / 719, rel=1e-6)
    assert isinstance(imu, Imu)
    assert (imu.rate, imu.gyroscope.stddev, imu.gyroscope.bias_stddev) == (100.0, 0.02, 0.001)
    assert imu.accelerometer.stddev == 0.3
    assert isinstance(infrared, Range)
    assert (infrared.infrared, infrared.range_max, infrared.topic) == (True, 0.4, "/ir")
    assert isinstance(sonar, Range)
    assert sonar.field_of_view == pytest.approx(2 * math.atan(0.15))
    assert isinstance(bumper, Contact)


def test_sensors_of_gz_and_ros2_control_are_read():
    declared = declared_sensors(_robot(GZ))
    lidar, gps, remapped, imu, distance, place, fix = declared.specs
    assert isinstance(lidar, Lidar)
    assert (lidar.rows, lidar.samples, lidar.topic, lidar.range_max) == (16, 640, "scan", 1e6)
    assert isinstance(gps, Gps)
    assert gps.rate == 1.0
    assert (remapped.topic, remapped.frame) == ("/front/scan", "base_link")
    assert isinstance(imu, Imu)
    assert imu.link == "base_link"
    assert isinstance(distance, Range)
    assert (distance.range_min, distance.range_max, distance.rate) == (0.1, 3.0, 20.0)
    assert isinstance(place, GroundTruth)
    assert isinstance(fix, Gps)
    # the base has no parent joint to measure a force in
    assert [d.code for d in declared.diagnostics] == ["W140", "W140"]
    assert "has no parent joint" in declared.diagnostics[0].message
    assert "humidity" in declared.diagnostics[1].message


LASER = """<gazebo reference="base_link"><sensor type="ray" name="front"><update_rate>10</update_rate>
  <ray><range><min>0.1</min><max>9</max></range></ray>
  <plugin name="laser" filename="libgazebo_ros_{kind}.so">{inside}</plugin></sensor></gazebo>"""


@pytest.mark.parametrize(
    ("kind", "inside", "at_root", "in_fleet"),
    [
        # ROS 1: spawn_model's namespace applies to plugins without one. Absolute names do not change
        ("laser", "<topicName>scan</topicName>", "/scan", "/fleet/scan"),
        ("laser", "<topicName>/scan</topicName>", "/scan", "/scan"),
        (
            "laser",
            "<robotNamespace>/bot/</robotNamespace><topicName>scan</topicName>",
            "/bot/scan",
            "/bot/scan",
        ),
        ("laser", "<robotNamespace>/</robotNamespace><topicName>scan</topicName>", "/scan", "/scan"),
        ("laser", "<robotNamespace/><topicName>scan</topicName>", "/rover/scan", "/rover/scan"),
        # ROS 2: `~` is the plugin's name. spawn_entity's namespace overrides that of the plugin
        ("ray_sensor", "<ros/>", "/laser/out", "/fleet/laser/out"),
        ("ray_sensor", "<ros><namespace>bot</namespace></ros>", "/bot/laser/out", "/fleet/laser/out"),
        (
            "ray_sensor",
            "<ros><namespace>/bot</namespace><remapping>~/out:=scan</remapping></ros>",
            "/bot/scan",
            "/fleet/scan",
        ),
        ("ray_sensor", "<ros><remapping>~/out:=/scan</remapping></ros>", "/scan", "/scan"),
        ("ray_sensor", "<ros><argument>~/out:=scan</argument></ros>", "/scan", "/fleet/scan"),
    ],
)
def test_topic_names_equal_those_of_gazebo_plugins(kind, inside, at_root, in_fleet):
    robot = _robot(LASER.format(kind=kind, inside=inside))
    for naming, topic in ((Naming("rover"), at_root), (Naming("rover", "fleet"), in_fleet)):
        simulation = Simulation(robot, naming=naming)
        mount_declared(simulation)
        assert topic in simulation.bus.topics


CAMERA = """<gazebo reference="base_link"><sensor type="{kind}" name="eye"><update_rate>10</update_rate>
  {topic}<camera><clip><near>0.1</near><far>9</far></clip></camera>
  <plugin name="eyes" filename="{plugin}">{inside}</plugin></sensor></gazebo>"""


@pytest.mark.parametrize(
    ("kind", "topic", "plugin", "inside", "topics"),
    [
        (
            "camera", "", "libgazebo_ros_camera.so",
            "<cameraName>rgb</cameraName><imageTopicName>picture</imageTopicName>"
            "<cameraInfoTopicName>about</cameraInfoTopicName>",
            ("/rgb/picture", "/rgb/about", None),
        ),
        (
            "depth", "", "libgazebo_ros_openni_kinect.so",
            "<robotNamespace>bot</robotNamespace><cameraName>cam</cameraName>"
            "<imageTopicName>/cam/rgb/image_raw</imageTopicName>"
            "<depthImageTopicName>depth/raw</depthImageTopicName>",
            ("/cam/rgb/image_raw", "/bot/cam/camera_info", "/bot/cam/depth/raw"),
        ),
        (
            "depth", "", "libgazebo_ros_camera.so",
            "<ros><namespace>bot</namespace><remapping>cam/image_raw:=rgb/image</remapping></ros>"
            "<camera_name>cam</camera_name>",
            ("/bot/rgb/image", "/bot/cam/camera_info", "/bot/cam/depth/image_raw"),
        ),
        ("camera", "", "libgazebo_ros_camera.so", "<ros/>", ("/eye/image_raw", "/eye/camera_info", None)),
        ("camera", "<topic>front/see</topic>", "other", "", ("front/see", "front/camera_info", None)),
        ("rgbd_camera", "<topic>cam</topic>", "other", "", ("cam/image", None, "cam/depth_image")),
        ("depth_camera", "<topic>cam</topic>", "other", "", ("cam/image", "camera_info", "cam")),
    ],
)  # fmt: skip
def test_camera_topics_equal_those_of_gazebo_plugins(kind, topic, plugin, inside, topics):
    (camera,) = declared_sensors(
        _robot(CAMERA.format(kind=kind, topic=topic, plugin=plugin, inside=inside))
    ).specs
    image, info, depth = topics
    assert camera.topic == image
    assert info is None or camera.info_topic == info
    assert depth is None or camera.depth_topic == depth
    assert camera.depth is (depth is not None)


ARM = """
<link name="arm"><inertial><mass value="2"/><origin xyz="0.1 0 0"/>
  <inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="wrist" type="fixed"><parent link="base_link"/><child link="arm"/><origin xyz="0 0 0.2"/></joint>
"""


def test_force_torque_sensors_of_gz_and_ros2_control_are_read():
    robot = _robot(
        ARM
        + """<gazebo reference="wrist"><sensor name="cell" type="force_torque"><update_rate>200</update_rate>
        <force_torque><frame>parent</frame><measure_direction>parent_to_child</measure_direction>
        <force><x><noise type="gaussian"><stddev>0.5</stddev></noise></x></force></force_torque>
        </sensor></gazebo>
        <ros2_control name="r" type="system"><sensor name="fts"><state_interface name="force.z"/>
        <param name="frame_id">arm</param></sensor></ros2_control>"""
    )
    declared = declared_sensors(robot)
    assert not declared.diagnostics
    cell, fts = declared.specs
    assert isinstance(cell, ForceTorque)
    assert (cell.joint, cell.axes, cell.direction, cell.rate) == ("wrist", "parent", "parent_to_child", 200.0)
    assert cell.force.stddev == 0.5
    assert isinstance(fts, ForceTorque)
    assert (fts.joint, fts.axes) == ("wrist", "child")
    spoilt = _robot(ARM + '<gazebo reference="wrst"><sensor name="c" type="force_torque"/></gazebo>')
    (reported,) = declared_sensors(spoilt).diagnostics
    assert "unknown joint 'wrst': did you mean 'wrist'" in reported.message


def test_logical_camera_is_reported_as_not_simulated():
    declared = declared_sensors(
        _robot('<gazebo reference="base_link"><sensor name="eye" type="logical_camera"/></gazebo>')
    )
    assert not declared.specs
    (warning,) = declared.diagnostics
    assert (warning.code, warning.is_error) == ("W140", False)
    assert warning.message == "eye: the sensor type 'logical_camera' is not simulated"


def test_one_invalid_sensor_does_not_affect_the_others():
    text = CLASSIC.format(link="base_link").replace("<samples>720</samples>", "<samples>many</samples>", 1)
    simulation = Simulation(_robot(text))
    sensors, reported = mount_declared(simulation, strict=False)
    assert set(sensors) == {"imu_sensor", "ir_front", "sonar", "bumper"}
    assert [d.code for d in reported] == ["W141"]


def test_declared_sensors_are_mounted_and_publish():
    simulation = Simulation(_robot(CLASSIC.format(link="base_link")), "corridor")
    sensors, reported = mount_declared(simulation)
    assert not reported
    assert set(sensors) == {"head_hokuyo_sensor", "imu_sensor", "ir_front", "sonar", "bumper"}
    simulation.run(0.2)
    assert sensors["head_hokuyo_sensor"].latest.header.frame_id == "base_link"
    assert np.isfinite(sensors["head_hokuyo_sensor"].latest.ranges).any()
    assert {"/laser/scan", "/imu_sensor", "/ir", "/sonar", "/bumper"} <= set(simulation.bus.topics)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<samples>720</samples>", "<samples>many</samples>", "finite number, not 'many'"),
        ("<pose>0 0 0.1 0 0 0</pose>", "<pose>0 0 0.1</pose>", "six finite numbers"),
        ("<max>30.0</max>", "<max>0.01</max>", "minimum range must be at least 0 m"),
        ("<max>30.0</max>", "<max>-inf</max>", "finite number, not '-inf'"),
        ("<update_rate>40</update_rate>", "<update_rate>-4</update_rate>", "from 1e-09 to 1e+05 Hz"),
        ("<stddev>0.01</stddev>", "<stddev>-1</stddev>", "must be at least 0"),
    ],
)
def test_invalid_value_is_an_error_at_its_line(old, new, words):
    text = CLASSIC.format(link="base_link")
    assert old in text
    robot = _robot(text.replace(old, new, 1))
    with pytest.raises(DescriptionError) as error:
        mount_declared(Simulation(robot))
    (reported,) = [d for d in error.value.diagnostics if d.is_error]
    assert words in reported.message
    assert reported.message.startswith("head_hokuyo_sensor: ")
    assert reported.origin is not None
    assert reported.origin.span.line > 3


def test_rate_of_zero_is_reported():
    text = CLASSIC.format(link="base_link").replace(
        "<update_rate>40</update_rate>", "<update_rate>0</update_rate>", 1
    )
    (reported,) = declared_sensors(_robot(text)).diagnostics
    assert (reported.code, reported.is_error) == ("W140", False)
    assert "KBot uses 10 Hz" in reported.message


def test_unknown_link_and_type_get_a_suggestion():
    reported = declared_sensors(_robot(CLASSIC.format(link="base_lnk"))).diagnostics
    assert all("did you mean 'base_link'" in d.message for d in reported)
    (warning,) = declared_sensors(
        _robot('<gazebo reference="base_link"><sensor type="gpu_lidr" name="l"/></gazebo>')
    ).diagnostics
    assert not warning.is_error
    assert "did you mean" in warning.message


def test_sensors_of_real_robots_are_read(shared):
    counts = {}
    for path in sorted((shared / "corpus/expected").rglob("*.urdf")):
        robot = load_robot(path).robot
        if robot is None:
            continue
        declared = declared_sensors(robot)
        assert not any(d.is_error for d in declared.diagnostics), path
        for spec in declared.specs:
            counts[type(spec).__name__] = counts.get(type(spec).__name__, 0) + 1
        written = sum(len(list(e.elements("sensor"))) for e in robot.extensions if e.tag == "gazebo")
        of_gazebo = [s for s in declared.specs if s.origin is not None]
        assert len(of_gazebo) + len(declared.diagnostics) >= written, path
    assert {"Lidar", "Camera", "Imu", "Contact"} <= set(counts)


@pytest.mark.parametrize(
    ("file", "topics"),
    [
        (
            "ros-navigation+navigation2_tutorials/sam_bot_description/src/description/"
            "sam_bot_description.urdf.urdf",
            {"/demo/imu", "/demo/cmd_vel", "/demo/odom", "/scan", "/depth_camera/image_raw"},
        ),
        (
            "ros-simulation+gazebo_ros_demos/rrbot_description/urdf/rrbot.xacro.urdf",
            {"/rrbot/camera1/image_raw", "/rrbot/camera1/camera_info", "/rrbot/laser/scan"},
        ),
        (
            "linorobot+linorobot2/linorobot2_description/urdf/robots/2wd.urdf.xacro.urdf",
            {"/odom/unfiltered", "/imu/data", "/camera/color/image_raw", "/camera/depth/image_rect_raw"},
        ),
    ],
)
def test_topics_of_real_robots_equal_those_of_gazebo(shared, file, topics):
    """The expected names are from the descriptions and their launch files."""
    simulation = Simulation(load_robot(shared / "corpus/expected" / file).require())
    mount_declared(simulation, strict=False)
    pictures = {topic for topic in topics if "camera" in topic}
    _, reported = mount_declared(simulation)
    without = pictures if any("OpenGL" in d.message for d in reported) else set()
    assert topics - without <= simulation.bus.topics.keys()


def test_second_mount_returns_the_same_sensors():
    simulation = Simulation(_robot(CLASSIC.format(link="base_link")))
    first, _ = mount_declared(simulation)
    again, _ = mount_declared(simulation)
    assert first is again


def test_sensors_are_removed_with_their_robot_and_mounted_for_its_successor():
    robot = _robot(CLASSIC.format(link="base_link").replace("/laser/scan", "laser/scan"))
    simulation = Simulation(robot)
    simulation.models.spawn_model(robot, "other", x=2.0)
    mount_on_others(simulation)
    received = []
    simulation.bus.subscribe("/other/laser/scan", LaserScan, received.append)
    simulation.run(1.0)
    rate = len(received)
    assert rate > 0
    simulation.models.delete_model("other")
    simulation.run(1.0)
    assert len(received) == rate
    simulation.models.spawn_model(robot, "other", x=2.0)
    for _ in range(2):
        mount_on_others(simulation)
    simulation.run(1.0)
    assert len(received) == 2 * rate


def test_declared_camera_renders_only_for_subscribers():
    camera = """<gazebo reference="base_link"><sensor name="eye" type="camera"><update_rate>20</update_rate>
      <camera><horizontal_fov>1.0</horizontal_fov><image><width>32</width><height>24</height></image>
      <clip><near>0.05</near><far>9</far></clip></camera></sensor></gazebo>"""
    simulation = Simulation(_robot(camera))
    sensors, reported = mount_declared(simulation)
    if reported:
        pytest.skip(reported[0].message)
    simulation.run(0.2)
    with pytest.raises(KbotError, match="eye has no reading: it measures only while its topic has a sub"):
        _ = sensors["eye"].latest
    received = []
    simulation.bus.subscribe("eye/image_raw", Image, received.append)
    simulation.run(0.2)
    assert len(received) == 4
    assert (received[0].width, received[0].height) == (32, 24)


def _imu_on(topic):
    return f"""<gazebo reference="base_link"><sensor type="imu" name="imu">
        <topic>{topic}</topic></sensor></gazebo>"""


@pytest.mark.parametrize(
    ("topic", "words"),
    [
        ("/clock", "topic /clock is reserved"),
        ("tf", "topic /tf is reserved"),
        ("/tf_static", "topic /tf_static is reserved"),
        ("/robot_description", "topic /robot_description is reserved"),
        ("map", "topic /map is reserved"),
        ("/contacts", "topic /contacts is reserved"),
        ("/kbot/commands", "topic /kbot/commands is reserved"),
        ("kbot/recording", "topic /kbot/recording is reserved"),
        ("joint_states", "topic /joint_states carries JointState, not Imu"),
        ("..", "'/..' is not a valid topic name in ROS"),
        ("a//b", "is not a topic name"),
        ("~/x", "'/~/x' is not a valid topic name in ROS"),
        ("1abc", "'/1abc' is not a valid topic name in ROS"),
        ("imu/2nd", "'/imu/2nd' is not a valid topic name in ROS"),
        ("{x}", "'/{x}' is not a valid topic name in ROS"),
        ("a:=b", "'/a:=b' is not a valid topic name in ROS"),
        ("ä", r"'/\xe4' is not a valid topic name in ROS"),
        ("a\nb", r"'/a\nb' is not a valid topic name in ROS"),
        ("a" * 10_000, "has 10001 characters: the limit is 255"),
    ],
)
def test_sensor_with_invalid_topic_is_ignored_with_a_warning(topic, words):
    simulation = Simulation(_robot(_imu_on(topic)))
    mounted, (reported,) = mount_declared(simulation)
    assert mounted == {}
    assert (reported.code, reported.is_error) == ("W140", False)
    assert words in reported.message
    assert len(reported.message) < 250
    assert reported.message.startswith("imu: this sensor is ignored: ")
    assert reported.origin is not None
    assert reported.origin.span.line == 3


@pytest.mark.parametrize("topic", ["imu/data", "/imu_2/Data__x", "_imu", "a" * 254, "kbot"])
def test_valid_ros_topics_are_accepted(topic):
    mounted, reported = mount_declared(Simulation(_robot(_imu_on(topic))))
    assert (list(mounted), reported) == (["imu"], ())


def test_camera_with_one_invalid_topic_creates_no_topics():
    text = """<gazebo reference="base_link"><sensor type="camera" name="eye"><topic>eye</topic>
        <camera><camera_info_topic>/tf</camera_info_topic></camera></sensor></gazebo>"""
    simulation = Simulation(_robot(text))
    mounted, (reported,) = mount_declared(simulation)
    assert mounted == {}
    assert "topic /tf is reserved" in reported.message
    assert "/eye" not in simulation.bus.topics
    simulation.run(0.2)  # does not render
