"""What a request means for the robot, the worlds and the scenarios, before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbot.sweep.best_design import written_design
from kbot.sweep.designs import Method
from kbot.sweep.plan import Plan
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.results import Design
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to
from kbot.trials.pool import Pool

XACRO = "http://www.ros.org/wiki/xacro"
BOX = """\
  <link name="base_link">
    <collision><geometry><box size="{size} 0.1 0.1"/></geometry></collision>
    <inertial>
      <mass value="{mass}"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
"""


@pytest.fixture(autouse=True)
def folder(drive_folder: Path) -> Path:
    return drive_folder


def write_robot(head: str, size: str = "0.1", mass: str = "1", name: str = "r.xacro") -> None:
    box = BOX.format(size=size, mass=mass)
    Path(name).write_text(f'<robot name="r" xmlns:xacro="{XACRO}">\n{head}\n{box}</robot>\n')


def plan(
    *dimensions: str, robot: str = "r.xacro", scenario: str = "drive.scenario.yaml", **values: str
) -> Plan:
    with Pool(1) as pool:
        request = Request(robot=robot, dimensions=dimensions, scenarios=[scenario], values=values)
        return prepare(request, pool)


def refused(*dimensions: str, robot: str = "r.xacro", **values: str) -> str:
    with pytest.raises(KbotError) as raised:
        plan(*dimensions, robot=robot, **values)
    return str(raised.value)


def test_a_property_that_does_not_vary_is_part_of_the_best_design() -> None:
    write_robot(
        '<xacro:property name="size" value="0.2"/><xacro:arg name="mass" default="1"/>',
        "${size}",
        "$(arg mass)",
    )
    found = plan("mass=1.0,2.0", size="0.3")
    assert (found.robot.arguments, found.robot.properties) == ({}, {"size": "0.3"})
    assert found.to_json()["robot"][1:] == ["size:=0.3"]
    written_design(found, Design(1, {"mass": 2.0}, {}, ()), "best.xacro").write()
    text = Path("best.xacro").read_text()
    assert '<xacro:property name="size" value="0.3"/>' in text
    assert '<xacro:arg name="mass" default="2"/>' in text


@pytest.mark.parametrize("is_first", [True, False])
def test_the_world_is_chosen_before_its_parameters_are_set(is_first: bool) -> None:
    dimensions = ["world=stairs,stairs:steps=3", "world.height=0.005,0.02"]
    found = plan(*(dimensions if is_first else reversed(dimensions)), robot="kbot")
    worlds = {found.task(number, found.space.grid(number)).scenario.world for number in range(4)}
    assert worlds == {
        "stairs:height=0.005",
        "stairs:height=0.02",
        "stairs:steps=3,height=0.005",
        "stairs:steps=3,height=0.02",
    }


def test_the_world_of_a_battery_that_tests_it_does_not_vary() -> None:
    assert plan("world=rooms,empty", robot="kbot", scenario="straight").runs == 2
    with pytest.raises(KbotError, match=r"--set world: the battery slope has its own world, incline:angle="):
        plan("world=rooms,empty", robot="kbot", scenario="slope")
    Path("mine.scenario.yaml").write_text("world: stairs\n" + Path("drive.scenario.yaml").read_text())
    assert plan("world=rooms,empty", robot="kbot", scenario="mine.scenario.yaml").runs == 2


def test_the_name_of_an_argument_may_contain_a_dot() -> None:
    write_robot('<xacro:arg name="box.size" default="0.1"/>', "$(arg box.size)")
    found = plan("box.size=0.2,0.3")
    robot = found.task(1, found.space.grid(1)).scenario.robot
    assert robot is not None
    assert robot.arguments == {"box.size": "0.3"}


def test_an_argument_without_a_default_may_vary() -> None:
    """xacro reads the robot only if such an argument is given."""
    write_robot("", "$(arg size)")
    found = plan("size=0.2,0.3")
    assert found.robot.arguments == {}
    robot = found.task(1, found.space.grid(1)).scenario.robot
    assert robot is not None
    assert robot.arguments == {"size": "0.3"}


def test_a_name_is_either_set_or_varied() -> None:
    write_robot('<xacro:arg name="size" default="0.1"/>', "$(arg size)")
    expected = "size:=0.4 and --set size=0.2,0.3 both set it. Remove one"
    assert refused("size=0.2,0.3", size="0.4") == expected


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        (Method.GRID, set()),
        (Method.RANDOM, {"numpy"}),
        (Method.LHS, {"numpy", "scipy"}),
        (Method.OPTIMIZE, {"numpy", "optuna"}),
    ],
)
def test_the_libraries_that_choose_the_designs_are_recorded(method: Method, expected: set[str]) -> None:
    with Pool(1) as pool:
        request = Request(
            robot="kbot",
            dimensions=["wheel_radius=0.03,0.04"],
            scenarios=["drive.scenario.yaml"],
            objectives=["energy"],
            method=method,
            runs=2,
        )
        assert set(prepare(request, pool).versions) - {"kbot", "mujoco-core"} == expected


def test_dimensions_have_the_units_of_the_robot_and_of_the_scenario() -> None:
    start = "duration: 1\nsteps: [{command: {linear: 0.2}}]\n"
    Path("two.scenario.yaml").write_text(
        f"name: one\n{start}expect: [{{final_forward: {{min: 0}}}}]\n---\n"
        f"name: two\n{start}expect: [{{max_tilt: {{max: 1}}}}]\n"
    )
    found = plan(
        "wheel_radius=0.03,0.04",
        "wheel_mass=0.1,0.2",
        "seed=1,2",
        "scenario.duration=1,2",
        "scenario.steps.0.linear=0.1,0.2",
        "scenario.expect.0.max=1,2",
        robot="kbot",
        scenario="two.scenario.yaml",
    )
    # the last one is a distance in one scenario, and an angle in the other
    assert [each.unit for each in found.space.dimensions] == ["m", "kg", "", "s", "m/s", ""]


def test_a_dimension_of_a_python_scenario_has_a_unit() -> None:
    Path("drive.py").write_text(
        "from kbot.trials import Command, Scenario, Step\n"
        "scenarios = [Scenario('drive', 1.0, [Step(Command(0.2))])]\n"
    )
    found = plan("scenario.steps.0.angular=0.1,0.2", robot="kbot", scenario="drive.py")
    assert [each.unit for each in found.space.dimensions] == ["rad/s"]


def test_a_name_with_two_meanings_is_noted() -> None:
    write_robot(
        '<xacro:arg name="mass" default="1"/><xacro:property name="mass" value="2"/>'
        '<xacro:arg name="size" default="0.1"/><xacro:property name="size" value="$(arg size)"/>'
        '<xacro:property name="seed" value="7"/>'
        '<xacro:arg name="world" default="flat"/>',
        size="${size}",
        mass="${mass}",
    )
    notes: list[str] = []
    with notes_sent_to(notes.append):
        plan("mass=1.0,2.0", "size=0.1,0.2", "seed=1,2", "world=empty,rooms")
    assert notes == [
        "--set mass=1.0,2.0 varies the argument 'mass'. The property of the same name is 2 in all designs",
        "--set seed=1,2 varies the seed of the simulation, not the robot's property 'seed'. "
        "To vary that one, give it another name",
        "--set world=empty,rooms varies the world of the simulation, not the robot's argument 'world'. "
        "To vary that one, give it another name",
    ]
