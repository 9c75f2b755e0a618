"""Fuzzes `kbot check`: the report of malformed XML, the rules, the fixes and the formats, and its settings.

For any text, a check must end with findings that can be printed in every format. The fixes must give a text
that has no more errors than before.
"""

from contextlib import suppress
from pathlib import Path

from choices import Choices
from edits import edited, real_files

from kbot.checks import check_text
from kbot.checks.baseline import without_known
from kbot.checks.config import Config
from kbot.checks.fixes import fixed
from kbot.checks.formats import github, junit, sarif
from kbot.checks.settings import load_config
from kbot.text import KbotError
from kbot.text.render import render_text, to_json
from kbot.xacro import clear_cache

SEEDS = real_files(".xacro", ".urdf", ".xacro.in")
CONFIG = Config()
PATH = "fuzz.xacro"
HEAD = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'
FRAGMENTS = [
    '<link name="{}">', "</link>", '<link name="base_link"/>', '<link name="l{}"/>', '<lnk {}="1"/>',
    '<joint name="{}" type="revolute">', '<joint name="j" type="{}">', "</joint>", '<parent link="{}"/>',
    '<parent link="base_link"/><child link="{}"/>', '<axis xyz="{}"/>', '<limit lower="{}" upper="1"/>',
    '<mimic joint="{}"/>', '<origin xyz="{}" rpy="0 0 0"/>', '<inertial><mass value="{}"/></inertial>',
    '<inertial><mass value="1"/><inertia ixx="{}" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>',
    "<visual><geometry>", "</geometry></visual>", "<collision><geometry>", "</geometry></collision>",
    '<box size="{}"/>', '<cylinder radius="{}" length="1"/>', '<mesh filename="{}" scale="1 1 1"/>',
    '<gazebo reference="{}"><mu1>{}</mu1></gazebo>', '<material name="{}"><color rgba="{}"/></material>',
    '<gazebo><plugin filename="libgazebo_ros_diff_drive.so"><left_joint>{}</left_joint></plugin></gazebo>',
    '<ros2_control name="{}" type="system"><hardware><plugin>{}</plugin></hardware></ros2_control>',
    '<transmission name="t"><joint name="{}"/></transmission>', "<!-- kbot: ignore[{}] why -->",
    '<xacro:property name="{}" value="1"/>', '<xacro:macro name="m" params="{}">', "</xacro:macro>",
    '<xacro:m a="{}"/>', '<xacro:include filename="{}"/>', "<a>${{}}</a>",
    "{}", "<{} ", "='{}", "&{};", "-->",
]  # fmt: skip


def check(text: str, with_fixes: bool) -> None:
    """Check a text, print the findings in every format, and apply the fixes."""
    found = check_text(text, PATH, config=CONFIG)
    for finding in found:
        assert finding.code, finding
        assert finding.message, finding
        to_json(finding)
    render_text(found)
    sarif(found, "0")
    github(found)
    junit(found, [PATH])
    if with_fixes:
        after, fixes, _ = fixed(
            text, PATH, lambda changed: check_text(changed, PATH, config=CONFIG), unsafe=True
        )
        assert bool(fixes) == (after != text)


def document(choices: Choices) -> str:
    """The text for an input: the input itself, a real file, or fragments that are filled with it."""
    kind = choices.integer(0, 3)
    if kind == 0:
        return choices.text(4_000)
    if kind == 1:
        return edited(choices, SEEDS, [fragment.encode() for fragment in FRAGMENTS]).decode(errors="replace")
    parts = [HEAD]
    for _ in range(choices.integer(1, 20)):
        fragment = choices.pick(FRAGMENTS)
        parts.append(fragment.replace("{}", choices.text(20)))
    return "".join(parts) + "</robot>"


def one_input(choices: Choices) -> None:
    check(document(choices), with_fixes=choices.flag())
    if choices.integer(0, 63) == 0:
        clear_cache()


SETTINGS = b"""[check]
select = ["ALL"]
ignore = ["S101", "I"]
per-file-ignores = { "vendor/*.xacro" = ["ALL"] }
baseline = "baseline.json"
arguments = [{ robot = "small" }, { robot = "large", arm = "true" }]
"""
BASELINE = b'{"version": 1, "findings": [{"code": "U001", "file": "a.urdf", "message": "m", "count": 1}]}'


def one_setting(choices: Choices) -> None:
    is_baseline = choices.flag()
    file = Path("baseline.json" if is_baseline else "kbot.toml")
    file.write_bytes(edited(choices, [BASELINE if is_baseline else SETTINGS]))
    with suppress(KbotError):
        if is_baseline:
            without_known([], str(file))
        else:
            load_config(".")


TARGETS = {"check": one_input, "settings": one_setting}
