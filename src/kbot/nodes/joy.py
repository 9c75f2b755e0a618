"""joy_node: a gamepad as Linux tells of it at /dev/input/js0, on a topic.

https://www.kernel.org/doc/html/latest/input/joydev/joystick-api.html
"""

from __future__ import annotations

import os
import select
import struct
import sys
import threading
from collections.abc import Callable

from kbot.launch.teleop import Gamepad
from kbot.messages import Bus, Clock, Header
from kbot.messages.sensing import Joy

RATE = 50.0
"""Hz at which it looks for what changed."""
LARGEST = 32767.0
_EVENT = struct.Struct("=IhBB")
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_WAIT_SECONDS, _AGAIN_SECONDS = 0.1, 1.0
_LAST = 63
"""Number of the last axis or button."""


class Joystick:
    """Where a gamepad's axes and buttons are: a thread reads them, from 1 (left, ahead) to -1."""

    def __init__(self, gamepad: Gamepad, tell: Callable[[str], None]) -> None:
        """`tell` is given sentences for the user."""
        self._gamepad, self._tell = gamepad, tell
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, int] = {}
        self.changes = 0
        """Grows with each event."""
        self._is_told = False
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Read no more."""
        self._closed.set()
        self._thread.join()

    @property
    def axes(self) -> tuple[float, ...]:
        found = dict(self._axes)
        return tuple(found.get(number, 0.0) for number in range(max(found, default=-1) + 1))

    @property
    def buttons(self) -> tuple[int, ...]:
        found = dict(self._buttons)
        return tuple(found.get(number, 0) for number in range(max(found, default=-1) + 1))

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                descriptor = os.open(self._gamepad.device, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
            except OSError as error:
                self._explain(error)
                self._closed.wait(_AGAIN_SECONDS)
                continue
            try:
                self._tell(f"The gamepad at {self._gamepad.device} is read")
                self._read(descriptor)
            except OSError:
                self._tell(f"The gamepad at {self._gamepad.device} is gone")
            finally:
                os.close(descriptor)
                self._let_go()

    def _explain(self, error: OSError) -> None:
        if self._is_told:
            return
        self._is_told = True
        here = f"cannot be read: {error.strerror}" if sys.platform == "linux" else "is there on Linux alone"
        self._tell(
            f"The gamepad at {self._gamepad.device} {here}. One that the page's browser knows drives"
            f" by its left stick; {self._gamepad.topic} is heard from peers"
        )

    def _read(self, descriptor: int) -> None:
        while not self._closed.is_set():
            ready, _, _ = select.select([descriptor], [], [], _WAIT_SECONDS)
            if not ready:
                continue
            data = os.read(descriptor, _EVENT.size * 64)
            if not data:
                raise OSError
            for _, value, kind, number in _EVENT.iter_unpack(data[: len(data) // _EVENT.size * _EVENT.size]):
                self._take(value, kind & ~_INITIAL, number)

    def _take(self, value: int, kind: int, number: int) -> None:
        if number > _LAST:
            return
        if kind == _AXIS:
            zone = self._gamepad.deadzone
            share = min(1.0, abs(value) / LARGEST)
            moved = max(0.0, share - zone) / (1.0 - zone)
            self._axes[number] = moved if value < 0 else 0.0 - moved
        elif kind == _BUTTON:
            self._buttons[number] = value
        self.changes += 1

    def _let_go(self) -> None:
        """A gamepad that is gone drives nothing."""
        self._axes = dict.fromkeys(self._axes, 0.0)
        self._buttons = dict.fromkeys(self._buttons, 0)
        self.changes += 1


class JoyNode:
    """Says on a topic where a gamepad's sticks and buttons are, once they change, and again at its rate."""

    def __init__(self, bus: Bus, clock: Clock, gamepad: Gamepad, joystick: Joystick) -> None:
        self._clock, self._joystick = clock, joystick
        self._publisher = bus.advertise(gamepad.topic, Joy)
        self._period = round(1e9 / gamepad.repeat) if gamepad.repeat > 0.0 else 0
        self._seen, self._last = 0, clock.nanoseconds
        self._timer = clock.every(RATE, self._look)

    def close(self) -> None:
        """Say no more."""
        self._timer.cancel()

    def _look(self) -> None:
        joystick, now = self._joystick, self._clock.nanoseconds
        is_due = bool(self._period and joystick.changes) and now - self._last >= self._period
        if joystick.changes == self._seen and not is_due:
            return
        self._seen, self._last = joystick.changes, now
        self._publisher.publish(Joy(Header(self._clock.stamp), joystick.axes, joystick.buttons))
