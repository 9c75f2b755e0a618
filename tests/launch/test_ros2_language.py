"""Names, groups, substitutions and markup of ROS 2 launch files. Expected values follow the sources of launch
and launch_ros."""

import os
import sys
from pathlib import Path

import pytest

from .ros2_files import arguments_of, clean, node, python, read


def test_each_name_can_be_imported_from_its_own_submodule(folder: Path) -> None:
    before = (
        "from launch.substitutions.path_join_substitution import PathJoinSubstitution as P\n"
        "from launch.actions.declare_launch_argument import DeclareLaunchArgument as D\n"
        "from launch_ros.actions.node import Node as N\n"
        "from launch.event_handlers.on_process_exit import OnProcessExit\n"
    )
    plan = python(
        folder, "D('a', default_value='x')", node("P(['a', LaunchConfiguration('a')])"), before=before
    )
    assert arguments_of(plan) == str(Path("a/x"))


def test_environment_variables_are_appended_and_prepended(folder: Path) -> None:
    plan = python(
        folder,
        "SetEnvironmentVariable('K', 'a')",
        "AppendEnvironmentVariable('K', 'b')",
        "AppendEnvironmentVariable('K', 'c', prepend=True, separator=';')",
        "AppendEnvironmentVariable('KBOT_NEW', 'n')",
        node("EnvironmentVariable('K')", "EnvironmentVariable('KBOT_NEW')"),
    )
    assert arguments_of(plan) == f"c;a{os.pathsep}b n"


def test_descriptions_and_worlds_read_the_variables_that_actions_set(folder: Path) -> None:
    group = "GroupAction([SetEnvironmentVariable('K', 'a'), AppendEnvironmentVariable('K', 'b')])"
    assert clean(python(folder, group)).environment == {"K": f"a{os.pathsep}b"}
    unset = "GroupAction([SetEnvironmentVariable('K', 'a'), UnsetEnvironmentVariable('K')])"
    assert clean(python(folder, unset)).environment == {}


def test_launch_file_imports_the_module_of_another_package(folder: Path) -> None:
    (folder / "package.xml").write_text("<package><name>mine</name></package>")
    other = folder / "tools_of_mine"
    (other / "tools_of_mine").mkdir(parents=True)
    (other / "package.xml").write_text("<package><name>tools_of_mine</name></package>")
    (other / "tools_of_mine" / "__init__.py").write_text("")
    (other / "tools_of_mine" / "names.py").write_text(
        """from launch import LaunchContext, SomeSubstitutionsType, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

class Upper(Substitution):
    def __init__(self, name: SomeSubstitutionsType) -> None:
        self.name = normalize_to_list_of_substitutions(name)

    def perform(self, context: LaunchContext) -> str:
        return perform_substitutions(context, self.name).upper()
"""
    )
    name = "Upper(LaunchConfiguration('name', default='arm'))"
    plan = python(folder, node(name), before="from tools_of_mine.names import Upper")
    assert arguments_of(plan) == "ARM"
    assert "tools_of_mine" not in sys.modules


def test_groups_forward_and_scope_configurations(folder: Path) -> None:
    group = (
        "GroupAction([" + node("LaunchConfiguration('a', default='-')", "LaunchConfiguration('b')") + "],"
        " launch_configurations={'b': LaunchConfiguration('a')}, forwarding=%s, scoped=%s)"
    )
    start = "SetLaunchConfiguration('a', '1')"
    assert arguments_of(python(folder, start, group % (True, True))) == "1 1"
    assert arguments_of(python(folder, start, group % (False, True))) == "- 1"
    after = (
        "Node(package='p', executable='e', name='after', arguments=[LaunchConfiguration('b', default='-')])"
    )
    assert arguments_of(python(folder, start, group % (True, True), after), "after") == "-"
    assert arguments_of(python(folder, start, group % (True, False), after), "after") == "1"
    xml = """<launch><let name="a" value="1"/><group forwarding="false"><keep name="b" value="$(var a)"/>
      <node pkg="p" exec="e" name="probe" args="$(var b)"/></group>
      <reset><keep name="c" value="$(var a)2"/></reset>
      <node pkg="p" exec="e" name="after" args="$(var c)"/></launch>"""
    plan = read(folder / "a.launch.xml", xml)
    assert (arguments_of(plan), arguments_of(plan, "after")) == ("1", "12")


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
        node(look).replace("probe", "after"),
    )
    assert (arguments_of(plan), arguments_of(plan, "after")) == ("1", "-")


def test_substitutions_of_newer_releases_work(folder: Path) -> None:
    (folder / "words.txt").write_text("from a file")
    xml = f"""<launch><let name="a" value="1"/><set_parameter name="q" value="7"/>
      <node pkg="p" exec="e" name="probe" args="$(any false $(var a)) $(all true false) $(param q)
        $(path-join x y) '$(file-content {folder}/words.txt)'"/></launch>"""
    words = arguments_of(read(folder / "a.launch.xml", xml)).split()
    assert words == ["true", "false", "7", str(Path("x/y")), "'from", "a", "file'"]
    plan = python(
        folder,
        "SetParameter('q', 7)",
        node("AnySubstitution('false', 'true')", "AllSubstitution('true', 'false')", "Parameter('q')"),
    )
    assert arguments_of(plan) == "true false 7"


@pytest.mark.parametrize(
    ("before", "message", "hint"),
    [
        ("os.environ['KBOT_MODEL']", "the environment variable KBOT_MODEL is not set", "KBOT_MODEL=VALUE"),
        ("import no_such_module", "needs the Python module 'no_such_module'", "PYTHONPATH"),
        ("from launch.actions import NoSuchAction", "KBot does not provide launch.actions.NoSuchAction", ""),
        ("from nav2_common.launch import RewritenYaml", "nav2_common.launch.RewritenYaml", "RewrittenYaml"),
    ],
)
def test_missing_names_and_modules_are_reported_with_a_hint(
    folder: Path, before: str, message: str, hint: str
) -> None:
    (problem,) = python(folder, before=before).problems
    assert message in problem.message
    assert hint in (problem.hint or "")
    assert problem.origin is not None
    assert problem.origin.span.text == before


def test_yaml_group_can_be_a_list(folder: Path) -> None:
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
def test_escaped_substitutions_in_markup_are_text(folder: Path, text: str, expected: str | None) -> None:
    """Expected values come from the parser of launch itself."""
    escaped = text.replace('"', "&quot;").replace("<", "&lt;")
    xml = f'<launch><let name="a" value="x"/><let name="b" value="{escaped}"/>'
    plan = read(
        folder / "a.launch.xml", f'{xml}<node pkg="p" exec="e" name="n" namespace="$(var b)"/></launch>'
    )
    if expected is None:
        assert any(p.is_error for p in plan.problems)
    else:
        assert [n.namespace.strip("/") for n in clean(plan).nodes] == [expected]
