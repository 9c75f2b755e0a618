"""What the numbers in the attributes of URDF measure: lengths, masses or angles."""

from __future__ import annotations

from kbot.xacro.not_a_number import ANGLE, LENGTH, MASS

_QUANTITIES = {
    ("origin", "xyz"): LENGTH, ("origin", "rpy"): ANGLE, ("box", "size"): LENGTH,
    ("sphere", "radius"): LENGTH, ("cylinder", "radius"): LENGTH, ("cylinder", "length"): LENGTH,
    ("capsule", "radius"): LENGTH, ("capsule", "length"): LENGTH, ("mass", "value"): MASS,
}  # fmt: skip
_POSITIONS = {"lower", "upper", "offset", "soft_lower_limit", "soft_upper_limit"}
"""Attributes in the unit of a joint's position."""
_OF_JOINTS = {"revolute": ANGLE, "continuous": ANGLE, "prismatic": LENGTH}


def quantity_of(tag: str, attribute: str, joint_type: str = "") -> str:
    """Return what an attribute measures, or an empty string. `joint_type` is that of the joint around it."""
    if tag in ("limit", "mimic", "safety_controller") and attribute in _POSITIONS:
        return _OF_JOINTS.get(joint_type, "")
    return _QUANTITIES.get((tag, attribute), "")
