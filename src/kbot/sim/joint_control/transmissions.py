"""The `<transmission>`s of ros_control: which interfaces they give controllers to a joint."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

from kbot.model import Robot
from kbot.sim.joint_control.kinds import Interface
from kbot.text import Element
from kbot.text.numbers import to_float
from kbot.world.findings import Findings

_INTERFACES = {f"{interface.capitalize()}JointInterface": interface for interface in Interface}


def joint_interfaces(robot: Robot, findings: Findings) -> Mapping[str, frozenset[Interface]]:
    """By joint, what a controller may command of it.

    Commands, states and limits are the joint's, on the far side of the gear, as in ROS: whatever
    `<mechanicalReduction>` a transmission has, the joint goes where it is told. One that is no number, or
    0, is none, and its joints cannot be commanded (transmission_interface::SimpleTransmission).
    """
    found: dict[str, frozenset[Interface]] = {}
    for transmission in robot.extensions:
        if transmission.tag != "transmission" or not _has_gear(transmission, findings):
            continue
        for joint in transmission.elements("joint"):
            name = joint.attributes.get("name", "")
            found[name] = found.get(name, frozenset()) | set(_interfaces(joint, transmission))
    return found


def _interfaces(joint: Element, transmission: Element) -> Iterator[Interface]:
    """Those of the joint; of its actuators in descriptions from before Indigo."""
    for holder in (joint, *transmission.elements("actuator")):
        written = [element.text.strip() for element in holder.elements("hardwareInterface")]
        known = [i for word in written if (i := _INTERFACES.get(word.rpartition("/")[2]))]
        if known:
            yield from known
            return


def _has_gear(transmission: Element, findings: Findings) -> bool:
    for element in transmission.descendants():
        if element.tag != "mechanicalReduction":
            continue
        try:
            reduction = to_float(element.text)
        except ValueError:
            reduction = 0.0
        if not isfinite(reduction) or reduction == 0.0:
            what = f"a reduction is a number other than 0, not '{element.text.strip()}'"
            findings.warning("W130", what, element.origin, "the transmission is left out")
            return False
    return True
