"""Paths: their points, and their conversion to messages."""

import math

import numpy as np
import pytest

from kbot.navigation.path import Path
from kbot.text import KbotError


def test_paths_survive_conversion_to_messages_and_back():
    path = Path.through([(0, 0), (1, 0), (1, 2)], yaw=0.3)
    message = path.to_message()
    assert message.header.frame_id == "map"
    assert [p.pose.position.y for p in message.poses] == [0.0, 0.0, 2.0]
    # along +y at the corner: a quarter turn
    assert message.poses[1].pose.orientation.z == pytest.approx(math.sin(math.pi / 4))
    back = Path.from_message(message)
    assert np.array_equal(back.points, path.points)
    assert back.yaw == pytest.approx(0.3)


@pytest.mark.parametrize("points", [[], [(1, 2, 3)], [(0, math.nan)], [(0, 1), (2,)], "here"])
def test_a_path_with_invalid_points_is_refused(points):
    with pytest.raises(KbotError):
        Path.through(points)
