"""The speeds and accelerations that a controller may use."""

import math

import pytest

from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.text import KbotError


@pytest.mark.parametrize("values", [(0.0, 1.0), (1.0, -1.0), (math.inf, 1.0), (1.0, math.nan)])
def test_limits_must_be_finite_and_above_zero(values):
    with pytest.raises(KbotError, match="finite numbers above 0"):
        MotionLimits(*values)
