"""Coverage-guided fuzzing of `kbot check`: the report of malformed XML, the rules, the fixes and the formats.

    pip install atheris
    python fuzz/fuzz_check.py CORPUS_FOLDER [-runs=1000000] [-timeout=10]

For any text, a check must end within the timeout, with findings that can be printed in every format. The
fixes must give a text that has no more errors than before.
"""

import sys

import atheris

with atheris.instrument_imports(include=["kbot.text", "kbot.checks", "kbot.model"]):
    from kbot.checks import check_text
    from kbot.checks.config import Config
    from kbot.checks.fixes import fixed
    from kbot.checks.formats import github, junit, sarif
    from kbot.text.render import render_text, to_json
    from kbot.xacro import clear_cache

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
        after, fixes = fixed(
            text, PATH, lambda changed: check_text(changed, PATH, config=CONFIG), unsafe=True
        )
        assert bool(fixes) == (after != text)


def document(provider: atheris.FuzzedDataProvider) -> str:
    """The text for an input: the input itself, or fragments that are filled with it."""
    if provider.ConsumeIntInRange(0, 3) == 0:
        return provider.ConsumeUnicodeNoSurrogates(4_000)
    parts = [HEAD]
    for _ in range(provider.ConsumeIntInRange(1, 20)):
        fragment = FRAGMENTS[provider.ConsumeIntInRange(0, len(FRAGMENTS) - 1)]
        parts.append(fragment.replace("{}", provider.ConsumeUnicodeNoSurrogates(20)))
    return "".join(parts) + "</robot>"


def one_input(data: bytes) -> None:
    provider = atheris.FuzzedDataProvider(data)
    check(document(provider), with_fixes=provider.ConsumeBool())
    if len(data) % 64 == 0:
        clear_cache()


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
