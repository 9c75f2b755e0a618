"""The finding W308: a policy commands higher speeds than its robot reaches."""

from __future__ import annotations

from kbot.text import Diagnostic, Severity

Speeds = tuple[float, float, float]
"""Forward and to the left in m/s, and turning in rad/s."""
_ROUNDED = 1.01
"""A policy whose highest speed is above that of the robot by less was trained for this robot."""


def speed_finding(commanded: Speeds, robot: str, reached: Speeds) -> Diagnostic | None:
    """W308 if a policy's highest speeds exceed those of the robot with this name, else None."""
    for wanted, fastest, unit in zip(commanded, reached, ("m/s", "m/s", "rad/s"), strict=True):
        if wanted > _ROUNDED * fastest:
            message = (
                f"the policy commands up to {wanted:.3g} {unit}, but robot '{robot}' only reaches"
                f" {fastest:.3g} {unit}"
            )
            hint = "use a policy that was trained with the limits of this robot"
            return Diagnostic("W308", Severity.INFO, message, None, hint)
    return None
