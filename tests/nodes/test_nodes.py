"""robot_state_publisher: the topics it publishes, and when."""

import json
from math import cos, sin

import pytest

from kbot.messages import Bus, Clock, Header, JointState, String, TFMessage, Time
from kbot.model.load import load_robot, load_robot_text
from kbot.tf.robot_state_publisher import RobotStatePublisher

MS = 1_000_000

ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/><link name="tip"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
 <origin xyz="0 0 0.5"/><limit lower="-1" upper="2" effort="1" velocity="1"/>
 <safety_controller soft_lower_limit="-0.5" soft_upper_limit="1.5" k_position="1" k_velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 0 1"/>
 <origin xyz="1 0 0"/><limit lower="-4" upper="4" effort="1" velocity="1"/>
 <mimic joint="shoulder" multiplier="-2" offset="0.25"/></joint>
<joint name="tip" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.5 0 0"/></joint>
<joint name="slide" type="prismatic"><parent link="base"/><child link="slider"/><axis xyz="1 0 0"/>
 <limit lower="0.2" upper="0.6" effort="1" velocity="1"/></joint><link name="slider"/></robot>"""


@pytest.fixture
def arm():
    return load_robot_text(ARM, "arm.urdf").require()


def subscribe(bus, topic, kind):
    received = []
    bus.subscribe(topic, kind, received.append)
    return received


def test_fixed_frames_are_published_once_and_latched(arm):
    bus, clock = Bus(), Clock()
    RobotStatePublisher(arm, bus, clock, description="<robot/>")
    static = subscribe(bus, "/tf_static", TFMessage)
    (transform,) = static[0].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("lower", "tip")
    assert transform.transform.translation.x == 0.5
    assert subscribe(bus, "/robot_description", String) == [String("<robot/>")]


def test_joint_states_become_transforms_also_of_mimic_joints(arm):
    bus, clock = Bus(), Clock()
    RobotStatePublisher(arm, bus, clock)
    received = subscribe(bus, "/tf", TFMessage)
    stamp = Time(1, 0)
    bus.publish("/joint_states", JointState(Header(stamp), ("shoulder", "unknown"), (0.5, 9.0)))
    found = {t.child_frame_id: t for t in received[0].transforms}
    assert set(found) == {"upper", "lower", "slider"}
    assert found["upper"].header.stamp == stamp
    rotation = found["upper"].transform.rotation
    assert (rotation.z, rotation.w) == pytest.approx((sin(0.25), cos(0.25)))
    rotation = found["lower"].transform.rotation
    elbow = -2 * 0.5 + 0.25
    assert (rotation.z, rotation.w) == pytest.approx((sin(elbow / 2), cos(elbow / 2)))


def test_tf_is_published_at_most_at_50_hz(arm):
    bus, clock = Bus(), Clock()
    RobotStatePublisher(arm, bus, clock)
    received = subscribe(bus, "/tf", TFMessage)
    for ms in range(0, 100, 10):
        stamp = Time.from_nanoseconds(ms * MS)
        bus.publish("/joint_states", JointState(Header(stamp), ("shoulder",), (0.0,)))
    assert len(received) == 5


def test_the_frame_prefix_is_part_of_every_frame(arm):
    bus, clock = Bus(), Clock()
    RobotStatePublisher(arm, bus, clock, frame_prefix="a/")
    received = subscribe(bus, "/tf", TFMessage)
    bus.publish("/joint_states", JointState(Header(), ("shoulder",), (0.0,)))
    assert {t.child_frame_id for t in received[0].transforms} == {"a/upper", "a/lower", "a/slider"}
    fixed = subscribe(bus, "/tf_static", TFMessage)
    assert {t.child_frame_id for t in fixed[0].transforms} == {"a/tip"}


def test_transforms_equal_those_of_ros_noetic(shared):
    """The reference is robot_state_publisher of ROS Noetic, for the corrected chapter at four positions."""
    chapter = shared / "chapter"
    robot = load_robot(chapter / "corrected" / "kbot.urdf").require()
    for case in json.loads((chapter / "ros_reference" / "tf_transforms.json").read_text()):
        bus = Bus()
        RobotStatePublisher(robot, bus, Clock())
        moving, static = subscribe(bus, "/tf", TFMessage), subscribe(bus, "/tf_static", TFMessage)
        joints = case["joint_positions"]
        bus.publish("/joint_states", JointState(Header(), tuple(joints), tuple(joints.values())))
        for received, expected in ((moving, case["tf"]), (static, case["tf_static"])):
            found = {t.child_frame_id: t for t in received[0].transforms}
            assert set(found) == {frame["child"] for frame in expected}
            for frame in expected:
                transform = found[frame["child"]]
                translation, rotation = transform.transform.translation, transform.transform.rotation
                assert transform.header.frame_id == frame["parent"]
                xyz = (translation.x, translation.y, translation.z)
                assert xyz == pytest.approx(frame["translation"], abs=1e-12)
                x, y, z, w = frame["rotation_xyzw"]
                dot = rotation.x * x + rotation.y * y + rotation.z * z + rotation.w * w
                assert abs(dot) == pytest.approx(1.0, abs=1e-12)  # q and -q are the same rotation
