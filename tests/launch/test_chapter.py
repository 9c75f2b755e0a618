"""The launch files of the printed chapter: errors that ROS would raise are reported with a line and a fix."""

from pathlib import Path

from kbot.ros.launch import Plan, read_launch
from kbot.ros.launch.known_packages import Role, role
from kbot.xacro import Packages


def plan_of(path: Path) -> Plan:
    return read_launch(str(path), packages=Packages(around=str(path)))


def launch_findings(plan: Plan) -> dict[str, tuple[int, str]]:
    return {
        d.code: (d.origin.span.line, d.origin.span.text)
        for d in plan.diagnostics
        if d.origin and d.code.startswith("L")
    }


def test_printed_launch_file_has_the_findings_for_noetic(shared: Path) -> None:
    folder = shared / "chapter/printed/kbot_description/launch"
    plan = plan_of(folder / "kbot_base_rviz_gazebo.launch")
    assert launch_findings(plan) == {
        "L057": (2, "--inorder"),
        "L053": (3, "state_publisher"),
        "L056": (15, "-verbose"),
    }
    renamed = next(d for d in plan.findings if d.code == "L053")
    assert "no transforms are published" in renamed.hint
    assert renamed.fix is not None
    assert [edit.replacement for edit in renamed.fix.edits] == ["robot_state_publisher"]
    assert not any(problem.is_error for problem in plan.problems)
    assert {d.code for d in plan.findings if d.message.startswith("on ROS: ")} == {"L053", "L056"}
    (removed,) = [d.fix for d in plan.findings if d.code == "L056"]
    assert removed is not None
    assert [(edit.span.text, edit.replacement) for edit in removed.edits] == [(" -verbose", "")]


def test_gazebo_world_is_replaced_with_its_arguments(shared: Path) -> None:
    folder = shared / "chapter/printed/kbot_description/launch"
    (world,) = plan_of(folder / "kbot_base_rviz_gazebo.launch").included
    assert (world.package, world.name) == ("gazebo_ros", "empty_world.launch")
    assert world.arguments["paused"] == "false"
    assert world.arguments["verbose"] == "true"
    assert world.arguments["physics"] == "ode"


def test_corrected_launch_file_has_no_findings_and_lists_its_nodes(shared: Path) -> None:
    plan = plan_of(shared / "chapter/corrected/kbot_description/launch/kbot_base_rviz.launch")
    assert plan.require() is plan
    assert launch_findings(plan) == {}
    assert [role(node.package, node.type) for node in plan.nodes] == [
        Role.ROBOT_STATE,
        Role.JOINT_STATE,
        Role.VIEWER,
    ]
    assert plan.nodes[2].required
    description = plan.params["/robot_description"].description
    assert description is not None
    assert Path(description.path) == shared / "chapter/corrected/kbot_description/urdf/kbot.xacro"
