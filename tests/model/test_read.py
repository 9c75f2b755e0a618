"""Tests the reader with correct and broken URDF."""

import math
import sys
from types import FrameType

import pytest

from kbot.model import Box, Cylinder, JointType, Mesh, RobotReading, read_robot
from kbot.text import DescriptionError, Source, parse_xml


def read(text: str) -> RobotReading:
    return read_robot(parse_xml(Source("robot.urdf", text)))


def robot(*body: str) -> str:
    return "<robot name='r'>\n" + "\n".join(body) + "\n</robot>"


def link(name: str, inside: str = "") -> str:
    return f"<link name='{name}'>{inside}</link>"


def joint(name: str, parent: str, child: str, kind: str = "fixed", inside: str = "") -> str:
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
    )


def findings(text: str) -> list[tuple[str, int, str]]:
    return [(d.code, d.origin.span.line, d.origin.span.text) for d in read(text).diagnostics]


def test_a_complete_robot():
    reading = read(
        robot(
            "<material name='red'><color rgba='1 0 0 1'/></material>",
            link("base", "<visual><geometry><box size='1 2 3'/></geometry><material name='red'/></visual>"),
            link(
                "arm",
                "<inertial><origin xyz='0 0 1'/><mass value='2'/>"
                "<inertia ixx='1' ixy='0' ixz='0' iyy='2' iyz='0' izz='3'/></inertial>"
                "<collision name='c'><origin rpy='0 1.5 0'/>"
                "<geometry><cylinder radius='.5' length='1e1'/></geometry></collision>",
            ),
            joint(
                "j",
                "base",
                "arm",
                "revolute",
                "<origin xyz='1 2 3'/><axis xyz='0 0 1'/>"
                "<limit lower='-1' upper='1' effort='5' velocity='6'/><dynamics damping='.1'/>",
            ),
            "<gazebo reference='arm'/>",
        )
    )
    result = reading.require()
    assert not reading.diagnostics
    assert (result.name, result.root, list(result.links), list(result.joints)) == (
        "r",
        "base",
        ["base", "arm"],
        ["j"],
    )
    visual = result.links["base"].visuals[0]
    assert isinstance(visual.geometry, Box)
    assert visual.geometry.size == (1, 2, 3)
    assert visual.material is not None
    assert visual.material.rgba == (1, 0, 0, 1)
    arm = result.links["arm"]
    assert arm.inertial is not None
    assert (arm.inertial.mass, arm.inertial.iyy, arm.inertial.pose.xyz) == (2, 2, (0, 0, 1))
    assert isinstance(arm.collisions[0].geometry, Cylinder)
    assert arm.collisions[0].geometry.length == 10
    assert arm.collisions[0].pose.rpy == (0, 1.5, 0)
    j = result.joints["j"]
    assert (j.type, j.axis, j.pose.xyz) == (JointType.REVOLUTE, (0, 0, 1), (1, 2, 3))
    assert j.limit is not None
    assert (j.limit.lower, j.limit.upper, j.limit.effort, j.limit.velocity) == (-1, 1, 5, 6)
    assert j.dynamics is not None
    assert (j.dynamics.damping, j.dynamics.friction) == (0.1, 0)
    assert [e.tag for e in result.extensions] == ["gazebo"]
    assert j.child_origin.span.text == "arm"


BROKEN = {
    "not a robot": ("<sdf/>", [("U001", 1, "<sdf/>")]),
    "no name": ("<robot><link name='a'/></robot>", [("U002", 1, "<robot>")]),
    "no link": ("<robot name='r'/>", [("U003", 1, "<robot name='r'/>")]),
    "duplicate link": (robot(link("a"), link("a")), [("U004", 3, "a")]),
    "duplicate joint": (
        robot(link("a"), link("b"), link("c"), joint("j", "a", "b"), joint("j", "a", "c")),
        [("U005", 6, "j")],
    ),
    "undefined parent": (
        robot(link("base_link"), link("b"), joint("j", "bse_link", "b")),
        [("U006", 4, "bse_link")],
    ),
    "undefined child": (robot(link("a"), link("wheel"), joint("j", "a", "whel")), [("U007", 4, "whel")]),
    "two roots": (
        robot(link("x"), link("a"), link("b"), joint("j", "a", "b")),
        [("U008", 2, "<link name='x'>")],
    ),
    "ring": (
        robot(link("r"), link("a"), link("b"), joint("j", "a", "b"), joint("k", "b", "a")),
        [("U009", 5, "b")],
    ),
    "own parent": (robot(link("r"), link("a"), joint("j", "a", "a")), [("U009", 4, "a")]),
    "two parents": (
        robot(
            link("a"), link("b"), link("c"), joint("j", "a", "b"), joint("k", "a", "c"), joint("l", "b", "c")
        ),
        [("U010", 7, "c")],
    ),
    "unknown joint type": (
        robot(link("a"), link("b"), joint("j", "a", "b", "hinge")),
        [("U011", 4, "hinge")],
    ),
    "no number": (
        robot(link("a"), link("b"), joint("j", "a", "b", inside="<origin xyz='0 o 0'/>")),
        [("U012", 4, "0 o 0")],
    ),
    "NaN": (
        robot(link("a"), link("b"), joint("j", "a", "b", inside="<origin xyz='0 0 nan'/>")),
        [("U012", 4, "0 0 nan")],
    ),
    "too large": (
        robot(link("a", "<visual><geometry><sphere radius='1e999'/></geometry></visual>")),
        [("U012", 2, "1e999")],
    ),
    "a box beyond all bounds": (
        robot(link("a", "<visual><geometry><box size='1 1 2e9'/></geometry></visual>")),
        [("U012", 2, "1 1 2e9")],
    ),
    "a place beyond all bounds": (
        robot(link("a"), link("b"), joint("j", "a", "b", inside="<origin xyz='-1e300 0 0'/>")),
        [("U012", 4, "-1e300 0 0")],
    ),
    "two of three": (
        robot(link("a", "<visual><geometry><box size='1 2'/></geometry></visual>")),
        [("U012", 2, "1 2")],
    ),
    "missing attribute": (
        robot(link("a", "<visual><geometry><sphere/></geometry></visual>")),
        [("U013", 2, "<sphere/>")],
    ),
    "missing child": (
        robot(link("a"), "<joint name='j' type='fixed'><parent link='a'/></joint>"),
        [("U014", 3, "<joint name='j' type='fixed'>")],
    ),
    "missing geometry": (robot(link("a", "<visual/>")), [("U014", 2, "<visual/>")]),
    "missing mass": (
        robot(link("a", "<inertial><inertia ixx='1' ixy='0' ixz='0' iyy='2' iyz='0' izz='3'/></inertial>")),
        [("U014", 2, "<inertial>")],
    ),
    "link without name": (robot(link("a"), "<link/>"), [("U015", 3, "<link/>")]),
    "empty name": (robot(link("a"), "<link name=' '/>"), [("U015", 3, " ")]),
    "unknown shape": (
        robot(link("a", "<visual><geometry><bx size='1 1 1'/></geometry></visual>")),
        [("U016", 2, "<bx size='1 1 1'/>")],
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_fault_is_reported_once_where_it_was_written(name):
    text, expected = BROKEN[name]
    assert findings(text) == expected


@pytest.mark.parametrize("digits", ["\uff11", "\u0661", "1\u00a0", "1_0", "0x1"])
def test_numbers_are_written_in_ascii_as_for_strtod(digits):
    """Python reads full-width and Arabic digits and no-break spaces as numbers, ROS does not."""
    text = f'<robot name="r"><link name="a"/><link name="b"/>{JOINT.format(digits)}</robot>'
    found = read_robot(parse_xml(Source("r.urdf", text))).diagnostics
    assert {d.code for d in found} == {"U012"}
    assert digits.strip() in found[0].message


JOINT = """<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="{0} 0 0"/></joint>"""


def test_nearest_names_are_suggested():
    text = robot(link("base_link"), link("b"), joint("j", "bse_link", "b", "fixd"))
    hints = [d.hint for d in read(text).diagnostics]
    assert hints == ["did you mean 'fixed'?"]
    assert read(text.replace("fixd", "fixed")).diagnostics[0].hint == "did you mean 'base_link'?"


def test_many_faults_in_one_run():
    text = robot(
        link("a", "<inertial><mass value='x'/><inertia ixx='1'/></inertial>"),
        link("b"),
        joint("j", "a", "b", inside="<origin xyz='1 2'/><limit effort='e' velocity='1'/>"),
    )
    assert [code for code, _, _ in findings(text)] == ["U013"] * 5 + ["U012"] * 3


def test_a_robot_with_errors_exists_but_require_raises():
    text = robot(
        link(
            "a",
            "<inertial><mass value='nan'/>"
            "<inertia ixx='1' ixy='0' ixz='0' iyy='2' iyz='0' izz='3'/></inertial>",
        )
    )
    reading = read(text)
    assert reading.robot is not None
    assert math.isnan(reading.robot.links["a"].inertial.mass)
    with pytest.raises(DescriptionError, match="not a finite number"):
        reading.require()


def test_the_same_fault_in_two_places_is_two_findings():
    shape = "<geometry><sphere radius='${r}'/></geometry>"
    reading = read(robot(link("a", f"<visual>{shape}</visual>\n<collision>{shape}</collision>")))
    assert [d.origin.span.line for d in reading.diagnostics] == [2, 3]
    assert all("not expanded" in d.hint for d in reading.diagnostics)
    assert reading.robot is not None
    assert (reading.robot.links["a"].visuals, reading.robot.links["a"].collisions) == ((), ())


def test_an_unexpanded_vector_is_one_finding():
    text = robot(link("a"), link("b"), joint("j", "a", "b", inside="<origin xyz='${x + 1} 0 -${y}'/>"))
    assert findings(text) == [("U012", 4, "${x + 1} 0 -${y}")]


def test_without_a_tree_there_is_no_robot():
    assert read(robot(link("a"), link("b"))).robot is None


def test_first_definition_of_a_material_counts():
    visual = "<visual><geometry><sphere radius='1'/></geometry><material name='{}'>{}</material></visual>"
    result = read(
        robot(
            "<material name='red'><color rgba='1 0 0 1'/></material>",
            link("a", visual.format("red", "<color rgba='0 1 0 1'/>")),
            link("b", visual.format("own", "<color rgba='0 0 1 1'/>")),
            link("c", visual.format("own", "")),
            link("d", visual.format("none", "")),
            *(joint(f"j{x}", "a", x) for x in "bcd"),
        )
    ).require()
    colors = {name: part.visuals[0].material.rgba for name, part in result.links.items()}
    assert colors == {"a": (1, 0, 0, 1), "b": (0, 0, 1, 1), "c": (0, 0, 1, 1), "d": None}


def test_a_missing_mesh_is_not_an_error_of_the_reader():
    result = read(
        robot(link("a", "<visual><geometry><mesh filename='package://no/a.stl'/></geometry></visual>"))
    )
    mesh = result.require().links["a"].visuals[0].geometry
    assert isinstance(mesh, Mesh)
    assert (mesh.uri, mesh.path, mesh.scale) == ("package://no/a.stl", None, (1, 1, 1))


def test_every_expanded_robot_of_the_corpus_is_read(shared):
    fragments = {"uxarm_gripper.urdf.xacro.x.urdf", "sawyer_base.gazebo.xacro.urdf"}
    files = sorted((shared / "corpus/expected").rglob("*.urdf"))
    assert len(files) > 100
    for file in files:
        reading = read(file.read_text())
        if file.name in fragments:
            assert {d.code for d in reading.diagnostics} <= {"U006", "U007"}
        else:
            assert reading.require().links, file


def test_numbers_separated_by_commas_have_a_hint():
    (found,) = read(
        robot(link("a"), link("b"), joint("j", "a", "b", inside="<origin xyz='0.15,0,0'/>"))
    ).diagnostics
    assert found.message == "'xyz' of <origin> needs 3 numbers, not 1"
    assert found.hint == "separate numbers by spaces, not by commas: 0.15 0 0"
    assert found.fix is not None
    assert [edit.replacement for edit in found.fix.edits] == ["0.15 0 0"]


def test_work_for_several_roots_grows_linearly() -> None:
    """Counts executed lines: two chains of four times the links take at most five times the lines."""
    work = []
    for count in (100, 400):
        links = [link(f"{side}{i}") for side in "ab" for i in range(count)]
        joints = [joint(f"{s}{i}", f"{s}{i}", f"{s}{i + 1}") for s in "ab" for i in range(count - 1)]
        root = parse_xml(Source("robot.urdf", robot(*links, *joints)))
        lines = 0

        def counted(_frame: FrameType, event: str, _argument: object) -> object:
            nonlocal lines
            lines += event == "line"
            return counted

        before = sys.gettrace()
        sys.settrace(counted)
        try:
            found = read_robot(root).diagnostics
        finally:
            sys.settrace(before)
        assert [d.code for d in found] == ["U008"]
        work.append(lines)
    assert work[1] < 5 * work[0], work


def test_the_root_of_most_links_is_the_main_one() -> None:
    body = (link("small"), link("big"), link("a"), link("b"), joint("1", "big", "a"), joint("2", "a", "b"))
    (found,) = read(robot(*body)).diagnostics
    assert found.message == "link 'small' has no parent joint, and the robot already has the root 'big'"
