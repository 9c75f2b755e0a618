"""The sizes that a plugin or controller uses, compared with those of its robot."""

from __future__ import annotations

from kbot.kinematics.differential_drive import DifferentialDrive
from kbot.text import Origin
from kbot.world.findings import Findings

NOTICEABLE = 0.005
"""Share by which a plugin's size may differ from the robot's before it is reported."""
UNEQUAL = 0.002
"""Share by which wheels may differ in radius before it is reported, as for D111 of `kbot check`."""
ABSURD = 1000.0
"""A size that is this many times too large or too small is replaced by the robot's own."""


def compared(
    what: str, given: float, true: float, origin: Origin | None, findings: Findings, note: str = ""
) -> float:
    """The size to use, in m: the given one, or the true one if the given one is absurd. A difference is
    reported. The hint gives the true size, followed by `note`."""
    hint = f"write {true:g}{note}, or compute it from the sizes that the wheels are made of"
    if not true / ABSURD <= given <= true * ABSURD:
        message = f"the {what} is {true:g} m, not {given:g} m as the drive has it: KBot uses {true:g} m"
        findings.warning("W131", message, origin, hint)
        return true
    if abs(given - true) > NOTICEABLE * true:
        findings.warning(
            "W131",
            f"the drive uses {given:g} m for the {what}, which is {true:g} m: its odometry will be"
            f" {100 * abs(given / true - 1):.0f} % off",
            origin,
            hint,
        )
    return given


def compared_radius(
    given: float,
    drive: DifferentialDrive,
    origin: Origin | None,
    findings: Findings,
    *,
    is_diameter: bool = False,
) -> float:
    """As `compared`, for a radius in m. `is_diameter` says that the description gives the diameter: the
    finding then names diameters, so that its hint can be copied. Where the wheels differ in radius, the
    finding names the radius of each, because their mean is the radius of none."""
    least, most = (of(drive.joints, key=lambda name: drive.wheels[name].radius) for of in (min, max))
    small, large = drive.wheels[least].radius, drive.wheels[most].radius
    is_absurd = not drive.radius / ABSURD <= given <= drive.radius * ABSURD
    if is_absurd or large - small <= UNEQUAL * large:
        if is_diameter:
            note = f" (twice the radius {drive.radius:g} m)"
            return compared("wheels' diameter", 2.0 * given, 2.0 * drive.radius, origin, findings, note) / 2.0
        return compared("wheels' radius", given, drive.radius, origin, findings)
    findings.warning(
        "W131",
        f"the drive uses {given:g} m for every wheel's radius, which is {small:g} m on '{least}' and"
        f" {large:g} m on '{most}': no figure is right for both",
        origin,
        "make the wheels by one macro, with one radius",
    )
    return given
