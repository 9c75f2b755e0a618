"""Edits in all files that a robot is made from, and robots that have only some of them."""

import pickle
from collections.abc import Mapping
from pathlib import Path

import pytest

from kbot.text import DescriptionError
from kbot.trials.compare.causes import relevant_changes
from kbot.trials.compare.edits import Edits
from kbot.trials.compare.revisions import Description, opened

PACKAGE = "<package><name>{}</name></package>"
MAIN = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find robot)/urdf/wheels.xacro"/>
  <xacro:property name="sizes" value="${xacro.load_yaml('../config/sizes.yaml')}"/>
  <link name="base">
    <inertial><mass value="${sizes['mass']}"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <xacro:wheel name="left" y="0.2"/>
  <xacro:wheel name="right" y="-0.2"/>
</robot>
"""
WHEELS = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="name y">
    <link name="${name}">
      <collision>
        <origin rpy="1.57 0 0"/><geometry><cylinder radius="0.05" length="0.02"/></geometry>
      </collision>
      <inertial><mass value="0.1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    </link>
    <joint name="${name}_joint" type="continuous">
      <parent link="base"/>
      <child link="${name}"/>
      <origin xyz="0 ${y} 0"/>
      <axis xyz="0 1 0"/>
    </joint>
  </xacro:macro>
</robot>
"""
FILES = {
    "robot/package.xml": PACKAGE.format("robot"),
    "robot/urdf/robot.xacro": MAIN,
    "robot/urdf/wheels.xacro": WHEELS,
    "robot/config/sizes.yaml": "mass: 2.0\nwidth: 0.4\n",
}
ROBOT = "robot/urdf/robot.xacro"


Files = Mapping[str, str | None]
"""Texts by file, None for a file that does not exist."""


def sides(tmp_path: Path, before: Files, after: Files) -> list[Description]:
    """The robot with other files on each side."""
    found = []
    for name, other in (("a", before), ("b", after)):
        for file, text in {**FILES, **other}.items():
            if text is not None:
                path = tmp_path / name / file
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
        with opened(str(tmp_path / name / ROBOT)) as description:
            assert isinstance(description, Description)
            found.append(description)
    return found


def relevant(edits: Edits, tmp_path: Path) -> list[list[tuple[str, int]]]:
    return [
        [(Path(e.file).relative_to(tmp_path / "b").as_posix(), e.line) for e in change.lines]
        for change in relevant_changes(edits)
    ]


OTHER = WHEELS.replace('radius="0.05"', 'radius="0.06"').replace("<axis", "<!-- y -->\n      <axis")

OPTIONAL = MAIN.replace("</robot>", '<xacro:include filename="more.xacro" optional="true"/></robot>')
MORE = '<robot><gazebo reference="left"><mu1>0.5</mu1></gazebo></robot>'


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        # an included file
        ({}, {"robot/urdf/wheels.xacro": OTHER}, [[("robot/urdf/wheels.xacro", 5)]]),
        # a YAML file that expressions read, with harmless edits of both files
        (
            {},
            {
                "robot/config/sizes.yaml": "# sizes\nmass: 2.5\nwidth: 0.40\n",
                ROBOT: MAIN.replace("-0.2", "-0.20"),
            },
            [[("robot/config/sizes.yaml", 2)]],
        ),
        # a renamed file
        (
            {},
            {
                "robot/urdf/wheels.xacro": None,
                "robot/urdf/parts.xacro": OTHER,
                ROBOT: MAIN.replace("wheels.xacro", "parts.xacro"),
            },
            [[("robot/urdf/parts.xacro", 5)]],
        ),
        # a file for each kind of wheel instead of one
        (
            {},
            {
                "robot/urdf/other.xacro": OTHER.replace('"wheel"', '"wheel2"'),
                ROBOT: MAIN.replace('wheel name="left"', 'wheel2 name="left"').replace(
                    "  <xacro:property", '  <xacro:include filename="other.xacro"/>\n  <xacro:property'
                ),
            },
            [[(ROBOT, 3), (ROBOT, 9)]],
        ),
        # a package that only B has
        (
            {},
            {
                "parts/package.xml": PACKAGE.format("parts"),
                "parts/wheels.xacro": OTHER,
                ROBOT: MAIN.replace("$(find robot)/urdf", "$(find parts)"),
            },
            [[(ROBOT, 2)]],
        ),
        # a file of another package
        (
            {
                "parts/package.xml": PACKAGE.format("parts"),
                "parts/wheels.xacro": WHEELS,
                ROBOT: MAIN.replace("$(find robot)/urdf", "$(find parts)"),
            },
            {
                "parts/package.xml": PACKAGE.format("parts"),
                "parts/wheels.xacro": OTHER,
                ROBOT: MAIN.replace("$(find robot)/urdf", "$(find parts)"),
            },
            [[("parts/wheels.xacro", 5)]],
        ),
        # an optional include that appears or disappears
        (
            {ROBOT: OPTIONAL},
            {ROBOT: OPTIONAL, "robot/urdf/more.xacro": MORE},
            [[("robot/urdf/more.xacro", 1)]],
        ),
    ],
)  # fmt: skip
def test_the_file_and_line_of_a_change(
    tmp_path: Path,
    no_packages: None,
    before: Files,
    after: Files,
    expected: list[list[tuple[str, int]]],
):
    edits = Edits(*sides(tmp_path, before, after))
    assert edits.behaves_like_after(edits.all)
    assert not edits.behaves_like_after(())
    assert relevant(edits, tmp_path) == expected
    # and the other way round
    back = Edits(*sides(tmp_path / "back", after, before))
    assert back.behaves_like_after(back.all)
    assert relevant_changes(back)


def test_a_file_that_disappeared_is_in_a(tmp_path: Path, no_packages: None):
    edits = Edits(*sides(tmp_path, {ROBOT: OPTIONAL, "robot/urdf/more.xacro": MORE}, {ROBOT: OPTIONAL}))
    assert [Path(e.file) for c in relevant_changes(edits) for e in c.edits] == [
        tmp_path / "a" / "robot" / "urdf" / "more.xacro"
    ]


PLUGIN = """  <ros2_control name="r" type="system">
    <joint name="left_joint"><command_interface name="velocity"/></joint>
  </ros2_control>
  <gazebo><plugin name="gz_ros2_control" filename="libgazebo_ros2_control.so">
    <parameters>$(find robot)/config/controllers.yaml</parameters>
  </plugin></gazebo>
</robot>"""
CONTROLLERS = """controller_manager:
  ros__parameters:
    drive:
      type: diff_drive_controller/DiffDriveController
drive:
  ros__parameters:
    left_wheel_names: [left_joint]
    right_wheel_names: [right_joint]
    wheel_separation: {}
    wheel_radius: {}
"""


def test_a_parameter_file_of_a_plugin(tmp_path: Path, no_packages: None):
    def files(*sizes: str) -> dict[str, str]:
        text = CONTROLLERS.format(*sizes)
        return {ROBOT: MAIN.replace("</robot>", PLUGIN), "robot/config/controllers.yaml": text}

    descriptions = sides(tmp_path, files("0.4", "0.05"), files("0.42", "0.050 # m"))
    edits = Edits(*descriptions)
    assert relevant(edits, tmp_path) == [[("robot/config/controllers.yaml", 9)]]
    assert relevant_changes(edits)[0].edits[0].column == len("    wheel_separation: 0.4") + 1
    # a simulation in the block reads the changed file
    with edits.variant(edits.all).opened() as robot:
        from kbot.kinematics.drive.declared import declared_drives

        separations = [d.given["wheel_separation"].value for d in declared_drives(robot)]
    assert separations == [0.42]


NEARBY = """mobile_base_controller:
  type: "diff_drive_controller/DiffDriveController"
  left_wheel: left_joint
  right_wheel: right_joint
  wheel_separation: {}
"""
CLASSIC = '<gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo></robot>'


@pytest.mark.parametrize(("before", "after"), [("0.4", "0.5"), (None, "0.5"), ("0.4", None)])
def test_a_controller_in_a_file_that_no_description_names(
    tmp_path: Path, no_packages: None, before: str | None, after: str | None
):
    def files(separation: str | None) -> dict[str, str | None]:
        text = None if separation is None else NEARBY.format(separation)
        return {ROBOT: MAIN.replace("</robot>", CLASSIC), "robot/config/control.yaml": text}

    edits = Edits(*sides(tmp_path, files(before), files(after)))
    changes = relevant_changes(edits)
    assert [Path(e.file).name for change in changes for e in change.edits] == ["control.yaml"]
    assert edits.behaves_like_after(edits.all)


def stl(size: float) -> str:
    """A tetrahedron."""
    points = (0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size)
    faces = (0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)
    lines = [
        "facet normal 0 0 0 outer loop "
        + " ".join("vertex {} {} {}".format(*points[corner]) for corner in face)
        + " endloop endfacet"
        for face in faces
    ]
    return "\n".join(["solid t", *lines, "endsolid t\n"])


MESH = '<collision><geometry><mesh filename="package://robot/meshes/{}.stl"/></geometry></collision>'


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (("base", {"base": 1.0}), ("base", {"base": 1.5}), [[("robot/meshes/base.stl", 1)]]),
        (("base", {"base": 1.0}), ("body", {"body": 1.0}), []),
        (("base", {"base": 1.0}), ("body", {"body": 1.5}), [[(ROBOT, 5)]]),
        (("base", {}), ("base", {"base": 1.0}), [[("robot/meshes/base.stl", 1)]]),
    ],
)
def test_a_collision_mesh(
    tmp_path: Path,
    no_packages: None,
    before: tuple[str, dict[str, float]],
    after: tuple[str, dict[str, float]],
    expected: list[list[tuple[str, int]]],
):
    def files(name: str, meshes: dict[str, float]) -> dict[str, str]:
        main = MAIN.replace("    <inertial>", f"    {MESH.format(name)}<inertial>")
        return {ROBOT: main, **{f"robot/meshes/{mesh}.stl": stl(size) for mesh, size in meshes.items()}}

    edits = Edits(*sides(tmp_path, files(*before), files(*after)))
    assert edits.behaves_like_after(edits.all)
    assert relevant(edits, tmp_path) == expected


def test_a_variant_can_be_sent_to_another_process_and_writes_no_file(tmp_path: Path, no_packages: None):
    descriptions = sides(tmp_path, {}, {"robot/urdf/wheels.xacro": OTHER})
    edits = Edits(*descriptions)
    with pickle.loads(pickle.dumps(edits.variant(edits.all))).opened() as robot:
        assert {c.geometry.radius for link in robot.links.values() for c in link.collisions} == {0.06}
    with edits.variant(()).opened() as robot:
        assert {c.geometry.radius for link in robot.links.values() for c in link.collisions} == {0.05}
    assert (tmp_path / "a" / "robot" / "urdf" / "wheels.xacro").read_text() == WHEELS


def test_files_of_different_names_are_compared(tmp_path: Path, no_packages: None):
    for name, text in (("one", WHEELS), ("two", OTHER)):
        (tmp_path / f"{name}.xacro").write_text(MAIN.replace("$(find robot)/urdf/wheels", f"{name}_wheels"))
        (tmp_path / f"{name}_wheels.xacro").write_text(text)
    (tmp_path.parent / "config").mkdir()
    (tmp_path.parent / "config" / "sizes.yaml").write_text("mass: 2\n")
    edits = Edits(*(Description(name, str(tmp_path / f"{name}.xacro")) for name in ("one", "two")))
    assert [(Path(e.file).name, e.line) for c in relevant_changes(edits) for e in c.lines] == [
        ("two_wheels.xacro", 5)
    ]


def test_the_same_files_have_no_edits(tmp_path: Path, no_packages: None):
    before, _ = sides(tmp_path, {}, {})
    edits = Edits(before, before)
    assert edits.all == ()
    assert relevant_changes(edits) == ()


def test_a_description_with_errors_is_refused(tmp_path: Path, no_packages: None):
    with pytest.raises(DescriptionError, match="sizs"):
        Edits(*sides(tmp_path, {}, {ROBOT: MAIN.replace("sizes[", "sizs[")}))


def test_files_that_a_pattern_includes_are_a_change_as_a_whole(tmp_path: Path, no_packages: None):
    main = MAIN.replace("</robot>", '<xacro:include filename="more/*.xacro"/></robot>')
    more = {"robot/urdf/more/a.xacro": '<robot><link name="a"/><joint name="a" type="fixed">'
            '<parent link="base"/><child link="a"/></joint></robot>'}  # fmt: skip
    before, after = sides(tmp_path, {ROBOT: main}, {ROBOT: main, **more})
    edits = Edits(before, after)
    assert relevant(edits, tmp_path) == [[(ROBOT, 1)]]
    (change,) = relevant_changes(edits)
    with edits.variant(change.edits).opened() as robot:
        assert "a" in robot.links
