"""Physics settings with which wheels roll accurately, and the reasons for them.

The reasons were measured on KBot: the error of odometry, computed from the true wheel angles, against ground
truth. With these settings ten turns on the spot are off by 0.002 degrees, with MuJoCo's default contacts,
cylinder wheels and a frictionless caster by 15.6 degrees.

- Contacts are stiff, because a wheel's rolling radius is its radius minus half its penetration.
- A drive wheel touches the ground as a sphere. A thin cylinder touches it with its two edges, so its track is
  anything within its width.
- Contacts have three dimensions (condim 3). Torsional and rolling friction (condim 4 and 6) resist turning:
  they cost 13 to 23 degrees in ten turns.
"""

from __future__ import annotations

from enum import StrEnum

TIMESTEP = 0.002
"""Seconds. At 4 ms the error of a step command doubles."""

IMPRATIO = 10.0
"""Ratio of friction to normal impedance in an elliptic cone. MuJoCo's manual: values above 1 prevent slip."""
SOLREF = (0.002, 1.0)
"""Time constant in s and damping ratio of contacts: at MuJoCo's default of 0.02 s wheels sink in 0.2 mm."""
SOLIMP = (0.999, 0.9999, 0.001, 0.5, 2.0)
"""Impedance of contacts. With stiffer contacts (0.9999 at both ends) a standing robot creeps."""

SKID_SOLIMP = (0.3, 0.3, 0.001, 0.5, 2.0)
SKID_DAMPING = 3.0
SKID_IMPRATIO = 1e4
"""Impedance, damping of friction in 1/s and IMPRATIO with the tyres of skid-steer robots.

These slide in every turn. MuJoCo pushes a sliding contact up, by more the stiffer it is and the more its
friction is damped. With the contacts above a sliding tyre hops 100 times a second, its wheel slows down at
each impact, and the robot turns by down to half of what Coulomb's law gives. With these settings it stays on
the ground up to 1 rad/s, and a robot of 6 kg sinks in by 0.06 mm. With IMPRATIO it would creep down a slope
of 10 degrees by 4 mm/s, with SKID_IMPRATIO by 0.004 mm/s."""

FRICTION = 1.0
"""Default coefficient of friction, as in Gazebo."""

CASTER_FRICTION = 0.0
"""A caster rolls or swivels freely in every direction, and so does a sphere that slides without friction."""

CONTROL_PERIOD = 0.02
"""Seconds between updates of odometry, joint states and the watchdog: 50 Hz, as diff_drive_controller."""

CONTROL_RATE = 1.0 / CONTROL_PERIOD
"""The same in Hz."""

SLEW_PERIOD = 0.004
"""Seconds between updates of the twist while it follows a command. The torque of a motor that speeds up
ripples by 0.2 %, at 10 ms by 1.6 %."""

STEERING_PERIOD = 0.01
"""Seconds between updates of wheels that steer. Their servos are slower: with shorter periods they slip more
where all of them begin to steer."""

SERVO_TIME = 0.0055
"""Time constant of the speed servo in s: kv is the moved inertia divided by it. At 4.5 ms, cars
with steered wheels slip more as they begin to steer. At 7 ms, the overshoot costs 1.5 % of energy."""

BASE_SERVO_TIME = 0.007
"""The same for the servo that moves a holonomic base."""

SERVO_STIFFNESS = 30.0
"""Stiffness per damping in 1/s. It holds a robot on a slope. With SERVO_TIME, and with an inertia of the
servo that is as large as the moved one, the servo is nearly critically damped. An overshoot costs energy."""

SERVO_MARGIN = 1.3
"""Torque limit as a multiple of the torque that the tyre can hold. Without a limit a robot climbs walls."""

LINEAR_ACCELERATION = 1.0
ANGULAR_ACCELERATION = 8.0
"""Default limits in m/s^2 and rad/s^2. Without them a step command tips KBot by 4 degrees."""

WATCHDOG = 0.5
"""Seconds until a command from outside times out: the default cmd_vel_timeout of diff_drive_controller."""


class Contacts(StrEnum):
    """How shapes touch.

    `recipe`: drive wheels touch the ground as spheres, and casters slide freely. `as-written`: every shape
    touches as the description defines it.
    """

    RECIPE = "recipe"
    AS_WRITTEN = "as-written"
