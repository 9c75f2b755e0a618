"""teleop_twist_keyboard: the keys that its documentation lists."""

import pytest

from kbot.ros.nodes.teleop_twist_keyboard import TeleopKeys

MOVES = {
    "i": (0.5, 0.0),
    "o": (0.5, -1.0),
    "j": (0.0, 1.0),
    "l": (0.0, -1.0),
    "u": (0.5, 1.0),
    ",": (-0.5, 0.0),
    ".": (-0.5, 1.0),
    "m": (-0.5, -1.0),
    "k": (0.0, 0.0),
    "#": (0.0, 0.0),
}


@pytest.mark.parametrize(("key", "twist"), MOVES.items())
def test_motion_of_each_key_at_the_initial_speeds(key: str, twist: tuple[float, float]) -> None:
    teleop = TeleopKeys()
    teleop.press("i")
    teleop.press(key)
    assert teleop.twist == twist


@pytest.mark.parametrize(
    ("keys", "speed", "turn"),
    [
        ("q", 0.55, 1.1),
        ("z", 0.45, 0.9),
        ("w", 0.55, 1.0),
        ("x", 0.45, 1.0),
        ("e", 0.5, 1.1),
        ("c", 0.5, 0.9),
    ],
)
def test_speeds_change_by_10_percent_and_the_motion_continues(keys: str, speed: float, turn: float) -> None:
    teleop = TeleopKeys()
    for key in f"u{keys}":
        teleop.press(key)
    assert teleop.twist == pytest.approx((speed, turn))


def test_commands_repeat_while_moving_and_come_once_to_stop() -> None:
    commands: list[tuple[float, float]] = []
    teleop = TeleopKeys()
    for key in ("", "i", "", "k", "", ""):
        if key:
            teleop.press(key)
        teleop.drive(lambda linear, angular: commands.append((linear, angular)))
    assert commands == [(0.5, 0.0), (0.5, 0.0), (0.0, 0.0)]
