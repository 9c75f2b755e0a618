"""The nearest valid names to a misspelt one."""

from __future__ import annotations

import pytest

from kbot.text.suggest import did_you_mean, nearest

LINKS = ["base_link", "imu_link", "laser_link", "left_wheel_link", "right_wheel_link"]


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("lasr_link", "laser_link"),
        ("Base_Link", "base_link"),
        ("baselink", "base_link"),
        ("left_whel_link", "left_wheel_link"),
        ("laser_lnk", "laser_link"),
    ],
)
def test_a_slip_of_the_fingers_is_understood(name: str, first: str) -> None:
    assert nearest(name, LINKS)[0] == first


@pytest.mark.parametrize("name", ["bulkhead_link", "arm_mount_link", "x_link", "camera"])
def test_an_ending_that_all_have_is_no_likeness(name: str) -> None:
    assert did_you_mean(name, LINKS) == ""


@pytest.mark.parametrize(
    ("name", "known", "near"),
    [
        ("caster_wheel_radius", ["base_wheel_gap", "base_width"], []),
        ("caster_wheel_radius", ["wheel_radius", "base_wheel_gap"], ["wheel_radius"]),
        ("wheel_seperation", ["wheel_separation", "wheel_radius"], ["wheel_separation"]),
        ("wheel_sep", ["wheel_separation", "wheel_radius"], ["wheel_separation"]),
    ],
)
def test_a_word_in_the_middle_that_both_have_is_no_likeness(
    name: str, known: list[str], near: list[str]
) -> None:
    assert nearest(name, known) == near


def test_without_candidates_nothing_is_near() -> None:
    assert nearest("base_link", []) == []


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("base_lnk", "base_link"),
        ("base_liink", "base_link"),
        ("base_lynk", "base_link"),
        ("base_lnik", "base_link"),
        ("ium_link", "imu_link"),
        ("Base_Link", "base_link"),
    ],
)
def test_one_slip_of_one_name_is_sure(written: str, meant: str) -> None:
    assert did_you_mean(written, LINKS).sure == meant


@pytest.mark.parametrize(
    ("written", "known"),
    [
        ("l_wheel", ["r_wheel"]),
        ("arm_1", ["arm_2"]),
        ("wheel2", ["wheel"]),
        ("fl_wheel", ["fr_wheel", "rl_wheel"]),
        ("whee", ["wheel", "wheek"]),
        ("base", ["base_link"]),
    ],
)
def test_what_may_be_another_name_is_not_sure(written: str, known: list[str]) -> None:
    assert did_you_mean(written, known).sure == ""
