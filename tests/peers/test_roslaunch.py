"""The output of roslaunch compared with that of KBot, for its examples and for harder files."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from kbot.ros.launch import Plan, read_launch
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

MIDDLE = """<launch>
  <arg name="c"/><arg name="a" default="middle"/>
  <group ns="m"><include file="$(dirname)/inner.launch" ns="$(arg c)x" if="0">
      <arg name="b" value="1"/></include>
    <include file="$(dirname)/inner.launch"><arg name="b" value="$(arg c)"/>
      <arg name="a" default="d"/></include>
  </group>
  <param name="c" value="$(arg c)"/>
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
    "conditions": """<launch>
      <arg name="on" default="True"/><arg name="off" default="0"/><arg name="word" default="fast"/>
      <group if="$(arg on)"><param name="a" value="1"/><group unless="$(arg off)">
        <node pkg="p" type="t" name="n" if="1"><param name="x" value="1" unless="$(arg on)"/>
          <param name="y" value="2" if="$(arg on)"/></node></group></group>
      <include file="$(dirname)/inner.launch" if="$(arg off)"><arg name="b" value="1"/></include>
      <include file="$(dirname)/inner.launch" ns="i"><arg name="b" value="1"/>
        <arg name="a" value="x" if="$(arg off)"/><arg name="a" value="y" unless="$(arg off)"/></include>
      <arg name="late" value="$(eval 'b' + word)" if="$(eval word == 'fast' and on)"/>
      <param name="late" value="$(arg late)"/>
      <rosparam if="$(arg on)">{r: 1}</rosparam><rosparam unless="$(arg on)">{s: 1}</rosparam>
    </launch>""",
    "passing": """<launch>
      <arg name="a" default="mine"/><arg name="b" default="too"/>
      <include file="$(dirname)/inner.launch" pass_all_args="true"><arg name="a" value="over"/></include>
      <include file="$(dirname)/middle.launch"><arg name="c" value="$(arg a)-$(arg b)"/></include>
    </launch>""",
    "overwritten": """<launch>
      <param name="a" value="1"/><param name="a" value="2"/><rosparam>{b: 1}</rosparam>
      <rosparam>{b: 2, c: {d: 1}}</rosparam><param name="c/e" value="3"/>
      <group ns="g"><rosparam ns="/abs">{z: 1}</rosparam><rosparam param="/q">5</rosparam>
        <rosparam param="rel" ns="deep">[a, b]</rosparam></group>
      <group ns="gone" clear_params="true"><param name="kept" value="1"/></group>
    </launch>""",
    "numbers": """<launch>
      <param name="plus" value="+5"/><param name="neg" value="-0"/><param name="exp" value="1.5e-3"/>
      <param name="zero" value="007"/><param name="oct" value="0o7"/><param name="inf" value=".inf"/>
      <param name="spaces" value="  a b  "/><param name="empty" value=""/><param name="nl" value="a&#10;b"/>
      <param name="d" value="1e3" type="double"/><param name="i" value="-12" type="int"/>
      <param name="yes" value="yes"/><param name="y2" value="yes" type="yaml"/>
      <param name="n" value="null" type="yaml" if="0"/><param name="s" value="true" type="string"/>
      <param name="f" value="12." type="yaml"/><param name="big" value="2147483647"/>
    </launch>""",
    "expressions": """<launch>
      <arg name="w" default="0.5"/><arg name="n" default="3"/><arg name="list" default="[1, 2]"/>
      <param name="a" value="$(eval w * n)"/><param name="b" value="$(eval arg('w') &gt; 0.4 and n == 3)"/>
      <param name="c" value="$(eval str(n) + '/' + str(w))"/><param name="d" value="$(eval -n // 2)"/>
      <param name="e" value="$(eval optenv('NOT_SET', 'x') + env('LANG'))"/>
      <param name="f" value="$(eval 'yes' if list == '[1, 2]' else 'no')"/>
      <param name="g" value="$(eval int(w * 10) % 4)"/><param name="h" value="$(eval not true)"/>
      <param name="i" value="$(eval ceil(w) + sqrt(16))"/><param name="j" value="$(eval dirname() != '')"/>
      <param name="k" value="$(eval round(2.5) if false else pow(2, 3))" if="0"/>
      <param name="l" value="$(eval ','.join(['a', 'b']))" if="0"/>
    </launch>""",
    "builtins": """<launch>
      <arg name="n" default="3"/><arg name="max" default="mine"/>
      <param name="a" value="$(eval len('abc') + n)"/><param name="b" value="$(eval max)"/>
      <param name="c" value="$(eval round(2.567, 1))"/><param name="d" value="$(eval sorted(['b', 'a']))"/>
      <param name="e" value="$(eval abs(-n) == min(3, 5) and any([false, true]))"/>
    </launch>""",
    "finding": """<launch>
      <param name="a" value="$(find roslaunch)resources"/><param name="b" value="$(find roslaunch)/"/>
      <param name="c" value="$(find roslaunch)//etc/hostname"/><param name="d" value="$(find roslaunch) x"/>
      <param name="e" value="-$(find roslaunch)/a$(find roslaunch)"/>
      <param name="f" value="$(find roslaunch)/$(find roslaunch)/x $(find roslaunch)"/>
      <include file="$(find roslaunch)/../roslaunch/resources/example-min.launch"/>
      <include file="$(dirname)/../launch_files/middle.launch"><arg name="c" value="up"/></include>
    </launch>""",
    "shared": """<launch>
      <include file="$(dirname)/private.launch" ns="first"/><node pkg="p" type="t" name="none"/>
      <param name="~x" value="1"/><include file="$(dirname)/private.launch" ns="second"/>
      <node pkg="p" type="t" name="both"/>
    </launch>""",
    "cleared": """<launch>
      <group ns="g" clear_params="True"><param name="a" value="1"/>
        <node pkg="p" type="t" name="n" clear_params=""/></group>
    </launch>""",
    "machines": """<launch>
      <group><machine name="here" address="localhost" default="True" timeout="2.5"/></group>
      <machine name="here" address="localhost" timeout="2.5" ssh-port="22" if="0"/>
      <machine name="never" address="127.0.0.1" default="never"/><node pkg="p" type="t" name="n"/>
    </launch>""",
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
    "nested": '<launch><param name="p" value="$(arg $(arg q))"/></launch>',
    "find nothing": '<launch><param name="p" value="$(find)"/></launch>',
    "late eval": '<launch><param name="p" value="a $(eval 1)"/></launch>',
    "undefined": '<launch><param name="p" value="$(eval nothing)"/></launch>',
    "missing include": '<launch><include file="/no/such.launch"/></launch>',
    "missing yaml": '<launch><rosparam file="/no/such.yaml"/></launch>',
    "missing text": '<launch><param name="p" textfile="/no/such.txt"/></launch>',
    "two sources": '<launch><param name="p" value="1" textfile="/etc/hostname"/></launch>',
    "no default": '<launch><include file="$(dirname)/inner.launch"/></launch>',
    "delay": '<launch><node pkg="p" type="t" name="n" respawn_delay="soon"/></launch>',
    "failing command": '<launch><param name="p" command="cat /no/such/file"/></launch>',
    "yaml key": "<launch><rosparam>{on: 1}</rosparam></launch>",
    "yaml number": "<launch><rosparam>{a: {1: b}}</rosparam></launch>",
    "empty ns": '<launch><group ns=""/></launch>',
    "yaml": "<launch><rosparam>[1, 2]</rosparam></launch>",
    "substitution": '<launch><param name="p" value="$(fnd p)"/></launch>',
    "name with namespace": '<launch><node pkg="p" type="t" name="a/b"/></launch>',
    "private name": '<launch><node pkg="p" type="t" name="~b"/></launch>',
    "private namespace": '<launch><group ns="~b"/></launch>',
    "namespace of a node": '<launch><node pkg="p" type="t" name="n" ns=""/></launch>',
    "respawn and required": '<launch><node pkg="p" type="t" name="n" respawn="true" required="true"/>'
    "</launch>",
    "output": '<launch><node pkg="p" type="t" name="n" output="both"/></launch>',
    "cwd": '<launch><node pkg="p" type="t" name="n" cwd="home"/></launch>',
    "no package": '<launch><node pkg=" " type="t" name="n"/></launch>',
    "cleared nowhere": '<launch><group clear_params="True"/></launch>',
    "cleared perhaps": '<launch><group ns="g" clear_params="1"/></launch>',
    "substituted": '<launch><rosparam subst_value="1">{a: 1}</rosparam></launch>',
    "test that respawns": '<launch><test pkg="p" type="t" test-name="t" respawn="true"/></launch>',
    "time limit": '<launch><test pkg="p" type="t" test-name="t" time-limit="0"/></launch>',
    "retry": '<launch><test pkg="p" type="t" test-name="t" retry="1.5"/></launch>',
    "machine": '<launch><machine name="m" address="a"/><machine name="m" address="b"/></launch>',
    "machine port": '<launch><machine name="m" address="a" ssh-port="x"/></launch>',
    "machine timeout": '<launch><machine name="m" address="a" timeout=""/></launch>',
    "machine default": '<launch><machine name="m" address="a" default="yes"/></launch>',
    "passed to a group": '<launch><arg name="a" default="1"/>'
    '<include file="$(dirname)/grouped.launch" pass_all_args="true"/></launch>',
}


@pytest.fixture(scope="module")
def folder(ros: Ros) -> Path:
    folder = ros.home / "launch_files"
    folder.mkdir()
    (folder / "inner.launch").write_text(INNER)
    (folder / "middle.launch").write_text(MIDDLE)
    (folder / "fixed.launch").write_text('<launch><arg name="a" value="2"/></launch>')
    (folder / "private.launch").write_text(
        '<launch><param name="~y" value="2"/><node pkg="p" type="t" name="n"/></launch>'
    )
    (folder / "grouped.launch").write_text('<launch><group><arg name="a" value="2"/></group></launch>')
    (folder / "p.yaml").write_text("a: {b: 1}\nlist: [1.5, x]\n")
    (folder / "r.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="width" default="1"/>'
        '<link name="a${2 * $(arg width)}"/></robot>'
    )
    for name, text in {**HARD, **WRONG}.items():
        (folder / f"{name}.launch").write_text(text)
    return folder


def test_command_line_of_a_node_is_the_same(ros: Ros, folder: Path) -> None:
    file = folder / "command.launch"
    file.write_text(
        '<launch><remap from="joint_states" to="/js"/><env name="E" value="a b"/>'
        '<node pkg="joint_state_publisher" type="joint_state_publisher" name="jsp" ns="left"'
        ' args="--fast  $(anon x)" launch-prefix="nice"/></launch>'
    )
    theirs = ros.run("roslaunch", "--args", "/left/jsp", str(file)).split()
    ours = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", str(file), "--args", "/left/jsp"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    at = ours.index("joint_state_publisher/joint_state_publisher")
    # roslaunch prints the path of the program; the words before and after it are the same
    program = next(i for i, word in enumerate(theirs) if word.endswith("/joint_state_publisher"))
    assert without_anonymous_part(ours[at + 1 :]) == without_anonymous_part(theirs[program + 1 :])
    assert "nice" in theirs[:program]
    assert "nice" in ours[:at]


def without_anonymous_part(words: list[str]) -> list[str]:
    """Words without the part of the anonymous name that differs in each run."""
    return [re.sub(r"^x_.*", "x", word) for word in words]


def nodes(text: str) -> list[str]:
    """Node names without the parts of anonymous names that differ in each run."""
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
def test_examples_of_roslaunch_give_the_same_plan(ros: Ros, name: str) -> None:
    compare_params(ros, EXAMPLE_FOLDER / name)
    compare_nodes(ros, EXAMPLE_FOLDER / name)


def test_example_with_bytes_gives_the_same_nodes(ros: Ros) -> None:
    """roslaunch cannot dump the parameters of this example, because one has bytes."""
    compare_nodes(ros, EXAMPLE_FOLDER / "example.launch")


@pytest.mark.parametrize("name", HARD)
def test_harder_files_give_the_same_plan(ros: Ros, folder: Path, name: str) -> None:
    compare_params(ros, folder / f"{name}.launch")
    compare_nodes(ros, folder / f"{name}.launch")


@pytest.mark.parametrize("name", WRONG)
def test_files_that_roslaunch_rejects_are_rejected(ros: Ros, folder: Path, name: str) -> None:
    file = folder / f"{name}.launch"
    with pytest.raises(AssertionError):
        ros.run("roslaunch", "--nodes", str(file))
    with pytest.raises(DescriptionError):
        plan_of(ros, file).require()


def test_list_of_arguments_is_the_same(ros: Ros, folder: Path) -> None:
    file = str(folder / "args.launch")
    ours = subprocess.run(
        [sys.executable, "-m", "kbot", "launch", file, "--ros-args"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert ours.stdout == ros.run("roslaunch", "--ros-args", file)


def test_arguments_in_groups_can_be_set_and_are_not_listed(ros: Ros, folder: Path) -> None:
    file = folder / "grouped_arguments.launch"
    file.write_text(
        '<launch><arg name="top" default="1"/><group><arg name="late" default="2"/>'
        '<param name="p" value="$(arg late)"/></group></launch>'
    )
    for words in (("--ros-args",), ("--dump-params", "late:=5")):
        ours = subprocess.run(
            [sys.executable, "-m", "kbot", "launch", str(file), *words],
            capture_output=True,
            text=True,
            check=True,
        )
        assert (ours.stdout, ours.stderr) == (ros.run("roslaunch", words[0], str(file), *words[1:]), "")


def test_corrected_chapter_gives_the_same_plan(ros: Ros, shared: Path) -> None:
    link = ros.packages / "kbot_description"
    link.symlink_to(shared / "chapter/corrected/kbot_description")
    try:
        compare_params(ros, link / "launch/kbot_base_rviz.launch")
        compare_nodes(ros, link / "launch/kbot_base_rviz.launch")
    finally:
        link.unlink()
