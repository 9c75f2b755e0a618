"""A drive publishes odometry and its transform as its plugin or controller does.

The expected values are those of the sources that docs/reference/plugin-settings.md names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import JointState, Odometry, TFMessage
from kbot.model import RobotModel
from kbot.model.load import load_robot, load_robot_text
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.without_map.local_pilot import _WheelOdometry
from kbot.sim import Simulation
from kbot.sim.injected_faults import BlockedJoint
from kbot.sim.naming import Naming
from kbot.sim.topics import odometry_frames

from .test_holonomic import CORNERS, FOUR, ros2_omni, tracked
from .test_holonomic import body as holonomic
from .test_steered import CAR, REAR, wheel
from .test_steered import body as car

FAR = 1e12
CLASSIC, ZEROS = (1e-5, 1e-5, FAR, FAR, FAR, 1e-3), (0.0,) * 6
LIST = "[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]"
GIVEN = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
SECONDS = 2.0


@dataclass(frozen=True)
class Published:
    """What is on the bus: topics and frames (None: nothing), rate in Hz, and variances."""

    odometry: str | None
    transform: tuple[str, str] | None
    rate: float = 100.0
    frames: tuple[str, str] = ("odom", "base_footprint")
    pose: tuple[float, ...] = CLASSIC
    twist: tuple[float, ...] = ZEROS
    transform_topic: str = "/tf"


def published(sim: Simulation, topic: str = "/odom") -> Published:
    """Measure what a simulation publishes in `SECONDS` of simulated time."""
    odometry, transforms = [], []
    outputs = {name: kind for name, kind in sim.bus.topics.items() if name not in sim.bus.inputs}
    name = topic if outputs.get(topic) is Odometry else None
    if name is not None:
        sim.bus.subscribe(name, Odometry, odometry.append)
    tf_topics = [found for found, kind in outputs.items() if kind is TFMessage]
    tf_topic = tf_topics[0] if tf_topics else "/tf"
    if tf_topics:
        sim.bus.subscribe(tf_topic, TFMessage, transforms.append)
    sim.run(SECONDS)
    counts = {len(found) for found in (odometry, transforms) if found}
    assert len(counts) <= 1, "odometry and its transform have one rate"
    rate = counts.pop() / SECONDS if counts else 0.0
    stamps = [message.header.stamp.nanoseconds for message in odometry]
    assert len(set(stamps)) == len(stamps)
    transform = transforms[-1].transforms[0] if transforms else None
    last = odometry[-1] if odometry else None
    return Published(
        name,
        (transform.header.frame_id, transform.child_frame_id) if transform else None,
        rate,
        (last.header.frame_id, last.child_frame_id) if last else ("", ""),
        tuple(last.pose.covariance[7 * i] for i in range(6)) if last else (),
        tuple(last.twist.covariance[7 * i] for i in range(6)) if last else (),
        tf_topic,
    )


def tags(**given: object) -> str:
    return "".join(f"<{name}>{value}</{name}>" for name, value in given.items())


def plugin(file: str, inner: str, name: str = "drive") -> str:
    return f'<gazebo><plugin name="{name}" filename="{file}">{inner}</plugin></gazebo>'


WHEELS_1 = tags(leftJoint="left_wheel_joint", rightJoint="right_wheel_joint")
WHEELS_2 = tags(left_joint="left_wheel_joint", right_joint="right_wheel_joint")
OFF = Published(None, None, 0.0, ("", ""), (), ())
BOTH = ("odom", "base_footprint")


def diff_1(inner: str = "") -> str:
    return plugin("libgazebo_ros_diff_drive.so", WHEELS_1 + inner)


def diff_2(inner: str = "") -> str:
    return plugin("libgazebo_ros_diff_drive.so", WHEELS_2 + inner)


def gz_diff(inner: str = "") -> str:
    return plugin("gz-sim-diff-drive-system", WHEELS_2 + inner, "gz::sim::systems::DiffDrive")


ON_2 = tags(publish_odom="true", publish_odom_tf="true")
PLUGINS_OF_TWO_WHEELS = {
    "ROS 1 diff_drive": (diff_1(), Published("/odom", BOTH)),
    "ROS 1 publishTf": (diff_1(tags(publishTf="false")), OFF),
    "ROS 1 publishTf 0": (diff_1(tags(publishTf="0")), OFF),
    "ROS 1 publishOdomTF": (diff_1(tags(publishOdomTF="false")), Published("/odom", None)),
    "ROS 1 frames": (
        diff_1(tags(odometryFrame="start", robotBaseFrame="base_link")),
        # the transform leads to the root, so that base_link has one parent
        Published("/odom", ("start", "base_footprint"), frames=("start", "base_link")),
    ),
    "ROS 1 another base": (
        diff_1(tags(robotBaseFrame="elsewhere")),
        Published("/odom", ("odom", "elsewhere"), frames=("odom", "elsewhere")),
    ),
    "ROS 1 topic and rate": (
        diff_1(tags(odometryTopic="wheels", updateRate="20")),
        Published("/wheels", BOTH, 20.0),
    ),
    "ROS 1 every step": (diff_1(tags(updateRate="0")), Published("/odom", BOTH, 500.0)),
    "ROS 2 diff_drive": (diff_2(), OFF),
    "ROS 2 publish_odom": (
        diff_2(tags(publish_odom="true")),
        Published("/odom", None, twist=CLASSIC),
    ),
    "ROS 2 publish_odom_tf": (
        diff_2(tags(publish_odom_tf="true")),
        replace(OFF, transform=BOTH, rate=100.0),
    ),
    "ROS 2 both off": (diff_2(tags(publish_odom="false", publish_odom_tf="false")), OFF),
    "ROS 2 remapped": (
        diff_2(ON_2 + "<ros><remapping>odom:=wheels</remapping></ros>" + tags(update_rate="30")),
        Published("/wheels", BOTH, 30.0, twist=CLASSIC),
    ),
    "ROS 2 variances": (
        diff_2(ON_2 + tags(covariance_x="0.1", covariance_y="0.2", covariance_yaw="0.3")),
        Published("/odom", BOTH, pose=(0.1, 0.2, FAR, FAR, FAR, 0.3), twist=(0.1, 0.2, FAR, FAR, FAR, 0.3)),
    ),
    "gz DiffDrive": (gz_diff(), Published("/odom", BOTH, 50.0, pose=ZEROS)),
    "gz topics": (
        gz_diff(tags(odom_topic="wheels", tf_topic="/wheels/tf", odom_publish_frequency="25")),
        Published("/wheels", BOTH, 25.0, pose=ZEROS, transform_topic="/wheels/tf"),
    ),
    "gz frames": (
        gz_diff(tags(frame_id="start", child_frame_id="base_link", tf_topic="tf")),
        Published("/odom", ("start", "base_footprint"), 50.0, ("start", "base_link"), ZEROS),
    ),
    "an unknown plugin": (
        plugin("libmy_diff_drive.so", WHEELS_1 + tags(publishOdomTF="false", updateRate="10")),
        Published("/odom", None, 10.0, pose=(0.001,) * 5 + (0.01,), twist=(0.001,) * 5 + (0.01,)),
    ),
}


@pytest.fixture(scope="module")
def plain() -> str:
    """KBot as URDF without a drive."""
    return load_robot("kbot", {"control": "none"}).expansion.text


@pytest.fixture
def two_wheels(plain) -> Callable[[str], RobotModel]:
    """A function that adds a plugin to KBot."""
    return lambda text: load_robot_text(plain.replace("</robot>", f"{text}</robot>"), "k.urdf").require()


@pytest.mark.parametrize("case", PLUGINS_OF_TWO_WHEELS)
def test_a_plugin_of_two_wheels_publishes_as_its_source(two_wheels, case):
    text, expected = PLUGINS_OF_TWO_WHEELS[case]
    topic = expected.odometry or "/odom"
    assert published(Simulation(two_wheels(text)), topic) == expected


def moved(file: str, inner: str = "", name: str = "drive") -> str:
    return holonomic(FOUR, plugin(file, inner, name))


def skid(inner: str = "") -> str:
    joints = tags(
        leftFrontJoint="front_left_joint",
        rightFrontJoint="front_right_joint",
        leftRearJoint="rear_left_joint",
        rightRearJoint="rear_right_joint",
    )
    return moved("libgazebo_ros_skid_steer_drive.so", joints + inner)


def gz_mecanum(inner: str) -> str:
    ends = {name: name.replace("rear", "back") for name in CORNERS}
    joints = tags(**{f"{end}_joint": f"{name}_joint" for name, end in ends.items()})
    return moved("gz-sim-mecanum-drive-system", joints + inner, "gz::sim::systems::MecanumDrive")


def ackermann_2(inner: str = "") -> str:
    wheels = wheel("front_left", "base_link", 0.5, 0.2, steered=True)
    wheels += wheel("front_right", "base_link", 0.5, -0.2, steered=True)
    joints = tags(
        front_left_joint="front_left_joint",
        front_right_joint="front_right_joint",
        rear_left_joint="left_joint",
        rear_right_joint="right_joint",
        left_steering_joint="front_left_steering",
        right_steering_joint="front_right_steering",
    )
    return car(REAR + wheels, plugin("libgazebo_ros_ackermann_drive.so", joints + inner))


def tricycle(inner: str) -> str:
    wheels = REAR + wheel("front", "base_link", 0.5, 0.0, steered=True)
    return car(wheels, plugin("libgazebo_ros_tricycle_drive.so", inner))


TRICYCLE_1 = tags(steeringJoint="front_steering", actuatedWheelJoint="front_joint")
TRICYCLE_2 = tags(steering_joint="front_steering", actuated_wheel_joint="front_joint")
BASE_LINK = ("odom", "base_link")
SKID = (1e-4, 1e-4, FAR, FAR, FAR, 1e-2)
PLANAR_2 = {"pose": CLASSIC, "twist": CLASSIC}
OTHER_PLUGINS = {
    "ROS 1 skid_steer": (
        skid(),
        Published("/odom", None, frames=BASE_LINK, pose=SKID, twist=SKID),
    ),
    "ROS 1 broadcastTF": (
        skid(tags(broadcastTF="true", covariance_x="1", covariance_y="2", covariance_yaw="3")),
        Published("/odom", BASE_LINK, 100.0, BASE_LINK, (1, 2, FAR, FAR, FAR, 3), (1, 2, FAR, FAR, FAR, 3)),
    ),
    "ROS 1 planar_move": (
        moved("libgazebo_ros_planar_move.so", tags(commandTopic="cmd_vel", robotBaseFrame="base_link")),
        Published("/odom", BASE_LINK, 20.0, BASE_LINK),
    ),
    "ROS 1 odometryRate": (
        moved("libgazebo_ros_planar_move.so", tags(odometryRate="40", robotBaseFrame="base_link")),
        Published("/odom", BASE_LINK, 40.0, BASE_LINK),
    ),
    "ROS 1 odometryRate 0": (
        moved("libgazebo_ros_planar_move.so", tags(odometryRate="0", robotBaseFrame="base_link")),
        OFF,
    ),
    "ROS 2 planar_move": (
        moved("libgazebo_ros_planar_move.so", tags(robot_base_frame="base_link", publish_rate="10")),
        Published("/odom", BASE_LINK, 10.0, BASE_LINK, **PLANAR_2),
    ),
    "ROS 2 planar_move off": (
        moved(
            "libgazebo_ros_planar_move.so",
            tags(robot_base_frame="base_link", publish_odom="true", publish_odom_tf="false"),
        ),
        Published("/odom", None, 20.0, BASE_LINK, **PLANAR_2),
    ),
    "force_based_move": (
        moved(
            "libhector_gazebo_ros_force_based_move.so",
            tags(robotBaseFrame="base_link", publishOdometryTf="false"),
        ),
        Published("/odom", None, 20.0, BASE_LINK, (1e-3, 1e-3, FAR, FAR, FAR, 1e-2)),
    ),
    "gz MecanumDrive": (
        gz_mecanum(tags(frame_id="start", child_frame_id="base_link", odom_publish_frequency="10")),
        Published("/odom", ("start", "base_link"), 10.0, ("start", "base_link"), ZEROS),
    ),
    "gz VelocityControl": (
        moved("gz-sim-velocity-control-system", "", "gz::sim::systems::VelocityControl"),
        Published("/odom", BASE_LINK, 50.0, BASE_LINK, ZEROS),
    ),
    "gz TrackedVehicle": (
        tracked(tags(odom_publish_frequency="10", odom_topic="tracks")),
        Published("/tracks", BASE_LINK, 10.0, BASE_LINK, ZEROS),
    ),
    "gz AckermannSteering": (
        CAR.replace("</plugin>", tags(odom_publish_frequency="20", tf_topic="car/tf") + "</plugin>"),
        Published("/odom", BASE_LINK, 20.0, BASE_LINK, ZEROS, transform_topic="/car/tf"),
    ),
    "ROS 2 ackermann_drive": (ackermann_2(), OFF),
    "ROS 2 ackermann_drive on": (
        ackermann_2(ON_2 + tags(robot_base_frame="base_link", update_rate="25")),
        Published("/odom", BASE_LINK, 25.0, BASE_LINK, **PLANAR_2),
    ),
    "ROS 1 tricycle_drive": (tricycle(TRICYCLE_1), Published("/odom", BASE_LINK, 100.0, BASE_LINK)),
    "ROS 2 tricycle_drive": (tricycle(TRICYCLE_2), OFF),
    # its transform has no switch of its own
    "ROS 2 tricycle_drive on": (
        tricycle(TRICYCLE_2 + tags(publish_odom="true", update_rate="50")),
        Published("/odom", BASE_LINK, 50.0, BASE_LINK),
    ),
}


@pytest.mark.parametrize("case", OTHER_PLUGINS)
def test_another_plugin_publishes_as_its_source(urdf, case):
    text, expected = OTHER_PLUGINS[case]
    assert published(Simulation(urdf(text)), expected.odometry or "/odom") == expected


def controlled(folder: Path, kind: str, parameters: str) -> str:
    """A plugin whose file of parameters has a controller of ROS 2 with the name `base`."""
    file = folder / "c.yaml"
    file.write_text(
        f"controller_manager: {{ros__parameters: {{base: {{type: {kind}}}}}}}\n"
        f"base: {{ros__parameters: {{{parameters}}}}}\n"
    )
    return plugin("libgz_ros2_control-system.so", f"<parameters>{file}</parameters>", "control")


DIFF = "diff_drive_controller/DiffDriveController"
WHEELS = "left_wheel_names: [left_wheel_joint], right_wheel_names: [right_wheel_joint]"
LINK = ("odom", "base_link")
"""The default of base_frame_id. KBot's transform leads to its root, base_footprint."""
CONTROLLERS = {
    "defaults": ("", Published("/odom", BOTH, 50.0, LINK, ZEROS)),
    "own topic": ("", Published("/base/odom", BOTH, 50.0, LINK, ZEROS)),
    "enable_odom_tf": ("enable_odom_tf: false", Published("/odom", None, 50.0, LINK, ZEROS)),
    "publish_rate": ("publish_rate: 20.0", Published("/base/odom", BOTH, 20.0, LINK, ZEROS)),
    "frames": (
        "odom_frame_id: start, base_frame_id: base_footprint",
        Published("/odom", ("start", "base_footprint"), 50.0, ("start", "base_footprint"), ZEROS),
    ),
    "variances": (
        f"pose_covariance_diagonal: {LIST}, twist_covariance_diagonal: [1, 2, 3, 4, 5, 6]",
        Published("/odom", BOTH, 50.0, LINK, GIVEN, (1, 2, 3, 4, 5, 6)),
    ),
    "prefix": (
        "tf_frame_prefix: robot1, base_frame_id: base_footprint",
        Published(
            "/odom",
            ("robot1/odom", "robot1/base_footprint"),
            50.0,
            ("robot1/odom", "robot1/base_footprint"),
            ZEROS,
        ),
    ),
    "prefix off": (
        "tf_frame_prefix: robot1, tf_frame_prefix_enable: false",
        Published("/odom", BOTH, 50.0, LINK, ZEROS),
    ),
}


@pytest.mark.parametrize("case", CONTROLLERS)
def test_a_diff_drive_controller_publishes_as_its_source(two_wheels, tmp_path, case):
    parameters, expected = CONTROLLERS[case]
    robot = two_wheels(controlled(tmp_path, DIFF, f"{WHEELS}, {parameters}"))
    assert published(Simulation(robot), expected.odometry) == expected


def test_a_tilde_in_the_prefix_is_the_namespace(two_wheels, tmp_path):
    """As controller_interface::resolve_tf_prefix."""
    robot = two_wheels(controlled(tmp_path, DIFF, f"{WHEELS}, tf_frame_prefix: '~/wheels'"))
    sim = Simulation(robot, naming=Naming(namespace="tb3_0"))
    assert published(sim, "/tb3_0/odom").frames == ("tb3_0/wheels/odom", "tb3_0/wheels/base_link")


STEERING = "traction_joints_names: [right_joint, left_joint], steering_joints_names: "
STEERING += "[front_right_steering, front_left_steering]"
NUMBERS = (0.0, 7.0, 14.0, 21.0, 28.0, 35.0)
"""The default variances of steering_controllers_library, which are the indices of the diagonal."""


@pytest.mark.parametrize(
    ("kind", "parameters", "expected"),
    [
        (
            "mecanum_drive_controller/MecanumDriveController",
            "enable_odom_tf: false",
            Published("/base/odometry", None, 50.0, BASE_LINK, (0.1,) * 6, (0.1,) * 6),
        ),
        (
            "mecanum_drive_controller/MecanumDriveController",
            f"odom_frame_id: start, tf_frame_prefix: a/, pose_covariance_diagonal: {LIST}",
            Published(
                "/odom", ("a/start", "a/base_link"), 50.0, ("a/start", "a/base_link"), GIVEN, (0.1,) * 6
            ),
        ),
        (
            "ackermann_steering_controller/AckermannSteeringController",
            STEERING,
            Published("/base/odometry", BASE_LINK, 50.0, BASE_LINK, NUMBERS, NUMBERS),
        ),
        (
            "ackermann_steering_controller/AckermannSteeringController",
            f"{STEERING}, enable_odom_tf: false, twist_covariance_diagonal: {LIST}",
            Published("/odom", None, 50.0, BASE_LINK, NUMBERS, GIVEN),
        ),
        (
            "tricycle_controller/TricycleController",
            "traction_joint_name: front_joint, steering_joint_name: front_steering",
            Published("/odom", None, 50.0, BASE_LINK, ZEROS),
        ),
        (
            "tricycle_controller/TricycleController",
            "traction_joint_name: front_joint, steering_joint_name: front_steering, enable_odom_tf: true",
            Published("/odom", BASE_LINK, 50.0, BASE_LINK, ZEROS),
        ),
    ],
)
def test_another_controller_of_ros_2_publishes_as_its_source(urdf, tmp_path, kind, parameters, expected):
    if "mecanum" in kind:
        names = ", ".join(f"{name}_wheel_command_joint_name: {name}_joint" for name in CORNERS)
        sizes = "kinematics: {wheels_radius: 0.05, sum_of_robot_center_projection_on_X_Y_axis: 0.35}"
        text = holonomic(FOUR, controlled(tmp_path, kind, f"{names}, {sizes}, {parameters}"))
    elif "ackermann" in kind:
        text = CAR[: CAR.index("<gazebo>")] + controlled(tmp_path, kind, parameters) + "</robot>"
    else:
        wheels = REAR + wheel("front", "base_link", 0.5, 0.0, steered=True)
        text = car(wheels, controlled(tmp_path, kind, parameters))
    assert published(Simulation(urdf(text)), expected.odometry) == expected


def test_an_omni_controller_names_its_variances_differently(urdf, tmp_path):
    text = ros2_omni(tmp_path)
    yaml = tmp_path / "controllers.yaml"
    more = f"enable_odom_tf: false, diagonal_covariance: {{pose: {LIST}}}, wheel_names"
    yaml.write_text(yaml.read_text().replace("wheel_names", more))
    expected = Published("/base/odom", None, 50.0, BASE_LINK, GIVEN)
    assert published(Simulation(urdf(text)), "/base/odom") == expected


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("", Published("/base/odom", BOTH, 50.0, LINK, GIVEN, GIVEN)),
        ("  enable_odom_tf: false\n", Published("/base/odom", None, 50.0, LINK, GIVEN, GIVEN)),
        ("  publish_rate: 10\n", Published("/odom", BOTH, 10.0, LINK, GIVEN, GIVEN)),
    ],
)
def test_a_spawned_controller_of_ros_1_publishes_as_its_source(plain, launched, more, expected):
    manager = plugin("libgazebo_ros_control.so", "", "gazebo_ros_control")
    yaml = f"base:\n  type: {DIFF}\n  left_wheel: left_wheel_joint\n  right_wheel: right_wheel_joint\n"
    yaml += f"  pose_covariance_diagonal: {LIST}\n  twist_covariance_diagonal: {LIST}\n{more}"
    robot = launched(plain.replace("</robot>", f"{manager}</robot>"), yaml, "base", ns="/")
    assert published(Simulation(robot), expected.odometry) == expected


def test_open_loop_odometry_is_the_integral_of_the_commands(two_wheels, tmp_path):
    """Blocked wheels do not turn, which only odometry from the wheels shows."""
    measured = {}
    for open_loop in ("true", "false"):
        parameters = f"{WHEELS}, open_loop: {open_loop}, base_frame_id: base_footprint"
        sim = Simulation(two_wheels(controlled(tmp_path, DIFF, parameters)))
        for side in ("left", "right"):
            sim.disturbances.schedule(BlockedJoint(f"{side}_wheel_joint"), at=0.0, duration=SECONDS)
        sim.cmd_vel(0.2, 0.0)
        sim.run(SECONDS)
        measured[open_loop] = sim.odometry
    # 0.2 m/s for 2 s minus the ramp of 1 m/s^2
    assert measured["true"].pose.x == pytest.approx(0.2 * 2.0 - 0.02, abs=0.005)
    assert measured["true"].twist.x == pytest.approx(0.2)
    assert measured["false"].pose.x == pytest.approx(0.0, abs=0.01)


def test_an_invalid_switch_is_reported_and_its_default_is_used(two_wheels):
    sim = Simulation(two_wheels(diff_1(tags(odometrySource="encoder", publishOdomTF="maybe"))))
    assert [d.code for d in sim.diagnostics] == ["W130"]
    assert sim.diagnostics[0].message == "<publishOdomTF> must be true or false, not 'maybe'"
    assert published(sim) == Published("/odom", BOTH)


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        # a key without a value
        ("odom_frame_id: , tf_frame_prefix: ~", []),
        ("odom_frame_id: [start]", ["odom_frame_id must be a text, not '['start']'"]),
        ("tf_frame_prefix: [a, b]", ["tf_frame_prefix must be a text, not '['a', 'b']'"]),
        (
            "pose_covariance_diagonal: [.nan, .inf, 1, 2, 3, 4]",
            ["pose_covariance_diagonal must be a list of 6 numbers, not '[nan, inf, 1, 2, 3, 4]'"],
        ),
        (
            "pose_covariance_diagonal: [1, 2]",
            ["pose_covariance_diagonal must be a list of 6 numbers, not '[1, 2]'"],
        ),
    ],
)
def test_without_a_valid_value_a_parameter_has_its_default(two_wheels, tmp_path, parameters, expected):
    sim = Simulation(two_wheels(controlled(tmp_path, DIFF, f"{WHEELS}, {parameters}")))
    assert [d.message for d in sim.diagnostics if d.code == "W130"] == expected
    assert published(sim) == Published("/odom", BOTH, 50.0, LINK, ZEROS)


def test_a_rate_near_zero_publishes_nothing_in_any_run(two_wheels):
    sim = Simulation(two_wheels(gz_diff(tags(odom_publish_frequency=1e-300))))
    odometry = []
    sim.bus.subscribe("/odom", Odometry, odometry.append)
    sim.run(SECONDS)
    assert odometry == []


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        (diff_1(), []),
        (diff_1(tags(odometrySource="world")), ["W139"]),
        (diff_1(tags(odometrySource="encoder")), []),
        (diff_2(ON_2), []),
        (diff_2(ON_2 + tags(odometry_source="1")), ["W139"]),
        (diff_2(ON_2 + tags(odometry_source="0")), []),
        # off by default: one line for odometry and its transform
        (diff_2(tags(odometry_source="0")), ["W150"]),
        (diff_2(tags(publish_odom="true")), ["W150"]),
        (diff_2(tags(odometry_source="0", publish_odom="true", publish_odom_tf="false")), []),
    ],
)
def test_defaults_that_differ_from_what_users_expect_are_reported(two_wheels, text, codes):
    assert [d.code for d in Simulation(two_wheels(text)).diagnostics] == codes


def test_the_finding_of_a_default_names_the_switches(two_wheels):
    (found,) = Simulation(two_wheels(diff_2(tags(odometry_source="0")))).diagnostics
    assert found.message == (
        "drive does not publish its odometry or the transform from odom to the robot: publish_odom and"
        " publish_odom_tf are false by default"
    )


def test_a_slow_rate_does_not_count_as_silence_for_navigation_without_a_map(two_wheels):
    for inner in (tags(publishTf="false"), tags(updateRate="2"), tags(updateRate="0")):
        sim = Simulation(two_wheels(diff_1(inner)))
        odometry = _WheelOdometry(sim)
        sim.cmd_vel(0.2, 0.0)
        for _ in range(20):
            sim.run(0.1)
            assert odometry() == sim.odometry
        odometry.close()


STATES = "libgazebo_ros_joint_state_publisher.so"
GZ_STATES, GZ_STATES_CLASS = "gz-sim-joint-state-publisher-system", "gz::sim::systems::JointStatePublisher"
ROS_2_NAMES = "<ros><remapping>joint_states:=states</remapping></ros>"


@pytest.mark.parametrize(
    ("text", "topic", "rate"),
    [
        ("", "/joint_states", 50.0),
        (plugin(STATES, tags(jointName="left_wheel_joint")), "/joint_states", 100.0),
        (plugin(STATES, tags(jointName="left_wheel_joint", updateRate="20")), "/joint_states", 20.0),
        (plugin(STATES, tags(joint_name="left_wheel_joint", update_rate="0")), "/joint_states", 500.0),
        (plugin(STATES, tags(update_rate="30") + ROS_2_NAMES), "/states", 30.0),
        (plugin(STATES, tags(update_rate="30") + ROS_2_NAMES), "/joint_states", 50.0),
        (plugin(GZ_STATES, "", GZ_STATES_CLASS), "/joint_states", 50.0),
        (plugin(GZ_STATES, tags(update_rate="25"), GZ_STATES_CLASS), "/joint_states", 25.0),
        (plugin(GZ_STATES, tags(topic="wheels", update_rate="25"), GZ_STATES_CLASS), "/wheels", 25.0),
    ],
)
def test_joint_states_have_the_rate_of_their_publisher(two_wheels, text, topic, rate):
    sim, received = Simulation(two_wheels(text)), []
    sim.bus.subscribe(topic, JointState, received.append)
    sim.run(SECONDS)
    assert len(received) == rate * SECONDS
    assert received[-1].name == ("left_wheel_joint", "right_wheel_joint")


@pytest.mark.parametrize("rate", [20, 100])
def test_joint_states_of_a_spawned_controller_have_its_rate(plain, launched, rate):
    manager = plugin("libgazebo_ros_control.so", "", "gazebo_ros_control")
    yaml = f"states:\n  type: joint_state_controller/JointStateController\n  publish_rate: {rate}\n"
    robot = launched(plain.replace("</robot>", f"{manager}</robot>"), yaml, "states", ns="/")
    sim, received = Simulation(robot), []
    sim.bus.subscribe("/joint_states", JointState, received.append)
    sim.run(SECONDS)
    assert len(received) == rate * SECONDS


def test_a_subscription_in_the_middle_of_a_run_gets_messages_at_multiples_of_the_period(two_wheels):
    sim, received = Simulation(two_wheels(diff_1(tags(updateRate="10")))), []
    sim.run(0.33)
    subscription = sim.bus.subscribe("/odom", Odometry, received.append)
    sim.run(0.4)
    subscription.close()
    sim.run(0.4)
    assert [round(m.header.stamp.nanoseconds / 1e6) for m in received] == [400, 500, 600, 700]
    received.clear()
    sim.reset()
    sim.bus.subscribe("/odom", Odometry, received.append)
    sim.run(0.2)
    assert [round(m.header.stamp.nanoseconds / 1e6) for m in received] == [100, 200]


def test_goals_are_reached_without_published_odometry(two_wheels):
    """Navigation takes odometry from the simulation, so it does not need /odom or /tf."""
    robot = two_wheels(diff_1(tags(publishTf="false")))
    sim = Simulation(robot)
    assert "/odom" not in sim.bus.topics
    assert go_to(sim, PlanarPose(0.5, 0.2, 0.0), timeout=20.0).reached


def test_frames_of_goals_and_the_page_are_those_of_odometry(two_wheels, tmp_path):
    parameters = f"{WHEELS}, tf_frame_prefix: robot1, odom_frame_id: start, enable_odom_tf: false"
    sim = Simulation(two_wheels(controlled(tmp_path, DIFF, parameters)))
    assert odometry_frames(sim.robots.first) == ("robot1/start", "robot1/base_link", "robot1/base_footprint")


def test_the_timeout_of_tricycle_controller_is_in_milliseconds(urdf, tmp_path):
    names = "traction_joint_name: front_joint, steering_joint_name: front_steering, cmd_vel_timeout: 250"
    wheels = REAR + wheel("front", "base_link", 0.5, 0.0, steered=True)
    text = car(wheels, controlled(tmp_path, "tricycle_controller/TricycleController", names))
    assert Simulation(urdf(text)).robots.first.settings.watchdog == 0.25


def test_the_limits_of_gz_without_a_direction_bound_turns_too(two_wheels):
    """gz's DiffDrive: `<max_velocity>` sets both the maximum linear and maximum angular velocity."""
    limits = tags(max_velocity="0.4", max_acceleration="2", max_jerk="3", min_acceleration="-1.5")
    found = Simulation(two_wheels(gz_diff(limits))).robots.first.settings.limits
    assert (found.linear_velocity, found.angular_velocity) == (0.4, 0.4)
    assert (found.linear_acceleration, found.angular_acceleration) == (2.0, 2.0)
    assert (found.linear_deceleration, found.angular_deceleration) == (1.5, 1.5)
    assert (found.linear_jerk, found.angular_jerk) == (3.0, 3.0)
