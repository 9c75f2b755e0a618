"""Fuzzes the launch files of ROS 1 and of ROS 2 (XML, YAML and Python).

For every input, reading must end within its limits and report errors as diagnostics with a code, a message
and a place. Files in Python are programs and are run: only whole actions are put into them.
"""

from functools import partial

from choices import Choices
from diagnostics import check_diagnostics
from edits import edited, real_files

from kbot.ros.launch.ros1.reader import read_launch
from kbot.ros.launch.ros2.reader import read_launch_2
from kbot.ros.launch.staging import stage
from kbot.text import Source
from kbot.xacro.packages import Packages

TAGS = [
    '<arg name="a" default="{}"/>',
    '<arg name="b" value="$(arg a)$(arg a)"/>',
    '<param name="p" value="$(eval {})"/>',
    '<param name="q" value="{}" type="yaml"/>',
    "<rosparam>{}</rosparam>",
    '<group ns="{}" if="$(eval {})">',
    "</group>",
    '<node pkg="p" type="t" name="n" args="{}"/>',
    '<remap from="{}" to="b"/>',
    '<let name="a" value="$(var a){}$(var a)"/>',
    '<let name="a" value="$(eval \'{}\')"/>',
    '<node pkg="p" exec="e" name="n"><param name="p" value="{}"/></node>',
    '<set_env name="A" value="$(env A){}"/>',
    '<push_ros_namespace namespace="{}"/>',
]
WORDS = [
    *("$(arg a)", "$(var a)", "$(env HOME)", "$(optenv A b)", "$(anon a)", "$(dirname)", "$(find p)"),
    *("$(not true)", "$(path-join $(var a) $(var a))", "$(if true a b)", "'a' * 3000000", "2**20000"),
    *("[[1] * 999] * 999", "('a'*3000000).rfind('ab'+'a'*1000000)", "dict.fromkeys(map(str, [1] * 9999))"),
    *("$(", ")", "1", "a: [b, {c: d}]"),
]


SEEDS = {
    "launch": real_files(".launch", ".launch.in"),
    "launch.xml": real_files(".launch.xml", ".launch.xml.in"),
    "launch.yaml": [
        b"""launch:
- arg: {name: robot, default: kbot}
- let: {name: a, value: $(var robot)_$(env HOME x)}
- include: {file: $(find-pkg-share p)/launch/a.launch.xml, arg: [{name: b, value: '1'}]}
- group:
  - push_ros_namespace: {namespace: $(var robot)}
  - set_env: {name: A, value: $(eval '1 + 1')}
  - node: {pkg: p, exec: e, name: n, if: $(eval "'$(var a)' == 'b'"), remap: [{from: a, to: b}],
           param: [{name: p, value: 1.5}, {name: q, value: [1, 2]}, {from: a.yaml}], args: -a --b}
- executable: {cmd: ls -l, shell: false}
"""
    ],
}
PYTHON = """
from launch import LaunchDescription
from launch.actions import *
from launch.conditions import *
from launch.event_handlers import *
from launch.substitutions import *
from launch_ros.actions import *
from launch_ros.parameter_descriptions import ParameterValue

def generate_launch_description():
    return LaunchDescription([{}])
"""
VALUES = [
    "'a'", "'$(var a)'", "1", "-1.5", "None", "True", "[]", "{}", "['a', 'b']", "{'a': 1}", "'a.yaml'",
    "object()", "LaunchConfiguration('a')", "TextSubstitution(text='b')", "PythonExpression(['1 +', '1'])",
    "[['a'], 'b']", "Command('ls')", "FindExecutable(name='ls')",
    "EnvironmentVariable('A', default_value='b')", "1e400", "b'a'",
    "PathJoinSubstitution(['a', LaunchConfiguration('a')])", "ParameterValue('1', value_type=float)",
    "'a' * 9999", "IfCondition('true')", "UnlessCondition(LaunchConfiguration('a'))",
    "OnProcessExit(on_exit=[])", "lambda *a: 1",
]  # fmt: skip
ACTIONS = [
    "DeclareLaunchArgument({}, default_value={})", "DeclareLaunchArgument('a', default_value={}, choices={})",
    "SetLaunchConfiguration({}, {})", "UnsetLaunchConfiguration({})", "SetEnvironmentVariable({}, {})",
    "Node(package={}, executable={}, name={}, parameters=[{}], remappings=[({}, {})], arguments=[{}])",
    "Node(package='p', executable='e', namespace={}, parameters={}, condition={})", "LogInfo(msg={})",
    "IncludeLaunchDescription({}, launch_arguments={})", "GroupAction([{}, {}], scoped={})",
    "PushRosNamespace({})", "TimerAction(period={}, actions=[{}])", "OpaqueFunction(function={}, args={})",
    "ExecuteProcess(cmd=[{}, {}])", "RegisterEventHandler({})", "SetParameter(name={}, value={})",
    "SetRemap({}, {})", "AppendEnvironmentVariable({}, {})", "{}",
]  # fmt: skip


def check(name: str, text: str) -> None:
    """Read a launch file and check the diagnostics."""
    source, given = Source(name, text), {"a": "1"}
    if name.endswith(".launch"):
        plan = read_launch(name, given, Packages(), source=source)
    else:
        plan = read_launch_2(name, given, Packages(), source=source, trusted=name.endswith(".py"))
    check_diagnostics((*plan.diagnostics, *stage(plan).notes))


def one_input(ending: str, choices: Choices) -> None:
    name = f"fuzz.{ending}"
    kind = choices.integer(0, 3)
    if kind == 0:
        check(name, choices.text(4_000))
        return
    if kind == 1:
        text = edited(choices, SEEDS[ending], [tag.encode() for tag in TAGS + WORDS])
        check(name, text.decode(errors="replace"))
        return
    parts = []
    for _ in range(choices.integer(1, 12)):
        word = choices.pick(WORDS)
        if choices.flag():
            word += choices.text(20)
        parts.append(choices.pick(TAGS).replace("{}", word))
    check(name, f"<launch>{''.join(parts)}</launch>")


def one_program(choices: Choices) -> None:
    """A launch file in Python, with actions whose arguments may be of any type."""
    actions = []
    for _ in range(choices.integer(1, 6)):
        action = choices.pick(ACTIONS)
        while "{}" in action:
            value = (
                choices.pick(ACTIONS)
                if choices.integer(0, 7) == 0 and len(action) < 300
                else choices.pick(VALUES)
            )
            action = action.replace("{}", value.replace("{}", "dict()") if "(" not in value else value, 1)
        actions.append(action)
    check("fuzz.launch.py", PYTHON.replace("{}", ", ".join(actions)))


TARGETS = {
    "ros1-launch": partial(one_input, "launch"),
    "ros2-launch-xml": partial(one_input, "launch.xml"),
    "ros2-launch-yaml": partial(one_input, "launch.yaml"),
    "ros2-launch-python": one_program,
}
