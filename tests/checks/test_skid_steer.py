"""How far a skid steer turns, compared with results computed by hand and with values that makers measured."""

import pytest

from kbot.checks.rules.skid_steer import turn_share


@pytest.mark.parametrize(
    ("wheelbase", "track", "multiplier"),
    [
        (0.512, 0.5708, 1.875),  # Husky, husky_control/config/control.yaml
        (0.262, 0.37559, 1.5),  # Jackal, jackal_control/config/control.yaml
    ],
)
def test_the_share_is_near_the_multipliers_that_makers_tuned(wheelbase, track, multiplier):
    axles = (wheelbase / 2.0, -wheelbase / 2.0)
    assert 1.0 / turn_share(axles, track) == pytest.approx(multiplier, rel=0.05)


@pytest.mark.parametrize("middle", [0.0, 0.3])
def test_two_axles_have_a_closed_form_wherever_the_base_link_is(middle):
    """0.25^2 / (0.2^2 + 0.25^2)"""
    assert turn_share((middle + 0.2, middle - 0.2), 0.5) == pytest.approx(0.0625 / 0.1025)


def test_a_third_axle_in_the_middle_helps_to_turn():
    """With a = b moments balance where 2 (2s - 1) = sqrt((1 - s)^2 + s^2), which is 14 s^2 - 14 s + 3 = 0."""
    assert turn_share((0.25, 0.0, -0.25), 0.5) == pytest.approx(0.5 + 1.0 / 28.0**0.5)


def test_wheels_on_one_axle_turn_as_commanded():
    assert turn_share((0.1,), 0.4) == pytest.approx(1.0)
