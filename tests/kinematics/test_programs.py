"""The table of plugins and controllers: each is recognised, and ignored settings are reported once."""

from __future__ import annotations

import pytest

from kbot.kinematics.drive.programs import (
    COVARIANCES,
    IGNORED,
    PROGRAMS,
    SAME,
    program_of_controller,
    program_of_plugin,
    setting_findings,
)
from kbot.model.load import load_robot_text
from kbot.sim.drive import odometry_settings

ROBOT = '<robot name="r"><link name="base"/><gazebo>{}</gazebo></robot>'


def test_every_program_has_settings_and_every_use_is_known():
    words = {value for name, value in vars(odometry_settings).items() if name.isupper() and value}
    used = {word for word in words if isinstance(word, str)} | {*COVARIANCES, "yes", IGNORED, SAME}
    used |= {"odometry_topic", "odometry_frame"}
    for program in PROGRAMS:
        assert program.settings, program.key
        names = [setting.name for setting in program.settings]
        assert len(names) == len(set(names)), program.key
        for setting in program.settings:
            assert set(setting.kbot.split("+")) <= used, setting


@pytest.mark.parametrize(
    ("words", "tags", "key"),
    [
        ("libgazeborosdiffdrive.sodrive", ["leftJoint"], "diff_drive_1"),
        ("libgazeborosdiffdrive.sodrive", ["left_joint"], "diff_drive_2"),
        ("libgazeborosdiffdrive.sodrive", ["left_joint", "updateRate", "publish_odom"], "diff_drive_2"),
        ("libgazeborosplanarmove.sodrive", ["odometryRate"], "planar_move_1"),
        ("libgazeborosplanarmove.sodrive", ["publish_rate"], "planar_move_2"),
        ("libgazeborosp3d.sop", ["bodyName"], "p3d_1"),
        ("libridgebackrosforcebasedmove.sodrive", [], "force_based_move"),
        ("gzsimdiffdrivesystemdrive", ["left_joint"], "gz_diff_drive"),
        ("ignitiongazebo6diffdrivesystemignition::gazebo::systems::diffdrive", [], "gz_diff_drive"),
        ("xgz::sim::systems::velocitycontrol", [], "gz_velocity_control"),
        ("libmydiffdrive.sodrive", ["leftJoint"], None),
        # ROS 2's tags in a plugin that exists for ROS 1 alone
        ("libgazeborosskidsteerdrive.sodrive", ["left_joint"], None),
    ],
)
def test_a_plugin_is_recognised_by_its_file_and_its_tags(words, tags, key):
    found = program_of_plugin(words, tags)
    assert (found.key if found is not None else None) == key


@pytest.mark.parametrize(
    ("kind", "ros", "key"),
    [
        ("diff_drive_controller/DiffDriveController", 1, "ros1_diff_drive"),
        ("diff_drive_controller/DiffDriveController", 2, "ros2_diff_drive"),
        ("tricycle_controller/TricycleController", 2, "ros2_tricycle"),
        ("tricycle_steering_controller/TricycleSteeringController", 2, "ros2_steering"),
        ("my_diff_drive_controller/DiffDriveController", 2, None),
    ],
)
def test_a_controller_is_recognised_by_its_type(kind, ros, key):
    found = program_of_controller(kind, ros)
    assert (found.key if found is not None else None) == key


def plugin(file: str, inner: str, name: str = "p") -> str:
    return f'<plugin name="{name}" filename="{file}">\n{inner}\n</plugin>'


TRACK = "gz-sim-track-controller-system"
CASES = [
    # a value other than the default
    (plugin("libgazebo_ros_ackermann_drive.so", "<max_speed>3</max_speed>"), ["<max_speed>"]),
    (plugin("libgazebo_ros_skid_steer_drive.so", "<torque>20</torque>"), ["<torque>"]),
    (
        plugin("gz-sim-pose-publisher-system", "<update_frequency>10</update_frequency>"),
        ["<update_frequency>"],
    ),
    # the default, written in any way
    (plugin("libgazebo_ros_ackermann_drive.so", "<max_speed>20.0</max_speed>"), []),
    (plugin("libgazebo_ros_ackermann_drive.so", "<publish_distance>0</publish_distance>"), []),
    (plugin(TRACK, "<track_orientation>0 0 0.0</track_orientation>"), []),
    (plugin(TRACK, "<track_orientation>0 0 1.57</track_orientation>"), ["<track_orientation>"]),
    # honoured, of no difference, and not of the plugin
    (plugin("libgazebo_ros_diff_drive.so", "<left_joint>a</left_joint><publish_odom>1</publish_odom>"), []),
    (plugin("libgazebo_ros_diff_drive.so", "<publish_wheel_tf>true</publish_wheel_tf>"), []),
    (plugin("libgazebo_ros_diff_drive.so", "<publish_odom>1</publish_odom><max_speed>3</max_speed>"), []),
    # without a default, any value
    (plugin(TRACK, "<max_command_age>1</max_command_age>"), ["<max_command_age>"]),
    # equal limits in both directions
    (
        plugin(
            TRACK,
            "<min_velocity>-1</min_velocity><max_velocity>1.0</max_velocity>",
        ),
        [],
    ),
    (plugin(TRACK, "<min_velocity>-1</min_velocity><max_velocity>2</max_velocity>"), ["<min_velocity>"]),
    # inside a tag
    (
        plugin(
            "gz-sim-tracked-vehicle-system",
            "<linear_velocity><min_jerk>-1</min_jerk></linear_velocity>",
        ),
        ["<linear_velocity.min_jerk>"],
    ),
]


@pytest.mark.parametrize(("text", "names"), CASES)
def test_an_ignored_setting_is_reported_once_at_its_line(text, names):
    robot = load_robot_text(ROBOT.format(text), "r.urdf").require()
    found = [*setting_findings(robot)]
    assert [d.message.split(": ")[1].split(" (")[0] for d in found] == [f"KBot ignores {n}" for n in names]
    assert {d.code for d in found} <= {"W149"}
    assert all(d.origin is not None and d.origin.span.line == 2 for d in found)


def test_parameters_of_a_controller_are_reported_in_their_file(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(
        "controller_manager: {ros__parameters: {base: {type: diff_drive_controller/DiffDriveController}}}\n"
        "base:\n  ros__parameters:\n    publish_limited_velocity: true\n"
        "    velocity_rolling_window_size: 10\n    linear.x.max_deceleration: .nan\n"
        "    enable_odom_tf: false\n"
    )
    text = plugin("libgz_ros2_control-system.so", f"<parameters>{file}</parameters>")
    (found,) = setting_findings(load_robot_text(ROBOT.format(text), "r.urdf").require())
    assert (
        found.message == "base: KBot ignores publish_limited_velocity (publish the command within its limits)"
    )
    assert found.origin is not None
    assert (found.origin.span.source.path, found.origin.span.line) == (str(file), 4)
