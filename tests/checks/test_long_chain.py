"""A robot with a chain deeper than Python's stack is checked and described like any other."""

from pathlib import Path

from kbot.checks import check_file
from kbot.kinematics.robot_info import describe_as_text
from kbot.model.load import load_robot

DEEP = 3000


def chain(kind: str) -> str:
    """A chain of `DEEP` joints between links of 1 kg."""
    parts = []
    for i in range(DEEP + 1):
        parts.append(
            f'<link name="l{i}"><inertial><mass value="1"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        if i:
            parts.append(
                f'<joint name="j{i}" type="{kind}"><parent link="l{i - 1}"/><child link="l{i}"/></joint>'
            )
    return '<robot name="chain">' + "\n".join(parts) + "</robot>"


def test_the_mass_of_a_long_chain_is_summed(tmp_path: Path) -> None:
    path = tmp_path / "chain.urdf"
    path.write_text(chain("continuous"))
    ratios = [d for d in check_file(str(path)) if d.code == "I116"]
    # l0 carries 3000 kg, l1 2999 kg and so on: more than 1000 times 1 kg for the first 2000 joints
    assert len(ratios) == 2000
    assert ratios[0].message.startswith("j1: 3000 kg at 'l1' and 1 kg at 'l0'")


def test_a_long_chain_is_printed_in_short_lines(tmp_path: Path) -> None:
    path = tmp_path / "chain.urdf"
    path.write_text(chain("fixed"))
    check_file(str(path))
    text = describe_as_text(load_robot(path).require())
    lines = text.splitlines()
    assert sum(line.lstrip(" ").startswith(("└─ l", "…  l")) for line in lines) == DEEP
    assert max(len(line) for line in lines) < 130 + len(str(path))
    assert "3001 kg" in lines[0]
