"""The quantities of a run at one time, such as `x`, `tilt` and `distance`.

They are the columns of a trace. A step of a scenario may wait for one (`when: {distance: {min: 1.0}}`).
"""

from __future__ import annotations

from dataclasses import dataclass

from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value that a run has at any time. `unit` is empty for a count."""

    name: str
    unit: str
    description: str


_ALL = (
    Quantity("time", "s", "simulated time since the start"),
    Quantity("x", "m", "true position of the base in the world"),
    Quantity("y", "m", "true position of the base in the world"),
    Quantity("z", "m", "true height of the base's origin in the world"),
    Quantity("yaw", "rad", "true heading of the base in the world, counting full turns"),
    Quantity("roll", "rad", "true roll of the base"),
    Quantity("pitch", "rad", "true pitch of the base, positive when its front is low"),
    Quantity("tilt", "rad", "angle between the base's z axis and the vertical"),
    Quantity("forward", "m", "displacement since the start, along the heading at the start"),
    Quantity("left", "m", "displacement since the start, to the left of the heading at the start"),
    Quantity("turn", "rad", "change of the heading since the start, counting full turns"),
    Quantity("up", "m", "rise of the base's origin since the start"),
    Quantity("distance", "m", "length of the true path"),
    Quantity("speed", "m/s", "true speed of the base over the ground"),
    Quantity("turn_rate", "rad/s", "true turning speed of the base"),
    Quantity("odometry_x", "m", "position in the world by odometry"),
    Quantity("odometry_y", "m", "position in the world by odometry"),
    Quantity("odometry_yaw", "rad", "heading in the world by odometry"),
    Quantity("odometry_error", "m", "distance between the true position and that of odometry"),
    Quantity("command_linear", "m/s", "commanded speed forwards"),
    Quantity("command_lateral", "m/s", "commanded speed to the left"),
    Quantity("command_angular", "rad/s", "commanded turning speed"),
    Quantity("effort", "N m", "largest effort of a driving joint"),
    Quantity("energy", "J", "mechanical work of the driving joints, without what braking returns"),
    Quantity("touched", "", "number of objects and other robots touched so far"),
    Quantity("clearance", "m", "distance to the nearest object other than the ground, at most 10 m"),
    Quantity("goals_reached", "", "number of goals reached so far"),
)
QUANTITIES = {quantity.name: quantity for quantity in _ALL}


def require_quantity(name: str) -> Quantity:
    """The quantity of a name. Raises KbotError for an unknown name, with the nearest ones."""
    if name not in QUANTITIES:
        raise KbotError(f"unknown quantity '{name}': {suggest_or_list(name, QUANTITIES)}")
    return QUANTITIES[name]
