"""The module xacro in launch files. Expected values are those that xacro 2.1.1 from PyPI returned."""

from pathlib import Path

import pytest

from kbot.ros.launch.staging import stage

from .ros2_files import arguments_of, node, python

ROBOT = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="width" default="1"/><link name="base_$(arg width)"/>
</robot>
"""
NAMES = "' '.join(link.getAttribute('name') for link in doc.getElementsByTagName('link'))"
CHANGE = "doc.getElementsByTagName('link')[0].setAttribute('name', 'changed_$(arg width)')"


@pytest.fixture(autouse=True)
def at_robot(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "r.xacro").write_text(ROBOT)
    (folder / "part.xacro").write_text("<robot/>")
    monkeypatch.chdir(folder)


@pytest.mark.parametrize(
    ("code", "links"),
    [
        ("doc = xacro.parse(open('r.xacro').read()); xacro.process_doc(doc, {'width': '3'})", "base_3"),
        ("doc = xacro.parse(open('r.xacro')); xacro.process_doc(doc, mappings={'width': '3'})", "base_3"),
        ("with open('r.xacro', 'rb') as f: doc = xacro.parse(f)\nxacro.process_doc(doc)", "base_1"),
        ("doc = xacro.parse(None, 'r.xacro'); xacro.process_doc(doc)", "base_1"),
        ("doc = xacro.parse(xacro.parse(None, 'r.xacro')); xacro.process_doc(doc)", "base_1"),
        ("doc = xacro.parse(open('r.xacro'))", "base_$(arg width)"),
        (f"doc = xacro.parse(open('r.xacro')); {CHANGE}; xacro.process_doc(doc)", "changed_1"),
        ("doc = xacro.process_file('r.xacro', mappings={'width': 2})", "base_2"),
        (
            "o, f = xacro.process_args(['r.xacro', 'width:=2']); doc = xacro.process_file(f, **vars(o))",
            "base_2",
        ),
        ("doc = xacro.parse(xacro.process('r.xacro', mappings={'width': '4'}))", "base_4"),
    ],
)
def test_document_has_the_links_of_the_description(folder: Path, code: str, links: str) -> None:
    plan = python(folder, node("links"), before=f"import xacro\n{code}\nlinks = {NAMES}\n")
    assert arguments_of(plan).strip("'") == links


@pytest.mark.parametrize(
    "text",
    [
        "doc.toxml()",
        "doc.toprettyxml(indent='  ')",
        "doc.toxml(encoding='utf-8').decode()",
        "doc.documentElement.toxml()",
    ],
)
def test_robot_file_is_known_after_each_method_that_prints_a_document(folder: Path, text: str) -> None:
    publisher = f"Node(package='p', executable='e', parameters=[{{'robot_description': {text}}}])"
    before = "import xacro\ndoc = xacro.process_file('r.xacro', mappings={'width': '2'})"
    (robot,) = stage(python(folder, publisher, before=before)).robots
    assert (robot.path, robot.arguments) == ("r.xacro", {"width": "2"})


def test_robot_of_a_changed_document_is_that_of_the_document(folder: Path) -> None:
    publisher = "Node(package='p', executable='e', parameters=[{'robot_description': doc.toxml()}])"
    before = f"import xacro\ndoc = xacro.parse(open('r.xacro'))\n{CHANGE}\nxacro.process_doc(doc)"
    (robot,) = stage(python(folder, publisher, before=before)).robots
    assert "changed_$(arg width)" in Path(robot.path).read_text()


def test_options_of_a_command_line_are_those_of_xacro(folder: Path) -> None:
    before = (
        "import xacro\n"
        "options, file = xacro.process_args(['r.xacro', 'width := 2', '--inorder', '-q', '-o', 'out'])\n"
        "none = xacro.process_args([], require_input=False)[1]\n"
        "text = ' '.join(f'{name}={value}' for name, value in sorted(vars(options).items()))\n"
    )
    plan = python(folder, node("text", "file", "str(none)"), before=before)
    assert arguments_of(plan) == (
        "\"in_order=True just_deps=False mappings={'width': '2'} output=out root_dir=None verbosity=0\""
        " r.xacro None"
    ).replace('"', "'")


@pytest.mark.parametrize(
    ("code", "found", "message"),
    [
        ("xacro.process_args(['a', 'b'])", "L041", "takes one file, and the arguments name 2"),
        ("xacro.process_args([])", "L041", "takes one file, and the arguments name 0"),
        ("xacro.process_args(['--fast', 'a'])", "L056", "no such option: --fast"),
        ("xacro.parse('<robot>')", "P001", "is not closed"),
        ("xacro.process_file('r.xacro', {})", "L081", "TypeError"),
    ],
)
def test_wrong_use_is_an_error(folder: Path, code: str, found: str, message: str) -> None:
    (problem,) = python(folder, before=f"import xacro\n{code}").problems
    assert problem.code == found
    assert message in problem.message
