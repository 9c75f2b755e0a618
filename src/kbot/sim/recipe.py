"""The settings of physics with which wheels roll accurately, and the reasons for them.

A wheel's rolling radius is its radius less half of what it sinks in, so contacts are stiff; a thin
cylinder stands on two edges, so a drive wheel meets the ground as a sphere; friction about the
contact's normal (condim 4 and 6) would hold back every turn.
"""

from __future__ import annotations

from enum import StrEnum

TIMESTEP = 0.002
"""Seconds; twice as much doubles the error of a step command."""

IMPRATIO = 10.0
SOLREF = (0.002, 1.0)
SOLIMP = (0.999, 0.9999, 0.001, 0.5, 2.0)
"""Stiffer ones (0.9999 throughout) creep: there is a cliff."""

FRICTION = 1.0
"""Sliding coefficient where nothing else is said, as in Gazebo."""

CASTER_FRICTION = 0.0
"""A caster rolls or swivels freely in every direction: a sphere that slides does the same."""

CONTROL_PERIOD = 0.02
"""Seconds between two updates of odometry, joint states and the watchdog."""

SLEW_PERIOD = 0.01
"""Seconds between two updates of the twist while it follows a command."""

SERVO_TIME = 0.007
"""Seconds in which the speed servo corrects an error: kv is the inertia it moves over this. Half of it
chatters against the torque limit from 0.4 m/s on."""

SERVO_STIFFNESS = 30.0
"""kp / kv in 1/s: holds a slope, and with the time above is just damped critically."""

SERVO_MARGIN = 1.3
"""Torque limit as a multiple of what the tyre can hold; without a limit a robot climbs walls."""

LINEAR_ACCELERATION = 1.0
ANGULAR_ACCELERATION = 8.0
"""m/s^2 and rad/s^2 by which commands are slewed; a step command would tip a small robot."""

WATCHDOG = 0.5
"""Seconds after which a command that came from outside is taken for lost."""


class Contacts(StrEnum):
    """`recipe`: drive wheels touch the ground as spheres, casters slide freely. `as-written`: every
    shape touches as the description has it."""

    RECIPE = "recipe"
    AS_WRITTEN = "as-written"
