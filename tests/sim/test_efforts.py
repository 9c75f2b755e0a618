"""The efforts of driving joints, against the mechanics of rigid bodies.

KBot weighs M = 1.1499 kg. Its two wheels have a radius of r = 0.035 m and, about their axles, inertias of
I = 3.064e-5 kg m^2. Its joints are damped, which the motors overcome.
"""

from math import degrees, pi, radians, sin

import pytest

from kbot.kinematics.bodies import total_mass
from kbot.sim import DriveLimits, Simulation
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.trials.trace import Sampler

STEPS = (0.0005, 0.001, 0.002, 0.004)
GRAVITY = 9.81
RADIUS = 0.035


def _part(name: str, mass: float, shape: str, moment: float) -> str:
    inertia = f'ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"'
    return (
        f'<link name="{name}"><collision><origin rpy="{pi / 2} 0 0"/><geometry>{shape}</geometry></collision>'
        f'<inertial><mass value="{mass}"/><inertia {inertia}/></inertial></link>'
    )


def _joint(name: str, kind: str, place: str) -> str:
    return (
        f'<joint name="{name}_joint" type="{kind}"><parent link="base_link"/><child link="{name}"/>'
        f'<origin xyz="{place}"/><axis xyz="0 1 0"/><limit effort="0.05" velocity="50"/></joint>'
    )


WEAK = (
    '<robot name="weak">'
    + _part("base_link", 4.9, '<box size="0.3 0.04 0.2"/>', 0.05)
    + "".join(
        _part(name, 0.5, '<cylinder radius="0.05" length="0.02"/>', 0.0004) for name in ("left", "right")
    )
    + _part("caster", 0.1, '<sphere radius="0.02"/>', 0.0001)
    + _joint("left", "continuous", "0 0.15 0")
    + _joint("right", "continuous", "0 -0.15 0")
    + _joint("caster", "fixed", "-0.13 0 -0.03")
    + '<gazebo><plugin name="diff" filename="libgazebo_ros_diff_drive.so"><left_joint>left_joint</left_joint>'
    "<right_joint>right_joint</right_joint></plugin></gazebo></robot>"
)


def speeding_up(robot, acceleration: float = 1.0) -> float:
    """The torque in N m on each of two wheels: the force M a / 2 at the rim, and the wheel's spin I a / r."""
    spin = robot.links["left_wheel"].inertial.izz
    return (total_mass(robot) / 2 * RADIUS + spin / RADIUS) * acceleration


def weight_on_slope(robot, angle: float) -> float:
    return total_mass(robot) * GRAVITY * sin(radians(angle)) * RADIUS / 2


def sampled(simulation: Simulation, seconds: float) -> list[float]:
    """The efforts of both wheels in every control period."""
    efforts = []
    for _ in range(round(seconds / CONTROL_PERIOD)):
        simulation.run(CONTROL_PERIOD)
        efforts += simulation.joint_states.effort
    return efforts


@pytest.mark.parametrize("speed", [0.2, 0.9])
@pytest.mark.parametrize("timestep", STEPS)
def test_no_effort_at_constant_speed_on_level_ground(kbot_robot, timestep, speed):
    simulation = Simulation(kbot_robot, timestep=timestep)
    simulation.cmd_vel(speed, 0.0)
    simulation.run(3.0)
    assert max(map(abs, sampled(simulation, 1.0))) < 0.005 * speeding_up(kbot_robot)


@pytest.mark.parametrize("speed", [0.2, -0.2, 0.0])
@pytest.mark.parametrize("timestep", STEPS)
def test_effort_on_a_slope_is_that_of_the_weight(kbot_robot, timestep, speed):
    """Driving up, rolling back, and standing."""
    simulation = Simulation(kbot_robot, "ramp:angle=10", timestep=timestep)
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(4.0)
    simulation.cmd_vel(speed, 0.0)
    simulation.run(1.0)
    assert degrees(simulation.link_pose("base_link").rpy[1]) == pytest.approx(-10.0, abs=0.01)
    weight = weight_on_slope(kbot_robot, 10.0)
    assert simulation.joint_states.effort == pytest.approx((weight, weight), rel=0.01)


@pytest.mark.parametrize("timestep", STEPS)
def test_effort_of_speeding_up_and_braking(kbot_robot, timestep):
    simulation = Simulation(kbot_robot, timestep=timestep)
    simulation.cmd_vel(0.9, 0.0)
    simulation.run(0.3)
    torque = speeding_up(kbot_robot)
    efforts = sampled(simulation, 0.5)
    assert efforts == pytest.approx([torque] * len(efforts), rel=0.01)
    simulation.run(1.0)
    simulation.cmd_vel(0.0, 0.0)
    simulation.run(0.3)
    efforts = sampled(simulation, 0.5)
    assert efforts == pytest.approx([-torque] * len(efforts), rel=0.01)


@pytest.mark.parametrize("timestep", STEPS)
@pytest.mark.parametrize("speed", [0.2, 0.8])
def test_energy_from_rest_to_rest_is_the_kinetic_energy_at_full_speed(kbot_robot, timestep, speed):
    """M v^2 / 2 + 2 I (v / r)^2 / 2. Braking returns it, which does not count, and friction takes nothing."""
    simulation = Simulation(kbot_robot, timestep=timestep)
    sampler = Sampler(simulation, with_clearance=False)
    for command in (speed, 0.0):
        simulation.cmd_vel(command, 0.0)
        for _ in range(100):
            simulation.run(CONTROL_PERIOD)
            sampler.sample()
    spin = kbot_robot.links["left_wheel"].inertial.izz
    work = total_mass(kbot_robot) / 2 * speed**2 + spin * (speed / RADIUS) ** 2
    assert sampler.now["energy"] == pytest.approx(work, rel=0.01)
    assert simulation.ground_truth.twist.x == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("timestep", STEPS)
def test_weak_motors_accelerate_with_their_whole_torque(urdf, timestep):
    """0.05 N m at two wheels of 0.05 m pull with 2 N, and accelerate 6 kg and the spin of the wheels."""
    simulation = Simulation(urdf(WEAK), timestep=timestep, limits=DriveLimits(linear_acceleration=5.0))
    simulation.cmd_vel(2.0, 0.0)
    simulation.run(1.0)
    before = simulation.ground_truth.twist.x
    efforts = sampled(simulation, 1.0)
    acceleration = 2.0 / (6.0 + 2 * 0.0004 / 0.05**2)
    assert simulation.ground_truth.twist.x - before == pytest.approx(acceleration, rel=0.01)
    # the limit is exact, and nothing ripples at it
    assert efforts == pytest.approx([0.05] * len(efforts), rel=1e-6)
