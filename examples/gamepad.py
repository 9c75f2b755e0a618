"""Drive a robot with a gamepad on Linux. It works with a running KBot, with ROS 1 and with ROS 2.

kbot sim kbot                              in one terminal
python gamepad.py                          in another
python gamepad.py _device:=/dev/input/js1  for the second gamepad

The page reads gamepads too, on every system. This program shows how to read any device of your own.
"""

import os
import struct
import sys

import kbot
from kbot.messages import Twist, Vector3

AXIS_EVENT = 2
LEFT_STICK_X, LEFT_STICK_Y = 0, 1  # numbers of the axes
FASTEST, TURN = 0.5, 2.0  # m/s and rad/s with the stick at its end
EVENT = struct.Struct("IhBB")  # time in ms, value from -32767 to 32767, kind, number: see linux/joystick.h


def main() -> None:
    node = kbot.Node("gamepad")
    device = os.open(node.param("device", "/dev/input/js0"), os.O_RDONLY | os.O_NONBLOCK)
    stick = {LEFT_STICK_X: 0.0, LEFT_STICK_Y: 0.0}

    def send() -> None:
        try:
            while event := os.read(device, EVENT.size):
                _, value, kind, number = EVENT.unpack(event)
                if kind & AXIS_EVENT and number in stick:
                    stick[number] = -value / 32767  # to the front and to the left is positive
        except BlockingIOError:
            pass  # no more events
        forward, turn = FASTEST * stick[LEFT_STICK_Y], TURN * stick[LEFT_STICK_X]
        node.publish("cmd_vel", Twist(Vector3(forward), Vector3(0.0, 0.0, turn)))

    node.every(0.05, send)  # more often than KBot's timeout of 0.5 s
    node.spin()


try:
    main()
except (kbot.KbotError, OSError) as error:  # no KBot is running, or there is no gamepad
    print(f"error: {error}", file=sys.stderr)
    sys.exit(2)
