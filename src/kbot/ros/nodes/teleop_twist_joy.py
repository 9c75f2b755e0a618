"""teleop_twist_joy: a gamepad's sticks in, a twist out, while a button is held."""

from __future__ import annotations

from collections.abc import Callable

from kbot.messages import Bus
from kbot.messages.sensing import Joy
from kbot.ros.launch.node_settings.teleop import Driver, Stick


class TeleopTwistJoy:
    """Commands forward m/s and turning rad/s with each message, and once to stop when the button is let
    go."""

    def __init__(self, bus: Bus, driver: Driver, command: Callable[[float, float], None]) -> None:
        self._driver, self._command = driver, command
        self._has_stopped = True
        self._subscription = bus.subscribe(driver.joy, Joy, self._hear)

    def close(self) -> None:
        """Hear no more."""
        self._subscription.close()

    def _hear(self, joy: Joy) -> None:
        driver = self._driver
        is_fast = _is_pressed(joy, driver.turbo)
        if is_fast or not driver.requires_enable or _is_pressed(joy, driver.enable):
            self._has_stopped = False
            self._command(_moved(joy, driver.linear, is_fast), _moved(joy, driver.angular, is_fast))
        elif not self._has_stopped:
            self._has_stopped = True
            self._command(0.0, 0.0)


def _is_pressed(joy: Joy, button: int) -> bool:
    return 0 <= button < len(joy.buttons) and bool(joy.buttons[button])


def _moved(joy: Joy, stick: Stick, is_fast: bool) -> float:
    if not 0 <= stick.axis < len(joy.axes):
        return 0.0
    return joy.axes[stick.axis] * (stick.turbo if is_fast else stick.scale)
