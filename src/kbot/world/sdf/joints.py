"""SDF joints: the ways in which they let a link move."""

from __future__ import annotations

from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from kbot.text import Element
from kbot.text.suggest import did_you_mean
from kbot.world.joints import Freedom, Motion
from kbot.world.sdf.entries import Context
from kbot.world.sdf.frames import Frames
from kbot.world.sdf.values import Values
from kbot.world.world import FURTHEST

Array = NDArray[np.float64]

FREEDOMS = {
    "revolute": (Motion.TURN,),
    "continuous": (Motion.TURN,),
    "prismatic": (Motion.SLIDE,),
    "ball": (Motion.BALL,),
    "universal": (Motion.TURN, Motion.TURN),
    "revolute2": (Motion.TURN, Motion.TURN),
    "screw": (Motion.TURN, Motion.SLIDE),
    "gearbox": (Motion.TURN,),
    "fixed": (),
}
ENDLESS = 1e15
"""Rad or m from which on a limit is none, as SDF's own default of 1e16 is."""


class Joints:
    """Reads the freedoms of joints. Directions are along the model's axes."""

    def __init__(self, values: Values) -> None:
        self._values = values

    def kind(self, joint: Element) -> str:
        """The joint's type; `fixed`, with a finding, where it is none that SDF knows."""
        kind = joint.attributes.get("type", "")
        if kind in FREEDOMS:
            return kind
        hint = did_you_mean(kind, FREEDOMS) or f"one of {', '.join(FREEDOMS)}"
        what = f"the type '{kind}'" if kind else "no type"
        name = joint.attributes.get("name", "")
        self._values.findings.error("W205", f"joint '{name}' has {what}", joint.origin, hint)
        return "fixed"

    def freedoms(self, joint: Element, frames: Frames, context: Context) -> tuple[Freedom, ...]:
        """How the child moves, the first way nearest to the parent."""
        kind = self.kind(joint)
        if kind == "gearbox":
            self._values.unsupported(joint, "a gearbox joint turns freely: its ratio is not simulated")
        motions = FREEDOMS[kind]
        tags = ("axis", "axis2") if kind in ("universal", "revolute2") else ("axis",) * len(motions)
        made = []
        for motion, tag in zip(motions, tags, strict=True):
            if motion is Motion.BALL:
                made.append(Freedom(motion, damping=self._damping(joint.find("axis"))))
            else:
                axis = self._axis(joint, tag)
                bounded = kind != "continuous" and not (kind == "screw" and motion is Motion.SLIDE)
                made.append(self._about(axis, motion, bounded, joint, frames, context))
        return tuple(made)

    def _axis(self, joint: Element, tag: str) -> Element | None:
        axis = joint.find(tag)
        if axis is None:
            message = f"joint '{joint.attributes.get('name', '')}' has no <{tag}>"
            self._values.findings.warning("W205", message, joint.origin, "z is taken")
        return axis

    def lead(self, joint: Element) -> float | None:
        """m/rad that a screw goes forward; None for other joints."""
        if joint.attributes.get("type") != "screw":
            return None
        if joint.find("screw_thread_pitch") is not None:
            return self._values.number(joint, "screw_thread_pitch", 1.0) / (2.0 * pi)
        # of old Gazebo, in rad/m and of the other sense
        pitch = self._values.number(joint, "thread_pitch", 1.0)
        return -1.0 / pitch if pitch else 0.0

    def _about(
        self,
        axis: Element | None,
        motion: Motion,
        bounded: bool,
        joint: Element,
        frames: Frames,
        context: Context,
    ) -> Freedom:
        x, y, z = self._direction(axis, joint, frames, context).tolist()
        limit = axis.find("limit") if axis is not None else None
        lower, upper = self._limits(limit) if bounded else (-inf, inf)
        dynamics = axis.find("dynamics") if axis is not None else None
        return Freedom(
            motion,
            (x, y, z),
            lower,
            upper,
            self._damping(axis),
            max(self._values.number(dynamics, "friction", 0.0), 0.0),
            max(self._values.number(dynamics, "spring_stiffness", 0.0), 0.0),
            self._values.number(dynamics, "spring_reference", 0.0),
        )

    def _damping(self, axis: Element | None) -> float:
        dynamics = axis.find("dynamics") if axis is not None else None
        return max(self._values.number(dynamics, "damping", 0.0), 0.0)

    def _limits(self, limit: Element | None) -> tuple[float, float]:
        lower = self._limit(limit, "lower", -inf)
        upper = self._limit(limit, "upper", inf)
        if limit is not None and lower > upper:
            message = f"a joint's lower limit {lower:g} is above its upper {upper:g}"
            self._values.findings.error("W204", message, limit.origin, "exchange them")
            return -inf, inf
        return (-inf if lower < -ENDLESS else lower), (inf if upper > ENDLESS else upper)

    def _limit(self, limit: Element | None, tag: str, default: float) -> float:
        written = limit.find(tag) if limit is not None else None
        if written is not None and written.text.strip().lower().lstrip("+-") in ("inf", "infinity"):
            return -inf if written.text.strip().startswith("-") else inf
        return self._values.number(limit, tag, default)

    def _direction(self, axis: Element | None, joint: Element, frames: Frames, context: Context) -> Array:
        """Unit vector (3,) along the model's axes."""
        written = axis.find("xyz") if axis is not None else None
        values = self._values.numbers(written, 3, FURTHEST) if written is not None else (0.0, 0.0, 1.0)
        vector = np.array(values or (0.0, 0.0, 1.0))
        length = float(np.linalg.norm(vector))
        if not length > 0.0:
            place = written or joint
            self._values.findings.error("W204", "a joint's axis is no direction: 0 0 0", place.origin)
            return np.array([0.0, 0.0, 1.0])
        frame = written.attributes.get("expressed_in", "") if written is not None else ""
        # before SDF 1.5 an axis was the model's; 1.5 and 1.6 have a flag for it
        old = axis is not None and self._values.truth(
            axis, "use_parent_model_frame", context.version < (1, 5)
        )
        if not frame:
            frame = frames.root if old else frames.key(joint)
        turned: Array = frames.pose(frame, written or joint).rotation @ vector / length
        return turned
