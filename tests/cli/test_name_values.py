"""Tests `name:=value` on command lines: properties are overridden with a note, unknown names are errors."""

import json
from pathlib import Path

import pytest

from kbot.cli.main import run
from kbot.workbench.protocol import SetParameter
from kbot.workbench.serve import open_session

WHEEL = """<link name="{side}"><inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4"
   iyz="0" izz="1e-4"/></inertial><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder
   radius="${{wheel_radius}}" length="0.02"/></geometry></collision></link>
  <joint name="{side}_joint" type="continuous"><parent link="base"/><child link="{side}"/>
   <origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>"""
MINE = f"""<robot name="mine" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="wheel_radius" value="0.035"/>
  <xacro:arg name="length" default="0.2"/>
  <link name="base"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0"
   izz="0.01"/></inertial><collision><geometry><box size="$(arg length) 0.1 0.02"/></geometry></collision>
  </link>
  {WHEEL.format(side="left", y=0.1)}
  {WHEEL.format(side="right", y=-0.1)}
</robot>
"""
TYPED = "wheel_radius:=0.06"
UNKNOWN = (
    ":1:1: error: there is no argument or top-level property 'wheel_raduis'; the nearest names are "
    "wheel_radius (property), length (argument) [X206]\n"
)
Captured = pytest.CaptureFixture[str]


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = Path("mine.xacro")
    file.write_text(MINE)
    return file


def note(file: Path) -> str:
    return f"note: the property wheel_radius is set to 0.06; {file}:2 has 0.035\n"


def test_a_simulation_uses_the_typed_value(mine: Path, capsys: Captured) -> None:
    def state(*words: str) -> str:
        report = ["sim", str(mine), *words, "--headless", "--duration", "0.2", "--cmd-vel", "0.1,0", "--json"]
        assert run(report) == 0
        return str(json.loads(capsys.readouterr().out)["state_sha256"])

    as_written, typed = state(), state(TYPED)
    mine.write_text(MINE.replace("0.035", "0.06"))
    assert typed == state() != as_written


@pytest.mark.parametrize(
    "verb",
    [
        ["info"],
        ["check"],
        ["where", "left"],
        ["export", "-o", "m.glb"],
        ["sim", "--headless", "--duration", "0"],
    ],
)
def test_each_verb_overrides_a_property_and_rejects_another_name(
    mine: Path, verb: list[str], capsys: Captured
) -> None:
    words = [verb[0], str(mine), *verb[1:]]
    run([*words, TYPED, "length:=0.3"])
    captured = capsys.readouterr()
    assert captured.err.startswith(note(mine))
    assert captured.err.count("note:") == 1
    assert "X20" not in captured.err + captured.out
    assert run([*words, "wheel_raduis:=0.06"]) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", f"{mine}{UNKNOWN}")


def test_view_rejects_another_name_before_it_serves_a_page(mine: Path, capsys: Captured) -> None:
    assert run(["view", str(mine), "wheel_raduis:=0.06", "--no-browser"]) == 2
    assert capsys.readouterr().err == f"{mine}{UNKNOWN}"


def test_where_names_the_property_s_own_line(mine: Path, capsys: Captured) -> None:
    assert run(["where", str(mine), "wheel_radius", TYPED]) == 0
    assert capsys.readouterr().out == f"{mine}:2:46: property 'wheel_radius' = 0.06\n"


def test_check_uses_the_typed_value(mine: Path, capsys: Captured) -> None:
    """A radius of 0 is an error of the reader at its line."""
    assert run(["check", str(mine), "wheel_radius:=0"]) == 1
    assert "error" in capsys.readouterr().out


def test_a_name_may_exist_in_only_one_of_several_files(mine: Path, capsys: Captured) -> None:
    other = mine.with_name("other.urdf")
    other.write_text('<robot name="other"><link name="base"/></robot>')
    run(["check", str(mine.parent), TYPED])
    captured = capsys.readouterr()
    assert captured.err == note(mine)
    assert captured.out.count("[X206]") == 1
    assert run(["check", str(other), str(mine), "wheel_raduis:=1"]) == 2
    assert "'wheel_raduis'" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["armed.xacro", "."])
@pytest.mark.parametrize("sets", ['{arm = "true"}', '{arm = "false"}, {arm = "true"}'])
def test_a_name_may_need_the_arguments_of_the_configuration(
    word: str, sets: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("kbot.toml").write_text(f"[check]\nselect = ['X', 'D', 'K']\narguments = [{sets}]\n")
    Path("armed.xacro").write_text(
        """<robot name="armed" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="arm" default="false"/>
<xacro:if value="$(arg arm)"><xacro:property name="arm_length" value="1"/></xacro:if>
<link name="base"><xacro:if value="$(arg arm)"><visual><geometry><box size="${arm_length} 1 1"/></geometry>
</visual></xacro:if></link></robot>"""
    )
    assert run(["check", word, "arm_length:=2"]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err.count("arm_length is set to 2")) == ("", 1)
    assert run(["check", word, "arm_width:=2"]) == 2
    assert run(["check", word, "arm:=false", "arm_length:=2"]) == 2
    assert "[X206]" in capsys.readouterr().err


def test_the_shipped_robot_has_arguments(capsys: Captured) -> None:
    assert run(["info", "kbot", "wheel_radius:=0.04"]) == 0
    assert capsys.readouterr().err == ""
    assert run(["info", "kbot", "wheel_raduis:=0.04"]) == 2
    assert "wheel_radius (argument)" in capsys.readouterr().err


def test_expand_ignores_an_undeclared_name_and_overrides_by_set(mine: Path, capsys: Captured) -> None:
    assert run(["expand", str(mine)]) == 0
    plain = capsys.readouterr().out
    assert run(["expand", str(mine), TYPED]) == 0
    captured = capsys.readouterr()
    assert captured.out == plain
    assert "declares no argument 'wheel_radius' [X206]" in captured.err
    assert "kbot expand --set wheel_radius=0.06 overrides it" in captured.err
    assert run(["expand", str(mine), "--set", "wheel_radius=0.06", "length:=0.3"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out == plain.replace("0.035", "0.06").replace('size="0.2 ', 'size="0.3 ')


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (
            ["wheel_raduis=1"],
            "no top-level property 'wheel_raduis'; the nearest names are wheel_radius (property)",
        ),
        (
            ["wheel_radius=1", "--set", "length=1"],
            "no top-level property 'length'; the nearest names are length (arg",
        ),
        (["wheel_radius"], "--set takes NAME=VALUE, not 'wheel_radius'"),
        (["wheel_radius:=1"], "--set takes NAME=VALUE. Write wheel_radius=1"),
        (["=1"], "--set takes NAME=VALUE, not '=1'"),
    ],
)
def test_set_rejects_an_unknown_name(mine: Path, words: list[str], error: str, capsys: Captured) -> None:
    assert run(["expand", str(mine), "--set", *words, "-o", "out.urdf"]) == 2
    assert error in capsys.readouterr().err
    assert not Path("out.urdf").exists()


def test_expand_suggests_the_property_for_a_misspelled_name(mine: Path, capsys: Captured) -> None:
    assert run(["expand", str(mine), "wheel_raduis:=0.05"]) == 0
    err = capsys.readouterr().err
    assert "did you mean the property wheel_radius? kbot expand --set wheel_radius=0.05 overrides it" in err


@pytest.mark.parametrize("verb", ["sim", "check", "info"])
def test_other_verbs_explain_what_to_write_instead_of_set(mine: Path, verb: str, capsys: Captured) -> None:
    assert run([verb, str(mine), "--set", "wheel_radius=0.05"]) == 2
    assert "Write name:=value, for example wheel_radius:=0.05." in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["sim", "check", "info"])
def test_a_text_for_a_number_is_one_error(mine: Path, verb: str, capsys: Captured) -> None:
    assert run([verb, str(mine), "wheel_radius:=0,05"]) == 2
    err = capsys.readouterr().err
    assert "the value given for wheel_radius, '0,05', is not a number" in err
    assert err.count("error:") == 1


def test_the_source_map_of_an_override_names_the_property_s_own_line(mine: Path) -> None:
    assert (
        run(["expand", str(mine), "--set", "wheel_radius=0.06", "--source-map", "m.json", "-o", "o.urdf"])
        == 0
    )
    source_map = json.loads(Path("m.json").read_text())
    bindings = {b["name"]: (b["value"], b["source"]) for b in source_map["bindings"]}
    assert bindings["wheel_radius"] == (0.06, [0, 2, 46, 2, 51])
    assert bindings.keys() == {"wheel_radius", "length"}


def test_xacro_in_a_launch_file_ignores_an_undeclared_name(mine: Path, capsys: Captured) -> None:
    launch = mine.with_name("mine.launch")
    launch.write_text(
        f'<launch><param name="robot_description" command="xacro $(dirname)/mine.xacro {TYPED}"/></launch>'
    )
    run(["launch", str(launch), "--dry-run"])
    assert "note:" not in capsys.readouterr().err
    assert run(["launch", str(launch), "--dump-params"]) == 0
    out = capsys.readouterr().out
    assert 'radius="0.035"' in out.replace("\\", "")
    assert "0.06" not in out


def test_a_page_keeps_the_typed_property_with_every_save(mine: Path) -> None:
    session = open_session(
        str(mine), simulate=False, arguments={"wheel_radius": "0.06"}, properties={"wheel_radius": "0.06"}
    )

    def radius() -> float:
        geometry = session.shown.robot.links["left"].collisions[0].geometry
        return float(geometry.radius)  # type: ignore[union-attr]  # it is a cylinder

    def codes() -> set[str]:
        return {finding.code for finding in session.shown.findings().findings}

    def read_again() -> None:
        session.adopt(session.read())

    def value() -> tuple[float, float]:
        parameters = session.shown.authoring.parameters().parameters
        return next((p.written, p.value) for p in parameters if p.name == "wheel_radius")

    assert radius() == 0.06
    assert value() == (0.035, 0.06)
    assert not codes() & {"X206", "X207"}
    mine.write_text(MINE.replace("0.035", "0.04"))
    read_again()
    assert radius() == 0.06
    assert value() == (0.04, 0.06)
    session.handle(SetParameter("property", "wheel_radius", 0.05), 1)
    read_again()
    assert radius() == 0.05
    mine.write_text(MINE.replace("wheel_radius", "radius"))
    read_again()
    assert radius() == 0.035
    assert codes() >= {"X206", "X207"}
