"""roslaunch's own dumps against ours, over its examples and files that are harder."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from kbot.launch import Plan, read_launch
from kbot.text import DescriptionError
from kbot.xacro import Packages

from .conftest import Ros

EXAMPLES = (
    "example-args.launch",
    "example-gdb.launch",
    "example-include.launch",
    "example-min.launch",
    "example-pass_all_args.launch",
    "example-ssh.launch",
    "timeouts.launch",
)

EXAMPLE_FOLDER = Path("/usr/share/roslaunch/resources")

INNER = """<launch>
  <arg name="a" default="one"/><arg name="b"/>
  <param name="inner_$(arg a)" value="$(arg b)"/>
  <param name="~private" value="from inner"/>
  <node pkg="p" type="t" name="inner" ns="deep/er"/>
</launch>"""

HARD = {
    "types": """<launch>
      <param name="int" value=" 12 "/><param name="float" value="1e3"/><param name="dot" value="1."/>
      <param name="under" value="1_0"/><param name="bool" value="fAlse"/><param name="hex" value="0x10"/>
      <param name="str" value="12" type="str"/><param name="double" value="12" type="double"/>
      <param name="yaml" value="{a: [1, 2.5, yes], b: {c: null}}" type="yaml"/>
      <param name="b1" value="1" type="bool"/><param name="/" value="root" if="0"/>
    </launch>""",
    "namespaces": """<launch>
      <group ns="a"><group ns="b"><param name="c" value="1"/><param name="/d" value="2"/>
        <node pkg="p" type="t" name="n"><param name="x" value="3"/><param name="~y" value="4"/></node>
        <node pkg="p" type="t" name="n" ns="/glob"><param name="x" value="3"/></node></group>
        <group ns="/abs"><param name="e" value="5"/></group></group>
      <group><param name="f" value="6"/></group><param name="a//b/" value="7"/>
    </launch>""",
    "private": """<launch>
      <node pkg="p" type="t" name="before"/><param name="~r" value="1"/><node pkg="p" type="t" name="one"/>
      <group><param name="~r" value="2"/><param name="~s" value="3"/>
        <node pkg="p" type="t" name="two"/></group>
      <node pkg="p" type="t" name="three"><param name="r" value="4"/></node>
    </launch>""",
    "args": """<launch>
      <arg name="x" default="1"/><arg name="y" value="$(arg x)2"/><arg name="doc" default="" doc="said"/>
      <param name="p" value="$(arg y)"/><param name="e" value="$(eval x + arg('y') * 2)"/>
      <param name="t" value="$(eval 'a' if x == 1 else 'b')"/><param name="pi" value="$(eval sin(pi/2))"/>
      <param name="l" value="$(eval list(map(str, [1, 2])))"/>
      <param name="o" value="$(optenv NOT_SET a b c)"/>
      <param name="if" value="1" if="$(eval x == 1)"/><param name="unless" value="1" unless="$(arg x)"/>
      <param name="two" value="$(arg x)-$(arg y)-$(arg x) $$(arg x) $"/>
    </launch>""",
    "include": """<launch>
      <arg name="b" value="outer"/>
      <include file="$(dirname)/inner.launch"><arg name="b" value="1"/></include>
      <include file="$(dirname)/inner.launch" ns="ns2"><arg name="a" value="two"/>
        <arg name="b" value="2"/></include>
      <group ns="g"><include file="$(dirname)/inner.launch" pass_all_args="true" ns="x"/></group>
      <node pkg="p" type="t" name="after"/>
    </launch>""",
    "rosparam": """<launch>
      <rosparam>{a: 1, b: {c: deg(180), d: rad(pi/4), e: [1, two]}}</rosparam>
      <rosparam param="list">[1, 2]</rosparam><rosparam ns="in">x: 1</rosparam><rosparam/>
      <rosparam file="$(dirname)/p.yaml" command="load" ns="file"/>
      <arg name="v" default="9"/><rosparam subst_value="true">s: $(arg v)</rosparam>
      <node pkg="p" type="t" name="n"><rosparam>{gain: 1, sub: {y: 2}}</rosparam></node>
    </launch>""",
    "files": """<launch>
      <param name="text" textfile="$(dirname)/p.yaml"/><param name="cat" command="cat $(dirname)/p.yaml"/>
      <param name="robot" command="$(find xacro)/xacro $(dirname)/r.xacro width:=0.3"/>
    </launch>""",
    "tests": """<launch><test test-name="t1" pkg="p" type="t" time-limit="5"/>
      <test test-name="t2" name="named" ns="n" pkg="p" type="t"><param name="x" value="1"/></test>
    </launch>""",
    "remaps": """<launch><remap from="a" to="b"/><env name="E" value="1"/>
      <node pkg="p" type="t" name="n" args="--x $(anon n)"><remap from="a" to="c"/></node></launch>""",
    "slow": "<launch>" + "".join(f'<param name="p{i}" value="{i}"/>' for i in range(300)) + "</launch>",
}

WRONG = {
    "unset": '<launch><arg name="a"/><param name="p" value="$(arg a)"/></launch>',
    "both": '<launch><param name="p" value="1" if="1" unless="0"/></launch>',
    "unused": '<launch><include file="$(dirname)/inner.launch"><arg name="b" value="1"/>'
    '<arg name="c" value="1"/></include></launch>',
    "twice": '<launch><arg name="a" default="1"/><arg name="a" default="2"/></launch>',
    "grounded": '<launch><include file="$(dirname)/fixed.launch"><arg name="a" value="1"/>'
    "</include></launch>",
    "type": '<launch><param name="p" value="x" type="int"/></launch>',
    "no value": '<launch><param name="p"/></launch>',
    "same name": '<launch><node pkg="p" type="t" name="n"/><node pkg="p" type="t" name="n"/></launch>',
    "package": '<launch><param name="p" textfile="$(find no_such_package)/x"/></launch>',
    "env": '<launch><param name="p" value="$(env KBOT_NOT_SET)"/></launch>',
    "dunder": '<launch><param name="p" value="$(eval \'\'.__class__)"/></launch>',
    "remap": '<launch><remap from="a"/></launch>',
    "bool": '<launch><node pkg="p" type="t" name="n" required="1"/></launch>',
    "no root": "<robot/>",
    "empty ns": '<launch><group ns=""/></launch>',
    "yaml": "<launch><rosparam>[1, 2]</rosparam></launch>",
    "substitution": '<launch><param name="p" value="$(fnd p)"/></launch>',
}


@pytest.fixture(scope="module")
def folder(ros: Ros) -> Path:
    folder = ros.home / "launch_files"
    folder.mkdir()
    (folder / "inner.launch").write_text(INNER)
    (folder / "fixed.launch").write_text('<launch><arg name="a" value="2"/></launch>')
    (folder / "p.yaml").write_text("a: {b: 1}\nlist: [1.5, x]\n")
    (folder / "r.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="width" default="1"/>'
        '<link name="a${2 * $(arg width)}"/></robot>'
    )
    for name, text in {**HARD, **WRONG}.items():
        (folder / f"{name}.launch").write_text(text)
    return folder


def nodes(text: str) -> list[str]:
    """Node names, with what is different at every run taken out of the anonymous ones."""
    return [re.sub(r"_\w+_\d+_\d+$|_\d+_\d+$", "_anonymous", line) for line in text.split()]


def plan_of(ros: Ros, file: Path) -> Plan:
    packages = Packages([str(ros.packages), "/usr/share"], around=str(file))
    return read_launch(str(file), packages=packages)


def compare_params(ros: Ros, file: Path) -> None:
    plan = plan_of(ros, file).require()
    dumped = yaml.safe_load(ros.run("roslaunch", "--dump-params", str(file)))
    ours = {name: param.value for name, param in plan.params.items()}
    for name, value in dumped.items():
        if isinstance(value, str) and value.startswith("<?xml"):
            assert (
                re.sub(r"<!--.*?-->", "", value).split() == re.sub(r"<!--.*?-->", "", ours.pop(name)).split()
            )
        else:
            found = ours.pop(name)
            assert (type(found), found) == (type(value), value), name
    assert ours == {}


def compare_nodes(ros: Ros, file: Path) -> None:
    plan = plan_of(ros, file).require()
    names = nodes(ros.run("roslaunch", "--nodes", str(file)))
    assert sorted(nodes(" ".join(node.full_name for node in plan.nodes))) == sorted(names)
    files = ros.run("roslaunch", "--files", str(file)).split()
    assert sorted(set(plan.files)) == sorted(set(files))


@pytest.mark.parametrize("name", EXAMPLES)
def test_roslaunch_s_own_examples(ros: Ros, name: str) -> None:
    compare_params(ros, EXAMPLE_FOLDER / name)
    compare_nodes(ros, EXAMPLE_FOLDER / name)


def test_the_example_whose_bytes_roslaunch_cannot_dump(ros: Ros) -> None:
    compare_nodes(ros, EXAMPLE_FOLDER / "example.launch")


@pytest.mark.parametrize("name", HARD)
def test_harder_files(ros: Ros, folder: Path, name: str) -> None:
    compare_params(ros, folder / f"{name}.launch")
    compare_nodes(ros, folder / f"{name}.launch")


@pytest.mark.parametrize("name", WRONG)
def test_what_roslaunch_refuses_is_refused(ros: Ros, folder: Path, name: str) -> None:
    file = folder / f"{name}.launch"
    with pytest.raises(AssertionError):
        ros.run("roslaunch", "--nodes", str(file))
    with pytest.raises(DescriptionError):
        plan_of(ros, file).require()


def test_the_list_of_arguments_reads_alike(ros: Ros, folder: Path) -> None:
    file = str(folder / "args.launch")
    ours = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", file, "--ros-args"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert ours.stdout == ros.run("roslaunch", "--ros-args", file)


def test_the_corrected_chapter(ros: Ros, shared: Path) -> None:
    link = ros.packages / "kbot_description"
    link.symlink_to(shared / "chapter/corrected/kbot_description")
    try:
        compare_params(ros, link / "launch/kbot_base_rviz.launch")
        compare_nodes(ros, link / "launch/kbot_base_rviz.launch")
    finally:
        link.unlink()
