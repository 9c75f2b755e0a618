"""What real ROS 2 launch files use beside launch itself; values follow the sources of launch, launch_ros,
controller_manager and ros_gz."""

from pathlib import Path

import pytest

from kbot.launch import Plan, read_launch_2
from kbot.launch.staging import stage
from kbot.xacro import Packages

HEAD = """import os
from launch import LaunchDescription
from launch.actions import *
from launch.substitutions import *
from launch_ros.actions import Node, SetParameter
from launch_ros.substitutions import *
"""
ROBOT = '<robot name="r"><link name="base"/></robot>'
MANIFEST = "<package format='3'><name>mine</name></package>"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "package.xml").write_text(MANIFEST)
    (tmp_path / "r.urdf").write_text(ROBOT)
    return tmp_path


def read(file: Path, text: str, **arguments: str) -> Plan:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return read_launch_2(str(file), arguments, Packages(around=str(file)), trusted=True)


def python(folder: Path, *actions: str, before: str = "", **arguments: str) -> Plan:
    body = f"def generate_launch_description():\n    return LaunchDescription([{', '.join(actions)}])\n"
    return read(folder / "a.launch.py", f"{HEAD}{before}\n{body}", **arguments)


def clean(plan: Plan) -> Plan:
    assert [str(d) for d in plan.diagnostics] == []
    return plan


def said(plan: Plan, name: str = "said") -> str:
    """The arguments of a node."""
    return next(node.args for node in clean(plan).nodes if node.name == name)


def node(*arguments: str) -> str:
    return f"Node(package='p', executable='e', name='said', arguments=[{', '.join(arguments)}])"


def test_each_name_can_be_imported_from_a_module_of_its_own(folder: Path) -> None:
    before = (
        "from launch.substitutions.path_join_substitution import PathJoinSubstitution as P\n"
        "from launch.actions.declare_launch_argument import DeclareLaunchArgument as D\n"
        "from launch_ros.actions.node import Node as N\n"
        "from launch.event_handlers.on_process_exit import OnProcessExit\n"
    )
    plan = python(
        folder, "D('a', default_value='x')", node("P(['a', LaunchConfiguration('a')])"), before=before
    )
    assert said(plan) == str(Path("a/x"))


def test_packages_are_found_before_anything_is_performed(folder: Path) -> None:
    before = (
        "from ament_index_python.resources import has_resource\n"
        "from ament_index_python.packages import get_package_prefix\n"
        "share = FindPackageShare('mine').find('mine')\n"
        "assert has_resource('packages', 'mine') and not has_resource('packages', 'other')\n"
    )
    assert said(python(folder, node("share"), before=before)) == str(folder)


def test_helpers_of_the_controller_manager_spawn(folder: Path) -> None:
    before = "from controller_manager.launch_utils import *\n"
    plan = python(
        folder,
        "generate_controllers_spawner_launch_description(['a', 'b'], ['/p.yaml'], ['--inactive'])",
        "generate_load_controller_launch_description('c')",
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
        (
            "controller_manager",
            "spawner",
            "d e --param-file /d.yaml --controller-manager controller_manager",
        ),
    ]


def test_a_command_gets_the_parameter_of_a_node_that_stands_before(folder: Path) -> None:
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
    assert (staged.path, staged.simulate) == (str(folder / "r.urdf"), True)
    (problem,) = python(folder, hardware, publisher).problems
    assert (problem.code, "robot_state_publisher" in problem.message) == ("L041", True)


GZ = """<launch><arg name="world" default="w.sdf"/>
  <gz_server world_sdf_file="$(var world)"/>
  <ros_gz_bridge bridge_name="b" config_file="/b.yaml" if="true"/>
  <gz_spawn_model file="/r.urdf" entity_name="mine" x="1.5" yaw="" unless="false"/>
</launch>"""


def test_actions_and_tags_of_gz(folder: Path) -> None:
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


def test_a_launch_file_that_a_build_would_make_is_stood_in_for(folder: Path) -> None:
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


def test_the_environment_grows_at_either_end(folder: Path) -> None:
    plan = python(
        folder,
        "SetEnvironmentVariable('K', 'a')",
        "AppendEnvironmentVariable('K', 'b')",
        "AppendEnvironmentVariable('K', 'c', prepend=True, separator=';')",
        "AppendEnvironmentVariable('KBOT_NEW', 'n')",
        node("EnvironmentVariable('K')", "EnvironmentVariable('KBOT_NEW')"),
    )
    import os

    assert said(plan) == f"c;a{os.pathsep}b n"


def test_groups_forward_what_they_are_told(folder: Path) -> None:
    group = (
        "GroupAction([" + node("LaunchConfiguration('a', default='-')", "LaunchConfiguration('b')") + "],"
        " launch_configurations={'b': LaunchConfiguration('a')}, forwarding=%s, scoped=%s)"
    )
    start = "SetLaunchConfiguration('a', '1')"
    assert said(python(folder, start, group % (True, True))) == "1 1"
    assert said(python(folder, start, group % (False, True))) == "- 1"
    after = (
        "Node(package='p', executable='e', name='after', arguments=[LaunchConfiguration('b', default='-')])"
    )
    assert said(python(folder, start, group % (True, True), after), "after") == "-"
    assert said(python(folder, start, group % (True, False), after), "after") == "1"
    xml = """<launch><let name="a" value="1"/><group forwarding="false"><keep name="b" value="$(var a)"/>
      <node pkg="p" exec="e" name="said" args="$(var b)"/></group>
      <reset><keep name="c" value="$(var a)2"/></reset>
      <node pkg="p" exec="e" name="after" args="$(var c)"/></launch>"""
    plan = read(folder / "a.launch.xml", xml)
    assert (said(plan), said(plan, "after")) == ("1", "12")


def test_configurations_are_pushed_popped_and_reset(folder: Path) -> None:
    look = "LaunchConfiguration('a', default='-')"
    plan = python(
        folder,
        "SetLaunchConfiguration('a', '1')",
        "PushLaunchConfigurations()",
        "SetLaunchConfiguration('a', '2')",
        "PopLaunchConfigurations()",
        node(look),
        "ResetLaunchConfigurations()",
        node(look).replace("said", "after"),
    )
    assert (said(plan), said(plan, "after")) == ("1", "-")


def test_substitutions_of_newer_releases(folder: Path) -> None:
    (folder / "words.txt").write_text("from a file")
    xml = f"""<launch><let name="a" value="1"/><set_parameter name="q" value="7"/>
      <node pkg="p" exec="e" name="said" args="$(any false $(var a)) $(all true false) $(param q)
        $(path-join x y) '$(file-content {folder}/words.txt)'"/></launch>"""
    words = said(read(folder / "a.launch.xml", xml)).split()
    assert words == ["true", "false", "7", str(Path("x/y")), "'from", "a", "file'"]
    plan = python(
        folder,
        "SetParameter('q', 7)",
        node("AnySubstitution('false', 'true')", "AllSubstitution('true', 'false')", "Parameter('q')"),
    )
    assert said(plan) == "true false 7"


@pytest.mark.parametrize(
    ("before", "message", "hint"),
    [
        ("os.environ['KBOT_MODEL']", "the environment variable KBOT_MODEL is not set", "KBOT_MODEL=…"),
        ("import no_such_module", "needs the Python module 'no_such_module'", "PYTHONPATH"),
        ("from launch.actions import NoSuchAction", "KBot has no launch.actions.NoSuchAction", ""),
        ("from nav2_common.launch import RewritenYaml", "nav2_common.launch.RewritenYaml", "RewrittenYaml"),
    ],
)
def test_what_a_program_lacks_is_told_in_a_sentence(
    folder: Path, before: str, message: str, hint: str
) -> None:
    (problem,) = python(folder, before=before).problems
    assert message in problem.message
    assert hint in (problem.hint or "")
    assert problem.origin is not None
    assert problem.origin.span.text == before


def test_a_package_that_was_never_built_is_read_from_its_sources(folder: Path) -> None:
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
def test_gazebo_as_a_process(folder: Path, command: str, expected: tuple[str, bool, bool]) -> None:
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=["
        "{'robot_description': Command(['cat ', os.path.join(os.path.dirname(__file__), 'r.urdf')])}])"
    )
    create = "Node(package='ros_gz_sim', executable='create', arguments=['-topic', 'robot_description'])"
    shell = "['ign " in command
    plan = clean(python(folder, f"ExecuteProcess(cmd={command}, shell={shell})", publisher, create))
    staged = stage(plan)
    assert staged.notes == ()
    assert (staged.world, staged.paused, staged.window) == expected


def test_a_description_that_the_launch_file_has_changed_is_still_the_robot(folder: Path) -> None:
    mesh = '<visual><geometry><mesh filename="package://mine/a.stl"/></geometry></visual>'
    (folder / "r.urdf").write_text(ROBOT.replace('"base"/>', f'"base">{mesh}</link>'))
    before = "import xacro\ntext = xacro.process_file(os.path.dirname(__file__) + '/r.urdf').toxml()\n"
    publisher = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher',"
        " parameters=[{'robot_description': text.replace(%s)}])"
    )
    moved = clean(python(folder, publisher % "'package://mine/', 'file:///there/'", before=before))
    assert stage(moved).path == str(folder / "r.urdf")
    renamed = clean(python(folder, publisher % "'base', 'other'", before=before))
    path = stage(renamed).path
    assert path is not None
    assert '"other"' in Path(path).read_text()


def test_a_group_of_yaml_may_be_a_list(folder: Path) -> None:
    text = """launch:
- let: {name: wait, value: "2.5"}
- group:
  - push_ros_namespace: {namespace: up}
  - node: {pkg: p, exec: e, name: n, respawn: "true", respawn_delay: $(var wait)}
- node: {pkg: p, exec: e, name: m}
- executable: {cmd: prog -x, args: y, on_exit: shutdown}
"""
    nodes = clean(read(folder / "a.launch.yaml", text)).nodes
    assert [n.full_name for n in nodes] == ["/up/n", "/m", "/prog"]
    assert (nodes[0].respawn, nodes[0].respawn_delay) == (True, 2.5)
    assert (nodes[2].args, nodes[2].required) == ("-x y", True)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (r"\$(var a) it\'s $(var a)", "$(var a) it's x"),
        (r"$(eval '\'$(var a)\' == \'x\'')", "True"),
        (r"$(eval '1 + \$(var a)')", None),
        ("$(eval \"'$(var a)' == 'x'\")", "True"),
        (r"$(var \$(var a))", None),
        ("$(or true maybe)", None),
        ("$(equals True 1)-$(equals 1.0 1)-$(equals a A)-$(not-equals false 0)", "true-true-false-false"),
    ],
)
def test_what_is_escaped_in_markup_is_text(folder: Path, text: str, expected: str | None) -> None:
    """Expected values are what the parser of launch itself gives."""
    escaped = text.replace('"', "&quot;").replace("<", "&lt;")
    xml = f'<launch><let name="a" value="x"/><let name="b" value="{escaped}"/>'
    plan = read(
        folder / "a.launch.xml", f'{xml}<node pkg="p" exec="e" name="n" namespace="$(var b)"/></launch>'
    )
    if expected is None:
        assert any(p.is_error for p in plan.problems)
    else:
        assert [n.namespace.strip("/") for n in clean(plan).nodes] == [expected]
