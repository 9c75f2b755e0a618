"""Whether a simulated robot has fallen over."""

from __future__ import annotations

import math

from kbot.sim import Simulation
from kbot.sim.motion_watch import UPRIGHT


def describe_fall(simulation: Simulation) -> str:
    """How the robot lies if it has fallen over, and what to do; empty for a robot on its wheels."""
    pose = simulation.link_pose(simulation.robot.root)
    up = float(pose.rotation[2, 2])
    if up >= UPRIGHT:
        return ""
    roll, pitch, _ = (round(math.degrees(angle)) for angle in pose.rpy)
    where = "back" if up < -UPRIGHT else "side"
    return (
        f"the robot lies on its {where} (roll {roll}°, pitch {pitch}°): reset the simulation, or place the "
        "robot upright, for example with a pose estimate"
    )
