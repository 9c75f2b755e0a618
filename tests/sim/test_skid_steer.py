"""Skid-steer robots in a simulation: how far they turn, against Coulomb's law of friction."""

from math import cos, hypot, pi, radians, sin

import pytest

from kbot.sim import Simulation
from kbot.sim.injected_faults import Slip

ALONG, ACROSS = 0.2, 0.25
"""Distance in m of each wheel from the middle, along and across the robot."""


def skid_steer(surface: str = "", wheel_rpy: str = "0 0 0") -> str:
    """A robot of 9 kg with a wheel in each corner."""
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    parts = [f'<link name="base_link"><inertial><mass value="5"/>{inertia}</inertial></link>']
    for end, x in (("front", ALONG), ("rear", -ALONG)):
        for side, y in (("left", ACROSS), ("right", -ACROSS)):
            name = f"{end}_{side}"
            parts.append(
                f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.002" iyy="0.002" izz="0.002"'
                f' ixy="0" ixz="0" iyz="0"/></inertial><collision><origin rpy="{wheel_rpy}"/><geometry>'
                '<sphere radius="0.1"/></geometry></collision></link>'
                f'<joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
                f'<child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
                f'<gazebo reference="{name}">{surface}</gazebo>'
            )
    return f'<robot name="rover">{"".join(parts)}</robot>'


def turned_share(sim: Simulation, rate: float = 0.5) -> float:
    """The steady turning rate, as a share of the commanded one."""
    sim.cmd_vel(0.0, rate)
    sim.run(1.0)
    before = sim.ground_truth.unwrapped_yaw
    sim.cmd_vel(0.0, rate)
    sim.run(1.0)
    turned = sim.ground_truth.unwrapped_yaw - before
    return (turned % (2 * pi)) / rate


@pytest.mark.parametrize("friction", [0.3, 1.0])
@pytest.mark.parametrize("rate", [0.2, 0.5, 1.0])
def test_a_skid_steer_robot_turns_as_coulombs_law_says(urdf, friction, rate):
    """The rim of a wheel at a, b slips by v - w b forwards and w a sideways. The torque of the friction,
    which opposes the slip, vanishes at w = v b / (a^2 + b^2), for every coefficient."""
    sim = Simulation(urdf(skid_steer(f"<mu1>{friction}</mu1><mu2>{friction}</mu2>")))
    share = ACROSS**2 / (ALONG**2 + ACROSS**2)
    assert turned_share(sim, rate) == pytest.approx(share, rel=0.02)


@pytest.mark.parametrize(
    ("direction", "wheel_rpy", "along", "across"),
    [
        ("0 1 0", "0 0 0", 0.4, 0.8),  # the wheel's axis
        ("1 0 0", "0 0 0", 0.8, 0.4),  # it turns with the wheel: its rolling direction on the ground
        ("0 1 0", f"{pi / 2} 0 0", 0.8, 0.4),  # in the frame of the collision shape, as in Gazebo
    ],
)
def test_friction_by_direction_changes_how_far_it_turns(urdf, direction, wheel_rpy, along, across):
    """The friction that dissipates most within an ellipse is (m^2 s, n^2 t) / |(m s, n t)| for a slip of s, t
    and coefficients m, n. Its torque vanishes at w = v m^2 b / (m^2 b^2 + n^2 a^2)."""
    surface = f"<mu1>0.8</mu1><mu2>0.4</mu2><fdir1>{direction}</fdir1>"
    sim = Simulation(urdf(skid_steer(surface, wheel_rpy)))
    assert not sim.diagnostics
    share = (along * ACROSS) ** 2 / ((along * ACROSS) ** 2 + (across * ALONG) ** 2)
    assert turned_share(sim) == pytest.approx(share, rel=0.02)


def test_without_a_direction_the_second_friction_is_reported(urdf):
    sim = Simulation(urdf(skid_steer("<mu1>0.8</mu1><mu2>0.4</mu2>")))
    assert {finding.code for finding in sim.diagnostics} == {"W136"}


def test_a_skid_steer_robot_drives_straight(urdf):
    sim = Simulation(urdf(skid_steer()))
    sim.run(0.5)
    start = sim.ground_truth.pose.x
    for _ in range(200):
        sim.cmd_vel(0.5, 0.0)
        sim.run(0.02)
    driven = sim.ground_truth.pose.x - start
    assert driven == pytest.approx(sim.odometry.pose.x, rel=2e-3)
    assert sim.ground_truth.pose.y == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_skid_steer_robot_stands_still_on_a_slope(urdf, axis):
    sim = Simulation(urdf(skid_steer()))
    slope = radians(10.0)
    sim.engine.model.opt.gravity[[axis, 2]] = 9.81 * sin(slope), -9.81 * cos(slope)
    sim.run(1.0)
    before = sim.ground_truth.pose
    sim.run(4.0)
    after = sim.ground_truth.pose
    assert hypot(after.x - before.x, after.y - before.y) < 1e-4


def test_a_skid_steer_robot_on_slippery_wheels_stands_still(urdf):
    sim = Simulation(urdf(skid_steer()))
    for name in ("front_left", "front_right", "rear_left", "rear_right"):
        sim.disturbances.schedule(Slip(name, 0.0), at=0.0)
    sim.cmd_vel(0.5, 0.0)
    sim.run(2.0)
    assert sim.ground_truth.pose.x == pytest.approx(0.0, abs=0.01)


def test_the_turning_share_is_reported(urdf):
    sim = Simulation(urdf(skid_steer()))
    for _ in range(200):
        sim.cmd_vel(0.0, 0.5)
        sim.run(0.02)
    (found,) = (finding for finding in sim.findings if finding.code == "W301")
    assert "it turns 61 % of what its wheels indicate" in found.message


def husky_in(folder, *controls):
    """A description with gazebo_ros_control, and packages of controllers beside it."""
    plugin = '<gazebo><plugin name="control" filename="libgazebo_ros_control.so"/></gazebo>'
    text = skid_steer().replace("</robot>", f"{plugin}</robot>")
    for package, name, file in [("rover_description", "rover.urdf", text), *controls]:
        place = folder / package
        place.mkdir(exist_ok=True)
        (place / "package.xml").write_text(f"<package><name>{package}</name></package>")
        place = place / ("config" if name.endswith("yaml") else "urdf")
        place.mkdir(exist_ok=True)
        (place / name).write_text(file)
    return folder / "rover_description" / "urdf" / "rover.urdf"


CONTROL = """rover_velocity_controller:
  type: diff_drive_controller/DiffDriveController
  left_wheel: [front_left_joint, rear_left_joint]
  right_wheel: [front_right_joint, rear_right_joint]
  wheel_separation_multiplier: 1.64
"""


def test_a_drive_controller_beside_the_description_is_used(tmp_path):
    """The multiplier is that of the closed form, so the robot turns as commanded."""
    file = husky_in(tmp_path, ("rover_control", "control.yaml", CONTROL))
    sim = Simulation(str(file))
    (found,) = (finding for finding in sim.diagnostics if finding.code == "W148")
    assert str(tmp_path / "rover_control" / "config" / "control.yaml") in found.message
    assert turned_share(sim) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(
    "controls",
    [
        [("husky_control", "control.yaml", CONTROL)],  # another robot's package
        [("rover_control", "control.yaml", CONTROL), ("rover_gazebo", "control.yaml", CONTROL)],
        [("rover_control", "control.yaml", CONTROL.replace("rear_left_joint", "other"))],
        [("rover_control", "control.yaml", CONTROL.replace(", rear_left_joint", ""))],
        [("rover_control", "control.yaml", CONTROL.replace("diff_drive_controller/", "my_drive/"))],
        [("rover_control", "control.yaml", "a: [")],
    ],
)
def test_a_file_that_does_not_clearly_fit_is_not_used(tmp_path, controls):
    sim = Simulation(str(husky_in(tmp_path, *controls)))
    assert "W148" not in {finding.code for finding in sim.diagnostics}
