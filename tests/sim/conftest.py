from pathlib import Path

import pytest

from kbot.model import RobotModel
from kbot.model.load import load_robot, load_robot_text
from kbot.model.spawned import with_controllers
from kbot.ros.launch import read_launch
from kbot.ros.launch.node_settings.spawner import read_controllers
from kbot.sim import Simulation
from kbot.xacro import Packages


@pytest.fixture(scope="session")
def kbot_robot() -> RobotModel:
    return load_robot("kbot").require()


@pytest.fixture
def sim(kbot_robot) -> Simulation:
    return Simulation(kbot_robot)


@pytest.fixture
def urdf():
    """A function that reads a robot from URDF text."""

    def read(text: str) -> RobotModel:
        return load_robot_text(text, "robot.urdf").require()

    return read


@pytest.fixture
def ball(urdf) -> RobotModel:
    """A robot without wheels: one ball of 1 kg."""
    inertia = '<inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/>'
    return urdf(
        f'<robot name="ball"><link name="ball"><inertial><mass value="1"/>{inertia}</inertial>'
        '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
    )


@pytest.fixture
def launched(urdf, tmp_path: Path):
    """A function that reads a robot with the controllers of a launch file's YAML and spawner."""

    def build(description: str, yaml: str, args: str, ns: str = "/arm"):
        (tmp_path / "controllers.yaml").write_text(yaml)
        file = tmp_path / "a.launch"
        file.write_text(
            '<launch>\n<rosparam command="load" file="$(dirname)/controllers.yaml"/>\n'
            f'<node pkg="controller_manager" type="spawner" name="s" ns="{ns}" args="{args}"/></launch>'
        )
        packages = Packages(around=str(file))
        plan = read_launch(str(file), packages=packages).require()
        return with_controllers(urdf(description), read_controllers(plan, plan.nodes)[0])

    return build
