"""Files and packages that are missing. They are errors only if KBot needs them: launch_ros warns of a missing
parameter file, and a launch file asks for the folder of a package before it uses a file of it."""

from pathlib import Path

import pytest

from kbot.ros.launch import Plan, read_launch
from kbot.ros.launch.staging import stage
from kbot.text import Diagnostic
from kbot.xacro import Packages

from .ros2_files import HEAD, node, python, read

AMENT = "from ament_index_python.packages import get_package_share_directory as share, PackageNotFoundError"
RVIZ = "Node(package='rviz2', executable='rviz2', arguments=['-d', {}])"
OTHER = "Node(package='robot_localization', executable='ekf_node', parameters=[{}])"
PUBLISHER = "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=[{}])"
INCLUDE = "IncludeLaunchDescription(PythonLaunchDescriptionSource([{}, '/launch/a.launch.py']))"
SHARE = "share('nav9')"
FIND = "FindPackageShare('nav9')"


def found_in(plan: Plan) -> list[Diagnostic]:
    return [*plan.diagnostics, *(note for note in stage(plan).notes if note.code != "L055")]


def shown(plan: Plan) -> list[str]:
    """Each finding: its code, its severity, the text at its place, and its message."""
    return [f"{d.code} {d.severity} {d.origin and d.origin.span.text}: {d.message}" for d in found_in(plan)]


NOT_FOUND = "the package 'nav9' is not found: KBot continues without its files"


@pytest.mark.parametrize(
    ("before", "action", "text"),
    [
        (f"path = {SHARE} + '/a.rviz'", RVIZ.format("path"), f"path = {SHARE} + '/a.rviz'"),
        (f"path = {SHARE} + '/a.rviz'", node("'unused'"), f"path = {SHARE} + '/a.rviz'"),
        ("", RVIZ.format(f"PathJoinSubstitution([{FIND}, 'a.rviz'])"), RVIZ),
        ("", f"DeclareLaunchArgument('params', default_value=[{FIND}, '/p.yaml'])", "DeclareLaunchArgument("),
        ("", f"SetEnvironmentVariable('K', {FIND})", "SetEnvironmentVariable("),
        (f"import os\nhas = os.path.exists({SHARE})", node("'unused'"), f"has = os.path.exists({SHARE})"),
    ],
)
def test_absent_package_is_a_warning_where_it_is_used(
    folder: Path, before: str, action: str, text: str
) -> None:
    (found,) = shown(python(folder, action, before=f"{AMENT}\n{before}"))
    assert found.startswith(f"L012 warning {text.partition('{}')[0]}")
    assert found.endswith(f": {NOT_FOUND}")


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (INCLUDE.format(FIND), "the package 'nav9' is not found"),
        (INCLUDE.format(SHARE), "the package 'nav9' is not found"),
        (
            PUBLISHER.format(f"{{'robot_description': Command(['xacro ', {FIND}, '/r.xacro'])}}"),
            "r.xacro of the absent package 'nav9' does not exist",
        ),
        (
            PUBLISHER.format(f"{{'robot_description': Command(['cat ', {FIND}, '/r.urdf'])}}"),
            "r.urdf of the absent package 'nav9' does not exist",
        ),
        (PUBLISHER.format(f"[{FIND}, '/p.yaml']"), "p.yaml of the absent package 'nav9' does not exist"),
        (
            "Node(package='nav2_map_server', executable='map_server', parameters=["
            f"{{'yaml_filename': [{FIND}, '/m.yaml']}}])",
            "the map m.yaml of the absent package 'nav9' does not exist: /map is not published",
        ),
        (
            "Node(package='gazebo_ros', executable='spawn_entity.py',"
            f" arguments=['-file', [{FIND}, '/r.urdf']])",
            "r.urdf of the absent package 'nav9' does not exist: /spawn_entity.py spawns nothing",
        ),
        (
            "LogInfo(msg=open(os.path.join(share('nav9'), 'a.txt')).read())",
            "a.txt of the absent package 'nav9' does not exist",
        ),
        (
            "LogInfo(msg=__import__('xacro').process_file(share('nav9') + '/r.xacro').toxml())",
            "r.xacro of the absent package 'nav9' does not exist",
        ),
        (
            "LogInfo(msg=os.listdir(share('nav9'))[0])",
            "the folder of the absent package 'nav9' does not exist",
        ),
    ],
)
def test_absent_package_is_an_error_where_kbot_needs_its_file(
    folder: Path, action: str, message: str
) -> None:
    (found, *others) = (d for d in found_in(python(folder, action, before=AMENT)) if d.is_error)
    assert not others
    assert message in found.message
    assert found.origin is not None
    assert found.origin.span.line == len(f"{HEAD}{AMENT}".splitlines()) + 3


@pytest.mark.parametrize(
    ("package", "name"),
    [
        ("nav2_bringup", "navigation_launch.py"),
        ("slam_toolbox", "online_async_launch.py"),
        ("robot_localization", "ekf.launch.py"),
    ],
)
def test_absent_launch_file_of_nodes_that_kbot_does_not_run_is_a_warning(
    folder: Path, package: str, name: str
) -> None:
    message = f"{name} of the absent package '{package}' is not read: KBot does not run its nodes"
    include = (
        f"IncludeLaunchDescription(PythonLaunchDescriptionSource([FindPackageShare('{package}'),"
        f" '/launch/{name}']), launch_arguments={{'params_file': FileContent('/no/such.yaml')}}.items())"
    )
    (found,) = found_in(python(folder, include, node("'after'")))
    assert (found.code, found.severity, found.message) == ("L012", "warning", message)
    text = f'<launch><include file="$(find {package})/launch/{name}"/></launch>'
    (folder / "a.launch").write_text(text)
    (found,) = found_in(read_launch(str(folder / "a.launch"), {}, Packages(around=str(folder))))
    assert (found.code, found.severity, found.message) == ("L012", "warning", message)


def test_absent_launch_file_that_may_start_a_robot_is_an_error(folder: Path) -> None:
    include = INCLUDE.format("FindPackageShare('nav2_bringup')").replace("a.launch", "tb3_simulation_launch")
    (found,) = found_in(python(folder, include.replace("launch.py", "py")))
    assert (found.code, found.severity) == ("L012", "error")


@pytest.mark.parametrize("error", ["PackageNotFoundError", "(KeyError, OSError)", "Exception"])
def test_launch_file_can_catch_the_error_of_an_absent_package(folder: Path, error: str) -> None:
    before = f"""{AMENT}
def find(name):
    try:
        return share(name)
    except {error}:
        return 'none'
"""
    plan = python(folder, node("find('nav9')", "find('mine')"), before=before)
    assert plan.diagnostics == ()
    assert plan.nodes[0].args == f"none {folder}"


def test_try_that_catches_other_errors_does_not_see_the_absent_package(folder: Path) -> None:
    before = f"{AMENT}\ntry:\n    path = {SHARE}\nexcept ValueError:\n    path = 'none'\n"
    (found,) = shown(python(folder, RVIZ.format("path"), before=before))
    assert found == f"L012 warning path = {SHARE}: {NOT_FOUND}"


@pytest.mark.parametrize(
    "file",
    [
        "'/no/such.yaml'",
        "ParameterFile('/no/such.yaml')",
        "ParameterFile('/no/such.yaml', allow_substs=True)",
        "RewrittenYaml('/no/such.yaml', param_rewrites={})",
        "ReplaceString('/no/such.yaml', replacements={})",
    ],
)
@pytest.mark.parametrize(
    ("of", "severity"),
    [
        (OTHER, "L059 warning"),
        (RVIZ.replace("arguments", "parameters"), "L059 warning"),
        (PUBLISHER, "F001 error"),
    ],
)
def test_missing_parameter_file_is_an_error_only_for_a_node_that_kbot_runs(
    folder: Path, file: str, of: str, severity: str
) -> None:
    before = (
        "from nav2_common.launch import ReplaceString, RewrittenYaml\n"
        "from launch_ros.parameter_descriptions import ParameterFile\n"
    )
    action = of.replace("'-d', ", "").format(file + ", {'rate': 5}")
    plan = python(folder, action, before=before)
    (found,) = shown(plan)
    assert found.startswith(f"{severity} {action}")
    assert ": /no/such.yaml does not exist" in found
    assert [param.value for param in plan.params.values()] == [5]


def test_missing_parameter_file_of_a_program_that_kbot_runs_is_an_error(folder: Path) -> None:
    own = "Node(package='mine', executable='drive.py', parameters=['/no/such.yaml'])"
    (found,) = found_in(python(folder, own))
    assert found.severity == "warning"
    (folder / "drive.py").write_text("import sys\n")
    (found,) = found_in(python(folder, own))
    assert (found.code, found.severity) == ("F001", "error")


def test_missing_parameter_file_in_xml_is_reported_at_its_tag(folder: Path) -> None:
    tag = '<param from="/no/such.yaml"/>'
    text = f'<launch><node pkg="robot_localization" exec="ekf_node">{tag}</node></launch>'
    (found,) = shown(read(folder / "a.launch.xml", text))
    assert found.startswith(f"L059 warning {tag}: ")


def test_parameter_file_that_is_not_yaml_is_an_error_that_kbot_can_ignore(folder: Path) -> None:
    (folder / "p.yaml").write_text("/**: [")
    plan = python(folder, OTHER.format(repr(str(folder / "p.yaml"))))
    assert plan.problems == ()
    (found,) = plan.findings
    assert (found.code, found.severity) == ("L033", "error")
    assert found.message.startswith("on ROS: ")


ROS_1 = '<launch><node pkg="{0}" type="{0}" name="n"{2}>{1}</node></launch>'
ROSPARAM = '<rosparam file="{}/p.yaml"/>'
FIRST = "L012 warning $(find nav9): "
ON_ROS = "L032 error /no/p.yaml: on ROS: /no/p.yaml does not exist"


@pytest.mark.parametrize(
    ("package", "inner", "args", "is_refused", "expected"),
    [
        # roslaunch stops at a missing file; it may have a package that KBot does not find
        (
            "move_base",
            ROSPARAM.format("/no"),
            "",
            False,
            ON_ROS,
        ),
        (
            "rviz",
            ROSPARAM.format("/no"),
            "",
            False,
            ON_ROS,
        ),
        ("map_server", ROSPARAM.format("/no"), "", True, "L032 error /no/p.yaml: /no/p.yaml does not exist"),
        (
            "move_base",
            ROSPARAM.format("$(find nav9)"),
            "",
            False,
            "L012 warning $(find nav9)/p.yaml:",
        ),
        (
            "map_server",
            ROSPARAM.format("$(find nav9)"),
            "",
            True,
            "L012 error $(find nav9)/p.yaml:",
        ),
        ("move_base", "", ' args="$(find nav9)/p.yaml"', False, FIRST + NOT_FOUND),
        ("rviz", "", ' args="-d $(find nav9)/a.rviz"', False, FIRST + NOT_FOUND),
        (
            "map_server",
            "",
            ' args="$(find nav9)/m.yaml"',
            False,
            "L059 error $(find nav9)/m.yaml:",
        ),
    ],
)
def test_missing_files_in_ros_1(
    folder: Path, package: str, inner: str, args: str, is_refused: bool, expected: str
) -> None:
    (folder / "a.launch").write_text(ROS_1.format(package, inner, args))
    plan = read_launch(str(folder / "a.launch"), {}, Packages(around=str(folder)))
    assert any(found.startswith(expected) for found in shown(plan))
    assert any(problem.is_error for problem in plan.problems) is is_refused
