"""The simulation uses the description's own settings of its drive and its links' surfaces."""

import re
from math import pi

import pytest

from kbot.kinematics.drive.drive import find_drive
from kbot.messages import Odometry, Twist, Vector3
from kbot.model.load import load_robot, load_robot_text
from kbot.sim import DriveLimits, Simulation
from kbot.sim.drive.settings import drive_settings
from kbot.sim.drive.twist_controller import RateLimiter
from kbot.sim.engine.robot_builder import link_surfaces
from kbot.sim.naming import Naming
from kbot.text import DiagnosticCollector

from .test_spawned_drive import ROVER, WHEEL


@pytest.fixture(scope="module")
def plain() -> str:
    """KBot as URDF without a drive."""
    return load_robot("kbot", {"control": "none"}).expansion.text


@pytest.fixture
def with_extension(plain):
    def add(text: str):
        return load_robot_text(plain.replace("</robot>", f"{text}</robot>"), "kbot.urdf").require()

    return add


def settings_of(robot):
    findings = DiagnosticCollector()
    settings = drive_settings(robot, find_drive(robot), findings)
    return settings, findings.diagnostics


def classic(inner: str) -> str:
    return f'<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so">{inner}</plugin></gazebo>'


def gz(inner: str) -> str:
    return f'<gazebo><plugin name="gz::sim::systems::DiffDrive" filename="x">{inner}</plugin></gazebo>'


JOINTS = "<leftJoint>left_wheel_joint</leftJoint><rightJoint>right_wheel_joint</rightJoint>"
GZ_JOINTS = "<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>"


def test_settings_of_a_classic_plugin_are_read(with_extension):
    """As in the plugin's source, wheelAcceleration is that of the rim in m/s^2."""
    settings, diagnostics = settings_of(
        with_extension(
            classic(
                f"{JOINTS}<wheelSeparation>0.174</wheelSeparation><wheelDiameter>0.07</wheelDiameter>"
                "<wheelAcceleration>0.5</wheelAcceleration><wheelTorque>0.3</wheelTorque>"
                "<commandTopic>drive/cmd</commandTopic><odometryTopic>wheels</odometryTopic>"
                "<odometryFrame>start</odometryFrame>"
            )
        )
    )
    assert diagnostics == []
    assert (settings.radius, settings.separation, settings.torque) == (0.035, 0.174, 0.3)
    assert settings.limits.linear_acceleration == 0.5
    assert settings.limits.angular_acceleration == pytest.approx(0.5 / 0.087)
    assert (settings.command_topic, settings.odometry_topic) == ("/drive/cmd", "/wheels")
    assert settings.odometry_frame == "start"


def test_settings_of_a_gz_plugin_are_read(with_extension):
    settings, diagnostics = settings_of(
        with_extension(
            gz(
                f"{GZ_JOINTS}<wheel_separation>0.174</wheel_separation><wheel_radius>0.035</wheel_radius>"
                "<max_linear_velocity>0.5</max_linear_velocity><min_linear_velocity>-0.2</min_linear_velocity>"
                "<max_linear_acceleration>0.4</max_linear_acceleration>"
                "<min_linear_acceleration>-0.8</min_linear_acceleration>"
                "<max_angular_velocity>1.5</max_angular_velocity><max_linear_jerk>2</max_linear_jerk>"
            )
        )
    )
    assert diagnostics == []
    assert settings.limits == DriveLimits(
        linear_velocity=0.5,
        reverse_velocity=0.2,
        linear_acceleration=0.4,
        linear_deceleration=0.8,
        angular_velocity=1.5,
        linear_jerk=2.0,
    )


def test_settings_of_a_ros2_controller_include_its_multipliers(with_extension, tmp_path):
    file = tmp_path / "controllers.yaml"
    file.write_text(
        "controller_manager:\n  ros__parameters:\n    base:\n"
        "      type: diff_drive_controller/DiffDriveController\n"
        "base:\n  ros__parameters:\n    wheel_separation: 0.174\n    wheel_radius: 0.035\n"
        "    wheel_separation_multiplier: 1.1\n    cmd_vel_timeout: 0.25\n    odom_frame_id: wheels\n"
        "    linear:\n      x:\n        has_velocity_limits: true\n        max_velocity: 0.6\n"
        "        min_velocity: -0.3\n    angular.z.max_acceleration: 2.0\n"
        "    angular.z.has_jerk_limits: false\n    angular.z.max_jerk: 3.0\n"
        "    angular.z.max_velocity: NAN\n    linear.x.max_jerk: .nan\n"  # no limit
    )
    plugin = f'<gazebo><plugin name="r" filename="x"><parameters>{file}</parameters></plugin></gazebo>'
    settings, diagnostics = settings_of(with_extension(plugin))
    assert diagnostics == []
    assert settings.separation == pytest.approx(0.174 * 1.1)
    assert (settings.watchdog, settings.odometry_frame) == (0.25, "wheels")
    assert settings.limits == DriveLimits(linear_velocity=0.6, reverse_velocity=0.3, angular_acceleration=2.0)


def test_missing_parameter_file_is_reported(with_extension):
    plugin = (
        '<gazebo><plugin name="r" filename="x"><parameters>/nowhere/c.yaml</parameters></plugin></gazebo>'
    )
    robot = with_extension(plugin)
    assert [d.code for d in Simulation(robot).diagnostics] == ["W132"]
    assert settings_of(robot)[0].radius == 0.035


@pytest.mark.parametrize("text", ["a: !!int ''\n", "a: 2020-13-45\n", "a: " + "[" * 5000, "a: [\n"])
def test_invalid_yaml_of_parameters_is_reported(with_extension, tmp_path, text):
    file = tmp_path / "c.yaml"
    file.write_text(text)
    plugin = f'<gazebo><plugin name="r" filename="x"><parameters>{file}</parameters></plugin></gazebo>'
    (finding,) = Simulation(with_extension(plugin)).diagnostics
    assert finding.code == "W132"
    assert "is not valid YAML" in finding.message
    assert finding.origin.span.file == str(file)


@pytest.mark.parametrize(
    ("size", "code"), [("1e-320", "W131"), ("1e300", "W131"), ("-0.17", "W130"), ("wide", "W130")]
)
def test_absurd_size_is_ignored_and_reported(with_extension, size, code):
    """With this size odometry would be infinite."""
    robot = with_extension(classic(f"{JOINTS}<wheelSeparation>{size}</wheelSeparation>"))
    settings, diagnostics = settings_of(robot)
    assert [d.code for d in diagnostics] == [code]
    assert settings.separation == pytest.approx(0.174)
    Simulation(robot).run(0.1)


TWICE = "use twice the radius of the wheels: 0.07"


@pytest.mark.parametrize(
    ("plugin", "hint"),
    [
        (
            classic(f"{JOINTS}<wheelDiameter>0.08</wheelDiameter>"),
            "use twice the radius of the wheels: 0.07",
        ),
        (
            classic(f"{JOINTS}<wheel_diameter>0.08</wheel_diameter>"),
            "use twice the radius of the wheels: 0.07",
        ),
        (gz(f"{GZ_JOINTS}<wheel_radius>0.04</wheel_radius>"), "use the radius of the wheels: 0.035"),
    ],
)
def test_hint_gives_a_valid_value_of_the_tag(with_extension, plugin, hint):
    """The tag of a diameter gets a diameter. A robot that follows the hint has no finding."""
    sim = Simulation(with_extension(plugin))
    (found,) = sim.diagnostics
    assert (found.code, sim.robots.first.settings.radius) == ("D106", pytest.approx(0.04))
    assert found.hint == hint
    followed = re.sub(r"0\.0[48](?=</wheel)", hint.split()[-1], plugin)
    sim = Simulation(with_extension(followed))
    assert (sim.robots.first.settings.radius, sim.diagnostics) == (pytest.approx(0.035), ())


@pytest.mark.parametrize("diameter", ["0.156", "0.158", "0.16"])
def test_wheels_of_different_radii_are_named_without_advising_their_mean(urdf, diameter):
    """With 78 mm left and 80 mm right, neither wheel has the mean radius of 79 mm."""
    sides = WHEEL.replace('radius="0.1"', 'radius="0.078"').format("left", 0.2)
    sides += WHEEL.replace('radius="0.1"', 'radius="0.08"').format("right", -0.2)
    joints = "<leftJoint>left_joint</leftJoint><rightJoint>right_joint</rightJoint>"
    robot = urdf(ROVER.format(sides + classic(f"{joints}<wheelDiameter>{diameter}</wheelDiameter>")))
    sim = Simulation(robot)
    (found,) = sim.diagnostics
    assert found.code == "D106"
    assert "the wheels have 0.078 on 'left_joint' and 0.08 on 'right_joint'" in found.message
    assert "0.079" not in found.message.replace("is 0.079 m", "") + found.hint
    assert sim.robots.first.settings.radius == float(diameter) / 2.0


@pytest.mark.parametrize("what", ["wheel_separation_multiplier", "left_wheel_radius_multiplier"])
def test_invalid_multiplier_is_ignored_and_reported(with_extension, tmp_path, what):
    file = tmp_path / "controllers.yaml"
    file.write_text(
        "controller_manager:\n  ros__parameters:\n    base:\n"
        "      type: diff_drive_controller/DiffDriveController\n"
        f"base:\n  ros__parameters:\n    {what}: 0.0\n"
    )
    plugin = f'<gazebo><plugin name="r" filename="x"><parameters>{file}</parameters></plugin></gazebo>'
    robot = with_extension(plugin)
    settings, diagnostics = settings_of(robot)
    assert [d.code for d in diagnostics] == ["W130"]
    assert (settings.radius, settings.separation) == pytest.approx((0.035, 0.174))
    sim = Simulation(robot)
    sim.cmd_vel(0.1, 0.0)
    sim.run(0.1)


def test_wrong_separation_turns_wrong_and_is_reported(with_extension):
    """With 0.15 m for wheels that are 0.174 m apart, the robot makes 0.15/0.174 of a commanded turn.

    Its odometry indicates a full turn.
    """
    robot = with_extension(classic(f"{JOINTS}<wheelSeparation>0.15</wheelSeparation>"))
    sim = Simulation(robot)
    assert [d.code for d in sim.diagnostics] == ["D105"]
    assert "+16 % off" in sim.diagnostics[0].message
    sim.cmd_vel(0.0, 1.0)
    sim.run(2 * pi)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    assert sim.ground_truth.unwrapped_yaw == pytest.approx(2 * pi * 0.15 / 0.174, abs=1e-3)
    assert sim.odometry.unwrapped_yaw == pytest.approx(2 * pi, abs=1e-3)


def test_invalid_number_is_ignored_and_reported(with_extension):
    settings, diagnostics = settings_of(
        with_extension(classic(f"{JOINTS}<wheelSeparation>wide</wheelSeparation>"))
    )
    assert [d.code for d in diagnostics] == ["W130"]
    assert settings.separation == pytest.approx(0.174)


def test_topics_of_the_plugin_are_used(with_extension):
    robot = with_extension(
        classic(f"{JOINTS}<commandTopic>go</commandTopic><odometryTopic>went</odometryTopic>")
    )
    sim, received = Simulation(robot), []
    sim.bus.subscribe("/went", Odometry, received.append)
    sim.bus.publish("/go", Twist(Vector3(0.2, 0.0, 0.0)))
    sim.run(0.4)
    assert received[-1].twist.twist.linear.x > 0.1


@pytest.mark.parametrize(
    ("inside", "command", "odometry"),
    [
        ("", "/fleet/cmd_vel", "/fleet/odom"),
        ("<robotNamespace>/bot</robotNamespace><odometryTopic>/o</odometryTopic>", "/bot/cmd_vel", "/o"),
        ("<ros><namespace>bot</namespace><remapping>odom:=o</remapping></ros>", "/fleet/cmd_vel", "/fleet/o"),
        (
            "<ros><remapping>drive:=/go</remapping></ros><command_topic>drive</command_topic>",
            "/go",
            "/fleet/odom",
        ),
    ],
)
def test_topics_of_the_plugin_are_in_its_namespace(with_extension, inside, command, odometry):
    """The names equal those of gazebo_ros for a robot that was spawned in `fleet`."""
    sim = Simulation(with_extension(classic(JOINTS + inside)), naming=Naming("rover", "fleet"))
    assert command in sim.bus.inputs
    assert sim.bus.topics[odometry] is Odometry
    assert not {"/fleet/cmd_vel", "/fleet/odom"} & (sim.bus.topics.keys() - {command, odometry})


def test_friction_of_a_link_is_read(with_extension):
    robot = with_extension(
        '<gazebo reference="left_wheel"><mu1>0.2</mu1></gazebo>'
        "<gazebo><self_collide>1</self_collide></gazebo>"
        '<gazebo reference="base_link"><turnGravityOff>true</turnGravityOff></gazebo>'
        '<gazebo reference="left_weel"><mu1>1</mu1></gazebo>'
        '<gazebo reference="right_wheel"><mu1>x</mu1></gazebo>'
    )
    findings = DiagnosticCollector()
    surfaces = link_surfaces(robot, findings)
    assert surfaces["left_wheel"].friction == 0.2
    assert not surfaces["base_link"].gravity
    assert all(surface.self_collide for surface in surfaces.values())
    assert [d.code for d in findings.diagnostics] == ["W133", "W130"]
    assert "did you mean 'left_wheel'" in findings.diagnostics[0].hint


def test_tyres_on_ice_slip(plain):
    """With friction of 0.02 nothing accelerates faster than 0.2 m/s^2, at any wheel speed."""
    ice = re.sub(r"<mu([12])>1.0</mu\1>", r"<mu\1>0.02</mu\1>", plain)
    sim = Simulation(load_robot_text(ice, "ice.urdf").require())
    sim.cmd_vel(0.5, 0.0)
    sim.run(0.5)
    assert sim.ground_truth.twist.x < 0.02 * 9.81 * 0.5 * 1.05
    assert sim.odometry.twist.x > 0.2


def test_jerk_limit_holds_and_the_target_is_reached():
    """The acceleration changes by at most jerk x period and never exceeds its limit."""
    slope, value, before = RateLimiter(0.01, 1.0, jerk=5.0), 0.0, 0.0
    values = []
    for _ in range(200):
        if value == 0.8:
            break
        value, mean = slope.advance(value, 0.8)
        assert values[-1] if values else 0.0 <= mean <= value + 1e-12
        assert abs(slope.acceleration) <= 1.0 + 1e-9
        assert slope.acceleration - before <= 0.05 + 1e-9
        before = slope.acceleration
        values.append(value)
    assert value == 0.8
    assert max(values) == 0.8
    # 0.2 s up to 1 m/s^2, 0.2 s down, and the rest at 1 m/s^2: 0.8 + 0.2 s
    assert len(values) == pytest.approx(100, abs=6)


def test_deceleration_has_its_own_limit():
    slope = RateLimiter(0.01, 1.0, deceleration=2.0)
    assert slope.advance(0.5, 0.0)[0] == pytest.approx(0.48)
    assert slope.advance(0.0, 0.5)[0] == pytest.approx(0.01)
    assert slope.advance(-0.5, 0.5)[0] == pytest.approx(-0.48)


def test_unknown_joints_of_a_plugin_are_reported(with_extension):
    wrong = JOINTS.replace("left_wheel_joint", "left_weel_joint")
    sim = Simulation(with_extension(classic(wrong)))
    assert [d.code for d in sim.diagnostics] == ["D101"]
    assert "did you mean 'left_wheel_joint'" in sim.diagnostics[0].hint


def test_friction_is_read_from_an_attribute(with_extension):
    robot = with_extension('<gazebo reference="left_wheel"><mu1 value="0.3"/></gazebo>')
    findings = DiagnosticCollector()
    assert link_surfaces(robot, findings)["left_wheel"].friction == 0.3
    assert findings.diagnostics == []
