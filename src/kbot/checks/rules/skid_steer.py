"""The rule about robots that turn by skidding: skid steers with two or more axles."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.drive.wheels import Pair
from kbot.text import Severity

_WORTH_TELLING = 0.1
"""Share of a turn that is missing from which on it is told; what is within it, friction blurs."""


@rule("D126", "turns-short", Severity.INFO, "drive")
def turns_short(context: Context) -> Found:
    """A skid steer whose drive is told the distance between its wheels, not the wider one that it turns by.

    Why: wheels before and behind the middle are dragged sideways in a turn, and friction holds it back: of
    axles 2a and wheels 2b apart it makes b^2 / (a^2 + b^2) of a turn, half of it where the wheels stand in a
    square, and odometry tells the whole. The figure is for wheels that bear the same and slide by Coulomb's
    law; in simulation more is missing. Mecanum wheels that are simulated as plain ones drag alike.

    Example: `wheel_separation: 0.3756` for a robot of four wheels, its axles 0.262 m apart.

    Fix: set `wheel_separation_multiplier` (ros2_control), or a plugin's wheel separation times that; then
    measure a turn and correct it.

    Autofix: none.
    """
    for controller in context.declared_drives:
        named = {joint.text for joint in (*controller.left, *controller.right)}
        pairs = [p for p in context.base.pairs if {p.left.joint.name, p.right.joint.name} <= named]
        wheels = {w.link for p in pairs for w in p.wheels}
        size = controller.separation
        if len(pairs) < 2 or context.unsure & wheels or size is None:
            continue
        true = pairs[0].separation
        if not (size.value > 0.0 and true > 0.0):
            continue
        needed = 1.0 / turn_share([_place(pair) for pair in pairs], true)
        made = size.value / true / needed
        if made < 1.0 - _WORTH_TELLING:
            yield Finding(
                size.given.origin,
                f"{controller.name}: a turn drags the wheels of {len(pairs)} axles across the ground: the "
                f"robot turns at least {(1.0 - made) * 100.0:.0f} % less than commanded",
                f"set wheel_separation_multiplier to {needed:.2f} or the separation to {needed * true:.3g} m"
                "; then measure a turn",
            )


def turn_share(axles: Sequence[float], separation: float) -> float:
    """What a skid steer that turns in place makes of its wheels' turn, 0 to 1; `axles` are their places
    along x and `separation` the distance of left and right wheels, m.

    The turn at which friction on all wheels, equal in load, of one coefficient and against the way that each
    slides (Coulomb), has no moment about the middle. For two axles it is b^2 / (a^2 + b^2).
    """
    middle, half = sum(axles) / len(axles), separation / 2.0
    offsets = [x - middle for x in axles]

    def moment(share: float) -> float:
        drive, total = half * (1.0 - share), 0.0
        for offset in offsets:
            across = offset * share
            total += (half * drive - offset * across) / max(hypot(drive, across), 1e-12)
        return total

    low, high = 0.0, 1.0
    for _ in range(50):
        between = (low + high) / 2.0
        low, high = (between, high) if moment(between) > 0.0 else (low, between)
    return (low + high) / 2.0


def _place(pair: Pair) -> float:
    return float(pair.left.center[0] + pair.right.center[0]) / 2.0
