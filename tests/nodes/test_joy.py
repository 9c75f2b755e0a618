"""A gamepad, as the kernel writes it, and what it drives."""

import os
import struct
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from kbot.messages import Bus, Clock
from kbot.messages.sensing import Joy
from kbot.record.encodings.bytes import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.ros.launch.node_settings.teleop import Driver, Gamepad, Stick
from kbot.ros.nodes.joy import JoyNode, Joystick
from kbot.ros.nodes.teleop_twist_joy import TeleopTwistJoy

BUTTON, AXIS, INITIAL = 1, 2, 0x80


def event(kind: int, number: int, value: int) -> bytes:
    """struct js_event of linux/joystick.h: milliseconds, value, type, number."""
    return struct.pack("=IhBB", 12345, value, kind, number)


def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.01)


class Pad:
    """A pipe in the place of a device."""

    def __init__(self, device: Path, deadzone: float = 0.0) -> None:
        os.mkfifo(device)
        self.told: list[str] = []
        self.joystick = Joystick(Gamepad("/joy", str(device), deadzone, 20.0), self.told.append)
        self._writer = os.open(device, os.O_WRONLY)

    def write(self, *events: bytes) -> None:
        before = self.joystick.changes
        os.write(self._writer, b"".join(events))
        until(lambda: self.joystick.changes >= before + len(events))

    def unplug(self) -> None:
        os.close(self._writer)

    def close(self) -> None:
        self.joystick.close()


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[Pad]:
    pad = Pad(tmp_path / "js0", deadzone=0.1)
    yield pad
    pad.close()


needs_pipes = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes")


@needs_pipes
def test_left_and_ahead_are_positive_and_a_little_is_nothing(pad: Pad) -> None:
    pad.write(event(AXIS | INITIAL, 1, 0), event(AXIS, 0, -32767), event(AXIS, 1, 32767), event(BUTTON, 2, 1))
    assert pad.joystick.axes == (1.0, -1.0)
    assert pad.joystick.buttons == (0, 0, 1)
    pad.write(event(AXIS, 0, -3000), event(AXIS, 1, -18022))
    # 3000 is within a tenth of 32767; 18022 is 0.55 of it, half way from the zone's edge to the end
    assert pad.joystick.axes == pytest.approx((0.0, 0.5), abs=1e-4)


@needs_pipes
def test_changes_are_said_and_said_again(pad: Pad) -> None:
    bus, clock, heard = Bus(), Clock(), list[Joy]()
    bus.subscribe("/joy", Joy, heard.append)
    JoyNode(bus, clock, Gamepad("/joy", "", 0.1, 20.0), pad.joystick)
    clock.advance_to(1_000_000_000)
    assert heard == []
    pad.write(event(BUTTON, 0, 1))
    clock.advance_to(1_020_000_000)
    assert [message.buttons for message in heard] == [(1,)]
    for step in range(1, 101):
        clock.advance_to(1_020_000_000 + step * 10_000_000)
    assert 15 <= len(heard) <= 21  # a second at 20 Hz, looked at 50 times


@needs_pipes
def test_a_gamepad_that_is_unplugged_lets_everything_go(pad: Pad) -> None:
    pad.write(event(AXIS, 1, -32767), event(BUTTON, 0, 1))
    pad.unplug()
    until(lambda: any("is gone" in line for line in pad.told))
    until(lambda: pad.joystick.axes == (0.0, 0.0))
    assert pad.joystick.buttons == (0,)


def test_where_there_is_none_it_is_said_once_and_what_can_be_done(tmp_path: Path) -> None:
    told: list[str] = []
    joystick = Joystick(Gamepad("/joy", str(tmp_path / "js9")), told.append)
    until(lambda: told)
    joystick.close()
    (line,) = told
    assert "the page's browser knows drives by its left stick; /joy is heard from peers" in line


@pytest.mark.skipif(sys.platform != "linux", reason="it is there on Linux alone")
@pytest.mark.parametrize(
    ("device", "why"),
    [
        ("/dev/null", "it ends before the first event"),
        ("/dev/zero", "what it tells is no event of a gamepad"),
        ("/tmp", "it is neither a character device nor a FIFO"),
        ("/dev/in\0put", "embedded null byte"),
    ],
)
def test_what_is_no_gamepad_is_said_once_and_tried_again_after_a_while(
    device: str, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries, stat = list[object](), os.stat
    monkeypatch.setattr("kbot.ros.nodes.joy._AGAIN_SECONDS", 0.2)
    monkeypatch.setattr("os.stat", lambda path, **how: (tries.append(path), stat(path, **how))[1])
    told: list[str] = []
    started = time.monotonic()
    joystick = Joystick(Gamepad("/joy", device), told.append)
    until(lambda: len(tries) >= 3)
    assert time.monotonic() - started >= 0.4  # it waits between tries, whatever the machine does
    joystick.close()
    (line,) = told
    assert f"The gamepad at {device} cannot be read: {why}. One that the page's browser" in line


@pytest.fixture
def drives() -> Callable[..., list[tuple[float, float]]]:
    def drive(driver: Driver, *messages: Joy) -> list[tuple[float, float]]:
        bus, commands = Bus(), list[tuple[float, float]]()
        TeleopTwistJoy(bus, driver, lambda linear, angular: commands.append((linear, angular)))
        for message in messages:
            bus.publish(driver.joy, message)
        return commands

    return drive


PLAIN = Driver("/joy", "/cmd_vel", Stick(1, 0.5, 2.0), Stick(0, 0.8, 1.6), enable=0, turbo=1)


def test_it_drives_while_the_button_is_held_and_stops_once(drives) -> None:
    axes = (0.5, 1.0)
    found = drives(PLAIN, Joy(axes=axes, buttons=(0, 0)), Joy(axes=axes, buttons=(1, 0)),
                   Joy(axes=axes, buttons=(0, 0)), Joy(axes=axes, buttons=(0, 0)))  # fmt: skip
    assert found == [pytest.approx((0.5, 0.4)), (0.0, 0.0)]


def test_the_turbo_button_goes_faster_by_itself(drives) -> None:
    assert drives(PLAIN, Joy(axes=(0.5, 1.0), buttons=(0, 1))) == [pytest.approx((2.0, 0.8))]


def test_without_a_button_to_hold_and_with_fewer_axes_than_are_asked_for(drives) -> None:
    free = Driver("/joy", "/cmd_vel", Stick(1, 0.5, 1.0), Stick(7, 1.0, 1.0), requires_enable=False)
    assert drives(free, Joy(axes=(0.0, -1.0))) == [pytest.approx((-0.5, 0.0))]


def test_the_message_is_that_of_ros() -> None:
    joy = Joy(axes=(0.5, -1.0), buttons=(1, 0))
    assert decode_cdr(encode_cdr(joy), Joy) == joy
    assert decode_ros1(encode_ros1(joy), Joy) == joy
