"""What pages tell that which moves the robot."""

from __future__ import annotations

from kbot.workbench.driving.motion import Motion
from kbot.workbench.protocol import Action, Advance, FromPage, Push, Seek, SetJoint, SetJoints, SetLoop


def carry_out(order: FromPage, motion: Motion) -> bool:
    """Whether it was something for a motion, which is then done.

    Raises:
        KbotError: it cannot be done; the text says why.
    """
    match order:
        case SetJoint(name=name, position=position):
            motion.set_joint(name, position)
        case SetJoints(preset=preset):
            motion.set_joints(preset)
        case Push(link=link, x=x, y=y, z=z, seconds=seconds):
            motion.push(link, (x, y, z), seconds)
        case Advance(seconds=seconds):
            motion.paused = True
            while seconds > 1e-6 and (done := motion.advance(seconds)) > 0.0:
                seconds -= done  # a slow machine does it in several goes
        case Seek(at=at):
            motion.seek(at)
        case SetLoop(loop=loop):
            motion.loop = loop
        case _ if isinstance(order, Action):
            motion.act(order)
        case _:
            return False
    return True
