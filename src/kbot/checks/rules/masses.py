"""How heavy the bodies of a robot are beside each other."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.model import Joint, Robot
from kbot.text import Related, Severity

_RATIO = 1000.0


def weights_below(context: Context, only_fixed: bool = True) -> dict[str, float]:
    """Mass of each link and of what fixed joints hold to it, or of all that hangs on it, kg."""
    robot = context.robot
    masses: dict[str, float] = {}
    for link in reversed(_downwards(robot)):
        hanging = sum(masses[j.child] for j in robot.child_joints[link] if not (only_fixed and j.is_movable))
        masses[link] = _own_mass(context, link) + hanging
    return masses


def _downwards(robot: Robot) -> list[str]:
    """The links, each behind its parent."""
    links = [robot.root]
    for link in links:
        links += [j.child for j in robot.child_joints[link]]
    return links


def _own_mass(context: Context, link: str) -> float:
    inertial = context.robot.links[link].inertial
    return inertial.mass if inertial and math.isfinite(inertial.mass) else 0.0


@rule("I116", "mass-ratio", Severity.WARNING, "robot")
def mass_ratio(context: Context) -> Found:
    """Bodies on both sides of a movable joint whose masses differ by more than 1000 times.

    Why: the contact and joint solvers of Gazebo, Bullet and MuJoCo converge slowly then: joints
    stretch, the light body trembles, a heavy load hangs on a light link as on a spring.

    Example: an arm of 2000 kg on a turntable of 1 kg.

    Fix: check the units, and give the light link its real mass.

    Autofix: none.
    """
    all_below, fixed_below = weights_below(context, only_fixed=False), weights_below(context)
    top = _tops(context.robot)
    for joint in context.sure_joints:
        if not joint.is_movable or {joint.parent, joint.child} & context.unsure:
            continue
        above, below = fixed_below[top[joint.parent]], fixed_below[joint.child]
        hanging = all_below[joint.child]
        if below <= 0.0 or above <= 0.0:
            continue
        if hanging / above > _RATIO:
            yield _ratio_finding(context, joint, hanging, above, joint.child, joint.parent)
        elif above / below > _RATIO and below > 0.02:
            yield _ratio_finding(context, joint, above, below, joint.parent, joint.child)


def _ratio_finding(
    context: Context, joint: Joint, heavy: float, light: float, heavy_link: str, light_link: str
) -> Finding:
    links = context.robot.links
    related = tuple(
        Related(f"the {word} side", inertial.mass_origin)
        for word, name in (("heavy", heavy_link), ("light", light_link))
        if (inertial := links[name].inertial)
    )
    return Finding(
        joint.origin,
        f"{joint.name}: {heavy:.4g} kg at '{heavy_link}' against {light:.4g} kg at '{light_link}', "
        f"{heavy / light:.0f} times: the joint will be soft and tremble",
        "check the masses' units",
        related,
    )


def _tops(robot: Robot) -> dict[str, str]:
    """For each link the topmost one that fixed joints hold it to: together they are one rigid body."""
    tops: dict[str, str] = {}
    for link in _downwards(robot):
        joint = robot.parent_joint.get(link)
        tops[link] = link if joint is None or joint.is_movable else tops[joint.parent]
    return tops
