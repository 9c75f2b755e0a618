"""Causes of what `MotionWatch` observed. Each is compared with the size of the observation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees, hypot, inf, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import HolonomicDrive, SteeredDrive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.drive.wheels import movable_above
from kbot.kinematics.spatial import GRAVITY
from kbot.model import JointType
from kbot.sim.cause import LEAST_SHARE, Cause, percent, unknown
from kbot.sim.command_watch import Miss
from kbot.sim.drive.twist_controller import Twist
from kbot.sim.engine.base_servo import traction
from kbot.sim.engine.contacts import SPRING
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.joints import rest
from kbot.sim.limit_causes import LimitCauses
from kbot.sim.motion_watch import Excess, Explanation, OdometryError, Standstill, Weakness
from kbot.sim.recipe import FRICTION
from kbot.sim.robot import SimulatedRobot
from kbot.sim.statics import angle_between, grip, ground_below, mass_of, tipping
from kbot.text import Diagnostic, Origin, Related, Severity

_SUDDEN = 2.0
"""Factor by which a load that begins suddenly exceeds one that grows slowly: the dynamic factor of a beam."""
_LEAST_TURN, _MOST_TURN = 0.2, 1.1
"""The least and the most that a base with several axles turns, as a share of what its wheels indicate: as in
the batteries (SLIPPING_TURN)."""
_WEAK_PUSH = 0.25
"""Share of the mean push of two driving wheels below which one hardly drives. The load of a wheel is this
small if the centre of mass is 3/8 of the wheel separation beside the middle."""
_IN_TURN = 0.1
"""Turn in rad from which a motion is one with turns. As a share of a smaller turn, an error of the heading
means little."""
_STEERS = 1.0
"""Seconds within which the wheels of a base have steered into a new direction: at 2 rad/s a quarter turn
takes 0.8 s."""
_GIVES_WAY = radians(6.0)
"""Angle in rad by which a suspension without a spring gives way at least."""
_SIDES = ("D107", "D108", "D109")
_SIZES = ("D106", "D105")
_UNLOADS = ("D112", "D128", "D116", "D115")
"""Faults because of which a driving wheel has too little load, or another part rests on the ground."""
_WEAK = ("D119", "D117")
_TIPS = ("D115", "D116", "D112", "G106")
_BELOW = ("D112", "G106", "D128")
"""Faults because of which a part is below the floor."""


class MotionCauses:
    """The causes of observations about a robot.

    A cause is named only if it explains at least `LEAST_SHARE` of an observation. Otherwise the cause is
    unknown. Forces and joint positions are those at the time of the call.
    """

    def __init__(self, engine: Engine, robot: SimulatedRobot) -> None:
        self._engine, self._robot, self._model = engine, robot, robot.robot
        self._limits = LimitCauses(engine, robot)
        self._drive, self._settings = self._limits.drive, self._limits.settings
        self._steering = self._drive.steering if isinstance(self._drive, SteeredDrive) else ()
        self._half = self._drive.separation / 2.0

    # observations

    def of_odometry_error(self, seen: OdometryError) -> Cause:
        """Sizes, sides and axes explain what is left without the slip. Slip has another cause."""
        if seen.slip <= (1.0 - LEAST_SHARE) * seen.total:
            return (
                self._drive_fault(self._size_codes(seen))
                or self._fault(("D111",))
                or self._assumes_slip(seen)
                or unknown()
            )
        share, in_turn = seen.share * seen.slip / seen.total, seen.odometry_rotation > _IN_TURN
        if in_turn and _is_of_heading(seen, 0.0):
            share = abs(seen.heading_error) / seen.odometry_rotation
        return (
            self._from_outside(seen.explanation)
            or self._slipping_tracks(seen)
            or self._skids(seen)
            or self._why_slips(share, in_turn=in_turn)
        )

    def of_standstill(self, seen: Standstill, weakness: Weakness | None) -> Cause:
        missing = 1.0 - seen.share
        if outside := self._from_outside(seen.explanation):
            return outside
        if seen.is_limited:
            return self._limits.of_standstill(seen)
        if seen.wheels_turn or not self._drive.joints:
            return self._why_slips(missing, in_turn=False)
        return (
            self._limits.of_resistance(weakness)
            or self._weak_motor_for(missing)
            or unknown("its wheels do not turn", "check what blocks the wheels")
        )

    def of_excess(self, seen: Excess) -> Cause:
        return self._limits.of_excess(seen)

    def of_weakness(self, seen: Weakness) -> Cause:
        if found := self._from_outside(seen.explanation) or self._limits.of_resistance(seen):
            return found
        able = self._limits.motor_acceleration()
        if self._uphill >= LEAST_SHARE * able:
            return self._on_slope()
        weak = self._fault(_WEAK) if able < self._limits.acceleration else None
        return weak or self._limits.of_motor(seen.joint)

    def of_miss(self, seen: Miss) -> Cause:
        """The wheels do not turn as commanded, or their sizes are wrong, or they slip: these three parts add
        up to what is missing."""
        limits = self._limits.of_miss(seen)
        if limits is not None and seen.share < 1.0:
            return limits
        least, found = LEAST_SHARE * abs(1.0 - seen.share), None
        if abs(seen.odometry - seen.rolled) >= least:
            found = self._drive_fault((*_SIDES, *_SIZES)) or self._fault(("D111",))
        if found is None and self._rolls_aside(seen):
            found = self._drive_fault(("D132",))
        if found is not None:
            return found
        if abs(1.0 - seen.odometry) >= least:
            return self._why_slow(seen)
        if seen.is_turn and len(self._drive.left) > 1:
            return self._skid(seen.odometry / seen.share if seen.share > 0.0 else inf)
        return self._why_slips(abs(seen.rolled - seen.share), in_turn=seen.is_turn)

    def of_fall(self, twist: Twist, explanation: Explanation) -> Cause:
        """What tipped a robot that was commanded to move at `twist`: its start, its curve or the slope takes
        more than the acceleration at which it tips. A load that begins suddenly tips it with half of that."""
        if outside := self._from_outside(explanation):
            return outside
        (x, y, yaw), (tips, off) = twist, tipping(self._robot)
        start, turn = self._limits.acceleration + self._uphill, abs(x * yaw) + yaw * yaw * off
        if tips <= _SUDDEN * start:
            text = f"it tips over at {max(tips, 0.0):.2g} m/s^2, and starts with up to {start:.2g} m/s^2"
            hint = "lower the heavy parts, or start slowly"
            return self._fault(_TIPS) or Cause(text, self._heaviest, hint)
        if tips <= _SUDDEN * turn:
            text = f"it tips over at {tips:.2g} m/s^2, and its turn at {abs(yaw):.3g} rad/s takes"
            return Cause(f"{text} {turn:.2g} m/s^2", None, "turn more slowly")
        return self._heavy_wheel(tips) or Cause(
            f"the cause is not known; it was commanded to drive at {hypot(x, y):.3g} m/s and to turn at"
            f" {abs(yaw):.3g} rad/s"
        )

    def of_loss(self, since: float | None, off_ground: Diagnostic | None) -> Cause:
        """Why the robot fell out of the world.

        `since` is when it left the ground in s, or None if it never touched it. `off_ground` is the finding
        about its start without ground, if it started there.
        """
        if not any(link.collisions for link in self._model.links.values()):
            return Cause("no link has a <collision>", self._model.origin, "add <collision> to the links")
        if since is not None:
            text = f"it left the ground at {since:.1f} s and has touched nothing since"
            return Cause(text, is_fault=False)
        if off_ground is not None:
            return Cause(f"{off_ground.message} ({off_ground.code})", off_ground.origin, is_fault=False)
        return Cause("there is no ground below the place where it was put", is_fault=False)

    def of_depth(self, link: str, depth: float) -> Cause:
        """Why a link reaches below the floor by `depth` (m)."""
        found = self._fault(_BELOW, link)
        if found is None and not self._model.links[link].collisions:
            hint = "add a <collision>, or move the link up"
            return Cause("it has no <collision>", self._model.links[link].origin, hint)
        return found or self._soft_contact(link, depth) or unknown()

    def of_sag(self, name: str, load: float) -> Cause | None:
        """Why a held joint sags under a load in N m or N, or None if its effort limit is not the reason."""
        joint = self._model.joints[name]
        most = joint.effort_limit
        if load <= most or joint.limit is None:
            return None
        unit = "N" if joint.type is JointType.PRISMATIC else "N m"
        text = (
            f"its effort limit is {most:.3g} {unit}, but its load is {load:.3g} {unit}, {load / most:.3g}"
            " times as much"
        )
        return Cause(text, joint.limit.origin, f"write at least {load:.3g}, or the real masses")

    # what acts from outside

    def _from_outside(self, seen: Explanation) -> Cause | None:
        """What acted on the robot from outside, which explains an observation by itself."""
        if seen.touched:
            return Cause(f"it touched '{seen.touched}' at {seen.touched_at:.1f} s", is_fault=False)
        if seen.disturbance:
            return Cause(f"{seen.disturbance} acted on it", is_fault=False)
        if seen.flight is not None:
            return Cause(f"it was in the air from {seen.flight:.1f} s on", is_fault=False)
        return Cause("it is attached to something", is_fault=False) if self.is_attached else None

    @property
    def is_attached(self) -> bool:
        """Whether an attachment pulls or holds the robot."""
        own = self._robot.body.prefix
        welds = self._engine.assembly.welds
        return any(body.startswith(own) for weld in welds for body in (weld.first, weld.second))

    @property
    def _slope(self) -> float:
        """Angle in rad between the ground on which the robot rests and the plane across gravity."""
        gravity = self._engine.model.opt.gravity
        pull = float(np.linalg.norm(gravity))
        if self._engine.has_failed or self._robot.body.root_qpos < 0 or not pull:
            return 0.0
        _, normal = ground_below(*self._engine.current(), self._robot)
        return angle_between(normal, -gravity / pull)

    @property
    def _uphill(self) -> float:
        """The acceleration in m/s^2 that the slope takes."""
        return GRAVITY * sin(self._slope)

    def _on_slope(self) -> Cause:
        text = f"the ground is not level: it rises by {degrees(self._slope):.0f} degrees"
        return Cause(text, is_fault=False)

    # slip

    def _why_slips(self, share: float, *, in_turn: bool) -> Cause:
        """Why the wheels slip by a share of what they drive: they push too little, or something drags.

        The forces give the acceleration that the tyres can cause, which is compared with the one that the
        drive's controller asks for, and how much the tyres creep.
        """
        least = LEAST_SHARE * share
        what = "the wheels slip" if self._drive.joints else "something holds it"
        no_cause = unknown(what, "check the load on the wheels and their friction")
        if self._engine.has_failed:
            return no_cause
        now = grip(*self._engine.current(), self._robot, in_turn=in_turn)
        needed, uphill = self._limits.acceleration, self._uphill
        missing = now.missing(needed)
        is_held = missing >= least and now.drag >= LEAST_SHARE * now.push
        if now.parts and (is_held or now.creep(now.drag) >= least):
            return self._dragging_part(now.parts[0])
        weak = min(now.pushes, key=now.pushes.__getitem__, default="")
        # of two wheels, each drives one side of the robot
        is_weak = bool(weak) and len(now.pushes) <= 2 and now.pushes[weak] < _WEAK_PUSH
        found = None
        if is_weak or missing >= least:
            found = self._slippery_wheel() or self._fault(_UNLOADS)
        if found is None and missing < least <= max(now.missing(needed + uphill), now.creep(uphill)):
            return self._on_slope()
        found = found or self._askew_wheel(least) or self._loose_suspension(least)
        if found is None and is_weak:
            push = percent(now.pushes[weak])
            text = f"the wheel '{weak}' can push with {push} of the mean of the driving wheels"
            return Cause(text, is_fault=False)
        return found or no_cause

    def _slipping_tracks(self, seen: OdometryError) -> Cause | None:
        """The slip of tracks in a turn, which odometry of gz's TrackedVehicle does not take into account."""
        drive, controller = self._drive, self._limits.controller
        if not isinstance(drive, HolonomicDrive) or drive.efficiency == 1.0 or controller is None:
            return None
        turned = (1.0 - drive.efficiency) * seen.odometry_rotation
        if not _is_of_heading(seen, self._half) or abs(turned) < LEAST_SHARE * abs(seen.heading_error):
            return None
        given = controller.first("steering_efficiency")
        text = (
            f"{controller.name} turns the tracks {1.0 / drive.efficiency:.3g} times as fast as without slip"
            f" (steering_efficiency {drive.efficiency:g}), and its odometry counts the slip as motion"
        )
        hint = "use another source of the heading, such as an IMU"
        return Cause(text, controller.origin if given is None else given.origin, hint, is_fault=False)

    def _skids(self, seen: OdometryError) -> Cause | None:
        """Several axles, whose wheels are dragged sideways in a turn.

        Such a base makes `_LEAST_TURN` to `_MOST_TURN` of the turn of wheels with its true sizes that do not
        slip, about a point between its axles. So the middle is off by at most the distance of the axles, and
        by the heading's error on the way.
        """
        drive, settings = self._drive, self._settings
        if len(drive.left) < 2 or seen.odometry_rotation < _IN_TURN:
            return None
        odometry_from_true = settings.radius / settings.separation * drive.separation / drive.radius
        turned = seen.odometry_rotation / odometry_from_true
        if not _LEAST_TURN * turned <= seen.rotation <= _MOST_TURN * turned:
            return None
        forward, error = drive.axle_in_base.rotation[:, 0], abs(turned - seen.rotation)
        ahead = [float(wheel.center @ forward) for wheel in drive.wheels.values()]
        most = max(ahead) - min(ahead) + seen.distance * error + self._half * error
        if most < LEAST_SHARE * seen.slip:
            return None
        is_of_heading = _is_of_heading(seen, self._half)
        return self._skid(seen.odometry_rotation / seen.rotation if is_of_heading else 1.0)

    def _assumes_slip(self, seen: OdometryError) -> Cause | None:
        """A wheel separation that assumes more slip of several axles than there is. D105 does not report it,
        because such a base needs a separation above that of its wheels."""
        turned = seen.odometry_rotation
        if len(self._drive.left) < 2 or not _IN_TURN <= turned < seen.rotation:
            return None
        return self._skid(turned / seen.rotation) if _is_of_heading(seen, self._half) else None

    def _skid(self, factor: float) -> Cause:
        """The slip of several axles, with which the wheels turn by `factor` times the turn of the base."""
        why = f"a turn drags the wheels of {len(self._drive.left)} axles across the ground"
        if factor == 1.0:
            text = f"{why}, so the robot does not turn about their middle"
            return Cause(text, None, "use another source of the position, such as a lidar", is_fault=False)
        if factor < 1.0:
            why = f"they slip less than its wheel separation of {self._settings.separation:.4g} m assumes"
        text = f"it turns {percent(1.0 / factor)} of what its wheels indicate, because {why}"
        hint = (
            f"give the drive a wheel separation that is {factor:.2g} times as large" if factor < inf else ""
        )
        size = None if self._limits.controller is None else self._limits.controller.separation
        return Cause(text, None if size is None else size.given.origin, hint, is_fault=False)

    def _dragging_part(self, link: str) -> Cause:
        """A link other than wheels that drags on the ground, or the caster that scrubs."""
        is_caster = link in self._drive.casters
        hint = "give it little friction" if is_caster else "raise it, or put a caster below it"
        return self._fault(("D118",) if is_caster else _UNLOADS) or Cause(
            f"'{link}' drags on the ground", self._model.links[link].origin, hint
        )

    def _askew_wheel(self, least: float) -> Cause | None:
        """A driving wheel that rolls at an angle to the others, whose sine is the share that is dragged."""
        leftward = self._drive.axle_in_base.rotation[:, 1]
        sines = (float(np.linalg.norm(np.cross(w.axis, leftward))) for w in self._drive.wheels.values())
        return self._fault(("D110",)) if max(sines, default=0.0) >= least else None

    def _loose_suspension(self, least: float) -> Cause | None:
        """A joint above a wheel that gave way under the weight, because nothing holds it. It moves the wheel
        by the sine of its angle."""
        positions, held = self._robot.body.joint_positions, self._robot.joints.control.holds
        for wheel in self._drive.wheels.values():
            above = movable_above(self._model, wheel.joint.parent)
            while above is not None:
                moved = abs(positions[above.name] - rest(above)) if above.name in positions else 0.0
                gives_way = moved > _GIVES_WAY and sin(min(moved, pi / 2.0)) >= least
                is_free = above.type is JointType.REVOLUTE and above.name not in (*held, *self._steering)
                if is_free and gives_way:
                    text = f"'{above.name}' gives way by {degrees(moved):.0f} degrees: nothing holds it"
                    return Cause(text, above.origin, "add a controller that holds it")
                above = movable_above(self._model, above.parent)
        return None

    def _slippery_wheel(self) -> Cause | None:
        """The driving wheel with the least friction, if it has less than usual."""
        drive, model = self._drive, self._engine.model
        if isinstance(drive, HolonomicDrive):  # its wheels slide freely, and the base has their friction
            friction = traction(self._model, drive).friction
            text = f"the coefficient of friction of the wheels is only {friction:g}"
            origin = next((self._model.links[link].origin for link in drive.tyres), None)
            return Cause(text, origin, "raise their <mu1>") if friction < FRICTION else None
        frictions = {
            link: float(model.geom_friction[self._geometries(link), 0].min(initial=FRICTION))
            for link in drive.tyres
        }
        link = min(frictions, key=frictions.__getitem__, default="")
        if not link or frictions[link] >= FRICTION:
            return None
        text = f"the coefficient of friction of '{link}' is only {frictions[link]:g}"
        return Cause(text, self._model.links[link].origin, "raise its <mu1>")

    # motors

    def _why_slow(self, seen: Miss) -> Cause:
        """Why the wheels turn less than commanded."""
        missing = 1.0 - seen.share
        if self._steering and self._robot.drives_sideways and missing * seen.seconds < _STEERS:
            origin = self._model.joints[self._steering[0]].origin
            return Cause("its wheels first steer into this direction", origin, is_fault=False)
        than = "more slowly" if missing > 0.0 else "faster"
        return self._limits.of_slow_start(seen) or unknown(f"its wheels turn {than} than commanded")

    def _weak_motor_for(self, missing: float) -> Cause | None:
        """The torque limits, if they allow only a part of the controller's acceleration."""
        able = self._limits.motor_acceleration() - self._uphill
        if 1.0 - able / self._limits.acceleration < LEAST_SHARE * missing:
            return None
        return self._fault(_WEAK) or self._limits.of_motors(max(able, 0.0))

    # masses and contacts

    @property
    def _heaviest(self) -> Origin | None:
        inertials = [link.inertial for link in self._model.links.values() if link.inertial]
        heaviest = max(inertials, key=lambda inertial: inertial.mass, default=None)
        return None if heaviest is None else heaviest.origin

    def _heavy_wheel(self, tips: float) -> Cause | None:
        """A driving wheel with an inertia that is far too large: starting it turns the body backwards.

        The wheels at a / r need the torque I a / r, and the body tips at m h times its acceleration.
        """
        if self._engine.has_failed:
            return None
        drive, (model, data) = self._drive, self._engine.current()
        center = data.subtree_com[self._robot.body.index(self._model.root)]
        base = self._robot.body.link_pose(self._robot.base).translation
        height = max(abs(float(center[2] - base[2])), drive.radius)
        for wheel in drive.wheels.values():
            inertia = float(model.body_inertia[self._robot.body.index(wheel.link)].max())
            torque = len(drive.wheels) * inertia * self._limits.acceleration / drive.radius
            found = self._fault(("I108",), wheel.link)
            if found is not None and _SUDDEN * torque >= tips * mass_of(model, self._robot) * height:
                return found
        return None

    def _soft_contact(self, link: str, depth: float) -> Cause | None:
        """A contact with a spring: at an impedance of `SPRING` the weight sinks in by (1 - SPRING) g / k."""
        stiffness = -self._engine.model.geom_solref[self._geometries(link), 0]  # in 1/s^2, of springs above 0
        if not (stiffness > 0.0).any() or (1.0 - SPRING) * GRAVITY / stiffness.max() < LEAST_SHARE * depth:
            return None
        text = "its contact is too soft for the weight"
        return Cause(text, self._model.links[link].origin, "raise <kp> of its surface")

    def _geometries(self, link: str) -> NDArray[np.intp]:
        """The engine's indices of the shapes of a link."""
        return np.flatnonzero(self._engine.model.geom_bodyid == self._robot.body.index(link))

    # faults of the description

    def _size_codes(self, seen: OdometryError) -> tuple[str, ...]:
        """The codes of faults that explain wrong odometry without slip. The one with the largest effect is
        first."""
        drive, settings = self._drive, self._settings
        effects = {
            "D106": abs(settings.radius / drive.radius - 1.0) * (seen.distance + self._half * seen.rotation),
            "D105": abs(drive.separation / settings.separation - 1.0) * self._half * seen.rotation,
        }
        return (*_SIDES, *sorted(effects, key=lambda code: -effects[code]))

    def _rolls_aside(self, seen: Miss) -> bool:
        """Whether the direction of the wheels explains the way: the cosine of its angle is the share."""
        cosine = float(self._drive.axle_in_base.rotation[0, 0])
        return not seen.is_turn and abs(seen.share - cosine) <= LEAST_SHARE * abs(1.0 - seen.share)

    def _drive_fault(self, codes: Sequence[str]) -> Cause | None:
        """The first of these faults of the plugin or controller that drives. The others are related."""
        faults = findings_of_drive(self._model, self._robot.drive)
        first = _first(codes, faults)
        if first is None:
            return None
        others = [f for f in faults if f.code in codes and f.origin != first.origin]
        more = tuple(Related(f"{f.message} ({f.code})", f.origin) for f in others if f.origin is not None)
        return replace(first, related=(*first.related, *more))

    def _fault(self, codes: Sequence[str], link: str = "") -> Cause | None:
        """The first of these faults of the description. With `link`, only faults whose message names it."""
        from kbot.checks.first_look import look_at_robot  # all rules, needed only if something goes wrong

        found = look_at_robot(self._model, codes)
        if link:
            return _first(codes, [fault for fault in found if fault.message.startswith(f"{link}: ")])
        # D128 of a visual is an info: a visual does not touch the ground
        return _first(codes, [f for f in found if f.code != "D128" or f.severity is Severity.WARNING])


def _first(codes: Sequence[str], faults: Sequence[Diagnostic]) -> Cause | None:
    """The fault whose code comes first, as a cause."""
    fitting = [fault for fault in faults if fault.code in codes]
    if not fitting:
        return None
    found = min(fitting, key=lambda fault: codes.index(fault.code))
    is_fault = found.severity is not Severity.INFO
    return Cause(f"{found.message} ({found.code})", found.origin, found.hint, is_fault, found.related)


def _is_of_heading(seen: OdometryError, half: float) -> bool:
    """Whether most of the error is that of the heading, or follows from it.

    The position is off by half of the product of the heading's error and the way, because the error grows.
    `half` is half of the distance between left and right wheels in m.
    """
    off = abs(seen.heading_error)
    return (
        half * off >= LEAST_SHARE * seen.total
        or off * seen.distance / 2.0 >= LEAST_SHARE * seen.position_error
    )
