"""Rules about the motors of wheels: whether they can turn the wheels and move the robot."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.bodies import total_mass
from kbot.kinematics.drive.drive import SteeredDrive
from kbot.kinematics.spatial import GRAVITY
from kbot.model import JointType, Mesh
from kbot.text import Related, Severity

_RADIUS = 0.05
"""m: the radius of a wheel whose size is not known."""
_SLOPE = math.radians(5.0)
"""A little steeper than a ramp for wheelchairs (1:12, 4.8 degrees)."""


@rule("D117", "wheel-cannot-turn", Severity.WARNING, "drive")
def wheel_cannot_turn(context: Context) -> Found:
    """The joint of a drive wheel is fixed or prismatic, or has limits.

    Why: The robot drives only until the wheel reaches its stop, for example after 0.31 m with a wheel of
    radius 5 cm and one full turn. On a fixed or prismatic joint the wheel does not turn.

    Example: `<joint name="left_wheel_joint" type="revolute"> … <limit lower="-3.14" upper="3.14" …/>`

    Fix: Set `type="continuous"`.

    Autofix: none.
    """
    named = _driven(context)
    for pair in context.level_pairs:
        driven = any(w.joint.name in named for w in pair.wheels)
        turning = [w for w in pair.wheels if w.joint.type is JointType.CONTINUOUS]
        for wheel in pair.wheels:
            joint = wheel.joint
            if joint.type is JointType.FIXED and (driven or turning):
                yield Finding(
                    joint.origin, f"{joint.name}: a drive wheel on a fixed joint does not turn", _HINT
                )
            elif joint.type is JointType.PRISMATIC:
                message = f"{joint.name}: a drive wheel on a prismatic joint slides and does not turn"
                yield Finding(joint.origin, message, _HINT)
            elif joint.type is JointType.REVOLUTE and joint.limit:
                low, high = joint.range
                if high - low < 1e4:  # rad; a larger range is written to mean no limit
                    way = (high - low) * wheel.radius
                    yield Finding(
                        joint.origin,
                        f"{joint.name}: a drive wheel with limits {low:.4g}..{high:.4g} rad stops "
                        f"after {way:.3g} m",
                        _HINT,
                        (Related("the limits", joint.limit.origin),),
                    )


_HINT = 'type="continuous"'


def _driven(context: Context) -> set[str]:
    return {joint.text for c in context.declared_drives for joint in (*c.left, *c.right)}


@rule("D119", "wheel-effort-small", Severity.WARNING, "drive")
def wheel_effort_small(context: Context) -> Found:
    """The effort limits of all wheel joints together cannot hold the robot on a slope of 5 degrees.

    Why: The required torque is mass x g x sin(slope) x radius. With less the robot cannot climb a ramp or a
    door sill, and on flat ground it follows its commands late.

    Example: 20 kg on wheels of 5 cm need 0.85 N m. Two wheels with `effort="0.1"` have 0.2 N m.

    Fix: Write the motors' torque, or the robot's real mass.

    Autofix: none.
    """
    wheels = [w for pair in context.level_pairs for w in pair.wheels]
    limits = [w.joint.limit for w in wheels if w.joint.limit is not None]
    efforts = [limit.effort for limit in limits if limit.effort and limit.effort > 0.0]  # else no limit
    radii = [w.radius for w in wheels if w.radius]
    mass = total_mass(context.robot)
    if not wheels or len(efforts) < len(wheels) or not radii:
        return
    needed = mass * GRAVITY * math.sin(_SLOPE) * max(radii)
    if sum(efforts) < needed:
        limit = wheels[0].joint.limit
        slope = math.degrees(math.asin(min(1.0, sum(efforts) / (mass * GRAVITY * max(radii)))))
        yield Finding(
            limit.origin if limit else wheels[0].joint.origin,
            f"{len(wheels)} wheels with {sum(efforts):.3g} N m together hold {mass:.4g} kg on a slope of at "
            f"most {slope:.2g} degrees; 5 degrees need {needed:.3g} N m",
            "write the motors' torque",
        )


@rule("D120", "wheel-mesh-collision", Severity.INFO, "drive")
def wheel_mesh_collision(context: Context) -> Found:
    """The collision shape of a drive wheel is a mesh.

    Why: The rim of a mesh is a polygon, not a circle. The wheel rumbles from edge to edge, and its rolling
    radius changes with its angle. Each contact takes as much time as a hundred contacts of primitive shapes.

    Example: `<collision> <geometry> <mesh filename="…/wheel.stl"/>`

    Fix: Use a cylinder or a sphere of the wheel's radius. The visual can stay a mesh.

    Autofix: none.
    """
    for pair in context.level_pairs:
        for wheel in pair.wheels:
            for collision in context.robot.links[wheel.link].collisions:
                if isinstance(collision.geometry, Mesh):
                    yield Finding(
                        collision.geometry.origin,
                        f"{wheel.link}: its collision shape is a mesh, so the wheel does not roll smoothly",
                        "use a cylinder of the wheel's radius",
                    )
                    break


def _motor(load: float, radius: float) -> str:
    """The `<limit>` of a motor that just makes its wheel slip under a load in kg, up to 1 m/s."""
    radius = radius or _RADIUS
    return f'<limit effort="{load * GRAVITY * radius:.2g}" velocity="{1.0 / radius:.2g}"/>'


@rule("D125", "wheel-undriven", Severity.INFO, "drive")
def wheel_undriven(context: Context) -> Found:
    """No plugin, controller or transmission drives a drive wheel, and its joint has no effort or velocity
    limit.

    Why: The wheel moves in rviz. In a simulator nothing turns it, or a motor with unbounded torque does. Such
    a motor reaches any speed within one step, and the wheel slips or the robot tips.

    Example: `<joint name="left_wheel_joint" type="continuous">` without `<limit>` in a description without
    plugins.

    Fix: Add `<limit effort="…" velocity="…"/>` and `<dynamics damping="…"/>`, and a drive plugin or
    ros2_control.

    Autofix: unsafe: KBot inserts a `<limit>`: the effort at which the wheel starts to slip, and the velocity
    at 1 m/s.
    """
    if isinstance(context.drive, SteeredDrive):
        return  # its plugins name the joints in other ways, and wheels that only roll need no motor
    driven = _driven(context)
    for extension in context.robot.extensions:
        for element in (extension, *extension.descendants()):
            if element.tag == "joint" and "name" in element.attributes:
                driven.add(element.attributes["name"])
            if "oint" in element.tag and element.text.strip():
                driven.add(element.text.strip())
    for pair in context.level_pairs:
        for wheel in pair.wheels:
            joint = wheel.joint
            if joint.name in driven or joint.limit is not None or joint.type is not JointType.CONTINUOUS:
                continue
            limit = _motor(total_mass(context.robot) / len(context.base.wheels), wheel.radius)
            lacks = "no effort or velocity limit" + (
                ", no damping or friction" if joint.dynamics is None else ""
            )
            yield Finding(
                joint.origin,
                f"{joint.name}: no plugin, controller or transmission drives it, and it has {lacks}",
                f"add a motor's limits, for example {limit}, and a drive plugin or ros2_control",
                fix=context.insert_into(joint.origin, limit, f"insert {limit}", safe=False),
            )
