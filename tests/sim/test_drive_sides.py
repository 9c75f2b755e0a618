"""The simulation drives the joints that a plugin or controller names, on the sides that it names.

gazebo_ros_diff_drive, gz's DiffDrive and diff_drive_controller command (v - w s/2)/r to the left joints and
(v + w s/2)/r to the right ones, and compute the rotation of their odometry from right minus left. With
exchanged names a robot that is commanded +w therefore turns at -w, while its odometry turns at +w.
"""

import re

import pytest

from kbot.cli.main import main
from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive, find_drive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.robot_info import describe
from kbot.model.load import load_robot, load_robot_text
from kbot.navigation.simulated.mobility import mobility
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.workbench.session.driven_session import reason_not_driving

LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"
YAML = """controller_manager:
  ros__parameters:
    base: {{type: diff_drive_controller/DiffDriveController}}
base:
  ros__parameters:
    left_wheel_names: [{left}]
    right_wheel_names: [{right}]
"""


@pytest.fixture(scope="module")
def plain() -> str:
    """KBot as URDF without a drive."""
    return load_robot("kbot", {"control": "none"}).expansion.text


@pytest.fixture(params=["classic", "gz", "ros2_control"])
def named(request, plain, tmp_path):
    """KBot with a drive of each kind, with these joints as left and right."""

    def build(left: str, right: str, change=lambda text: text):
        if request.param == "classic":
            plugin = f"<leftJoint>{left}</leftJoint><rightJoint>{right}</rightJoint>"
            attributes = 'name="d" filename="libgazebo_ros_diff_drive.so"'
        elif request.param == "gz":
            plugin = f"<left_joint>{left}</left_joint><right_joint>{right}</right_joint>"
            attributes = 'name="gz::sim::systems::DiffDrive" filename="gz-sim-diff-drive-system"'
        else:
            (tmp_path / "c.yaml").write_text(YAML.format(left=left, right=right))
            plugin, attributes = f"<parameters>{tmp_path}/c.yaml</parameters>", 'name="r" filename="x"'
        text = plain.replace("</robot>", f"<gazebo><plugin {attributes}>{plugin}</plugin></gazebo></robot>")
        return load_robot_text(change(text), "kbot.urdf").require()

    return build


def one_tag_each(text: str) -> str:
    """Write `<a>x, y</a>` as `<a>x</a><a>y</a>`, because plugins take one joint per tag."""
    return re.sub(r"<(\w+)>(\w+), (\w+)</\1>", r"<\1>\2</\1><\1>\3</\1>", text)


def driven(robot, linear: float, angular: float) -> Simulation:
    sim = Simulation(robot)
    sim.cmd_vel(linear, angular)
    sim.run(2.0)
    return sim


def codes(sim: Simulation) -> list[str]:
    return [d.code for d in sim.diagnostics]


def test_exchanged_sides_turn_against_the_command_while_odometry_agrees_with_it(named):
    """0.5 rad/s for 2 s with a ramp of 8 rad/s^2 gives 1 - 0.5^2/(2*8) = 0.984 rad, minus the servos' lag."""
    right, wrong = driven(named(LEFT, RIGHT), 0.0, 0.5), driven(named(RIGHT, LEFT), 0.0, 0.5)
    assert right.ground_truth.pose.yaw == pytest.approx(0.984, rel=0.03)
    assert wrong.ground_truth.pose.yaw == pytest.approx(-right.ground_truth.pose.yaw, rel=1e-3)
    assert wrong.odometry.pose.yaw == pytest.approx(right.odometry.pose.yaw, rel=1e-3)
    assert (codes(right), codes(wrong)) == ([], ["D107"])
    assert wrong.diagnostics[0].message.endswith(
        f"its left joint '{RIGHT}' turns the wheel at y = -87 mm, on the right: turns are reversed"
    )


def test_drive_uses_the_sides_of_its_plugin_or_controller(named):
    robot = named(RIGHT, LEFT)
    assert (find_drive(robot).left, find_drive(robot).right) == ((RIGHT,), (LEFT,))
    assert describe(robot)["drive"]["left"] == [RIGHT]


def test_exchanged_sides_still_drive_straight(named):
    """0.2 m/s for 2 s with a ramp of 1 m/s^2 gives 0.4 - 0.2^2/2 = 0.38 m."""
    sim = driven(named(RIGHT, LEFT), 0.2, 0.0)
    assert sim.ground_truth.pose.x == pytest.approx(0.38, rel=0.03)
    assert abs(sim.ground_truth.pose.y) < 1e-3


def test_wheel_axes_to_the_right_drive_backwards(named):
    """Both wheels turn backwards: x is -0.38 m, and that of the odometry +0.38 m."""

    def flipped(text: str) -> str:
        return text.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>')

    sim = driven(named(LEFT, RIGHT, flipped), 0.2, 0.0)
    assert sim.ground_truth.pose.x == pytest.approx(-0.38, rel=0.03)
    assert sim.odometry.pose.x == pytest.approx(0.38, rel=0.03)
    assert codes(sim) == ["D109"]
    # exchanged names and axes together are a robot turned by 180 degrees, which turns as commanded
    assert driven(named(RIGHT, LEFT, flipped), 0.0, 0.5).ground_truth.pose.yaw == pytest.approx(
        0.984, rel=0.03
    )


def test_goals_are_rejected_if_the_robot_turns_against_its_commands(named):
    mobility(Simulation(named(LEFT, RIGHT)))
    with pytest.raises(
        KbotError, match=rf"cannot follow a path: its left joint '{RIGHT}'.*turns are reversed"
    ):
        mobility(Simulation(named(RIGHT, LEFT)))


def test_drive_with_one_joint_on_both_sides_does_not_move(named):
    robot = named(LEFT, LEFT)
    sim = Simulation(robot)
    assert codes(sim) == ["D131"]
    assert isinstance(sim.robots.first.drive, NoDrive)
    reason = f"its drive names the joint '{LEFT}' both as left and as right"
    with pytest.raises(KbotError, match=f"robot 'kbot' cannot drive: {reason}"):
        sim.cmd_vel(0.2, 0.0)
    assert reason_not_driving(robot) == reason  # the page shows the reason
    sim.run(0.5)
    assert abs(sim.ground_truth.pose.x) < 1e-3


def test_one_joint_on_both_sides_is_a_one_line_error_of_the_command(plain, tmp_path, capsys):
    joint = f"<leftJoint>{LEFT}</leftJoint><rightJoint>{LEFT}</rightJoint>"
    plugin = f'<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so">{joint}</plugin></gazebo>'
    file = tmp_path / "same.urdf"
    file.write_text(plain.replace("</robot>", f"{plugin}</robot>"))
    with pytest.raises(SystemExit) as end:
        main(["sim", str(file), "--headless", "--duration", "1", "--cmd-vel", "0.2,0"])
    assert end.value.code == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error == (
        f"error: robot 'kbot' cannot drive: its drive names the joint '{LEFT}' both as left and as right"
    )


@pytest.mark.parametrize(
    ("left", "right", "side"),
    [(f"{LEFT}, {LEFT}", RIGHT, "left"), (LEFT, f"{RIGHT}, {RIGHT}", "right")],
)
def test_drive_with_a_joint_twice_on_one_side_does_not_move(named, left, right, side):
    """gazebo_ros_diff_drive and diff_drive_controller do not start with this."""
    robot = named(left, right, one_tag_each)
    sim = Simulation(robot)
    assert codes(sim) == ["D131"]
    joint = LEFT if side == "left" else RIGHT
    assert reason_not_driving(robot) == f"its drive names the joint '{joint}' twice as {side}"
    with pytest.raises(KbotError, match=f"'{joint}' twice as {side}"):
        sim.cmd_vel(0.2, 0.0)


def test_two_plugins_can_name_the_same_joints(plain):
    """Descriptions for both Gazebo Classic and gz have two plugins."""
    names = (
        ("libgazebo_ros_diff_drive.so", "leftJoint", "rightJoint"),
        ("DiffDrive", "left_joint", "right_joint"),
    )
    plugins = "".join(
        f'<gazebo><plugin name="{file}" filename="{file}"><{left}>{LEFT}</{left}><{right}>{RIGHT}</{right}>'
        "</plugin></gazebo>"
        for file, left, right in names
    )
    sim = Simulation(load_robot_text(plain.replace("</robot>", f"{plugins}</robot>"), "k.urdf").require())
    assert codes(sim) == []
    assert (sim.robots.first.drive.left, sim.robots.first.drive.right) == ((LEFT,), (RIGHT,))


WHEEL = """<link name="{0}"><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1"
 length="0.03"/></geometry></collision></link><joint name="{0}" type="continuous"><parent link="base"/>
 <child link="{0}"/><origin xyz="{1} {2} 0"/><axis xyz="0 1 0"/></joint>"""


@pytest.mark.parametrize(
    ("tags", "left", "right", "wrong"),
    [
        (("fl", "rl", "fr", "rr"), ("fl", "rl"), ("fr", "rr"), set()),
        (("fr", "rr", "fl", "rl"), ("fr", "rr"), ("fl", "rl"), {"fl", "fr", "rl", "rr"}),
        (("fl", "rr", "fr", "rl"), ("fl", "rr"), ("fr", "rl"), {"rl", "rr"}),
    ],
)
def test_skid_steer_uses_the_sides_of_its_plugin(urdf, tags, left, right, wrong):
    places = {"fl": (0.2, 0.2), "rl": (-0.2, 0.2), "fr": (0.2, -0.2), "rr": (-0.2, -0.2)}
    wheels = "".join(WHEEL.format(name, *place) for name, place in places.items())
    names = ("leftFrontJoint", "leftRearJoint", "rightFrontJoint", "rightRearJoint")
    joints = "".join(f"<{tag}>{joint}</{tag}>" for tag, joint in zip(names, tags, strict=True))
    plugin = (
        f'<gazebo><plugin name="d" filename="libgazebo_ros_skid_steer_drive.so">{joints}</plugin></gazebo>'
    )
    drive = find_drive(urdf(f'<robot name="r"><link name="base"/>{wheels}{plugin}</robot>'))
    assert isinstance(drive, DifferentialDrive)
    assert (drive.left, drive.right, set(drive.mistakes)) == (left, right, wrong)
    assert drive.separation == pytest.approx(0.4)


def test_plugin_without_a_right_joint_does_not_drive(urdf):
    wheels = WHEEL.format("l", 0, 0.2) + WHEEL.format("r", 0, -0.2)
    joints = "<left_joint>l</left_joint><left_joint>r</left_joint>"
    plugin = f'<gazebo><plugin name="gz::sim::systems::DiffDrive" filename="x">{joints}</plugin></gazebo>'
    drive = find_drive(urdf(f'<robot name="r"><link name="base"/>{wheels}{plugin}</robot>'))
    assert isinstance(drive, NoDrive)
    assert drive.reason == "its drive does not name a right joint"


CASTER = """<link name="ball"><collision><geometry><sphere radius="0.03"/></geometry></collision></link>
<joint name="ball_joint" type="continuous"><parent link="base"/><child link="ball"/>
<origin xyz="-0.2 0 -0.07"/><axis xyz="0 1 0"/></joint><link name="hat"/><joint name="hat_joint" type="fixed">
<parent link="base"/><child link="hat"/></joint>"""
MASS = '<inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


@pytest.mark.parametrize("kind", ["classic", "gz", "ros2_control"])
@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ("ball_joint", "the drive names the joint 'ball_joint', which is not a driving wheel's joint"),
        ("hat_joint", "the drive names the joint 'hat_joint', which is not a driving wheel's joint"),
        ("r_wheel", "its right joint 'r_wheel' is not a joint of this robot"),
        ("", "the drive does not name a right joint"),
        (None, "the drive does not name a right joint"),
    ],
)
def test_drive_of_a_joint_without_a_wheel_is_reported_with_the_driven_wheels(
    urdf, tmp_path, kind, wrong, what
):
    right = f"<right_joint>{wrong}</right_joint>" if wrong is not None else ""
    text = f"<left_joint>l</left_joint>{right}"
    attributes = 'name="gz::sim::systems::DiffDrive" filename="gz-sim-diff-drive-system"'
    if kind == "classic":
        text = text.replace("left_joint", "leftJoint").replace("right_joint", "rightJoint")
        attributes = 'name="d" filename="libgazebo_ros_diff_drive.so"'
    elif kind == "ros2_control":
        yaml = YAML.format(left="l", right=wrong or "")
        if wrong is None:
            yaml = yaml[: yaml.index("    right_wheel_names")]
        (tmp_path / "c.yaml").write_text(yaml)
        text, attributes = f"<parameters>{tmp_path}/c.yaml</parameters>", 'name="r" filename="x"'
    wheels = WHEEL.format("l", 0, 0.2) + WHEEL.format("r", 0, -0.2) + CASTER
    plugin = f"<gazebo><plugin {attributes}>{text}</plugin></gazebo>"
    bodies = wheels.replace("<collision>", f"{MASS}<collision>")  # bodies without mass cannot be driven
    sim = Simulation(urdf(f'<robot name="r"><link name="base">{MASS}</link>{bodies}{plugin}</robot>'))
    (found,) = [d for d in sim.diagnostics if d.code in ("D101", "W134")]
    assert found.code == ("D101" if wrong == "r_wheel" else "W134")
    like_this = "" if wrong == "r_wheel" else " like this"
    assert found.message.endswith(
        f"{what}: outside KBot the robot does not drive{like_this}; KBot drives 'r' instead"
    )
    assert found.hint == "name the joint that turns the right wheel: 'r'"
    assert found.origin is not None
    assert isinstance(sim.robots.first.drive, DifferentialDrive)
    assert sim.robots.first.drive.joints == ("l", "r")


@pytest.mark.parametrize(
    "plugin",
    [
        '<plugin name="diff_drive_control" filename="libgazebo_ros_control.so"/>',
        '<plugin name="d" filename="libgazebo_ros_diff_drive.so"/>',
    ],
)
def test_other_plugins_and_default_joint_names_are_not_reported(urdf, plugin):
    """gazebo_ros_diff_drive uses `left_joint` and `right_joint` if no names are given."""
    wheels = WHEEL.format("left_joint", 0, 0.2) + WHEEL.format("right_joint", 0, -0.2)
    if "control.so" in plugin:
        wheels = wheels.replace("left_joint", "l").replace("right_joint", "r")
    robot = urdf(f'<robot name="r"><link name="base"/>{wheels}<gazebo>{plugin}</gazebo></robot>')
    assert findings_of_drive(robot, find_drive(robot)) == ()
