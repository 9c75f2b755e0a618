"""Wheels that the rules find on robots whose shapes are in unusual places."""

from kbot.checks import Config, check_text


def wheel(side: str, y: float) -> str:
    """A wheel 0.02 m wide whose cylinder is on a tyre link, `y` from the middle."""
    return (
        f'<link name="{side}_wheel"/><link name="{side}_tyre"><collision><origin rpy="1.5708 0 0"/>'
        '<geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>'
        f'<joint name="{side}_wheel_joint" type="continuous"><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>'
        f'<parent link="base_link"/><child link="{side}_wheel"/></joint>'
        f'<joint name="{side}_tyre_joint" type="fixed"><origin xyz="0 {0.1 if y > 0 else -0.1} 0"/>'
        f'<parent link="{side}_wheel"/><child link="{side}_tyre"/></joint>'
    )


def test_a_tyre_on_a_separate_link_is_at_that_link():
    """The wheels' joints are inside the chassis, which is 0.1 m wide. The tyres are 0.13 m from the
    middle."""
    base = (
        '<link name="base_link"><collision><geometry><box size="0.2 0.1 0.1"/></geometry></collision></link>'
    )
    text = f'<robot name="r">{base}{wheel("left", 0.03)}{wheel("right", -0.03)}</robot>'
    found = check_text(text, "r.urdf", config=Config(select=("D114", "D125")))
    assert [finding.code for finding in found] == ["D125", "D125"]
