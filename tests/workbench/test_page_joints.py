"""The joints panel of a robot whose joints accept different commands."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.cli.main import run
from kbot.workbench.serve import open_session

from .conftest import until
from .pictures import decode_png
from .served import served

OpenPage = Callable[..., Any]

INERTIA = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
INERTIAL = f'<inertial><mass value="1"/>{INERTIA}</inertial>'
LINK = '<link name="{0}">' + INERTIAL + "{1}</link>"
BOX = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'


def joint(name: str, kind: str, child: str, inner: str) -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="world"/><child link="{child}"/>{inner}</joint>'


def plugin(kind: str, name: str) -> str:
    named = f'filename="gz-sim-{kind}-system" name="gz::sim::systems::X"'
    return f"<gazebo><plugin {named}><joint_name>{name}</joint_name></plugin></gazebo>"


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="2" effort="100" velocity="3"/>'
    parts = [
        '<robot name="arm"><link name="world"/>',
        *(LINK.format(name, BOX) for name in ("turret", "mast", "wheel", "twin")),
        joint("turn", "revolute", "turret", limit),
        joint(
            "lift",
            "prismatic",
            "mast",
            '<axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="100" velocity="1"/>',
        ),
        joint("spin", "continuous", "wheel", '<axis xyz="0 0 1"/><limit effort="100" velocity="5"/>'),
        joint("echo", "revolute", "twin", f'{limit}<mimic joint="turn" multiplier="0.5"/>'),
        plugin("joint-position-controller", "turn"),
        plugin("joint-position-controller", "lift"),
        plugin("joint-controller", "spin"),
        "</robot>",
    ]
    file = tmp_path / "arm.urdf"
    file.write_text("\n".join(parts))
    return file


@pytest.fixture
def running(arm: Path) -> Iterator[str]:
    with served(open_session(str(arm), simulate=True)) as address:
        yield address


def value(page: Any, label: str) -> float:
    return float(page.get_by_label(label, exact=True).input_value())


def test_joints_follow_commands_to_their_controllers(running: str, open_page: OpenPage) -> None:
    page = open_page(running)
    page.get_by_label("turn in degrees", exact=True).fill("60")
    page.keyboard.press("Enter")
    page.get_by_label("lift", exact=True).fill("0.25")
    until(lambda: abs(value(page, "turn in degrees") - 60) < 1)
    until(lambda: abs(value(page, "lift in millimetres") - 250) < 5)
    assert "follows turn" in page.locator("[data-joint=echo]").inner_text()
    assert page.get_by_label("echo", exact=True).is_disabled()
    until(lambda: abs(value(page, "echo in degrees") - 30) < 2)
    assert page.get_by_label("spin", exact=True).is_disabled()
    page.get_by_label("spin speed", exact=True).fill("2")
    until(lambda: "114.6" in page.locator("[data-joint=spin] output").inner_text())
    seen: set[float] = set()
    until(lambda: seen.add(value(page, "spin in degrees")) or max(seen) - min(seen) > 90)


def test_zero_is_shown_without_a_sign(arm: Path, open_page: OpenPage) -> None:
    with served(open_session(str(arm), simulate=False)) as address:
        page = open_page(address)
        number = page.get_by_label("turn in degrees", exact=True)
        slider = page.get_by_role("slider", name="turn", exact=True)
        number.fill("-0.01")
        number.press("Tab")
        until(lambda: float(slider.input_value()) < 0)
        until(lambda: slider.get_attribute("aria-valuetext") == "0.0 degrees")
        assert number.input_value() == "0.0"


def test_joints_have_units_limits_and_search(arm: Path, open_page: OpenPage) -> None:
    arm.write_text(
        arm.read_text().replace(
            "</robot>",
            "".join(
                LINK.format(f"l{i}", "") + joint(f"extra_{i}", "continuous", f"l{i}", '<axis xyz="0 0 1"/>')
                for i in range(6)
            )
            + "</robot>",
        )
    )
    with served(open_session(str(arm), simulate=False)) as address:
        page = open_page(address)
        limits = page.locator("[data-joint=turn] .limits span")
        units = page.get_by_role("group", name="Units")
        assert units.locator("[aria-pressed=true]").all_inner_texts() == ["°"]
        assert limits.all_inner_texts() == ["\u221257.3", "114.6"]
        page.get_by_role("button", name="rad and m").click()
        assert limits.all_inner_texts() == ["\u22121", "2"]
        assert units.locator("[aria-pressed=true]").all_inner_texts() == ["rad"]
        page.get_by_label("turn in radians", exact=True).fill("1.5")
        page.keyboard.press("Enter")
        page.get_by_label("lift in metres", exact=True).fill("9")
        page.keyboard.press("Enter")
        until(lambda: value(page, "lift in metres") == 0.5)  # its limit
        assert np.isclose(value(page, "turn in radians"), 1.5)
        assert np.isclose(value(page, "echo in radians"), 0.75)
        page.get_by_label("Search joints").fill("EXTRA_3")
        assert page.locator(".joint:visible").count() == 1
        page.get_by_label("Search joints").fill("nothing")
        assert page.locator("#joints").inner_text().strip().endswith("No joint matches.")


def test_joints_start_at_the_initial_positions_of_ros2_control(
    arm: Path, tmp_path: Path, open_page: OpenPage
) -> None:
    value_of = '<state_interface name="position"><param name="initial_value">{}</param></state_interface>'
    joints = {"turn": "0.5", "lift": "0.2", "spin": "soon"}
    expected = "".join(f'<joint name="{name}">{value_of.format(at)}</joint>' for name, at in joints.items())
    arm.write_text(
        arm.read_text().replace(
            "</robot>", f'<ros2_control name="a" type="system">{expected}</ros2_control></robot>'
        )
    )
    with served(open_session(str(arm), simulate=False)) as address:
        page = open_page(address)
        assert value(page, "turn in degrees") == pytest.approx(np.degrees(0.5), abs=0.05)
        # the mimic joint follows
        assert value(page, "echo in degrees") == pytest.approx(np.degrees(0.25), abs=0.05)
        assert value(page, "lift in millimetres") == pytest.approx(200.0, abs=0.05)
        assert value(page, "spin in degrees") == 0.0
    saved = tmp_path / "arm.html"
    assert run(["export", str(arm), "-o", str(saved), "--joint", "lift:=0.1"]) == 0
    page = open_page(saved.as_uri())
    assert value(page, "turn in degrees") == pytest.approx(np.degrees(0.5), abs=0.05)
    assert value(page, "lift in millimetres") == pytest.approx(100.0, abs=0.05)


def test_a_saved_picture_has_the_pages_joint_positions(arm: Path, tmp_path: Path) -> None:
    hardware = (
        '<ros2_control name="a" type="system"><joint name="lift"><state_interface name="position">'
        '<param name="initial_value">0.3</param></state_interface></joint></ros2_control></robot>'
    )
    pictures = [tmp_path / f"{name}.png" for name in ("shot", "export", "moved", "zero")]
    small = ["--size", "400x250"]
    assert run(["export", str(arm), "-o", str(pictures[2]), *small, "--joint", "lift:=0.3"]) == 0
    assert run(["export", str(arm), "-o", str(pictures[3]), *small]) == 0
    arm.write_text(arm.read_text().replace("</robot>", hardware))
    assert run(["view", str(arm), "--shot", str(pictures[0]), *small]) == 0
    assert run(["export", str(arm), "-o", str(pictures[1]), *small]) == 0
    shot, exported, by_hand, zero = (decode_png(picture.read_bytes()) for picture in pictures)
    assert (exported == by_hand).all()
    assert (shot == by_hand).all()
    assert (exported != zero).any()
