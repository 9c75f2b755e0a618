"""Tests the commands `kbot check` and `kbot rule`: exit status, formats, selection, fixes, folders."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner, Result

import kbot.cli.check
from kbot.checks.fixes import fixed
from kbot.checks.folder_files import entry_points
from kbot.cli.check import command as check
from kbot.cli.rule import command as rule
from kbot.text import KbotError, folders

FIXTURES = Path(__file__).parents[1] / "checks" / "fixtures"
SCHEMAS = Path(__file__).parents[1] / "checks" / "schemas"

MACRO = """<?xml version="1.0"?>
<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">
  <xacro:macro name="part" params="name mass">
    <link name="${name}">
      <visual> <geometry> <box size="0.1 0.1 0.1"/> </geometry> </visual>
      <inertial>
        <mass value="${mass}"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1" iix="0"/>
      </inertial>
    </link>
    <joint name="${name}_joint" type="fixed">
      <parent link="base_link"/>
      <child link="${name}"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
  <xacro:part name="a" mass="1"/>
  <xacro:part name="b" mass="1"/>
</robot>
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot with two findings in a macro, in the working directory."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "robot.xacro"
    path.write_text(MACRO)
    return path


def run(*words: str) -> Result:
    return CliRunner().invoke(check, list(words), catch_exceptions=False, standalone_mode=False)


def status(*words: str) -> int:
    result = run(*words)
    assert isinstance(result.return_value, int), result.output
    return result.return_value


def findings(*words: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(run(*words, "--json").stdout)["findings"]
    return found


def test_exit_statuses(robot: Path, tmp_path: Path) -> None:
    assert status("kbot") == 0
    assert status("robot.xacro") == 1
    assert status("gone.xacro") == 2
    (tmp_path / "empty.xacro").write_text("")
    assert status("empty.xacro") == 2
    (tmp_path / "notes.yaml").write_text("a: 1\n")
    assert status("notes.yaml") == 2
    (tmp_path / "image.xacro").write_bytes(b"\x89PNG\r\n\x1a\n\xff")
    assert status("image.xacro") == 2
    (tmp_path / "cut.xacro").write_text(MACRO[:300])
    assert status("cut.xacro") == 2
    (tmp_path / "page.xml").write_text("<html/>")
    assert status("page.xml") == 1
    launch = '<launch><param name="robot_description" command="xacro {}"/></launch>'
    for name, expected in (("robot.xacro", 1), ("cut.xacro", 2), ("gone.xacro", 2)):
        (tmp_path / "r.launch").write_text(launch.format(tmp_path / name))
        assert status("r.launch") == expected, name
    (tmp_path / "nothing").mkdir()
    assert status("nothing") == 2
    assert [f["code"] for f in findings("nothing")] == ["F006"]


def test_a_launch_file_is_checked_with_the_robot_it_loads(robot: Path, tmp_path: Path) -> None:
    (tmp_path / "r.launch").write_text(
        f'<launch><param name="a" command="xacro {robot}"/><param name="b" command="xacro {robot}"/></launch>'
    )
    through = {(f["code"], f["line"]) for f in findings("r.launch")}
    assert through == {(f["code"], f["line"]) for f in findings(str(robot))}
    assert len(findings("r.launch")) == len(through)
    robot.write_text(MACRO.replace("<inertia ", "<!-- kbot: ignore[U202, I108] -->\n<inertia "))
    assert findings("r.launch") == []


def test_a_terminal_shows_that_there_are_no_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run("kbot").output == ""
    monkeypatch.setattr("click.testing._NamedTextIOWrapper.isatty", lambda _: True)
    assert run("kbot").stderr == "no findings\n"
    assert "no findings" not in run("kbot", "--json").output


@pytest.mark.parametrize("file", ["gone.xacro", "robot.xacro", "kbot"])
def test_json_is_printed_whatever_the_status(robot: Path, file: str) -> None:
    for finding in findings(file):
        assert {"code", "severity", "message", "file", "line", "column", "stack", "related"} <= set(finding)


def test_a_fault_in_a_macro_is_reported_once_with_its_calls(robot: Path) -> None:
    (finding,) = [f for f in findings("robot.xacro") if f["code"] == "U202"]
    assert (finding["line"], finding["message"][:5]) == (8, "'iix'")
    assert [(c["kind"], c["name"], c["line"]) for c in finding["stack"]] == [("macro", "part", 17)]
    assert [r["line"] for r in finding["related"]] == [18]


def test_a_fault_in_one_call_is_reported_at_that_call(robot: Path) -> None:
    robot.write_text(MACRO.replace('name="b" mass="1"', 'name="b" mass="900"'))
    heavy = [f for f in findings("robot.xacro") if f["code"] == "I117"]
    assert [(f["line"], f["column"]) for f in heavy] == [(18, 30)]


def test_select_and_ignore(robot: Path) -> None:
    every = {f["code"] for f in findings("robot.xacro")}
    assert {"U202", "I108"} <= every
    assert {f["code"] for f in findings("robot.xacro", "--select", "U")} == {"U202"}
    assert "I108" not in {f["code"] for f in findings("robot.xacro", "--ignore", "I1")}
    assert {f["code"] for f in findings("robot.xacro", "--select", "I108,U", "--ignore", "U202")} == {"I108"}
    with pytest.raises(Exception, match="no rule has a code"):
        run("robot.xacro", "--select", "Z9")


def test_configuration_is_found_beside_the_file(robot: Path, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text('[tool.kbot.check]\nignore = ["I"]\n')
    assert {f["code"] for f in findings("robot.xacro")} == {"U202"}
    (tmp_path / "kbot.toml").write_text('[check]\nper-file-ignores = { "robot.*" = ["U202"] }\n')
    assert "U202" not in {f["code"] for f in findings("robot.xacro")}
    (tmp_path / "kbot.toml").write_text('[check]\nselct = ["I"]\n')
    with pytest.raises(Exception, match=r"selct.*did you mean"):
        run("robot.xacro")


def test_comments_suppress_and_unused_ones_are_reported(robot: Path) -> None:
    robot.write_text(
        MACRO.replace("        <inertia ", "        <!-- kbot: ignore[U202, I108] why -->\n        <inertia ")
    )
    assert findings("robot.xacro") == []
    robot.write_text(
        MACRO.replace('<link name="base_link"/>', '<link name="base_link"/> <!-- kbot: ignore[I117] -->')
    )
    assert "K001" in {f["code"] for f in findings("robot.xacro")}
    assert status("robot.xacro", "--fix") == 1
    assert "ignore[I117]" not in robot.read_text()
    robot.write_text(
        MACRO.replace('<link name="base_link"/>', '<link name="base_link"/> <!-- kbot: ignore[U2O2] -->')
    )
    (odd,) = [f for f in findings("robot.xacro") if f["code"] == "K002"]
    assert "U202" in odd["hint"]


def test_a_comment_at_one_call_suppresses_it_there(robot: Path) -> None:
    text = MACRO.replace('name="b" mass="1"', 'name="b" mass="900"')
    robot.write_text(
        text.replace('  <xacro:part name="b"', '  <!-- kbot: ignore[I117] lead -->\n  <xacro:part name="b"')
    )
    assert not {"I117", "K001"} & {f["code"] for f in findings("robot.xacro")}


def test_a_baseline_overwrites_nothing_but_baselines(robot: Path) -> None:
    before = robot.read_text()
    with pytest.raises(KbotError, match=r"robot\.xacro is not a baseline of kbot"):
        run("robot.xacro", "--write-baseline", "robot.xacro")
    assert robot.read_text() == before
    assert status("robot.xacro", "--write-baseline", "known.json") == 0
    assert status("robot.xacro", "--write-baseline", "known.json") == 0


KNOWN = '{{"version": 1, "findings": [{{"code": {}, "file": "", "message": "", "count": {}}}]}}'


@pytest.mark.parametrize(
    "text",
    [
        "null", '{"a": 1}', "[1]", "[" * 100_000, '{"version": 1, "findings": 3}', "", KNOWN.format(1, 1),
        *(KNOWN.format('"U001"', count) for count in ('"1"', "-1", "0", "1.5", "1e999", "true", "null")),
    ],
)  # fmt: skip
def test_a_file_that_is_not_a_baseline_is_rejected(robot: Path, text: str) -> None:
    Path("odd.json").write_text(text)
    with pytest.raises(KbotError) as refused:
        run("robot.xacro", "--baseline", "odd.json")
    assert str(refused.value) == (
        "odd.json is not a baseline of kbot check: write a new baseline with --write-baseline to another file"
    )


def test_a_baseline_hides_its_findings(robot: Path) -> None:
    assert status("robot.xacro", "--write-baseline", "known.json") == 0
    assert status("robot.xacro", "--baseline", "known.json") == 0
    robot.write_text("\n" + MACRO.replace('iix="0"', 'iix="0" iyx="0"').lstrip("\n"))
    robot.write_text(MACRO.replace('iix="0"', 'iix="0" iyx="0"'))
    assert [f["message"][:5] for f in findings("robot.xacro", "--baseline", "known.json")] == ["'iyx'"]
    with pytest.raises(Exception, match="does not exist"):
        run("robot.xacro", "--baseline", "gone.json")


def test_fixes_are_shown_and_then_applied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (FIXTURES / "J107" / "fails.xacro").read_text()
    path = tmp_path / "robot.xacro"
    path.write_text(text)
    diff = run("robot.xacro", "--diff")
    assert '-    <axis xyz="0 2 0"/>' in diff.stdout
    assert '+    <axis xyz="0 1 0"/>' in diff.stdout
    assert path.read_text() == text
    assert status("robot.xacro", "--fix") == 0
    assert path.read_text() == text.replace('xyz="0 2 0"', 'xyz="0 1 0"')


def test_a_diff_counts_the_findings_without_a_fix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.xacro").write_text((FIXTURES / "J107" / "fails.xacro").read_text())
    whole = run("robot.xacro", "--diff")
    assert (whole.return_value, whole.stderr) == (0, "")
    Path("robot.xacro").write_text((FIXTURES / "J102" / "fails.xacro").read_text())
    before = Path("robot.xacro").read_text()
    for words in (("--diff",), ("--fix", "--diff")):
        left = run("robot.xacro", *words)
        assert (left.return_value, left.stdout) == (1, "")
        assert "1 error without a safe fix; 1 can be fixed by --unsafe-fixes" in left.stderr
    unsafe = run("robot.xacro", "--unsafe-fixes", "--diff")
    assert unsafe.return_value == 0
    assert "+++ robot.xacro (fixed)" in unsafe.stdout
    assert Path("robot.xacro").read_text() == before
    Path("robot.xacro").write_text("<robot>")
    assert (run("robot.xacro", "--diff").return_value, run("missing.xacro", "--diff").return_value) == (2, 2)


def test_fixes_of_included_files_are_shown_and_applied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    text = (FIXTURES / "J107" / "fails.xacro").read_text()
    head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">'
    part, whole = here / "part.xacro", here / "robot.xacro"
    part.write_text(text)
    whole.write_text(head + '<xacro:include filename="part.xacro"/></robot>\n')
    diff = run("robot.xacro", "--diff")
    assert "+++ part.xacro (fixed)" in diff.stdout
    assert '+    <axis xyz="0 1 0"/>' in diff.stdout
    assert part.read_text() == text
    whole.write_text(head + f'<xacro:include filename="{part}"/></robot>\n')
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    for option in ("--diff", "--fix"):
        alone = run(str(whole), option)
        assert f"{part}: not fixed, because it is outside the working directory" in alone.stderr
        assert "+++" not in alone.stdout
    assert part.read_text() == text
    monkeypatch.chdir(here)
    run("robot.xacro", "--fix")
    assert part.read_text() == text.replace('xyz="0 2 0"', 'xyz="0 1 0"')


def test_an_edit_saved_during_the_check_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (FIXTURES / "J107" / "fails.xacro").read_text()
    path = tmp_path / "robot.xacro"
    path.write_text(text)

    def slow(*given: Any) -> Any:
        path.write_text(text + "<!-- saved meanwhile -->\n")
        return fixed(*given)

    monkeypatch.setattr(kbot.cli.check, "fixed", slow)
    with pytest.raises(KbotError, match="has changed in the meantime"):
        run("robot.xacro", "--fix")
    assert path.read_text() == text + "<!-- saved meanwhile -->\n"


def test_a_file_with_two_names_is_fixed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "more").mkdir()
    text = (FIXTURES / "J107" / "fails.xacro").read_text()
    Path("part.xacro").write_text(text)
    Path("more/same.xacro").symlink_to(tmp_path / "part.xacro")
    head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">'
    Path("one.xacro").write_text(head + '<xacro:include filename="part.xacro"/></robot>\n')
    Path("two.xacro").write_text(head + '<xacro:include filename="more/same.xacro"/></robot>\n')
    run("one.xacro", "two.xacro", "--fix")
    assert Path("part.xacro").read_text() == text.replace('xyz="0 2 0"', 'xyz="0 1 0"')
    assert Path("more/same.xacro").is_symlink()


def test_a_discarded_fix_is_not_offered_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    joint = '<joint name="{}" type="fixed"><parent link="base_link"/><child link="{}"/></joint>\n'
    links = '<link name="base_link"/><link name="mast"/>\n'
    text = (
        '<robot name="r">' + links + joint.format("one", "mast") + joint.format("two", "masst") + "</robot>\n"
    )
    Path("robot.urdf").write_text(text)
    words = ("robot.urdf", "--select", "U")
    assert "1 can be fixed by --fix" in run(*words).stdout
    after = run(*words, "--fix")  # with the correct name, the mast would have two parent joints
    assert (after.return_value, "can be fixed" in after.stdout) == (1, False)
    assert "write 'mast'" not in after.output
    assert Path("robot.urdf").read_text() == text


def test_an_unsafe_fix_needs_the_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "robot.xacro"
    path.write_text((FIXTURES / "J102" / "fails.xacro").read_text())
    assert status("robot.xacro", "--fix") == 1
    assert status("robot.xacro", "--unsafe-fixes") == 0


def test_sarif_keeps_its_schema(robot: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    log = json.loads(run("robot.xacro", "--output-format", "sarif").stdout)
    schema = json.loads((SCHEMAS / "sarif-schema-2.1.0.json").read_text("utf-8"))
    jsonschema.Draft4Validator(schema).validate(log)
    (result,) = [r for r in log["runs"][0]["results"] if r["ruleId"] == "U202"]
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "robot.xacro"
    assert place["region"]["startLine"] == 8
    flow = result["codeFlows"][0]["threadFlows"][0]["locations"]
    assert [s["location"]["physicalLocation"]["region"]["startLine"] for s in flow] == [17, 8]
    driver = log["runs"][0]["tool"]["driver"]
    assert driver["rules"][result["ruleIndex"]]["id"] == "U202"


def test_github_annotations_name_the_line(robot: Path) -> None:
    lines = run("robot.xacro", "--output-format", "github").stdout.splitlines()
    assert any(line.startswith("::warning file=robot.xacro,line=8,endLine=8,col=") for line in lines)
    assert all(
        line.startswith(("::error ", "::warning ", "::notice ")) and "\n" not in line for line in lines
    )


def test_junit_has_a_failed_case_for_each_finding(robot: Path) -> None:
    root = ElementTree.fromstring(run("robot.xacro", "--output-format", "junit").stdout)
    (suite,) = root.iter("testsuite")
    assert suite.get("name") == "robot.xacro"
    assert int(suite.get("failures") or 0) == len(list(suite.iter("failure"))) > 0


def test_statistics_count_the_rules(robot: Path) -> None:
    assert "unknown-attribute" in run("robot.xacro", "--statistics").stdout


def test_a_folder_is_checked_by_its_entry_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    urdf = tmp_path / "my_robot" / "urdf"
    urdf.mkdir(parents=True)
    (tmp_path / "my_robot" / "package.xml").write_text("<package><name>my_robot</name></package>")
    include = '<xacro:include filename="part.xacro"/>'
    (urdf / "robot.xacro").write_text(
        f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">{include}'
        '<xacro:arg name="n" default="a"/><xacro:part name="$(arg n)"/></robot>'
    )
    (urdf / "part.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="part" params="name">'
        '<link name="${name}"/></xacro:macro></robot>'
    )
    found = findings("my_robot")
    assert {(f["code"], Path(f["file"]).name) for f in found} == {("K101", "package.xml")}
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    (tmp_path / "kbot.toml").write_text('[check]\nignore = ["K101"]\narguments = [{ n = "" }, { n = "b" }]\n')
    assert {f["code"] for f in findings("my_robot")} == {"U003", "U015"}


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege on Windows")
def test_a_folder_search_leaves_out_file_systems_of_the_kernel_and_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("robots", "proc", "elsewhere"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "r.urdf").write_text('<robot name="r"><link name="l"/></robot>')
    root = tmp_path / "root"
    root.mkdir()
    for name in ("robots", "proc"):
        (tmp_path / name).rename(root / name)
    (root / "link").symlink_to(tmp_path / "elsewhere")
    searched: list[str] = []
    assert len(entry_points(str(root))) == 2  # a folder that is only named like one is searched
    monkeypatch.setattr(folders, "_VIRTUAL", frozenset({str((root / "proc").resolve())}))
    assert entry_points(str(root), searched.append) == [str(root / "robots" / "r.urdf")]
    assert f"looking for files in {root / 'robots'}" in searched
    assert f"reading {root / 'robots' / 'r.urdf'}" in searched


def test_a_terminal_shows_which_file_is_checked(robot: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (robot.parent / "other.urdf").write_text('<robot name="r"><link name="l"/></robot>')
    shown: list[str] = []

    @contextmanager
    def busy(what: str) -> Iterator[Callable[[str], None]]:
        shown.append(what)
        yield shown.append

    monkeypatch.setattr(kbot.cli.check, "busy", busy)
    run(".")
    assert shown[0] == "looking for files"
    assert shown[-2:] == ["checking other.urdf (1 of 2)", "checking robot.xacro (2 of 2)"]


def test_a_file_of_macros_is_not_a_broken_robot(robot: Path) -> None:
    head, macro = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">', '<xacro:macro name="m" params="a b">'
    robot.write_text(
        f'{head}<xacro:property name="r" value="$(arg size)"/>{macro}<link name="${{a}}"/></xacro:macro>'
        "<x>${r}</x></robot>"
    )
    assert [f["code"] for f in findings("robot.xacro")] == ["S104"]
    robot.write_text('<robot><joint name="j" type="fixed"/></robot>')
    assert {"U002", "U003"} <= {f["code"] for f in findings("robot.xacro")}


LEARNER = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">
  <xacro:property name="unused" value="1"/>
  <link name="base_link"> <visual> <geometry> <box size="1 1 ${height}"/> </geometry> </visual> </link>
  <link name="arm"> <visual> <geometry> <box size="1 1 1" sise="2"/> </geometry> </visual> </link>
  <joint name="shoulder" type="revolute">
    <parent link="base_link"/> <child link="amr"/> <axis xyz="0 0 1" rpy="0 0 0"/>
  </joint>
</robot>
"""


def test_causes_are_printed_first_and_the_rest_is_summarized(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.xacro").write_text(LEARNER.replace("child link", "child lnik"))
    lines = run("robot.xacro").output.splitlines()
    heads = [line for line in lines if line.startswith("robot.xacro:")]
    assert [head.rsplit("[", 1)[1] for head in heads] == ["X103]", "U013]"]
    summary = lines[lines.index("After the errors (-v shows all findings):") + 1 : -2]
    assert summary == ["  2 info U202 unknown-attribute  first at robot.xacro:4:59"]
    assert lines[-1].startswith("2 errors, 2 info")


def test_verbose_prints_everything_in_the_order_of_severity(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.xacro").write_text(LEARNER)
    output = run("-v", "robot.xacro").output
    heads = [line for line in output.splitlines() if line.startswith("robot.xacro:")]
    severities = [head.split(": ")[1] for head in heads]
    assert severities == sorted(severities, key=["error", "warning", "info"].index)
    assert len(heads) == len(json.loads(run("--json", "robot.xacro").output)["findings"])
    assert "After the error" not in output


def test_warnings_alone_are_printed_in_full(robot: Path) -> None:
    output = run("-v", "robot.xacro").output
    assert "After" not in output
    assert output.count("warning:") + output.count("info:") == 2


def test_notes_are_one_line_in_the_terminal(robot: Path) -> None:
    lines = run("robot.xacro").output.splitlines()
    assert [line.rsplit("[", 1)[1] for line in lines if line.startswith("robot.xacro:")] == ["I108]"]
    assert lines[-3:-1] == ["1 note: 1 U202 unknown-attribute; -v shows them", ""]
    assert len(findings("robot.xacro")) == 2
    robot.write_text(MACRO.replace("<visual>", '<visual> <origin xzy="0 0 1"/>'))
    assert "U202" in {f["code"] for f in findings("robot.xacro") if f["severity"] == "warning"}


def test_a_summary_has_at_most_ten_lines() -> None:
    from kbot.checks.ranking import summary
    from kbot.text import Diagnostic, Severity

    found = [Diagnostic(f"T{n:03}", Severity.WARNING, "m") for n in range(30) for _ in range(n + 1)]
    found.append(Diagnostic("T999", Severity.INFO, "m"))
    lines = summary(found)
    assert len(lines) == 10
    assert lines[0] == "30 warnings T029"
    assert lines[-1] == "… and 22 more rules"
    assert len(summary(found[-10:])) == 2


def test_rule_prints_a_page() -> None:
    def words(*given: str) -> str:
        return CliRunner().invoke(rule, list(given), catch_exceptions=False, standalone_mode=False).stdout

    assert words("I111").startswith("I111 tensor-not-turned (warning, since 0.1)")
    assert words("tensor-not-turned") == words("i111")
    assert len(words("--all").splitlines()) > 100
    with pytest.raises(Exception, match="did you mean 'I111'"):
        words("I1111")


def test_the_document_of_rules_is_up_to_date() -> None:
    done = CliRunner().invoke(rule, ["--all", "--markdown"], catch_exceptions=False, standalone_mode=False)
    document = Path(__file__).parents[2] / "docs" / "reference" / "rules.md"
    assert document.read_text("utf-8") == done.stdout


def test_the_summary_counts_fixable_findings(tmp_path: Path) -> None:
    safe, unsafe = "<axis xyz='0 2 0'/>", "<xacro:property name='unused' value='1'/>"
    text = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="a"/> <link name="b"/> {}
  <joint name="j" type="continuous"> <parent link="a"/> <child link="b"/> {} </joint>
</robot>"""
    file = tmp_path / "r.xacro"
    for parts, output in (
        ((unsafe, ""), "1 warning; 1 can be fixed by --unsafe-fixes"),
        (("", safe), "1 warning; 1 can be fixed by --fix"),
        ((unsafe, safe), "2 warnings; 1 can be fixed by --fix, 1 more by --unsafe-fixes"),
    ):
        file.write_text(text.format(*parts))
        lines = CliRunner().invoke(check, [str(file), "--select", "S101,J107"]).output.splitlines()
        assert lines[-1] == output


def test_an_unknown_word_explains_where_packages_are_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    output = run("quadruped_zebra").stdout
    assert status("quadruped_zebra") == 2
    assert "there is no file, folder or package 'quadruped_zebra' [F001]" in output
    assert "--package-path or ROS_PACKAGE_PATH" in output
    (tmp_path / "quadruped_zebras").mkdir()
    assert "did you mean 'quadruped_zebras'" in run("quadruped_zebra").stdout
