"""ROS 2 launch files that use other packages than launch. Expected values follow the sources of
controller_manager, ros_gz and ament."""

from pathlib import Path

import pytest

from kbot.ros.launch.staging import stage
from kbot.xacro import Packages

from .ros2_files import ROBOT, arguments_of, clean, node, python, read


def test_packages_are_found_while_the_file_is_loaded(folder: Path) -> None:
    before = (
        "from ament_index_python.resources import has_resource\n"
        "from ament_index_python.packages import get_package_prefix\n"
        "share = FindPackageShare('mine').find('mine')\n"
        "assert has_resource('packages', 'mine') and not has_resource('packages', 'other')\n"
    )
    assert arguments_of(python(folder, node("share"), before=before)) == str(folder)


def test_controller_manager_helpers_add_spawners(folder: Path) -> None:
    before = "from controller_manager.launch_utils import *\n"
    plan = python(
        folder,
        "generate_controllers_spawner_launch_description(['a', 'b'], ['/p.yaml'], ['--inactive'])",
        "generate_load_controller_launch_description('c')",
        "generate_load_controller_launch_description(controller_name='f', controller_type='kind/F')",
        "generate_controllers_spawner_launch_description_from_dict({'d': ['/d.yaml'], 'e': None})",
        before=before.replace(
            "*",
            "generate_controllers_spawner_launch_description, "
            "generate_load_controller_launch_description, "
            "generate_controllers_spawner_launch_description_from_dict",
        ),
    )
    assert [(n.package, n.type, n.args) for n in clean(plan).nodes] == [
        (
            "controller_manager",
            "spawner",
            "a b --param-file /p.yaml --inactive --controller-manager controller_manager",
        ),
        ("controller_manager", "spawner", "c --controller-manager controller_manager"),
        ("controller_manager", "spawner", "f -t kind/F --controller-manager controller_manager"),
        (
            "controller_manager",
            "spawner",
            "d e --param-file /d.yaml --controller-manager controller_manager",
        ),
    ]


def test_ros2_param_get_reads_the_parameter_of_an_earlier_node(folder: Path) -> None:
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=["
        "{'robot_description': Command(['cat ', os.path.join(os.path.dirname(__file__), 'r.urdf')])}])"
    )
    hardware = (
        "TimerAction(period=3.0, actions=[Node(package='controller_manager', executable='ros2_control_node',"
        " parameters=[{'robot_description': Command("
        "['ros2 param get --hide-type /robot_state_publisher robot_description'])}])])"
    )
    plan = clean(python(folder, publisher, hardware))
    assert plan.params["/ros2_control_node/robot_description"].value == ROBOT
    staged = stage(plan)
    assert (staged.robots[0].path, staged.is_simulated) == (str(folder / "r.urdf"), True)
    (problem,) = python(folder, hardware, publisher).problems
    assert (problem.code, "robot_state_publisher" in problem.message) == ("L041", True)


GZ = """<launch><arg name="world" default="w.sdf"/>
  <gz_server world_sdf_file="$(var world)"/>
  <ros_gz_bridge bridge_name="b" config_file="/b.yaml" if="true"/>
  <gz_spawn_model file="/r.urdf" entity_name="mine" x="1.5" yaw="" unless="false"/>
</launch>"""


def test_gz_actions_and_tags_are_equivalent(folder: Path) -> None:
    by_tags = read(folder / "a.launch.xml", GZ)
    by_actions = python(
        folder,
        "GzServer(world_sdf_file='w.sdf')",
        "RosGzBridge(bridge_name='b', config_file='/b.yaml')",
        "GzSpawnModel(file='/r.urdf', entity_name='mine', x='1.5', yaw='')",
        before="from ros_gz_sim.actions import GzServer, GzSpawnModel\n"
        "from ros_gz_bridge.actions import RosGzBridge\n",
    )
    by_file = python(
        folder,
        "IncludeLaunchDescription(PathJoinSubstitution([FindPackageShare('ros_gz_sim'), 'launch',"
        " 'gz_spawn_model.launch.py']), launch_arguments={'file': '/r.urdf', 'entity_name': 'mine',"
        " 'x': '1.5'}.items())",
    )
    for plan in (by_tags, by_actions):
        server, bridge = clean(plan).included
        assert (server.name, server.arguments) == ("gz_server.launch.py", {"world_sdf_file": "w.sdf"})
        assert (bridge.name, bridge.arguments["config_file"]) == ("ros_gz_bridge.launch.py", "/b.yaml")
    for plan in (by_tags, by_actions, by_file):
        (spawner,) = clean(plan).nodes
        assert (spawner.type, spawner.args) == ("create", "-file /r.urdf -name mine -x 1.5")


def test_launch_file_of_an_unbuilt_gz_package_is_replaced(folder: Path) -> None:
    sources = folder / "ros_gz_sim"
    sources.mkdir()
    (sources / "package.xml").write_text("<package><name>ros_gz_sim</name></package>")
    (folder / "package.xml").unlink()
    plan = python(
        folder,
        "IncludeLaunchDescription(PathJoinSubstitution([FindPackageShare('ros_gz_sim'), 'launch',"
        " 'gz_sim.launch.py']), launch_arguments={'gz_args': '-r empty.sdf'}.items())",
    )
    assert [i.name for i in clean(plan).included] == ["gz_sim.launch.py"]


def test_unbuilt_package_is_read_from_its_sources(folder: Path) -> None:
    (folder / "CMakeLists.txt").write_text(
        "project(mine)\n# install(DIRECTORY wrong/urdf DESTINATION share/mine)\n"
        "install(\n  DIRECTORY description/urdf bringup/config\n  DESTINATION share/${PROJECT_NAME}\n)\n"
        'install(DIRECTORY shapes/ DESTINATION "share/mine/meshes")\n'
        "install(FILES bringup/extra.xacro DESTINATION share/mine/urdf)\n"
    )
    for place, text in {
        "description/urdf/r.xacro": '<robot name="r" xmlns:xacro="x"><xacro:include filename='
        '"$(find mine)/urdf/extra.xacro"/><link name="base"><visual><geometry>'
        '<mesh filename="package://mine/meshes/a.stl"/></geometry></visual></link></robot>',
        "bringup/extra.xacro": '<robot xmlns:xacro="x"><link name="extra"/></robot>',
        "bringup/config/c.yaml": "/**: {ros__parameters: {gain: 2}}",
        "shapes/a.stl": "solid a",
    }.items():
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text(text)
    share = "FindPackageShare('mine')"
    plan = python(
        folder,
        "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=["
        f"{{'robot_description': Command(['xacro ', PathJoinSubstitution([{share}, 'urdf', 'r.xacro'])])}},"
        f" PathJoinSubstitution([{share}, 'config', 'c.yaml'])])",
    )
    params = clean(plan).params
    assert params["/robot_state_publisher/gain"].value == 2
    assert "extra" in params["/robot_state_publisher/robot_description"].value
    found = Packages(around=str(folder)).resolve("package://mine/meshes/a.stl")
    assert found == str(folder / "shapes/a.stl")
    assert Packages(around=str(folder)).resolve("package://mine/meshes/b.stl") is None


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("['gazebo', '--verbose', '-s', 'libgazebo_ros_init.so', '/w.world']", ("/w.world", False, True)),
        ("['gzserver', '-u', '/w.world']", ("/w.world", True, True)),
        ("['gz', 'sim', '-r', '-s', '/w.sdf']", ("/w.sdf", False, False)),
        ("['ign gazebo /w.sdf']", ("/w.sdf", True, True)),
    ],
)
def test_gazebo_process_sets_the_world_and_the_pause(
    folder: Path, command: str, expected: tuple[str, bool, bool]
) -> None:
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=["
        "{'robot_description': Command(['cat ', os.path.join(os.path.dirname(__file__), 'r.urdf')])}])"
    )
    create = "Node(package='ros_gz_sim', executable='create', arguments=['-topic', 'robot_description'])"
    shell = "['ign " in command
    plan = clean(python(folder, f"ExecuteProcess(cmd={command}, shell={shell})", publisher, create))
    staged = stage(plan)
    assert staged.notes == ()
    assert (staged.gazebo.world, staged.gazebo.paused, staged.has_window) == expected


def test_description_changed_by_the_launch_file_is_still_the_robot(folder: Path) -> None:
    mesh = '<visual><geometry><mesh filename="package://mine/a.stl"/></geometry></visual>'
    (folder / "r.urdf").write_text(ROBOT.replace('"base"/>', f'"base">{mesh}</link>'))
    before = "import xacro\ntext = xacro.process_file(os.path.dirname(__file__) + '/r.urdf').toxml()\n"
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher',"
        " parameters=[{'robot_description': text.replace(%s)}])"
    )
    moved = clean(python(folder, publisher % "'package://mine/', 'file:///there/'", before=before))
    assert stage(moved).robots[0].path == str(folder / "r.urdf")
    renamed = clean(python(folder, publisher % "'base', 'other'", before=before))
    path = stage(renamed).robots[0].path
    assert '"other"' in Path(path).read_text()


def test_robot_in_a_file_of_any_name_is_known_after_open(folder: Path) -> None:
    (folder / "robot.txt").write_text(ROBOT)
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=["
        "{'robot_description': open(os.path.join(os.path.dirname(__file__), 'robot.txt')).read()}])"
    )
    assert stage(clean(python(folder, publisher))).robots[0].path == str(folder / "robot.txt")


@pytest.mark.parametrize(("name", "options", "is_model"), [("a.xml", "", True), ("a.sdf", "'-sdf', ", False)])
def test_spawned_file_is_a_robot_or_an_sdf_model_by_its_content(
    folder: Path, name: str, options: str, is_model: bool
) -> None:
    text = "<sdf version='1.9'><model name='m'/></sdf>" if is_model else ROBOT
    (folder / name).write_text(text)
    spawner = (
        f"Node(package='gazebo_ros', executable='spawn_entity.py', arguments=[{options}'-file',"
        f" os.path.join(os.path.dirname(__file__), '{name}'), '-entity', 'm'])"
    )
    staged = stage(clean(python(folder, spawner)))
    assert (len(staged.models), len(staged.robots)) == (is_model, not is_model)
