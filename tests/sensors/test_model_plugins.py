"""Sensors that are model plugins of Gazebo Classic."""

import math

import numpy as np
import pytest

from kbot.messages import Odometry
from kbot.model.load import load_robot, load_robot_text
from kbot.sensors import Gps, GroundTruth, Imu
from kbot.sensors.declared import declared_sensors, mount_declared
from kbot.sensors.noise import NoiseSource
from kbot.sim import Simulation
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.text import Severity

BODY = """<robot name="crate"><link name="body"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="mast"/><joint name="stand" type="fixed"><parent link="body"/><child link="mast"/>
<origin xyz="0.5 0 0"/></joint>{}</robot>"""
P3D = "<bodyName>mast</bodyName><topicName>base_pose_ground_truth</topicName><updateRate>100</updateRate>"


def robot(library: str, inside: str = "", name: str = "truth"):
    plugin = f'<plugin name="{name}" filename="{library}">{inside}</plugin>'
    return load_robot_text(BODY.format(f"<gazebo>\n{plugin}</gazebo>"), "a.urdf").require()


def only_spec(library: str, inside: str = "", naming: Naming = ROOT_NAMING):
    declared = declared_sensors(robot(library, inside), naming)
    assert declared.diagnostics == ()
    (spec,) = declared.specs
    return spec


def test_p3d_publishes_the_true_pose_and_twist_of_its_link():
    """A mast 0.5 m ahead of a body that turns at w moves to its left at 0.5 w."""
    sim = Simulation(robot("libgazebo_ros_p3d.so", P3D + "<frameName>map</frameName>"))
    published: list[Odometry] = []
    mount_declared(sim)
    sim.bus.subscribe("/base_pose_ground_truth", Odometry, published.append)
    sim.run(0.5)
    assert len(published) == 50
    pose = published[-1].pose.pose.position
    assert (pose.x, pose.y, pose.z) == pytest.approx((0.5, 0.0, 0.1), abs=1e-3)
    assert (published[-1].header.frame_id, published[-1].child_frame_id) == ("map", "mast")
    sim.models.set_twist((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    sensor = mount_declared(sim)[0]["truth"]
    twist = sensor.measure().twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == pytest.approx((0.0, 1.0, 2.0), abs=1e-9)


def test_p3d_offsets_transform_the_pose():
    inside = f"{P3D}<xyzOffsets>1 2 3</xyzOffsets><rpyOffsets>0 0 1.5707963267948966</rpyOffsets>"
    sim = Simulation(robot("libgazebo_ros_p3d.so", inside))
    pose = mount_declared(sim)[0]["truth"].measure().pose.pose
    assert (pose.position.x, pose.position.y, pose.position.z) == pytest.approx((1.5, 2.0, 3.1), abs=1e-3)
    assert (pose.orientation.z, pose.orientation.w) == pytest.approx([math.sqrt(0.5)] * 2, abs=1e-9)


def test_p3d_noise_is_on_the_twist_with_matching_covariance():
    sim = Simulation(robot("libgazebo_ros_p3d.so", f"{P3D}<gaussianNoise>0.05</gaussianNoise>"))
    sensor = mount_declared(sim)[0]["truth"]
    published = [sensor.measure(n) for n in range(1, 2001)]
    speeds = np.array([m.twist.twist.linear.x for m in published])
    assert speeds.std() == pytest.approx(0.05, rel=0.1)
    assert published[0].twist.covariance[0] == published[0].twist.covariance[35] == pytest.approx(0.0025)
    assert {m.pose.pose.position.x for m in published} == {published[0].pose.pose.position.x}


@pytest.mark.parametrize(
    ("library", "inside", "naming", "topic"),
    [
        ("libgazebo_ros_p3d.so", P3D, ROOT_NAMING, "/base_pose_ground_truth"),
        ("libgazebo_ros_p3d.so", P3D, Naming("b", "b", "b/"), "/b/base_pose_ground_truth"),
        (
            "libgazebo_ros_p3d.so",
            "<body_name>mast</body_name><ros><remapping>odom:=truth</remapping></ros>",
            ROOT_NAMING,
            "/truth",
        ),
        (
            "libgazebo_ros_p3d.so",
            f"<robotNamespace>/far</robotNamespace>{P3D}",
            ROOT_NAMING,
            "/far/base_pose_ground_truth",
        ),
        ("libhector_gazebo_ros_imu.so", "<bodyName>mast</bodyName>", ROOT_NAMING, "/imu"),
        ("libhector_gazebo_ros_gps.so", "<bodyName>mast</bodyName><referenceHeading>90</referenceHeading>",
         ROOT_NAMING, "/fix"),
        ("libgazebo_ros_imu.so", "<bodyName>mast</bodyName><topicName>imu/d</topicName>",
         ROOT_NAMING, "/imu/d"),
    ],
)  # fmt: skip
def test_topics_equal_those_of_the_plugins(library, inside, naming, topic):
    assert only_spec(library, inside, naming).topic == topic


def test_imu_plugins_of_gazebo_ros_and_hector_are_read():
    plain = only_spec("libgazebo_ros_imu.so", "<bodyName>mast</bodyName><gaussianNoise>0.01</gaussianNoise>")
    assert isinstance(plain, Imu)
    assert (plain.link, plain.gyroscope.stddev, plain.accelerometer.stddev) == ("mast", 0.01, 0.01)
    inside = (
        "<bodyName>mast</bodyName><frameId>base/imu</frameId><updateRate>50.0</updateRate>"
        "<accelGaussianNoise>0.1 0.1 0.1</accelGaussianNoise><accelDrift>0.2 0.2 0.2</accelDrift>"
        "<accelDriftFrequency>0.5</accelDriftFrequency><rateGaussianNoise>0.02</rateGaussianNoise>"
    )
    imu = only_spec("libhector_gazebo_ros_imu.so", inside)
    assert (imu.rate, imu.frame, imu.gyroscope.stddev) == (50.0, "imu", 0.02)
    assert imu.accelerometer.stddev == 0.1
    # The long-term deviation of the drift is the declared one, at any rate. A rate of 5 Hz is fast to draw.
    source = NoiseSource(imu.accelerometer, 1, "drift", 3, 1.0 / 5.0)
    drift = np.array([source.bias(n) for n in range(0, 5 * 4000, 5)])
    assert drift.std() == pytest.approx(0.2, rel=0.1)


def test_hector_gps_has_its_reference_position():
    inside = (
        "<bodyName>body</bodyName><referenceLatitude>50</referenceLatitude>"
        "<referenceLongitude>9</referenceLongitude><referenceHeading>90</referenceHeading>"
    )
    sim = Simulation(robot("libhector_gazebo_ros_gps.so", inside, "gps"))
    sim.models.set_pose(0.0, 1000.0, 0.0)
    fix = mount_declared(sim)[0]["gps"].measure()
    # 1 km to the north is 1 / 6371 rad on a sphere, up to the earth's flattening
    assert fix.latitude - 50.0 == pytest.approx(math.degrees(1000.0 / 6.371e6), rel=5e-3)
    assert fix.longitude == pytest.approx(9.0, abs=1e-9)
    turned = declared_sensors(robot("libhector_gazebo_ros_gps.so", "<bodyName>body</bodyName>"))
    assert isinstance(turned.specs[0], Gps)
    assert ["heading of 0 degrees" in d.message for d in turned.diagnostics] == [True]


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ("<bodyName>mst</bodyName>", "did you mean 'mast'"),
        ("", "the plugin has no <bodyName>"),
        ("<bodyName>mast</bodyName><xyzOffsets>1 2</xyzOffsets>", "one or three finite numbers, not '1 2'"),
        ("<bodyName>mast</bodyName><rpyOffsets>0 nan 0</rpyOffsets>", "finite"),
        ("<bodyName>mast</bodyName><updateRate>fast</updateRate>", "finite number, not 'fast'"),
        ("<bodyName>mast</bodyName><updateRate>-3</updateRate>", "the rate must be from 1e-09 to 1e+05 Hz"),
        (
            "<bodyName>mast</bodyName><updateRate>1e-308</updateRate>",
            "the rate must be from 1e-09 to 1e+05 Hz",
        ),
        ("<bodyName>mast</bodyName><gaussianNoise>1e308</gaussianNoise>", "finite numbers up to 1e+100"),
    ],
)
def test_invalid_plugin_is_an_error_at_its_line(inside, words):
    declared = declared_sensors(robot("libgazebo_ros_p3d.so", inside))
    assert declared.specs == ()
    (found,) = declared.diagnostics
    assert (found.code, found.severity) == ("W141", Severity.ERROR)
    assert words in found.message
    assert found.origin is not None
    assert found.origin.span.line == 6


@pytest.mark.parametrize(
    ("library", "hint"),
    [
        ("libgazebo_ros_kobuki.so", "mobile_base/commands/velocity"),
        ("libmy_own_wind.so", "the rest of the robot is simulated"),
    ],
)
def test_unsupported_plugin_is_reported_with_its_consequence(library, hint):
    (found,) = declared_sensors(robot(library, name="some_controller")).diagnostics
    assert (found.code, found.severity) == ("W140", Severity.INFO)
    assert library in found.message
    assert hint in found.hint


@pytest.mark.parametrize(
    "library",
    ["libgazebo_ros_control.so", "libgazebo_ros2_control.so", "libgazebo_ros_diff_drive.so",
     "libgazebo_ros_joint_state_publisher.so", "gz-sim-joint-position-controller-system",
     "libgazebo_ros_planar_move.so", "libridgeback_ros_force_based_move.so"],
)  # fmt: skip
def test_plugins_handled_elsewhere_are_not_reported(library):
    assert declared_sensors(robot(library)).diagnostics == ()


def test_shipped_robot_has_no_unsupported_plugins():
    assert declared_sensors(load_robot("kbot").require()).diagnostics == ()


def test_p3d_is_read_as_ground_truth_of_its_link():
    spec = only_spec("libgazebo_ros_p3d.so", P3D)
    assert isinstance(spec, GroundTruth)
    assert (spec.link, spec.rate, spec.fixed_frame) == ("mast", 100.0, "world")
