"""The rule about robots that turn by skidding: skid steers with two or more axles."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.drive.wheels import Pair
from kbot.text import Severity

_LEAST_SHORTFALL = 0.1
"""The share by which a turn falls short before it is reported; friction makes smaller shares uncertain."""


@rule("D126", "turns-short", Severity.INFO, "drive")
def turns_short(context: Context) -> Found:
    """The configured wheel separation of a skid-steer drive is less than its effective wheel separation.

    Why: Wheels in front of and behind the centre are dragged sideways in a turn, and their friction reduces
    the turn. With axles 2a apart and wheels 2b apart the robot makes b^2 / (a^2 + b^2) of a turn, while
    odometry reports the whole turn. If the wheels form a square (a = b), the robot makes half a turn. The
    formula assumes equal loads and Coulomb friction. In simulation the robot turns even less. Mecanum wheels
    that are simulated as ordinary wheels have the same drag.

    Example: `wheel_separation: 0.3756` for a robot with four wheels whose axles are 0.262 m apart.

    Fix: Set `wheel_separation_multiplier` (ros2_control) to the factor in the message, or multiply a plugin's
    wheel separation by this factor. Then measure a turn and correct the value.

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
        if made < 1.0 - _LEAST_SHORTFALL:
            yield Finding(
                size.given.origin,
                f"{controller.name}: a turn drags the wheels of {len(pairs)} axles across the ground: the "
                f"robot turns at least {(1.0 - made) * 100.0:.0f} % less than commanded",
                f"set wheel_separation_multiplier to {needed:.2f} or the separation to {needed * true:.3g} m"
                "; then measure a turn",
            )


def turn_share(axles: Sequence[float], separation: float) -> float:
    """The share of a turn, 0 to 1, that a skid steer makes when its wheels command a whole turn on the spot.

    `axles` are the x positions of the axles, and `separation` is the distance between left and right wheels,
    both in m. At this share the friction of all wheels together has no moment about the middle. All wheels
    bear the same load, and each is braked against its direction of sliding (Coulomb). For two axles it is
    b^2 / (a^2 + b^2).
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
