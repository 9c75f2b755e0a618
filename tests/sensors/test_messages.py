"""Every reading can be serialized in the formats of ROS 1 and ROS 2, and read back."""

from dataclasses import replace

import numpy as np
import pytest

import kbot
from kbot.kinematics import PlanarPose
from kbot.messages.checked import checked
from kbot.navigation import Path
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.type_names import ros_name
from kbot.record.run_outputs import RunOutputs
from kbot.sensors import Camera, Contact, Encoders, Gps, GroundTruth, Imu, Lidar, Line, Range
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.world.occupancy import OccupancyGrid

SPECS = [
    (Lidar(link="base_link"), "sensor_msgs/msg/LaserScan"),
    (Lidar(link="base_link", rows=2, samples=9), "sensor_msgs/msg/PointCloud2"),
    (Imu(link="base_link"), "sensor_msgs/msg/Imu"),
    (Encoders(), "sensor_msgs/msg/JointState"),
    (Contact(link="base_link"), "std_msgs/msg/Bool"),
    (Range(link="base_link"), "sensor_msgs/msg/Range"),
    (Gps(link="base_link"), "sensor_msgs/msg/NavSatFix"),
    (GroundTruth(link="base_link"), "nav_msgs/msg/Odometry"),
    (Line(link="base_link"), "std_msgs/msg/Float32MultiArray"),
]


def _assert_round_trip(message, name):
    assert ros_name(type(message)) == name
    assert checked(message) is message  # the bus does not check KBot's own messages
    for encode, decode in ((encode_cdr, decode_cdr), (encode_ros1, decode_ros1)):
        data = encode(message)
        assert encode(decode(data, type(message))) == data


@pytest.mark.parametrize(("spec", "name"), SPECS, ids=[name for _, name in SPECS])
def test_readings_survive_serialization(robot, spec, name):
    sensor = Simulation(robot, "corridor").add_sensor(spec)
    _assert_round_trip(sensor.measure(), name)


def test_what_a_simulation_publishes_needs_no_conversion():
    simulation = Simulation(kbot.load("kbot", lidar=True), "rooms")
    mount_declared(simulation, strict=False)
    camera = Camera(link="base_link", width=8, height=6, depth=True)
    for index, spec in enumerate((*(spec for spec, _ in SPECS), camera)):
        simulation.add_sensor(replace(spec, topic=f"sensor_{index}/reading"))
    RunOutputs(print).join(simulation, "<robot/>", "rooms")
    received = {}
    for topic, kind in simulation.bus.topics.items():
        simulation.bus.subscribe(topic, kind, lambda message, topic=topic: received.update({topic: message}))
    simulation.cmd_vel(0.2, 0.5)
    simulation.run(0.5)
    assert {"/odom", "/joint_states", "/tf", "/clock", "/scan"} <= received.keys()
    for topic, message in received.items():
        assert checked(message) is message, topic


def test_paths_and_maps_survive_serialization():
    _assert_round_trip(Path.through([(0, 0), (1, 2)], yaw=0.5).to_message(), "nav_msgs/msg/Path")
    cells = np.array([[0, 100, -1], [50, 0, 0]], dtype=np.int8)
    grid = OccupancyGrid(cells, 0.1, PlanarPose(1.0, -2.0, 0.3))
    _assert_round_trip(grid.to_message(), "nav_msgs/msg/OccupancyGrid")
    back = OccupancyGrid.from_message(grid.to_message())
    assert np.array_equal(back.cells, cells)
    assert (back.origin.x, back.origin.y, back.frame) == (1.0, -2.0, "map")
    assert back.origin.yaw == pytest.approx(0.3)
