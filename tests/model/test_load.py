"""Tests loading robots from files and unsaved text, with the diagnostics of expansion and reading."""

import pytest

from kbot.model.load import load_robot, load_robot_text, resolve_robot_path
from kbot.text import DescriptionError
from kbot.xacro import Packages, expand_text

BROKEN = """<?xml version="1.0"?>
<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="base"/>
  <link name="ball"><collision><geometry><sphere radius="${radius}"/></geometry></collision></link>
  <joint name="j" type="fixd"><parent link="base"/><child link="ball"/></joint>
</robot>
"""


def test_kbot_is_the_shipped_robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kbot").write_text("something else")
    assert resolve_robot_path("kbot").endswith("robots/kbot_description/urdf/kbot.xacro")
    assert load_robot("kbot").require().name == "kbot"
    assert resolve_robot_path("./kbot") == "./kbot"


def test_errors_of_expansion_and_reading_are_reported_together():
    loaded = load_robot_text(BROKEN, "bot.xacro")
    assert [(d.code[0], d.origin.span.line) for d in loaded.diagnostics] == [("X", 4), ("U", 5)]
    with pytest.raises(DescriptionError):
        loaded.require()


def test_consequences_of_expansion_errors_are_not_reported():
    loaded = load_robot_text(BROKEN.replace("fixd", "fixed"), "bot.xacro")
    assert [d.code[0] for d in loaded.diagnostics] == ["X"]
    assert loaded.robot is not None
    assert loaded.robot.links["ball"].collisions == ()
    assert loaded.has_errors


def test_errors_have_the_macro_call_in_their_origin():
    text = """<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="side">
    <link name="${side}_wheel"/>
    <joint name="${side}_joint" type="fixed"><parent link="bse"/><child link="${side}_wheel"/></joint>
  </xacro:macro>
  <link name="base"/>
  <xacro:wheel side="left"/>
</robot>"""
    (found,) = load_robot_text(text, "bot.xacro").diagnostics
    assert (found.code, found.origin.span.line, found.origin.span.text) == ("U006", 4, "bse")
    assert [(call.name, call.span.line) for call in found.origin.stack] == [("wheel", 7)]


def test_meshes_are_found_around_the_file(tmp_path):
    package = tmp_path / "my_robot"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_robot</name></package>")
    (package / "meshes/a.stl").write_text("solid")
    (package / "urdf").mkdir()
    file = package / "urdf/r.urdf"
    uris = ["package://my_robot/meshes/a.stl", "package://my_robot/meshes/b.stl", "../meshes/a.stl"]
    visuals = "".join(f"<visual><geometry><mesh filename='{u}'/></geometry></visual>" for u in uris)
    file.write_text(f"<robot name='r'><link name='a'>{visuals}</link></robot>")
    robot = load_robot(file, packages=Packages()).require()
    paths = [v.geometry.path for v in robot.links["a"].visuals]
    assert [path is not None for path in paths] == [True, False, True]


@pytest.mark.parametrize(
    "content", [b"", b"\x89PNG\r\n\x1a\n\x00", b"a: 1\nb: 2\n", b"<robot name='r'><link", b"<sdf/>"]
)
def test_files_that_are_not_robots_never_raise(tmp_path, content):
    path = tmp_path / "file.urdf"
    path.write_bytes(content)
    loaded = load_robot(path)
    assert loaded.robot is None
    assert [d.is_error for d in loaded.diagnostics] == [True]


def test_a_directory_and_a_missing_file_never_raise(tmp_path):
    for path in (tmp_path, tmp_path / "none.urdf"):
        loaded = load_robot(path)
        assert loaded.robot is None
        assert len(loaded.diagnostics) == 1


def test_a_wrong_value_is_one_error_although_many_shapes_use_it() -> None:
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="r" value="0,05"/>'
        '<link name="a"><visual><geometry><sphere radius="${r}"/></geometry></visual>'
        '<collision><geometry><cylinder radius="${r}" length="${2*r}"/></geometry></collision></link></robot>'
    )
    assert [d.code for d in load_robot_text(text, "r.xacro").diagnostics] == ["U012"]


XACRO = """<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find lidar_description)/urdf/lidar.xacro"/>
  <xacro:include filename="$(find lidar_description)/urdf/mount.xacro"/>
  <link name="base"/>
  {}
</robot>"""


def test_include_of_an_absent_package_is_a_warning():
    loaded = load_robot_text(XACRO.format(""), "bot.xacro")
    (warning,) = loaded.diagnostics
    assert (warning.code, warning.is_error, warning.origin.span.line) == ("X114", False, 2)
    assert "the package 'lidar_description' is not found, so this file is not included" in warning.message
    assert [(r.message, r.origin.span.line) for r in warning.related] == [("included here too", 3)]
    assert list(loaded.require().links) == ["base"]
    strict = expand_text(XACRO.format(""), "bot.xacro")
    assert [(d.code, d.is_error) for d in strict.diagnostics] == [("X114", True)]


@pytest.mark.parametrize(
    "use",
    [
        '<xacro:lidar parent="base"/>',
        '<link name="${lidar_name}"/>',
        '<link name="$(arg lidar_name)"/>',
        '<xacro:insert_block name="lidar"/>',
        '<link name="$(find lidar_description)"/>',
        '<joint name="j" type="fixed"><parent link="lidar"/><child link="base"/></joint>',
    ],
)
def test_absent_package_is_an_error_if_the_robot_needs_it(use):
    (error,) = load_robot_text(XACRO.format(use), "bot.xacro").diagnostics
    assert (error.code, error.is_error, error.origin.span.line) == ("X114", True, 2)
    assert "'lidar_description'" in error.message
    if "joint" not in use:
        assert 5 in [place.origin.span.line for place in error.related]


def test_only_the_packages_that_the_calling_file_includes_are_errors(tmp_path):
    joint = '<joint name="j" type="fixed"><parent link="base"/><child link="lidar"/></joint>'
    mount = XACRO.format(f"<xacro:lidar/>{joint}").replace('<link name="base"/>', "")
    (tmp_path / "mount.xacro").write_text(mount)
    include = '<xacro:include filename="mount.xacro"/>'
    text = XACRO.format(include).replace("lidar_", "camera_")
    found = load_robot_text(text, tmp_path / "bot.xacro").diagnostics
    assert [(d.is_error, d.message.split("'")[1]) for d in found] == [
        (False, "camera_description"), (True, "lidar_description")
    ]  # fmt: skip


def test_a_slip_is_reported_beside_an_absent_package():
    text = XACRO.format(
        '<link name="a"/><joint name="j" type="fixed"><parent link="bse"/><child link="a"/></joint>'
    )
    found = load_robot_text(text, "bot.xacro").diagnostics
    assert [(d.code, d.is_error) for d in found] == [("X114", False), ("U006", True)]


DASHES = """
<?xml version="1.0"?>
<robot name="bot"><!-- a -- b --><link name="base"/><sensor:camera name="c"/></robot>
"""


def test_urdf_that_ros_reads_has_warnings():
    loaded = load_robot_text(DASHES, "bot.urdf")
    assert list(loaded.require().links) == ["base"]
    assert [(d.code, d.is_error, d.origin.span.line) for d in loaded.diagnostics] == [
        ("P007", False, 2), ("P007", False, 3), ("P004", False, 3)
    ]  # fmt: skip
    assert loaded.diagnostics[0].fix.title == "remove the text before <?xml"
    assert [d.code for d in expand_text(DASHES, "bot.urdf").diagnostics] == ["P001"]


def test_xacro_must_be_well_formed():
    """xacro rejects it, so ROS never loads it."""
    text = DASHES.replace("<link", '<xacro:property name="a" value="1"/><link')
    (error,) = load_robot_text(text, "bot.urdf").diagnostics
    assert (error.code, error.is_error) == ("P001", True)


LEFT_OVER = """<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="base"/>
  <xacro:grey/>
</robot>"""


def test_xacro_tag_in_urdf_is_ignored_with_a_warning():
    loaded = load_robot_text(LEFT_OVER, "bot.urdf")
    assert [(d.code, d.is_error, d.origin.span.line) for d in loaded.diagnostics] == [("X213", False, 3)]
    assert list(loaded.require().links) == ["base"]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (LEFT_OVER, "bot.xacro"),
        (LEFT_OVER.replace("<link", '<xacro:macro name="blue"/><link'), "bot.urdf"),
        (LEFT_OVER.replace("grey", "propery"), "bot.urdf"),
    ],
)
def test_unknown_macro_is_an_error_where_xacro_is_used(text, name):
    assert [(d.code, d.is_error) for d in load_robot_text(text, name).diagnostics] == [("X121", True)]
