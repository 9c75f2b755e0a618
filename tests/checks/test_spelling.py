"""`--fix` corrects a name that is a typo of exactly one possible name."""

from __future__ import annotations

import pytest

from kbot.checks import Config, check_text
from kbot.checks.fixes import fixed
from kbot.text import Diagnostic

ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="with_mast" default="true"/>
  <xacro:property name="wheel_radius" value="0.1"/>
  <xacro:macro name="wheel" params="prefix parent">
    <link name="${prefix}_wheel">
      <visual><geometry><sphere radius="${wheel_radius}"/></geometry></visual>
    </link>
    <joint name="${prefix}_joint" type="continuous">
      <parent link="${parent}"/><child link="${prefix}_wheel"/><axis xyz="0 1 0"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
  <xacro:wheel prefix="left" parent="base_link"/>
  <xacro:wheel prefix="right" parent="base_link"></xacro:wheel>
  <xacro:if value="$(arg with_mast)">
    <link name="mast"/>
    <joint name="to_mast" type="fixed"><parent link="base_link"/><child link="mast"/></joint>
  </xacro:if>
  <transmission name="drive"><joint name="left_joint"/></transmission>
</robot>
"""


def found_in(text: str) -> tuple[Diagnostic, ...]:
    return check_text(text, "robot.xacro", config=Config(ignore=("I1", "G106")))


def fixed_text(text: str) -> str:
    return fixed(text, "robot.xacro", found_in, unsafe=False)[0]


@pytest.mark.parametrize(
    ("right", "wrong", "code"),
    [
        ('type="continuous"', 'type="continous"', "U011"),
        ("${wheel_radius}", "${whel_radius}", "X103"),
        ('<xacro:wheel prefix="left"', '<xacro:weel prefix="left"', "X121"),
        (
            '<xacro:wheel prefix="right" parent="base_link"></xacro:wheel>',
            '<xacro:wheeel prefix="right" parent="base_link"></xacro:wheeel>',
            "X121",
        ),
        ('prefix="right" parent=', 'prefix="right" paernt=', "X122"),
        ("$(arg with_mast)", "$(arg with_mats)", "X112"),
        ('<child link="mast"/>', '<child link="masst"/>', "U007"),
        ('<parent link="base_link"/>', '<parent link="base_lnk"/>', "U006"),
        ('prefix="left" parent="base_link"', 'prefix="left" parent="Base_link"', "U006"),
    ],
)
def test_typo_is_fixed_where_it_is_written(right: str, wrong: str, code: str) -> None:
    assert right in ROBOT
    text = ROBOT.replace(right, wrong)
    assert code in {d.code for d in found_in(text)}
    assert fixed_text(text) == ROBOT


def test_typos_that_hide_each_other_are_all_fixed() -> None:
    text = ROBOT.replace("${wheel_radius}", "${whel_radius}").replace('link="mast"/></j', 'link="mst"/></j')
    assert fixed_text(text.replace('type="fixed"', 'type="fixd"')) == ROBOT


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('<link name="mast"/>', '<link name="mast_1"/><link name="mast_3"/>'),  # another digit is not a typo
        ('<parent link="base_link"/>', "<parent link=\"${'base'}_lnk\"/>"),  # a composed name
        ('<parent link="base_link"/>', '<parent link="chassis"/>'),  # no similar name
    ],
)
def test_ambiguous_name_is_not_changed(right: str, wrong: str) -> None:
    text = ROBOT.replace(right, wrong).replace('<child link="mast"/>', '<child link="mast_2"/>')
    assert fixed_text(text) == text


def test_typo_in_a_macro_is_reported_and_fixed_in_the_macro() -> None:
    text = ROBOT.replace("${wheel_radius}", "${whel_radius}")
    (finding,) = (d for d in found_in(text) if d.code == "X103")
    assert finding.origin is not None
    assert finding.origin.span.text == "${whel_radius}"
    assert finding.fix is not None
    assert finding.fix.safe


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("whel_radius if mode == 'whel_radius' else 1", "wheel_radius if mode == 'whel_radius' else 1"),
        ("dict(whel_radius=whel_radius)['whel_radius']", "dict(whel_radius=wheel_radius)['whel_radius']"),
        ("len('é&lt;a}'[:1]) + whel_radius", "len('é&lt;a}'[:1]) + whel_radius"),  # not an expression
        (" len('é&lt;&#228;') * whel_radius", " len('é&lt;&#228;') * wheel_radius"),
        ("whel_radius if 1 &lt; 2 and mode != &quot;whel_radius&quot; else whel_radius",
         "wheel_radius if 1 &lt; 2 and mode != &quot;whel_radius&quot; else wheel_radius"),
        ("whel_radius + sum([whel_radius for whel_radius in [1]])",
         "whel_radius + sum([whel_radius for whel_radius in [1]])"),  # the expression binds this name
    ],
)  # fmt: skip
def test_only_names_are_fixed_in_an_expression(wrong: str, right: str) -> None:
    robot = ROBOT.replace("<xacro:macro", '<xacro:property name="mode" value="whel_radius"/>\n  <xacro:macro')
    text = robot.replace("${wheel_radius}", "${" + wrong + "}")
    assert fixed_text(text) == robot.replace("${wheel_radius}", "${" + right + "}")


def test_only_names_are_fixed_in_an_eval_substitution() -> None:
    text = ROBOT.replace("$(arg with_mast)", "$(eval with_mats and 'with_mats' != '')")
    assert fixed_text(text) == ROBOT.replace("$(arg with_mast)", "$(eval with_mast and 'with_mats' != '')")
    text = ROBOT.replace("$(arg with_mast)", "$(eval with_mats and f'{with_mats}' != '')")
    assert fixed_text(text) == text


def test_string_in_an_expression_is_not_a_value() -> None:
    call = """<xacro:wheel prefix="${'left' if 'base_lnk' else ''}" parent="base_lnk"/>"""
    text = ROBOT.replace('<xacro:wheel prefix="left" parent="base_link"/>', call)
    assert fixed_text(text) == text.replace('parent="base_lnk"', 'parent="base_link"')
