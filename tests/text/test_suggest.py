"""Tests the suggestions for misspelled names."""

from __future__ import annotations

import copy
import time

import pytest

from kbot.text.suggest import Candidates, did_you_mean, nearest, suggest_or_list

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
def test_a_typing_mistake_is_corrected(name: str, first: str) -> None:
    assert nearest(name, LINKS)[0] == first


@pytest.mark.parametrize("name", ["bulkhead_link", "arm_mount_link", "x_link", "camera"])
def test_a_common_ending_does_not_make_names_similar(name: str) -> None:
    assert did_you_mean(name, LINKS) == ""


@pytest.mark.parametrize(
    ("name", "known", "near"),
    [
        ("caster_wheel_radius", ["wheel_radius", "base_wheel_gap", "base_width"], []),
        ("wheel_sep", ["wheel_separation", "wheel_radius"], []),
        ("wheel_raduis", ["wheel_radius"], ["wheel_radius"]),
        ("wheel_seperation", ["wheel_separation", "wheel_radius"], ["wheel_separation"]),
        ("left_wheel_radius", ["wheel_radius_left", "wheel_radius"], ["wheel_radius_left"]),
        ("wheelRadius", ["wheel_radius"], ["wheel_radius"]),
        ("whee", ["wheel", "wheek", "wheels"], ["wheek", "wheel"]),
        ("arm1", ["arm_1", "arm_2", "arm"], ["arm_1"]),
        ("/tf_statci", ["/tf", "/tf_static"], ["/tf_static"]),
    ],
)
def test_only_a_typo_or_another_order_of_the_words_is_near(
    name: str, known: list[str], near: list[str]
) -> None:
    assert nearest(name, known) == near


@pytest.mark.parametrize(
    ("written", "known"),
    [
        ("l_wheel", "r_wheel"),
        ("lwheel", "rwheel"),
        ("lwheel", "wheel"),
        ("fl_wheel", "fr_wheel"),
        ("wheelr", "wheell"),
        ("posx", "posy"),
        ("min_x", "mid_x"),
        ("arm_1", "arm_2"),
        ("arm_1_2", "arm_2_1"),
        ("arm_1_2", "arm_12"),
        ("wheel2", "wheel"),
        ("base", "base_link"),
        ("left_to_right", "right_to_left"),
        ("left_arm_right_finger", "right_arm_left_finger"),
        ("base_link", "base_link"),
        ("…", "?"),
        ("a" * 300, "a" * 299),
    ],
)
def test_another_name_is_not_suggested(written: str, known: str) -> None:
    assert did_you_mean(written, [known]) == ""


def test_a_fixed_vocabulary_has_no_letters_for_sides() -> None:
    assert did_you_mean("siml", ["sim", "view"]) == ""
    assert did_you_mean("siml", ["sim", "view"], sides=False) == "did you mean 'sim'?"


def test_without_candidates_there_is_no_suggestion() -> None:
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
def test_one_typo_from_a_single_name_is_certain(written: str, meant: str) -> None:
    assert did_you_mean(written, LINKS).sure == meant


def test_two_similar_names_are_not_certain() -> None:
    hint = did_you_mean("whee", ["wheel", "wheek"])
    assert hint == "did you mean 'wheek' or 'wheel'?"
    assert hint.sure == ""


def test_many_names_are_compared_quickly() -> None:
    """An unknown name takes less than a microsecond per known name: 5,000 of each stay within 10 s."""
    known = [f"link_{i}_left" for i in range(5000)]
    begin = time.process_time()
    for i in range(100):
        nearest(f"link_{i}_lft", known)
    assert time.process_time() - begin < 1.0


def test_shared_candidates_are_hashed_once() -> None:
    hashes = 0

    class Name(str):
        def __hash__(self) -> int:
            nonlocal hashes
            hashes += 1
            return super().__hash__()

    known = Candidates(Name(f"link_{i}_left") for i in range(1000))
    nearest("link_0_lft", known)
    hashes = 0
    assert nearest("link_1_lft", known) == ["link_1_left"]
    assert hashes < 1000


def test_a_suggestion_can_be_copied() -> None:
    copied = copy.deepcopy(did_you_mean("wheel_raduis", ["wheel_radius"]))
    assert (copied, copied.sure) == ("did you mean 'wheel_radius'?", "wheel_radius")


def test_without_a_similar_name_the_first_known_names_are_listed() -> None:
    assert suggest_or_list("lasr_link", LINKS) == "did you mean 'laser_link'?"
    assert suggest_or_list("base", ["base_link", "laser"]) == "choose from base_link, laser"
    assert suggest_or_list("x", list("abcdefgh")) == "choose from a, b, c, d, e, f, … (2 more)"
