"""Worlds that are too large, or that the engine cannot simulate, give one clear error in bounded time."""

from collections.abc import Callable
from pathlib import Path

import pytest

import kbot
from kbot.text import DescriptionError, KbotError
from kbot.world import load_world

Write = Callable[[str], str]


@pytest.fixture
def world(tmp_path: Path) -> Write:
    def write(inner: str) -> str:
        file = tmp_path / "w.sdf"
        file.write_text(f'<sdf version="1.7"><world name="w">{inner}</world></sdf>')
        return str(file)

    return write


def test_includes_that_double_each_other_are_rejected(world: Write, tmp_path: Path) -> None:
    """Twenty files, each of which includes the previous one twice: a million links."""
    (tmp_path / "0.sdf").write_text('<sdf version="1.7"><model name="m"><link name="l"/></model></sdf>')
    for number in range(1, 20):
        both = "".join(f"<include><uri>{number - 1}.sdf</uri><name>{n}</name></include>" for n in "ab")
        (tmp_path / f"{number}.sdf").write_text(f'<sdf version="1.7"><model name="m">{both}</model></sdf>')
    with pytest.raises(KbotError, match=r"sdf:1:\d+: the world has more than 10000 links"):
        load_world(world("<include><uri>19.sdf</uri></include>"))


def test_too_many_collisions_are_rejected(world: Write) -> None:
    """The engine would need minutes."""
    collision = '<collision name="c"><geometry><sphere><radius>1</radius></sphere></geometry></collision>'
    text = f'<model name="m"><static>1</static><link name="l">{collision * 20_001}</link></model>'
    with pytest.raises(KbotError, match=r"sdf:1:\d+: the world has more than 20000 collisions"):
        load_world(world(text))


def test_a_long_chain_of_joints_is_rejected(world: Write) -> None:
    """A step would take seconds."""
    links = "".join(f'<link name="l{i}"/>' for i in range(502))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent>l{i}</parent><child>l{i + 1}</child>'
        "<axis><xyz>0 0 1</xyz></axis></joint>"
        for i in range(501)
    )
    place = load_world(world(f'<model name="m">{links}{joints}</model>'))
    with pytest.raises(DescriptionError, match="l501' is in a chain of more than 500 movable joints"):
        kbot.Simulation(kbot.load("kbot"), place)


def test_too_many_contacts_are_an_error(world: Write) -> None:
    """The robot is inside 20,000 boxes."""
    box = "<geometry><box><size>1 1 1</size></box></geometry>"
    boxes = "".join(f'<collision name="c{i}">{box}</collision>' for i in range(20_000))
    text = f'<model name="m"><static>1</static><link name="l">{boxes}</link></model>'
    with pytest.raises(DescriptionError, match="the physics engine rejects the world with 'kbot'"):
        kbot.Simulation(kbot.load("kbot"), world=load_world(world(text)))


def test_too_large_directions_are_not_used(world: Write) -> None:
    """The length of a longer direction would overflow."""
    plane = '<collision name="c"><geometry><plane><normal>0 0 1e308</normal></plane></geometry></collision>'
    ends = "<parent>world</parent><child>l</child>"
    joint = f'<joint name="j" type="revolute">{ends}<axis><xyz>0 0 -1e308</xyz></axis>'
    found = load_world(world(f'<model name="m"><link name="l">{plane}</link>{joint}</joint></model>'))
    assert [(d.message, d.hint) for d in found.diagnostics] == [
        ("<xyz> must be 3 finite numbers up to 1e+06, not '0 0 -1e308'", "KBot uses the z axis"),
        ("<normal> must be 3 finite numbers up to 1e+06, not '0 0 1e308'", "KBot uses 0 0 1"),
    ]


@pytest.mark.parametrize("version", ["1" + "0" * 5000, "²", "1.²", "", "."])
def test_invalid_version_is_read_as_the_newest(tmp_path: Path, version: str) -> None:
    file = tmp_path / "w.sdf"
    file.write_text(f'<sdf version="{version}"><model name="m"><link name="l"/></model></sdf>')
    assert load_world(file).name == "m"
