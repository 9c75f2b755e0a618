"""What the numbers in the attributes of URDF measure: lengths, masses or angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kbot.xacro.not_a_number import Quantity

_QUANTITIES: dict[tuple[str, str], Quantity] = {
    ("origin", "xyz"): "length", ("origin", "rpy"): "angle", ("box", "size"): "length",
    ("sphere", "radius"): "length", ("cylinder", "radius"): "length", ("cylinder", "length"): "length",
    ("capsule", "radius"): "length", ("capsule", "length"): "length", ("mass", "value"): "mass",
}  # fmt: skip
_POSITIONS = {"lower", "upper", "offset", "soft_lower_limit", "soft_upper_limit"}
"""Attributes in the unit of a joint's position."""
_OF_JOINTS: dict[str, Quantity] = {"revolute": "angle", "continuous": "angle", "prismatic": "length"}


def quantity_of(tag: str, attribute: str, joint_type: str = "") -> Quantity:
    """Return what an attribute measures, or an empty string. `joint_type` is that of the joint around it."""
    if tag in ("limit", "mimic", "safety_controller") and attribute in _POSITIONS:
        return _OF_JOINTS.get(joint_type, "")
    return _QUANTITIES.get((tag, attribute), "")
