"""Plans of ROS 2 launch files. Expected values follow the documentation of launch."""

from pathlib import Path

import pytest

from kbot.ros.launch import Plan, is_ros_2, read_launch_2
from kbot.ros.launch.staging import stage
from kbot.text import Diagnostic
from kbot.xacro import Limits

from .ros2_files import HEAD, clean, python, read

ROBOT = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="width" default="1"/><link name="base"/>
</robot>
"""


@pytest.fixture(autouse=True)
def xacro(folder: Path) -> None:
    (folder / "r.xacro").write_text(ROBOT)


def only(plan: Plan) -> Diagnostic:
    (diagnostic,) = plan.diagnostics
    return diagnostic


def values(plan: Plan) -> dict[str, object]:
    return {name: param.value for name, param in plan.params.items()}


NODE = "Node(package='p', executable='e', name='n'{})"


def test_node_has_its_name_remaps_arguments_and_line(folder: Path) -> None:
    plan = clean(
        python(
            folder,
            "PushRosNamespace('up')",
            "Node(package='p', executable='e', namespace='in', remappings=[('a', 'b')],"
            " arguments=['-x', 'a b'])",
        )
    )
    (node,) = plan.nodes
    assert (node.full_name, node.remaps, node.args) == ("/up/in/e", (("a", "b"),), "-x 'a b'")
    assert node.origin.span.line == 15
    assert node.origin.span.text.startswith("Node(package='p'")


def test_arguments_and_expressions_control_conditions(folder: Path) -> None:
    actions = (
        "DeclareLaunchArgument('gui', default_value='true', description='show it')",
        NODE.format(", condition=IfCondition(LaunchConfiguration('gui'))"),
        "Node(package='p', executable='e', name='m', condition=UnlessCondition(LaunchConfiguration('gui')))",
        "Node(package='p', executable='e', name='o', condition=IfCondition("
        "PythonExpression([\"'\", LaunchConfiguration('gui'), \"' == 'false' or 1 > 2\"])))",
    )
    plan = clean(python(folder, *actions))
    assert [node.name for node in plan.nodes] == ["n"]
    assert (plan.arguments["gui"].default, plan.arguments["gui"].doc) == ("true", "show it")
    assert [node.name for node in clean(python(folder, *actions, gui="false")).nodes] == ["m", "o"]


def test_parameters_are_typed_as_in_launch(folder: Path) -> None:
    (folder / "p.yaml").write_text(
        "/**:\n  ros__parameters: {rate: 20, a: {b: 1}}\nother:\n  ros__parameters: {rate: 5}\n"
        "n:\n  ros__parameters: {own: true}\n"
    )
    parameters = (
        ", parameters=[{'text': '12', 'number': 12, 'nested': {'x': 0.5}, 'list': [1, 2],"
        " 'conf': LaunchConfiguration('c'),"
        " 'as_text': ParameterValue(LaunchConfiguration('c'), value_type=str)},"
        " PathJoinSubstitution([FindPackageShare('mine'), 'p.yaml'])]"
    )
    set_all = "SetParameter('use_sim_time', True)"
    declare = "DeclareLaunchArgument('c', default_value='3')"
    assert values(clean(python(folder, declare, set_all, NODE.format(parameters)))) == {
        "/n/use_sim_time": True,
        "/n/text": "12",
        "/n/number": 12,
        "/n/nested.x": 0.5,
        "/n/list": [1, 2],
        "/n/conf": 3,
        "/n/as_text": "3",
        "/n/rate": 20,
        "/n/a.b": 1,
        "/n/own": True,
    }


@pytest.mark.parametrize(
    "value",
    [
        "ParameterValue(Command(['xacro ', PathJoinSubstitution([FindPackageShare('mine'), 'r.xacro']),"
        " ' width:=2']), value_type=str)",
        "__import__('xacro').process_file(__import__('os').path.join(__import__('ament_index_python')"
        ".get_package_share_directory('mine'), 'r.xacro'), mappings={'width': '2'}).toxml()",
        "Command(['xacro ', PathSubstitution(FindPackageShare('mine')) / 'r.xacro', ' width:=2'])",
    ],
)
def test_robot_file_is_known_for_each_way_of_expansion(folder: Path, value: str) -> None:
    node = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher',"
        f" parameters=[{{'robot_description': {value}}}])"
    )
    found = stage(clean(python(folder, node)))
    assert (found.robots[0].path, found.robots[0].arguments, found.notes) == (
        str(folder / "r.xacro"),
        {"width": "2"},
        (),
    )


def test_robot_file_is_known_after_parse_and_process_doc(folder: Path) -> None:
    before = (
        f"import xacro\ndoc = xacro.parse(open({str(folder / 'r.xacro')!r}))\n"
        "xacro.process_doc(doc, mappings={'width': '2'})"
    )
    node = "Node(package='p', executable='e', parameters=[{'robot_description': doc.toxml()}])"
    found = stage(python(folder, node, before=before))
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "r.xacro"), {"width": "2"})


def test_robot_with_ros2_control_node_is_simulated(folder: Path) -> None:
    assert not stage(python(folder, "Node(package='controller_manager', executable='spawner')")).is_simulated
    manager = "Node(package='controller_manager', executable='ros2_control_node')"
    assert stage(python(folder, manager)).is_simulated


def test_robot_file_is_known_after_open(folder: Path) -> None:
    (folder / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    path = str(folder / "r.urdf")
    node = f"Node(package='p', executable='e', parameters=[{{'robot_description': open({path!r}).read()}}])"
    assert stage(python(folder, node)).robots[0].path == path


def test_spawned_robot_is_simulated(folder: Path) -> None:
    robot = "ParameterValue(Command(['xacro ', FindPackageShare('mine'), '/r.xacro']), value_type=str)"
    plan = python(
        folder,
        "IncludeLaunchDescription(PythonLaunchDescriptionSource([FindPackageShare('ros_gz_sim'),"
        " '/launch/gz_sim.launch.py']), launch_arguments={'gz_args': '-r empty.sdf'}.items())",
        f"Node(package='robot_state_publisher', executable='robot_state_publisher',"
        f" parameters=[{{'robot_description': {robot}}}])",
        "Node(package='ros_gz_sim', executable='create', arguments=['-topic', 'robot_description'])",
    )
    found = stage(clean(plan))
    assert (found.robots[0].path, found.is_simulated) == (str(folder / "r.xacro"), True)
    assert plan.included[0].arguments == {"gz_args": "-r empty.sdf"}


def test_gazebo_classic_reads_the_arguments_of_the_file_around_it(folder: Path) -> None:
    plan = python(
        folder,
        "DeclareLaunchArgument('world', default_value='own.world')",
        "IncludeLaunchDescription(PythonLaunchDescriptionSource("
        "os.path.join(FindPackageShare('gazebo_ros').find('gazebo_ros'), 'launch', 'gazebo.launch.py')))",
    )
    assert stage(clean(plan)).gazebo.world == "own.world"


def test_settings_in_a_group_end_with_the_group(folder: Path) -> None:
    group = (
        "GroupAction([PushRosNamespace('g'), SetLaunchConfiguration('x', '2'), "
        "Node(package='p', executable='e', name=LaunchConfiguration('x'))])"
    )
    after = "Node(package='p', executable='e', name=['n', LaunchConfiguration('x')])"
    plan = clean(python(folder, "DeclareLaunchArgument('x', default_value='1')", group, after))
    assert [node.full_name for node in plan.nodes] == ["/g/2", "/n1"]


def test_opaque_functions_timers_and_events_add_their_actions(folder: Path) -> None:
    before = (
        "def more(context, name):\n"
        "    size = LaunchConfiguration('x').perform(context)\n"
        "    return [Node(package='p', executable='e', name=name + size)]\n"
    )
    plan = clean(
        python(
            folder,
            "DeclareLaunchArgument('x', default_value='7')",
            "OpaqueFunction(function=more, args=['f'])",
            "TimerAction(period=2.0, actions=[Node(package='p', executable='e', name='late')])",
            "RegisterEventHandler(OnProcessExit(on_exit=[Node(package='p', executable='e', name='then')]))",
            before=before,
        )
    )
    assert [node.name for node in plan.nodes] == ["f7", "late", "then"]
    assert plan.nodes[0].origin.span.line == 13


def test_included_file_gets_the_passed_arguments(folder: Path) -> None:
    (folder / "inner.launch.py").write_text(
        f"{HEAD}\ndef generate_launch_description():\n"
        "    return LaunchDescription([DeclareLaunchArgument('who'),\n"
        "        DeclareLaunchArgument('b', default_value='B'), Node(package='p', executable='e',\n"
        "        name=[LaunchConfiguration('who'), LaunchConfiguration('b')])])\n"
    )
    include = (
        "IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/inner.launch.py']),"
        " launch_arguments={'who': 'me'}.items())"
    )
    plan = clean(python(folder, include))
    assert [node.name for node in plan.nodes] == ["meB"]
    assert [Path(file).name for file in plan.files] == ["a.launch.py", "inner.launch.py"]


@pytest.mark.parametrize(
    ("action", "code", "message"),
    [
        ("DeclareLaunchArgument('x')", "L011", "no default"),
        ("DeclareLaunchArgument('x', default_value='a', choices=['b'])", "L025", "cannot be 'a'"),
        (NODE.format(", condition=IfCondition('maybe')"), "L005", "neither true nor false"),
        (NODE.format(", namespace=LaunchConfiguration('x')"), "L011", "'x' is not set"),
        (NODE.format(", namespace=FindPackageShare('no_such')"), "L012", "no_such"),
        (NODE.format(", namespace=EnvironmentVariable('KBOT_NOT_SET')"), "L013", "KBOT_NOT_SET"),
        (NODE.format(", namespace=PythonExpression('open(1)')"), "L014", "'open' is not defined"),
        (NODE.format(", namespace=Command('rm -rf x')"), "L040", "rm"),
        (NODE.format(", parameters=[{'a': [LaunchConfiguration('y'), ': :']}]"), "L011", "'y' is not set"),
        ("1 / 0", "L081", "ZeroDivisionError"),
        ("Nod()", "L081", "NameError"),
        ("Node(package='p')", "L081", "TypeError"),
        ("DeclareLaunchArgument(True, default_value='a')", "L081", "must be a str, not bool"),
    ],
)
def test_error_is_reported_at_the_line_of_its_action(
    folder: Path, action: str, code: str, message: str
) -> None:
    found = only(python(folder, action))
    assert found.origin is not None
    assert (found.code, found.origin.span.line) == (code, 14)
    assert message in found.message


@pytest.mark.parametrize(
    ("end", "code", "line", "message"),
    [
        ("raise SystemExit(7)", "L081", 2, "SystemExit: 7"),
        ("raise type('Own', (BaseException,), {})('x')", "L081", 2, "Own: x"),
        ("pass", "L082", 1, "returned NoneType"),
        ("return []", "L082", 1, "returned list"),
    ],
)
def test_launch_file_without_a_description_is_reported(
    folder: Path, end: str, code: str, line: int, message: str
) -> None:
    found = only(read(folder / "a.launch.py", f"def generate_launch_description():\n    {end}\n"))
    assert found.origin is not None
    assert (found.code, found.origin.span.line) == (code, line)
    assert message in found.message


@pytest.mark.parametrize("nothing", ["None", "'talker'", "[[1]]"])
def test_value_that_is_not_an_action_is_reported(folder: Path, nothing: str) -> None:
    assert "expected an action, not " in only(python(folder, nothing)).message


def test_unknown_name_is_reported_at_its_import(folder: Path) -> None:
    found = only(read(folder / "a.launch.py", "import os\nfrom launch.actions import DeclareLaunchArgment\n"))
    assert found.origin is not None
    assert (found.code, found.origin.span.line) == ("L081", 2)
    assert "DeclareLaunchArgment" in found.message


def test_python_file_runs_only_if_trusted(folder: Path) -> None:
    file = folder / "a.launch.py"
    file.write_text(f"open({str(folder / 'mark')!r}, 'w').close()\n")
    found = only(read_launch_2(str(file)))
    assert (found.code, found.hint) == ("L080", "if you trust it, run it with kbot launch FILE --trust")
    assert not (folder / "mark").exists()


XML = """<launch>
  <arg name="width" default="2" description="how wide"/>
  <let name="both" value="$(var width)$(var width)"/>
  <group>
    <push_ros_namespace namespace="up"/>
    <node pkg="robot_state_publisher" exec="robot_state_publisher">
      <param name="robot_description"
             value="$(command 'xacro $(find-pkg-share mine)/r.xacro width:=$(var width)')" type="str"/>
      <param name="rate" value="20.0"/>
      <remap from="a" to="b"/>
    </node>
  </group>
  <node pkg="p" exec="e" name="n$(var both)" args="-a $(eval '1 + $(var width)')"
        if="$(equals $(var width) 2)"/>
  <node pkg="p" exec="e" name="m" unless="true"/>
</launch>
"""
YAML = """launch:
  - arg: {name: width, default: "2", description: how wide}
  - let: {name: both, value: $(var width)$(var width)}
  - group:
      children:
        - push_ros_namespace: {namespace: up}
        - node:
            pkg: robot_state_publisher
            exec: robot_state_publisher
            param:
              - {name: robot_description, type: str,
                 value: "$(command 'xacro $(find-pkg-share mine)/r.xacro width:=$(var width)')"}
              - {name: rate, value: 20.0}
            remap:
              - {from: a, to: b}
  - node: {pkg: p, exec: e, name: n$(var both), args: "-a $(eval '1 + $(var width)')",
           if: "$(equals $(var width) 2)"}
  - node: {pkg: p, exec: e, name: m, unless: "true"}
"""


@pytest.mark.parametrize(("name", "text"), [("a.launch.xml", XML), ("a.launch.yaml", YAML)])
def test_xml_and_yaml_give_the_same_plan(folder: Path, name: str, text: str) -> None:
    plan = clean(read(folder / name, text))
    first, second = plan.nodes
    assert (first.full_name, first.remaps) == ("/up/robot_state_publisher", (("a", "b"),))
    assert (second.full_name, second.args) == ("/n22", "-a 3")
    assert plan.params["/up/robot_state_publisher/rate"].value == 20.0
    found = stage(plan)
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "r.xacro"), {"width": "2"})
    assert is_ros_2(str(folder / name))


def test_ros1_file_is_not_a_ros2_file(folder: Path) -> None:
    file = folder / "a.launch"
    file.write_text('<launch><arg name="x" default="1"/><node pkg="p" type="t" name="$(arg x)"/></launch>')
    assert not is_ros_2(str(file))


def test_errors_in_xml_are_reported_at_their_element(folder: Path) -> None:
    text = '<launch>\n  <nod/>\n  <node pkg="p"/>\n  <node pkg="p" exec="$(vra x)"/>\n</launch>'
    found = read(folder / "a.launch.xml", text).diagnostics
    assert [(d.code, d.origin.span.line) for d in found if d.origin] == [
        ("L002", 2),
        ("L004", 3),
        ("L010", 4),
    ]


def test_timers_and_events_set_when_a_node_starts(folder: Path) -> None:
    plan = clean(
        python(
            folder,
            "Node(package='p', executable='e', name='at_once')",
            "TimerAction(period=2.0, actions=[TimerAction(period=LaunchConfiguration('more', default='0.5'),"
            " actions=[Node(package='p', executable='e', name='late')])])",
            "first",
            "RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[TimerAction(period='1',"
            " actions=[Node(package='p', executable='e', name='then')])]))",
            "RegisterEventHandler(OnProcessStart(target_action=first, on_start="
            "[Node(package='p', executable='e', name='beside')]))",
            before="from launch.event_handlers import OnProcessStart\n"
            "first = Node(package='p', executable='e', name='first', namespace='ns')",
        )
    )
    assert {n.name: (n.delay, n.after) for n in plan.nodes} == {
        "at_once": (0.0, None),
        "late": (2.5, None),
        "first": (0.0, None),
        "then": (1.0, ("exit", "/ns/first")),
        "beside": (0.0, ("start", "/ns/first")),
    }


@pytest.mark.parametrize("reaction", ["Shutdown()", "EmitEvent(event=ShutdownEvent(reason='gone'))"])
def test_node_whose_exit_shuts_down_is_required(folder: Path, reaction: str) -> None:
    plan = clean(
        python(
            folder,
            "viewer",
            f"RegisterEventHandler(OnProcessExit(target_action=viewer, on_exit=[{reaction}]))",
            f"Node(package='p', executable='e', name='own', on_exit={reaction})",
            "Node(package='p', executable='e', name='other')",
            before="from launch.events import Shutdown as ShutdownEvent\n"
            "viewer = Node(package='rviz2', executable='rviz2', name='viewer')",
        )
    )
    assert {n.name: n.required for n in plan.nodes} == {"viewer": True, "own": True, "other": False}


def test_period_that_is_not_a_number_is_reported(folder: Path) -> None:
    (found,) = python(folder, "TimerAction(period='soon', actions=[])").diagnostics
    assert found.code == "L005"


def test_missing_package_is_reported_at_the_line_that_needs_it(folder: Path) -> None:
    before = "from ament_index_python.packages import get_package_share_directory as share\nshare('nav9')\n"
    (found,) = python(folder, before=before).diagnostics
    assert found.origin is not None
    assert (found.code, found.origin.span.text) == ("L012", "share('nav9')")


def _placed(plan: Plan, name: str) -> str:
    origin = plan.params[name].origin
    return f"{Path(origin.span.file).name}:{origin.span.line}:{origin.span.text}"


def test_parameter_origin_is_where_it_is_written(folder: Path) -> None:
    (folder / "p.yaml").write_text("/**:\n  ros__parameters:\n    gains:\n      p: 1.0\n")
    xml = """<launch>
      <set_parameter name="all" value="2"/>
      <node pkg="p" exec="e" name="n">
        <param name="rate" value="5"/>
        <param name="a"><param name="b" value="$(var missing 1)"/>
          <param name="c" value="1"/></param>
        <param from="$(dirname)/p.yaml"/>
      </node></launch>"""
    plan = read(folder / "a.launch.xml", xml.replace("$(var missing 1)", "2"))
    assert _placed(plan, "/n/all") == 'a.launch.xml:2:<set_parameter name="all" value="2"/>'
    assert _placed(plan, "/n/rate") == 'a.launch.xml:4:<param name="rate" value="5"/>'
    assert _placed(plan, "/n/a.b") == 'a.launch.xml:5:<param name="b" value="2"/>'
    assert _placed(plan, "/n/a.c") == 'a.launch.xml:6:<param name="c" value="1"/>'
    assert _placed(plan, "/n/gains.p") == "p.yaml:4:p"
    node = """Node(package="p", executable="e", name="n", parameters=[
        {"ü": 1, "rate": 5}, "p.yaml", dict(other=2)])"""
    plan = python(folder, node.replace('"p.yaml"', repr(str(folder / "p.yaml"))))
    line = plan.nodes[0].origin.span.line
    assert _placed(plan, "/n/rate") == f'a.launch.py:{line + 1}:"rate"'
    assert _placed(plan, "/n/gains.p") == "p.yaml:4:p"
    assert plan.params["/n/other"].origin == plan.nodes[0].origin


def test_invalid_parameter_is_reported_where_it_is_written(folder: Path) -> None:
    (folder / "p.yaml").write_text("/**:\n  ros__parameters:\n    a: [1,\n")
    problem = only(
        read(
            folder / "a.launch.xml",
            '<launch><node pkg="p" exec="e"><param from="$(dirname)/p.yaml"/></node></launch>',
        )
    )
    assert problem.origin is not None
    assert (problem.code, Path(problem.origin.span.file).name, problem.origin.span.line) == (
        "L033",
        "p.yaml",
        4,
    )
    node = '<node pkg="p" exec="e">\n<param name="a" value="$(var v)"/></node>'
    problem = only(read(folder / "a.launch.xml", f'<launch><let name="v" value="]["/>{node}</launch>'))
    assert problem.origin is not None
    assert (problem.code, problem.origin.span.line) == ("L031", 2)


def test_shell_command_is_split_into_words(folder: Path) -> None:
    plan = clean(python(folder, "ExecuteProcess(cmd=[['ros2 ', 'bag ', 'record -o ', 'run']], shell=True)"))
    assert [(node.type, node.args) for node in plan.nodes] == [("ros2", "bag record -o run")]


def test_launch_context_created_by_the_file_is_that_of_the_launch(folder: Path) -> None:
    before = "from launch import LaunchContext\nname = FindExecutable(name='x').perform(LaunchContext())\n"
    plan = clean(python(folder, "Node(package='p', executable=name)", before=before))
    assert [node.type for node in plan.nodes] == ["x"]


def test_parameter_files_are_rewritten_as_in_nav2(folder: Path) -> None:
    (folder / "p.yaml").write_text(
        "map_server:\n  ros__parameters: {yaml_filename: '', use_sim_time: false, deep: {rate: 1.0}}\n"
        "amcl:\n  ros__parameters: {use_sim_time: false, alpha: 0.2}\n"
    )
    before = (
        "from nav2_common.launch import RewrittenYaml, HasNodeParams, ReplaceString\n"
        f"source = ReplaceString({str(folder / 'p.yaml')!r}, {{'amcl': 'localizer'}})\n"
        "params = RewrittenYaml(source, root_key='left', convert_types=True, param_rewrites={\n"
        "    'use_sim_time': LaunchConfiguration('sim'), 'yaml_filename': '/m.yaml',\n"
        "    'map_server.ros__parameters.deep.rate': '2.5'})\n"
    )
    plan = clean(
        python(
            folder,
            "DeclareLaunchArgument('sim', default_value='true')",
            "Node(package='nav2_map_server', executable='map_server', name='map_server', namespace='left',"
            " parameters=[params])",
            "Node(package='p', executable='e', name='params',"
            " parameters=[{'has': HasNodeParams(source, 'amcl')}])",
            before=before,
        )
    )
    values = {name: param.value for name, param in plan.params.items()}
    assert values == {
        "/left/map_server/yaml_filename": "/m.yaml",
        "/left/map_server/use_sim_time": True,
        "/left/map_server/deep.rate": 2.5,
        "/params/has": False,
    }


def test_number_of_included_files_is_limited(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.ros.launch.includes.MOST_FILES", 100)
    for level in range(30):
        twice = f'<include file="$(dirname)/{level + 1}.launch.xml"/>' * 2
        (folder / f"{level}.launch.xml").write_text(f"<launch>{twice}</launch>")
    (folder / "30.launch.xml").write_text("<launch/>")
    plan = read(folder / "a.launch.xml", '<launch><include file="$(dirname)/0.launch.xml"/></launch>')
    assert {d.code for d in plan.diagnostics} == {"L070"}
    assert len(plan.files) == 100


def test_parameter_files_share_one_limit(folder: Path) -> None:
    (folder / "p.yaml").write_text("n:\n  ros__parameters:\n    a: " + "x" * 400_000)
    node = '<node pkg="p" exec="e" name="n"><param from="$(dirname)/p.yaml"/></node>'
    plan = read(folder / "l.launch.xml", f"<launch>{node * 10}</launch>")
    assert {d.code for d in plan.diagnostics} == {"L070"}


SLOW = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<a n="${len([n * n for n in python.range(30000)])}"/></robot>"""


def test_expansions_share_one_limit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.ros.launch.reporter.DEFAULT", Limits(steps=300_000))
    (folder / "slow.xacro").write_text(SLOW)
    value = "$(command 'xacro $(dirname)/slow.xacro')"
    node = f'<node pkg="p" exec="e" name="n"><param name="d" value="{value}"/></node>'
    plan = read(folder / "l.launch.xml", f"<launch>{node * 10}</launch>")
    assert {d.code for d in plan.diagnostics} == {"L070"}


def test_expansions_by_the_xacro_module_share_one_limit(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.ros.launch.reporter.DEFAULT", Limits(steps=300_000))
    (folder / "slow.xacro").write_text(SLOW)
    before = f"import xacro\nfor _ in range(10): xacro.process_file('{folder}/slow.xacro')"
    plan = python(folder, before=before)
    assert {d.code for d in plan.diagnostics} == {"L070"}
