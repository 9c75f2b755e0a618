import pytest

from kbot.model import Robot
from kbot.model.load import load_robot, load_robot_text
from kbot.sim import Simulation


@pytest.fixture(scope="session")
def kbot_robot() -> Robot:
    return load_robot("kbot").require()


@pytest.fixture
def sim(kbot_robot) -> Simulation:
    return Simulation(kbot_robot)


@pytest.fixture
def urdf():
    """Reads a robot from URDF text."""

    def read(text: str) -> Robot:
        return load_robot_text(text, "robot.urdf").require()

    return read


@pytest.fixture
def ball(urdf) -> Robot:
    """A robot without wheels: one ball of 1 kg."""
    inertia = '<inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/>'
    return urdf(
        f'<robot name="ball"><link name="ball"><inertial><mass value="1"/>{inertia}</inertial>'
        '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
    )
