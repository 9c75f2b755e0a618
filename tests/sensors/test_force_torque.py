"""Force-torque sensors against statics."""

import math

import numpy as np
import pytest

from kbot.kinematics import Transform
from kbot.model.load import load_robot_text
from kbot.sensors import ForceTorque, Noise
from kbot.sim import Simulation
from kbot.text import KbotError

G = 9.81


def _robot(joint="fixed", rpy="0 0 0"):
    """A mass of 2 kg, 0.1 m beside a joint, which is 0.2 m above a base of 10 kg."""
    text = f"""<robot name="r">
      <link name="base"><inertial><mass value="10"/><origin xyz="0 0 0.05"/>
        <inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><origin xyz="0 0 0.05"/><geometry><box size=".6 .6 .1"/></geometry></collision></link>
      <link name="arm"><inertial><mass value="2"/><origin xyz="0.1 0 0"/>
        <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="wrist" type="{joint}"><parent link="base"/><child link="arm"/>
        <origin xyz="0 0 0.2" rpy="{rpy}"/><axis xyz="0 0 1"/></joint></robot>"""
    return load_robot_text(text, "r.urdf").require()


def _wrench(reading):
    f, t = reading.wrench.force, reading.wrench.torque
    return [f.x, f.y, f.z, t.x, t.y, t.z]


def _at_rest(robot, **spec):
    simulation = Simulation(robot)
    sensor = simulation.add_sensor(ForceTorque(joint="wrist", **spec))
    simulation.run(2.0)
    return simulation, sensor


def test_weight_at_rest_gives_its_force_and_torque():
    _, sensor = _at_rest(_robot())
    # the child's weight, 0.1 m ahead, pulls its parent down and turns it about +y
    assert _wrench(sensor.measure()) == pytest.approx([0, 0, -2 * G, 0, 0.1 * 2 * G, 0], abs=1e-3)
    assert sensor.latest.header.frame_id == "arm"


def test_parent_to_child_is_the_opposite_direction():
    _, sensor = _at_rest(_robot("continuous"), direction="parent_to_child")
    assert _wrench(sensor.measure()) == pytest.approx([0, 0, 2 * G, 0, -0.1 * 2 * G, 0], abs=1e-3)


@pytest.mark.parametrize(
    ("axes", "frame", "expected"),
    [
        # the child is rolled by 90 degrees: its y points up and its z right, so its weight is along -y
        ("child", "arm", [0, -2 * G, 0, 0, 0, -0.1 * 2 * G]),
        ("parent", "base", [0, 0, -2 * G, 0, 0.1 * 2 * G, 0]),
        # the sensor is rolled back
        ("sensor", "arm", [0, 0, -2 * G, 0, 0.1 * 2 * G, 0]),
    ],
)
def test_readings_are_in_the_axes_of_the_spec(axes, frame, expected):
    back = Transform.from_xyz_rpy((0, 0, 0), (-math.pi / 2, 0, 0))
    _, sensor = _at_rest(_robot(rpy=f"{math.pi / 2} 0 0"), axes=axes, pose=back)
    assert _wrench(sensor.measure()) == pytest.approx(expected, abs=1e-3)
    assert sensor.latest.header.frame_id == frame


def test_measuring_does_not_change_the_run():
    states = []
    for rate in (1.0, 500.0):
        simulation = Simulation(_robot("continuous"))
        simulation.add_sensor(ForceTorque(joint="wrist", rate=rate))
        simulation.disturbances.apply_body_wrench("arm", (0.0, 3.0, 0.0), 0.3)
        simulation.run(1.0)
        states.append(simulation.state_sha256())
    assert states[0] == states[1]


def test_noise_has_the_given_deviation():
    simulation, sensor = _at_rest(_robot(), force=Noise(stddev=0.5), torque=Noise(stddev=0.02), rate=500.0)
    received = []
    simulation.bus.subscribe(sensor.topic, sensor.message_type, received.append)
    simulation.run(4.0)
    values = np.array([_wrench(m) for m in received])
    # the standard error of the deviation of 2000 values is 1.6 %
    assert values[:, :3].std(axis=0) == pytest.approx([0.5] * 3, rel=0.08)
    assert values[:, 3:].std(axis=0) == pytest.approx([0.02] * 3, rel=0.08)
    assert values[:, 2].mean() == pytest.approx(-2 * G, abs=0.05)


def test_unknown_joint_is_rejected_with_a_suggestion():
    with pytest.raises(KbotError, match="did you mean 'wrist'"):
        Simulation(_robot()).add_sensor(ForceTorque(joint="wrst"))
