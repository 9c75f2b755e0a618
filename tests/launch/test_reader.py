"""Plans of ROS 1 launch files. Expected values follow the documentation of roslaunch."""

import os
import sys
from pathlib import Path

import pytest

from kbot.ros.launch import Plan, read_launch
from kbot.text import DescriptionError, Diagnostic
from kbot.xacro import Limits, Packages


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


def plan_of(folder: Path, body: str, **arguments: str) -> Plan:
    file = folder / "a.launch"
    file.write_text(f"<launch>\n{body}\n</launch>\n")
    return read_launch(str(file), arguments, Packages(around=str(file)))


def values(plan: Plan) -> dict[str, object]:
    return {name: param.value for name, param in plan.params.items()}


def clean(plan: Plan) -> Plan:
    assert [str(d) for d in plan.diagnostics] == []
    return plan


def only(plan: Plan) -> Diagnostic:
    (diagnostic,) = plan.diagnostics
    return diagnostic


def place(diagnostic: Diagnostic) -> str:
    assert diagnostic.origin is not None
    return diagnostic.origin.span.text


def test_parameter_types_are_guessed_or_given(folder: Path) -> None:
    plan = clean(
        plan_of(
            folder,
            """<param name="i" value=" 3 "/><param name="f" value="3."/><param name="b" value="True"/>
            <param name="s" value="1_000"/><param name="t" value="3" type="str"/>
            <param name="y" value="[1, {a: 2}]" type="yaml"/><param name="d" value="3" type="double"/>""",
        )
    )
    assert values(plan) == {
        "/i": 3,
        "/f": 3.0,
        "/b": True,
        "/s": "1_000",
        "/t": "3",
        "/y": [1, {"a": 2}],
        "/d": 3.0,
    }
    assert isinstance(plan.params["/d"].value, float)


def test_namespaces_of_groups_and_nodes_apply_to_parameters(folder: Path) -> None:
    plan = clean(
        plan_of(
            folder,
            """<group ns="robot"><param name="~rate" value="10"/><param name="up" value="1"/>
              <node pkg="p" type="t" name="n" ns="arm"><param name="own" value="2"/>
                <rosparam>{gain: {p: 1.5}}</rosparam><param name="/global" value="3"/></node>
              <node pkg="p" type="t" name="m"/></group>
            <node pkg="p" type="t" name="n"/>""",
        )
    )
    assert values(plan) == {
        "/robot/up": 1,
        "/robot/arm/n/gain/p": 1.5,
        "/robot/arm/n/rate": 10,
        "/robot/arm/n/own": 2,
        "/robot/arm/n/global": 3,
        "/robot/m/rate": 10,
    }
    assert [node.full_name for node in plan.nodes] == ["/robot/arm/n", "/robot/m", "/n"]


def test_arguments_and_defaults_control_conditions(folder: Path) -> None:
    body = """<arg name="gui" default="true"/><arg name="fixed" value="7"/>
      <param name="x" value="1" if="$(arg gui)"/><param name="y" value="$(arg fixed)" unless="$(arg gui)"/>
      <param name="z" value="$(eval arg('fixed') * 2 + (1 if gui else 0))"/>"""
    assert values(clean(plan_of(folder, body))) == {"/x": 1, "/z": 15}
    assert values(clean(plan_of(folder, body, gui="false"))) == {"/y": 7, "/z": 14}


def test_fixed_argument_cannot_be_set(folder: Path) -> None:
    found = only(plan_of(folder, '<arg name="fixed" value="7"/>', fixed="8"))
    assert (found.code, place(found)) == ("L022", "7")


def test_unset_argument_is_an_error_where_it_is_used(folder: Path) -> None:
    plan = plan_of(folder, '<arg name="model"/>\n<param name="m" value="x$(arg model)"/>')
    found = only(plan)
    assert (found.code, place(found)) == ("L011", "$(arg model)")
    with pytest.raises(DescriptionError):
        plan.require()


def test_undeclared_argument_is_a_warning_with_a_hint(folder: Path) -> None:
    plan = plan_of(folder, '<arg name="model" default="a"/>', modle="b")
    found = only(plan)
    assert (found.code, found.is_error, found.hint) == ("L024", False, "did you mean 'model'?")


def test_included_files_get_only_passed_arguments(folder: Path) -> None:
    (folder / "inner.launch").write_text(
        '<launch><arg name="a"/><arg name="b" default="B"/>'
        '<param name="got" value="$(arg a)$(arg b)"/></launch>'
    )
    body = """<arg name="b" value="outer"/>
      <include file="$(dirname)/inner.launch" ns="one"><arg name="a" value="x-$(arg b)-"/></include>
      <include file="$(dirname)/inner.launch" ns="two" pass_all_args="true">
        <arg name="a" value="y"/></include>"""
    assert values(clean(plan_of(folder, body))) == {"/one/got": "x-outer-B", "/two/got": "youter"}


def test_unknown_argument_of_an_include_is_an_error_at_its_name(folder: Path) -> None:
    (folder / "inner.launch").write_text('<launch><arg name="model" default=""/></launch>')
    body = '<include file="$(dirname)/inner.launch"><arg name="modle" value="x"/></include>'
    found = only(plan_of(folder, body))
    assert (found.code, place(found), found.hint) == ("L023", "modle", "did you mean 'model'?")


def test_error_in_an_included_file_names_the_include(folder: Path) -> None:
    (folder / "inner.launch").write_text("<launch>\n  <nod/>\n</launch>")
    found = only(plan_of(folder, '<include file="$(dirname)/inner.launch"/>'))
    assert found.origin is not None
    assert (found.code, found.origin.span.line, found.origin.span.column) == ("L002", 2, 3)
    (call,) = found.origin.stack
    assert (call.kind, call.span.line) == ("include", 2)


def test_file_that_includes_itself_is_one_error(folder: Path) -> None:
    plan = plan_of(folder, '<include file="$(dirname)/a.launch"/>')
    assert [d.code for d in plan.diagnostics] == ["L070"]


def test_number_of_included_files_is_limited(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.ros.launch.includes.MOST_FILES", 100)
    for level in range(30):
        twice = f'<include file="$(dirname)/{level + 1}.launch"/>' * 2
        (folder / f"{level}.launch").write_text(f"<launch>{twice}</launch>")
    (folder / "30.launch").write_text("<launch/>")
    plan = plan_of(folder, '<include file="$(dirname)/0.launch"/>')
    assert {d.code for d in plan.diagnostics} == {"L070"}
    assert len(plan.files) == 100


def test_remaps_and_environment_apply_to_later_nodes_in_scope(folder: Path) -> None:
    plan = clean(
        plan_of(
            folder,
            """<remap from="scan" to="/base/scan"/><env name="A" value="1"/>
            <group><remap from="scan" to="other"/><node pkg="p" type="t" name="a"/></group>
            <node pkg="p" type="t" name="b"><remap from="x" to="y"/><env name="B" value="2"/></node>""",
        )
    )
    a, b = plan.nodes
    assert a.remaps == (("scan", "other"),)
    assert b.remaps == (("scan", "/base/scan"), ("x", "y"))
    assert (a.env, b.env) == ((("A", "1"),), (("A", "1"), ("B", "2")))


def test_two_nodes_with_one_name_are_an_error_that_shows_both(folder: Path) -> None:
    found = only(plan_of(folder, '<node pkg="p" type="t" name="a"/>\n<node pkg="q" type="t" name="a"/>'))
    assert found.code == "L050"
    assert found.origin is not None
    assert (found.origin.span.line, found.related[0].origin.span.line) == (3, 2)


def test_rosparam_loads_trees_lists_and_angles(folder: Path) -> None:
    (folder / "p.yaml").write_text("limits:\n  lower: rad(-pi/2)\n  upper: deg(90)\nlist: [1, 2]\n")
    plan = clean(
        plan_of(folder, '<rosparam file="$(dirname)/p.yaml" ns="arm"/><rosparam param="x">3</rosparam>')
    )
    found = values(plan)
    assert found == {
        "/arm/limits/lower": pytest.approx(-1.5707963267948966),
        "/arm/limits/upper": pytest.approx(1.5707963267948966),
        "/arm/list": [1, 2],
        "/x": 3,
    }


def test_rosparam_makes_substitutions_with_subst_value(folder: Path) -> None:
    body = '<arg name="n" value="4"/><rosparam subst_value="true">a: $(arg n)</rosparam>'
    assert values(clean(plan_of(folder, body))) == {"/a": 4}


LENGTH = "<robot name='r'><link name='$(optenv KBOT_LENGTH none)'/></robot>"


@pytest.mark.parametrize(
    ("command", "value"),
    [
        ("$(dirname)/env_run $(dirname)/long xacro", "2 m"),
        ("env KBOT_LENGTH=4 xacro", "4"),
        ("rosrun xacro xacro", "none"),
    ],
)
def test_wrapper_sets_the_variables_that_xacro_reads(folder: Path, command: str, value: str) -> None:
    (folder / "r.xacro").write_text(LENGTH)
    (folder / "long").write_text("# long\n\nKBOT_WIDTH=1\nexport KBOT_LENGTH='2 m' # m\n")
    plan = clean(plan_of(folder, f'<param name="robot" command="{command} $(dirname)/r.xacro"/>'))
    assert f'<link name="{value}"/>' in str(plan.params["/robot"].value)
    assert plan.environment.get("KBOT_LENGTH", "none") == value
    assert "KBOT_LENGTH" not in os.environ


def test_other_wrapper_needs_permission_and_then_sets_variables(folder: Path) -> None:
    (folder / "r.xacro").write_text(LENGTH)
    wrapper = folder / "wrap"
    wrapper.write_text("#!/bin/sh\nexport KBOT_LENGTH=$1\nshift\n$@\n")
    wrapper.chmod(0o755)
    body = '<param name="robot" command="$(dirname)/wrap 3 xacro $(dirname)/r.xacro"/>'
    assert only(plan_of(folder, body)).code == "L040"
    plan = clean(read_launch(str(folder / "a.launch"), allow_commands=True))
    assert '<link name="3"/>' in str(plan.params["/robot"].value)


def test_command_that_does_not_end_is_an_error(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.ros.launch.commands._TIMEOUT_S", 0.2)
    body = f'<param name="a" command="{sys.executable} -c \'import time; time.sleep(60)\'"/>'
    (folder / "a.launch").write_text(f"<launch>{body}</launch>")
    found = only(read_launch(str(folder / "a.launch"), allow_commands=True))
    assert (found.code, found.message) == ("L041", "the command did not end within 0.2 s")


@pytest.mark.parametrize("line", ["A=$(rm x)", "A=`rm x`", "rm x", "A=1 rm x", "A='"])
def test_env_run_file_is_not_run_as_a_program(folder: Path, line: str) -> None:
    (folder / "long").write_text(f"\n{line}\n")
    found = only(plan_of(folder, '<param name="r" command="env_run $(dirname)/long xacro r.xacro"/>'))
    assert (found.code, "long:2: " in found.message) == ("L041", True)


def test_clear_params_lists_the_namespaces(folder: Path) -> None:
    body = '<group ns="a" clear_params="true"><node pkg="p" type="t" name="n" clear_params="true"/></group>'
    assert clean(plan_of(folder, body)).clear == ("/a/", "/a/n/")


@pytest.mark.parametrize(
    ("body", "code", "where"),
    [
        ('<param name="a" value="1" vlaue="2"/>', "L003", "vlaue"),
        ('<node pkg="p" name="n"/>', "L004", '<node pkg="p" name="n"/>'),
        ('<param name="a"/>', "L030", '<param name="a"/>'),
        ('<param name="a" value="x" type="int"/>', "L031", "x"),
        ('<param name="a" value="x" type="integer"/>', "L031", "integer"),
        ('<param name="a" value="1" if="yes"/>', "L005", "yes"),
        (
            '<param name="a" value="1" if="1" unless="1"/>',
            "L006",
            '<param name="a" value="1" if="1" unless="1"/>',
        ),
        ('<param name="a" value="$(fnd x)"/>', "L010", "$(fnd x)"),
        ('<param name="a" value="a $(arg $(arg b))"/>', "L015", "$(arg $"),
        ('<param name="a" value="$(env KBOT_SURELY_UNSET)"/>', "L013", "$(env KBOT_SURELY_UNSET)"),
        ('<param name="a" value="$(eval 1 +)"/>', "L014", "1 +"),
        ('<param name="a" value="$(eval nothing)"/>', "L014", "nothing"),
        ('<param name="a" value="$(eval \'\'.__class__)"/>', "L014", "''.__class__"),
        ('<param name="a" textfile="/no/such/file"/>', "L032", "/no/such/file"),
        ('<param name="a" command="rm -rf x"/>', "L040", "rm -rf x"),
        ('<rosparam file="/no/such.yaml"/>', "L032", "/no/such.yaml"),
        ("<rosparam>a: [</rosparam>", "L033", "<rosparam>"),
        ("<rosparam>3</rosparam>", "L034", "<rosparam>"),
        ("<rosparam>{on: 1}</rosparam>", "L033", "<rosparam>"),
        ('<rosparam command="laod"/>', "L033", "laod"),
        ('<arg name="a" value="1" default="2"/>', "L020", '<arg name="a" value="1" default="2"/>'),
        ('<include file="/no/such.launch"/>', "F001", "/no/such.launch"),
        ('<include file="$(find no_such_package)/a.launch"/>', "L012", "$(find no_such_package)"),
        ('<remap from="a b" to="c"/>', "L060", "a b"),
        ('<group ns=""/>', "L005", ""),
        ('<node pkg="p" type="t" name="1a"/>', "L051", "1a"),
        ('<node pkg="p" type="t" name="a" respawn="maybe"/>', "L005", "maybe"),
    ],
)
def test_error_is_reported_once_at_its_place(folder: Path, body: str, code: str, where: str) -> None:
    found = only(plan_of(folder, body))
    assert (found.code, place(found)) == (code, where)


def test_all_errors_are_reported_in_one_run(folder: Path) -> None:
    body = '<nod/><param name="a"/><param name="b" value="$(arg x)" tpye="int"/>'
    assert [d.code for d in plan_of(folder, body).diagnostics] == ["L002", "L030", "L011", "L003"]


def test_file_that_is_not_a_launch_file_is_an_error(folder: Path) -> None:
    file = folder / "robot.urdf"
    file.write_text("<robot/>")
    assert only(read_launch(str(file))).code == "L001"
    assert only(read_launch(str(folder / "none.launch"))).code == "F001"


def test_anonymous_names_are_consistent_and_can_stay_unresolved(folder: Path) -> None:
    body = '<node pkg="p" type="t" name="$(anon a)" args="$(anon a) $(anon b)"/>'
    (node,) = clean(plan_of(folder, body)).nodes
    first, second = node.args.split()
    assert node.name == first != second
    (node,) = read_launch(str(folder / "a.launch"), resolve_anonymous=False).nodes
    assert node.full_name == "$(anon a)"


def test_eval_cannot_run_arbitrary_python(folder: Path) -> None:
    (folder / "x").write_text("")
    for expression in (
        "open('x')",
        "[].__class__",
        "(lambda: 1)()",
        "exec('1')",
        "str.format('{0.__class__}', 1)",
    ):
        plan = plan_of(folder, f'<param name="a" value="$(eval {expression})"/>')
        assert "class" not in str(values(plan))


def test_repeatedly_doubled_text_is_limited(folder: Path) -> None:
    doubled = "".join(f"<arg name='a{n}' default='$(arg a{n - 1})$(arg a{n - 1})'/>" for n in range(1, 60))
    plan = plan_of(folder, f"<arg name='a0' default='x'/>{doubled}")
    assert [d.code for d in plan.diagnostics] == ["L015"]
    assert max(len(argument.value or "") for argument in plan.arguments.values()) == 1 << 21


@pytest.mark.parametrize(
    ("tag", "size"),
    [
        ('<param name="p{}" textfile="$(dirname)/big.yaml"/>', 8_000_000),
        ('<param name="p{}" binfile="$(dirname)/big.yaml"/>', 8_000_000),
        ('<param name="p{}" type="yaml" textfile="$(dirname)/big.yaml"/>', 400_000),
        ('<rosparam file="$(dirname)/big.yaml"/>', 400_000),
    ],
)
def test_files_share_one_limit(folder: Path, tag: str, size: int) -> None:
    (folder / "big.yaml").write_text("a: " + "x" * size)
    tags = "".join(tag.format(number) for number in range(10))
    diagnostic = only(plan_of(folder, tags))
    assert diagnostic.code == "L070"
    assert "big.yaml is too large, counted together with all files before it" in diagnostic.message


def test_expansions_share_one_limit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each expansion takes at least 30,000 steps for its multiplications."""
    monkeypatch.setattr("kbot.ros.launch.reporter.DEFAULT", Limits(steps=300_000))
    (folder / "r.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<a n="${len([n * n for n in python.range(30000)])}"/></robot>'
    )
    tag = '<param name="p{}" command="xacro $(dirname)/r.xacro"/>'
    plan = plan_of(folder, "".join(map(tag.format, range(10))))
    assert {d.code for d in plan.diagnostics} == {"L070"}
    assert (
        "r.xacro takes too many steps to expand, counted together with all files before it"
        in only(plan).message
    )
    assert 0 < len(plan.params) < 10
