"""joy_node: a gamepad as Linux tells of it at /dev/input/js0, on a topic.

https://www.kernel.org/doc/html/latest/input/joydev/joystick-api.html
"""

from __future__ import annotations

import os
import select
import stat
import struct
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from kbot.messages import Bus, Clock, Header
from kbot.messages.sensing import Joy
from kbot.ros.launch.node_settings.teleop import Gamepad

RATE = 50.0
"""Hz at which it looks for what changed."""
LARGEST = 32767.0
_EVENT = struct.Struct("=IhBB")
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_WAIT_SECONDS, _AGAIN_SECONDS, _REST_SECONDS = 0.1, 1.0, 0.005
_LAST = 63
"""Number of the last axis or button."""


class _NoGamepad(Exception):
    """The device tells of none; why, in words."""


class Joystick:
    """Where a gamepad's axes and buttons are: a thread reads them, from 1 (left, ahead) to -1."""

    def __init__(self, gamepad: Gamepad, tell: Callable[[str], None]) -> None:
        """`tell` is given sentences for the user."""
        self._gamepad, self._tell = gamepad, tell
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, int] = {}
        self.changes = 0
        """Grows with each event."""
        self._told = ""
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
            self._try()
            self._closed.wait(_AGAIN_SECONDS)

    def _try(self) -> None:
        """Read the device until it is gone, if it can be."""
        device = self._gamepad.device
        try:
            descriptor = _opened(device)
        except (OSError, ValueError) as error:
            self._explain(getattr(error, "strerror", None) or str(error))
            return
        try:
            self._read(descriptor)
        except _NoGamepad as error:
            self._explain(str(error))
        except OSError:
            self._say(f"The gamepad at {device} is gone")
        finally:
            os.close(descriptor)
            self._let_go()

    def _explain(self, why: str) -> None:
        here = f"cannot be read: {why}" if sys.platform == "linux" else "is there on Linux alone"
        self._say(
            f"The gamepad at {self._gamepad.device} {here}. One that the page's browser knows drives"
            f" by its left stick; {self._gamepad.topic} is heard from peers"
        )

    def _say(self, text: str) -> None:
        """Tell it, unless it was the last that was told."""
        if text != self._told:
            self._told = text
            self._tell(text)

    def _read(self, descriptor: int) -> None:
        """Take in events. Raises _NoGamepad: it tells of none; OSError: it is gone."""
        is_read = False
        while not self._closed.is_set():
            ready, _, _ = select.select([descriptor], [], [], _WAIT_SECONDS)
            if not ready:
                continue
            data = os.read(descriptor, _EVENT.size * 64)
            if not data:
                raise OSError if is_read else _NoGamepad("it ends before the first event")
            events = list(_EVENT.iter_unpack(data[: len(data) // _EVENT.size * _EVENT.size]))
            if not any(kind & ~_INITIAL in (_AXIS, _BUTTON) for _, _, kind, _ in events):
                raise _NoGamepad("what it tells is no event of a gamepad")
            if not is_read:
                is_read = True
                self._say(f"The gamepad at {self._gamepad.device} is read")
            for _, value, kind, number in events:
                self._take(value, kind & ~_INITIAL, number)
            self._closed.wait(_REST_SECONDS)

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


def _opened(device: str) -> int:
    """The descriptor of a device, or of a pipe in the place of one. Raises OSError, ValueError: it cannot be
    opened, or is neither."""
    mode = Path(device).stat().st_mode
    if not stat.S_ISCHR(mode) and not stat.S_ISFIFO(mode):
        raise ValueError("it is neither a character device nor a FIFO")
    return os.open(device, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))


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
