"""Findings about a run: what `MotionWatch` observed, with the finding about the robot that explains it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import acos, degrees, hypot, inf, pi, radians, sin

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.declared import declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.drive.wheels import movable_above
from kbot.kinematics.spatial import GRAVITY
from kbot.kinematics.transform import Transform
from kbot.model import JointType, Mesh
from kbot.model.shapes import span_along
from kbot.sim.command_watch import Miss
from kbot.sim.drive.settings import TORQUE
from kbot.sim.drive.twist_controller import STILL, Twist
from kbot.sim.engine.base_servo import traction
from kbot.sim.engine.contacts import SPRING
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.joints import resistance, rest
from kbot.sim.motion_watch import (
    STUCK,
    Excess,
    Explanation,
    MotionWatch,
    OdometryError,
    Standstill,
    Weakness,
)
from kbot.sim.recipe import FRICTION, LINEAR_ACCELERATION
from kbot.sim.robot import SimulatedRobot
from kbot.sim.statics import grip, tipping
from kbot.text import Diagnostic, Origin, Related, Severity

_SAME = 0.01
"""Share by which a declared size may differ, as in D105 and D106."""
_MOST = 0.5
"""Least share of what was observed that a cause must explain. No other cause can then explain more of it."""
_SUDDEN = 2.0
"""Factor by which a load that begins suddenly exceeds one that grows slowly: the dynamic factor of a beam."""
_SLOPE = radians(3.0)
"""Tilt in rad above which the ground is not level. A robot tilts less when it starts and stops."""
_LEAST_TURN, _MOST_TURN = 0.2, 1.1
"""The least and the most that a base with several axles turns, as a share of what its wheels indicate: as in
the batteries (SLIPPING_TURN)."""
_WEAK_PUSH = 0.25
"""Share of the mean push of the driving wheels below which one of two hardly drives."""
_IN_TURN = 0.1
"""Turn in rad from which a motion is one with turns."""
_DEEP = 0.005
"""Metres below the floor that are reported. Stiff contacts sink in by 0.01 mm, and soft ones by a few mm."""
_FLAT = 0.7
"""Least vertical component of a floor's normal: it rises by up to 45 degrees."""
_LEANS = radians(15.0)
"""Angle to the ground in rad from which a robot that rests on another part than its wheels and casters has
tipped over. One whose caster is too short leans less."""
_SAG = 0.05
"""Distance in rad or m from its target at which a held joint is reported if it cannot carry its load."""
_STEERS = 1.0
"""Seconds within which the wheels of a base have steered into a new direction."""
_GIVES_WAY = radians(6.0)
"""Angle in rad by which a suspension without a spring gives way at least."""
_SLOWEST = 0.05
"""Share of its highest speed at which a robot ordinarily drives at least."""
_BELOW_WORLD = 0.5
"""Metres below the lowest fixed shape at which the robot has left the world."""

_SPEED_LIMITS = (
    ("max_linear_velocity", "max_velocity", "linear.x.max_velocity"),
    ("max_angular_velocity", "angular.z.max_velocity"),
)
_ACCELERATION_LIMITS = (
    (
        "max_linear_acceleration",
        "max_acceleration",
        "linear.x.max_acceleration",
        "wheelAcceleration",
        "max_wheel_acceleration",
    ),
    (
        "max_angular_acceleration",
        "angular.z.max_acceleration",
        "wheelAcceleration",
        "max_wheel_acceleration",
    ),
)
_JERK_LIMITS = (
    ("max_linear_jerk", "max_jerk", "linear.x.max_jerk"),
    ("max_angular_jerk", "angular.z.max_jerk"),
)
"""The controllers' limits of speed, acceleration and jerk, for driving and for turning."""
_SIDES = ("D107", "D108", "D109")
_UNLOADS = ("D112", "D128", "D116", "D115")
"""Faults because of which a driving wheel has too little load, or another part rests on the ground."""
_WEAK = ("D119", "D117")
_TIPS = ("D115", "D116", "D112", "G106")


@dataclass(frozen=True, slots=True)
class _Cause:
    """Why something happened, and at which line. `is_fault`: whether the description is the reason.

    `is_limit`: a limit of the drive, which explains a missed command, but no error of odometry.

    A cause is named only if it explains at least `_MOST` of what was observed. Otherwise it is unknown."""

    text: str
    origin: Origin | None = None
    hint: str = ""
    is_fault: bool = True
    related: tuple[Related, ...] = ()
    is_limit: bool = False


class MotionFindings:
    """The findings about the first robot of a simulation. Each cause is looked up once."""

    def __init__(
        self,
        watch: MotionWatch,
        engine: Engine,
        robot: SimulatedRobot,
        off_ground: Diagnostic | None,
    ) -> None:
        """`off_ground` is the finding about a start without ground below it."""
        self._off_ground = off_ground
        self._watch, self._engine, self._robot = watch, engine, robot
        self._causes: dict[str, _Cause] = {}
        self._sunk: Diagnostic | None = None
        self._lost_since: float | None = None
        """Since when in s the robot falls for ever."""
        self._restarts = watch.restarts

    def find(self) -> tuple[Diagnostic, ...]:
        """What was observed since the last reset, and whether the robot is below the floor now."""
        found = [self._jump(), self._depth(), self._fall(), self._excess(), self._standstill()]
        found.append(self._weakness())
        limited = self._miss() if self._is_limited and not any(found) else None
        found += [self._odometry(limited is None), self._sag(), limited]
        if not any(found):
            found.append(self._miss())
        return tuple(finding for finding in found if finding is not None)

    # observations

    def _odometry(self, explains_miss: bool) -> Diagnostic | None:
        seen, still = self._watch.odometry_error, self._watch.standstill
        if seen is None or self._is_consequence(seen.since):
            return None
        if still is not None and still.wheels_turn and still.since <= seen.since:
            return None  # a consequence: odometry counts the turns of wheels that move nothing
        off = _joined(f"{seen.position_error * 1e3:.0f} mm", _in_degrees(abs(seen.heading_error), ".1f"))
        way = f"{seen.distance:.2f} m" if seen.distance >= 0.005 else ""
        driven = _joined(way, _in_degrees(seen.rotation, ".0f", " of turns")) or "no motion"
        what = f"odometry is {_percent(seen.share)} off: {off} after {driven}, first at {seen.since:.1f} s"
        missed = self._watch.miss
        what += f"; the robot {_share_of(missed)}" if missed is not None and explains_miss else ""
        cause = self._first_cause("W301", lambda: self._why_off(seen))
        return _finding("W301", what, cause)

    def _standstill(self) -> Diagnostic | None:
        seen = self._watch.standstill
        if seen is None or self._is_consequence(seen.since):
            return None
        if self._watch.excess is not None and seen.allowed < 2.0 * STUCK:
            return None  # a consequence: the robot drives as fast as it can
        what = (
            f"the robot hardly moves after {seen.since:.1f} s: it drives {_percent(seen.share)} of the "
            "commanded distance"
        )
        cause = self._cause("W302", seen.explanation, lambda: self._why_still(seen))
        return _finding("W302", what, cause)

    def _excess(self) -> Diagnostic | None:
        seen = self._watch.excess
        if seen is None:
            return None
        unit = "rad/s" if seen.is_turn else "m/s"
        what = (
            f"the command of {abs(seen.commanded):g} {unit} since {seen.since:.1f} s is far above the "
            f"{seen.allowed:.3g} {unit} that the drive allows"
        )
        return _finding("W305", what, self._first_cause("W305", lambda: self._why_far(seen)))

    def _weakness(self) -> Diagnostic | None:
        seen = self._watch.weakness
        if seen is None or self._is_consequence(seen.since) or self._watch.standstill is not None:
            return None  # a robot that hardly moves is one finding, with the motor as its cause
        what = (
            f"the motor of '{seen.joint}' is too weak after {seen.since:.1f} s: it turns at {seen.speed:.3g}"
            f" of the commanded {seen.commanded:.3g} rad/s"
        )
        return _finding("W306", what, self._cause("W306", seen.explanation, self._why_weak))

    def _miss(self) -> Diagnostic | None:
        """W307. What acted on the robot from outside, or holds it, explains it without a finding."""
        seen = self._watch.miss
        if seen is None or (
            self._watch.explanation.is_known or self._attached() or self._watch.tilt > _SLOPE
        ):
            return None
        what = f"the robot {_share_of(seen)} in {seen.seconds:.1f} s"
        return _finding("W307", what, self._cause_of_miss(seen))

    def _cause_of_miss(self, seen: Miss) -> _Cause:
        # each command may have another cause; looking for one takes longer than a period of the page
        return self._first_cause(f"W307 {seen.is_turn} {seen.wanted}", lambda: self._why_missed(seen))

    @property
    def _is_limited(self) -> bool:
        """Whether a limit of the drive explains why the robot missed its command."""
        seen = self._watch.miss
        return seen is not None and self._cause_of_miss(seen).is_limit

    def _sag(self) -> Diagnostic | None:
        """W306 of a joint that is held, but whose effort limit is below its load. Seen at this call."""
        body, joints = self._robot.body, self._robot.joints
        if self._engine.has_failed:
            return None
        held = [name for name in joints.servos.joints if name in joints.control.holds]
        here = body.joint_positions
        targets = {name: joints.servos.commanded_position(name) for name in held}
        sagging = [name for name in held if abs(here[name] - targets[name]) > _SAG]
        if not sagging:
            return None
        loads = self._loads(targets)
        for name in sagging:
            joint, most = self._robot.robot.joints[name], self._robot.robot.joints[name].effort_limit
            if loads[name] > most and joint.limit is not None:
                unit = "N" if joint.type is JointType.PRISMATIC else "N m"
                what = (
                    f"'{name}' sags: its effort limit is {most:.3g} {unit}, but its load is {loads[name]:.3g}"
                    f" {unit}, {loads[name] / most:.3g} times as much"
                )
                hint = f"write at least {loads[name]:.3g}, or the real masses"
                return Diagnostic("W306", Severity.WARNING, what, joint.limit.origin, hint)
        return None

    def _loads(self, positions: Mapping[str, float]) -> dict[str, float]:
        """The magnitudes of the weight's efforts in N m or N on joints at these positions (rad or m)."""
        model, data = self._engine.current()
        still, body = mujoco.MjData(model), self._robot.body
        still.qpos[:] = data.qpos
        places = {name: model.joint(body.prefix + name) for name in positions}
        for name, place in places.items():
            still.qpos[place.qposadr] = positions[name]
        mujoco.mj_forward(model, still)
        return {name: abs(float(still.qfrc_bias[place.dofadr[0]])) for name, place in places.items()}

    def _is_consequence(self, since: float) -> bool:
        """Whether something that was observed first at a time (s) follows from a jump, a fall, or because the
        robot left the ground for ever."""
        jump, fall = self._watch.jump, self._watch.fall
        earlier = [seen.since for seen in (jump, fall) if seen is not None]
        earlier += [self._lost_since] if self._lost_since is not None else []
        return any(time <= since for time in earlier)

    def _jump(self) -> Diagnostic | None:
        """W309."""
        seen = self._watch.jump
        if seen is None:
            return None
        what = (
            f"between {seen.since:.2f} s and {seen.until:.2f} s the velocity of the robot changes by "
            f"{seen.change:.3g} m/s, which gravity, contacts and motors do not explain: this is an error of"
            " the physics engine, and the robot is not at fault"
        )
        hint = (
            "do not use the results after this time, and report the files and the command to KBot's authors"
        )
        return Diagnostic("W309", Severity.WARNING, what, None, hint)

    def _fall(self) -> Diagnostic | None:
        seen, jump = self._watch.fall, self._watch.jump
        if jump is not None and (seen is None or jump.since <= seen.since):
            return None
        if self._lost_since is not None and (seen is None or self._lost_since <= seen.since):
            return None
        if seen is None:
            return self._lean()
        cause = self._cause("W303", seen.explanation, lambda: self._why_fallen(seen.twist))
        return _finding("W303", f"the robot fell over at {seen.since:.1f} s", cause)

    def _lean(self) -> Diagnostic | None:
        """W303 of a robot that tipped only until a part of it touched the ground. Seen at this call."""
        if self._engine.has_failed or self._robot.body.root_qpos < 0:
            return None
        resting, normal = self._ground_below()
        angle = acos(min(1.0, float(self._watch.up @ normal)))
        if angle < _LEANS or not resting:
            return None
        twist = self._robot.wheels.twist if self._robot.wheels is not None else STILL
        cause = self._cause("W303", self._watch.explanation, lambda: self._why_fallen(twist))
        what = f"the robot leans by {degrees(angle):.0f} degrees and rests on '{resting[0]}'"
        return _finding("W303", what, cause)

    def _ground_below(self) -> tuple[list[str], NDArray[np.float64]]:
        """The links that rest on fixed shapes, without wheels and casters, and the ground's normal (3,)."""
        model, data = self._engine.current()
        mine = set(own_geometries(model, self._robot.name).tolist())
        drive, resting, normal = self._robot.drive, [], np.array([0.0, 0.0, 1e-9])
        rolling: set[str] = set()
        if isinstance(drive, DifferentialDrive):
            rolling = {wheel.link for wheel in drive.wheels.values()}.union(drive.casters)
        if isinstance(drive, HolonomicDrive):
            rolling.update(drive.treads)
        for contact in data.contact:
            pair = contact.geom.tolist()
            for geom, other in (pair, pair[::-1]):
                if geom in mine and model.body_weldid[model.geom_bodyid[other]] == 0:
                    up = contact.frame[:3] * np.sign(contact.frame[2])
                    if up[2] > _FLAT:
                        normal = normal + up
                        resting.append(_link_of(model, geom))
        return [link for link in resting if link not in rolling], normal / np.linalg.norm(normal)

    def _depth(self) -> Diagnostic | None:
        """W304. What sinks without a contact is seen only at the time of this call."""
        engine = self._engine
        jump = self._watch.jump
        if engine.has_failed or (jump is not None and self._sunk is None):
            return None
        self._forget_before_restart()
        if self._sunk is None:
            model, data = engine.current()
            own = own_geometries(model, self._robot.name)
            self._sunk = self._below_world(model, data) or self._below_floor(model, data, own)
        return self._sunk

    def _below_world(self, model: mujoco.MjModel, data: mujoco.MjData) -> Diagnostic | None:
        """W304 of a robot that fell through the floor, or off its edge."""
        fixed = data.geom_xpos[model.body_weldid[model.geom_bodyid] == 0, 2]
        height = self._robot.body.link_pose(self._robot.robot.root).translation[2]
        if height > fixed.min(initial=0.0) - _BELOW_WORLD:
            return None
        what = f"at {self._engine.time:.1f} s the robot is at z = {height:.1f} m and falls"
        flight = self._watch.flight
        self._lost_since = self._engine.time if flight is None else flight
        touches = [link for link in self._robot.robot.links.values() if link.collisions]
        if not touches:
            origin = self._robot.robot.origin
            cause = _Cause("no link has a <collision>", origin, "add <collision> to the links")
        elif self._watch.has_touched:
            text = f"it left the ground at {self._lost_since:.1f} s and touches nothing since then"
            cause = _Cause(text, is_fault=False)
        elif self._off_ground is not None and self._watch.begun == 0.0:
            cause = _Cause(f"{self._off_ground.message} (W115)", self._off_ground.origin, is_fault=False)
        else:
            cause = _Cause("there is no ground below the place where it was put", is_fault=False)
        return _finding("W304", what, cause)

    def _below_floor(
        self, model: mujoco.MjModel, data: mujoco.MjData, own: NDArray[np.intp]
    ) -> Diagnostic | None:
        """W304 of a shape that reaches into the floor, seen or in a contact."""
        deepest, link = max(
            (*self._depths_of_contacts(model, data, own), *self._depths_of_shapes(model, data)),
            default=(0.0, ""),
        )
        if deepest < _DEEP:
            return None
        faults = self._faults(("D112", "G106", "D128"), link)
        collides = bool(self._robot.robot.links[link].collisions)
        origin = self._robot.robot.links[link].origin
        cause = faults or (self._soft_contact(model, link, deepest) if collides else None)
        if cause is None and not collides:
            cause = _Cause("it has no <collision>", origin, "add a <collision>, or move the link up")
        cause = cause or _unknown()
        return _finding("W304", f"'{link}' reaches {deepest * 1e3:.0f} mm below the floor", cause)

    def _soft_contact(self, model: mujoco.MjModel, link: str, depth: float) -> _Cause | None:
        """A contact with a spring: at an impedance of `SPRING` the weight sinks in by (1 - SPRING) g / k."""
        geoms = np.flatnonzero(model.geom_bodyid == self._robot.body.index(link))
        stiffness = -model.geom_solref[geoms, 0]  # negative for a spring, in 1/s^2
        if not (stiffness > 0.0).any() or (1.0 - SPRING) * GRAVITY / stiffness.max() < _MOST * depth:
            return None
        text, origin = "its contact is too soft for the weight", self._robot.robot.links[link].origin
        return _Cause(text, origin, "raise <kp> of its surface")

    def _depths_of_contacts(
        self, model: mujoco.MjModel, data: mujoco.MjData, own: NDArray[np.intp]
    ) -> Iterator[tuple[float, str]]:
        """How deep each link is in fixed shapes below it, in m."""
        mine = set(own.tolist())
        # the third component of the normal is that along z: skip walls
        is_deep = (data.contact.dist < -_DEEP) & (np.abs(data.contact.frame[:, 2]) > _FLAT)
        for at in np.flatnonzero(is_deep).tolist():
            contact = data.contact[at]
            pair = contact.geom.tolist()
            for geom, other in (pair, pair[::-1]):
                if geom in mine and model.body_weldid[model.geom_bodyid[other]] == 0:
                    yield -float(contact.dist), _link_of(model, geom)

    def _depths_of_shapes(self, model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[tuple[float, str]]:
        """How deep the shapes of each link, apart from meshes, reach below a level floor, in m."""
        is_floor = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (data.geom_xmat[:, 8] > 1.0 - 1e-9)
        if not is_floor.any():
            return
        floor = float(data.geom_xpos[is_floor, 2].min())
        for name, link in self._robot.robot.links.items():
            for part in link.collisions or link.visuals:
                if isinstance(part.geometry, Mesh):
                    continue
                pose = self._robot.body.link_pose(name) @ Transform.of(part.pose)
                span = span_along(part.geometry, pose.rotation[2])
                if span is not None:
                    yield floor - float(pose.translation[2]) - span[0], name

    # causes

    def _cause(self, code: str, outside: Explanation, why: Callable[[], _Cause]) -> _Cause:
        """The cause of an observation. What acted from outside explains it by itself."""
        return self._first_cause(code, lambda: _from_outside(outside) or self._attached() or why())

    def _first_cause(self, code: str, why: Callable[[], _Cause]) -> _Cause:
        self._forget_before_restart()
        if code not in self._causes:
            self._causes[code] = why()
        return self._causes[code]

    def _forget_before_restart(self) -> None:
        if self._restarts != self._watch.restarts:
            self._restarts, self._sunk, self._lost_since = self._watch.restarts, None, None
            self._causes.clear()

    def _attached(self) -> _Cause | None:
        """An attachment of the robot, which pulls it or holds it."""
        own = self._robot.body.prefix
        welds = self._engine.assembly.welds
        is_held = any(body.startswith(own) for weld in welds for body in (weld.first, weld.second))
        return _Cause("it is attached to something", is_fault=False) if is_held else None

    def _why_off(self, seen: OdometryError) -> _Cause:
        """Sizes, sides and axes explain what is left without the slip. Slip has another cause."""
        if seen.slip <= (1.0 - _MOST) * seen.total:
            return self._drive_fault(self._size_codes(seen)) or self._faults(("D111",)) or _unknown()
        share, in_turn = seen.share * seen.slip / seen.total, seen.odometry_rotation > _IN_TURN
        if in_turn and self._is_of_heading(seen, 0.0):
            share = abs(seen.heading_error) / seen.odometry_rotation
        return (
            _from_outside(seen.explanation)
            or self._attached()
            or self._slipping_tracks(seen)
            or self._skids(seen)
            or self._why_slips(share, in_turn=in_turn)
        )

    @staticmethod
    def _is_of_heading(seen: OdometryError, half: float) -> bool:
        """Whether most of the error is that of the heading, or follows from it: the position is off by half
        of the product of the heading's error and the way, because the error grows. `half` is half of the
        distance between left and right wheels in m."""
        off = abs(seen.heading_error)
        return half * off >= _MOST * seen.total or off * seen.distance / 2.0 >= _MOST * seen.position_error

    def _size_codes(self, seen: OdometryError) -> tuple[str, ...]:
        """The codes of faults that explain wrong odometry without slip, the one with the largest effect
        first."""
        drive, settings = self._robot.drive, self._robot.settings
        if not isinstance(drive, DifferentialDrive) or settings is None:
            return ()
        half = drive.separation / 2.0
        radius, separation = (
            settings.radius / drive.radius - 1.0,
            drive.separation / settings.separation - 1.0,
        )
        effects = {
            "D106": abs(radius) * (seen.distance + half * seen.rotation),
            "D105": abs(separation) * half * seen.rotation,
        }
        return (*_SIDES, *sorted(effects, key=lambda code: -effects[code]))

    def _why_still(self, seen: Standstill) -> _Cause:
        missing = 1.0 - seen.share
        if 1.0 - seen.allowed >= _MOST * missing and seen.allowed < 2.0 * STUCK:
            return self._limits(seen)
        if seen.wheels_turn or not self._has_motors:
            return self._why_slips(missing, in_turn=False)
        return (
            self._resistance()
            or self._weak_motor_for(missing)
            or _unknown("its wheels do not turn, and the cause is not known", "check what blocks the wheels")
        )

    def _why_slips(self, share: float, *, in_turn: bool) -> _Cause:
        """Why the wheels slip by a share of what they drive: they push too little, or something drags.

        The forces of now give the acceleration that the tyres can cause, which is compared with the one that
        the drive's controller asks for, and how much they creep.
        """
        least = _MOST * share
        what = "the wheels slip" if self._has_motors else "something holds it"
        unknown = _unknown(
            f"{what}, and the cause is not known", "check the load on the wheels and their friction"
        )
        if self._engine.has_failed:
            return unknown
        now = grip(*self._engine.current(), self._robot, in_turn=in_turn)
        needed, uphill = self._acceleration(), GRAVITY * sin(self._slope)
        is_held = now.missing(needed) >= least and now.drag >= _MOST * now.push
        if now.parts and (now.creep(now.drag) >= least or is_held):
            return self._dragging_part(now.parts[0])
        weak = min(now.pushes, key=now.pushes.__getitem__, default="")
        # of two wheels, each drives one side of the robot
        is_weak = bool(weak) and len(now.pushes) <= 2 and now.pushes[weak] < _WEAK_PUSH
        if is_weak or now.missing(needed) >= least:
            found = self._slippery_wheel() or self._faults(_UNLOADS)
            if found is not None:
                return found
        if now.missing(needed) < least <= max(now.missing(needed + uphill), now.creep(uphill)):
            return self._on_slope()
        found = self._askew_wheel(least) or self._loose_suspension(least)
        if found is None and is_weak:
            pushes = _percent(now.pushes[weak])
            text = f"the wheel '{weak}' can push with {pushes} of the mean of the driving wheels"
            return _Cause(text, is_fault=False)
        return found or unknown

    def _acceleration(self) -> float:
        """The acceleration in m/s^2 that the drive's controller asks for at most."""
        settings = self._robot.settings
        limit = inf if settings is None else settings.limits.linear_acceleration
        return limit if limit < inf else LINEAR_ACCELERATION

    @property
    def _has_motors(self) -> bool:
        """Whether joints drive the robot. A plugin may move the base itself, or turn tracks."""
        drive = self._robot.drive
        return isinstance(drive, DifferentialDrive) and bool(drive.joints)

    def _why_far(self, seen: Excess) -> _Cause:
        text, origin = self._speed_limit_of(seen.allowed, is_turn=seen.is_turn)
        small = _in_small_unit(seen)
        hint = f"cmd_vel takes m/s and rad/s: {small}" if small else "command a lower speed, in m/s and rad/s"
        return _Cause(text, origin, hint)

    def _speed_limit_of(self, speed: float, *, is_turn: bool) -> tuple[str, Origin | None]:
        """What limits the speed to m/s or rad/s, and where it is written: the controller, or the joint of a
        wheel."""
        robot, drive = self._robot.robot, self._robot.drive
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*_SPEED_LIMITS[is_turn])
        if controller is not None and given is not None and given.number == speed:
            return f"{controller.name} limits it with {given.name}", given.origin
        joints = drive.joints if isinstance(drive, DifferentialDrive) else ()
        name = min(joints, key=lambda joint: robot.joints[joint].speed_limit, default="")
        limit = robot.joints[name].limit if name else None
        if limit is None:
            return "the limits of the drive", None
        return f"'{name}' has a velocity limit of {robot.joints[name].speed_limit:g} rad/s", limit.origin

    def _why_missed(self, seen: Miss) -> _Cause:
        """Why a robot does not move as commanded. Its wheels do not, or their sizes are wrong, or they slip:
        these three parts add up to what is missing."""
        limits = self._limit_of(seen) or self._steering_limit(seen)
        if limits is not None and seen.share < 1.0:
            return limits
        least = _MOST * abs(1.0 - seen.share)
        drive = self._robot.drive
        if abs(seen.odometry - seen.rolled) >= least:
            found = self._drive_fault((*_SIDES, "D106", "D105")) or self._faults(("D111",))
            if found is not None:
                return found
        if self._rolls_aside(seen):
            found = self._drive_fault(("D132",))
            if found is not None:
                return found
        if abs(1.0 - seen.odometry) >= least:
            return self._why_slow(seen)
        if seen.is_turn and isinstance(drive, DifferentialDrive) and len(drive.left) > 1:
            return self._skid(seen.odometry / seen.share if seen.share > 0.0 else inf)
        return self._why_slips(abs(seen.rolled - seen.share), in_turn=seen.is_turn)

    def _rolls_aside(self, seen: Miss) -> bool:
        """Whether the direction of the wheels explains the way: the cosine of its angle is the share."""
        drive = self._robot.drive
        if not isinstance(drive, DifferentialDrive) or seen.is_turn:
            return False
        return abs(seen.share - float(drive.axle_in_base.rotation[0, 0])) <= _MOST * abs(1.0 - seen.share)

    def _why_slow(self, seen: Miss) -> _Cause:
        """Why the wheels turn less than commanded."""
        drive = self._robot.drive
        missing = 1.0 - seen.share
        if isinstance(drive, SteeredDrive) and drive.sideways and missing * seen.seconds < _STEERS:
            origin = self._robot.robot.joints[drive.steering[0]].origin
            return _Cause("its wheels first steer into this direction", origin, is_fault=False)
        return self._slow_motor(seen) or _unknown(
            "its wheels turn more slowly than commanded, and the cause is not known"
            if missing > 0.0
            else "its wheels turn faster than commanded, and the cause is not known"
        )

    def _limit_of(self, seen: Miss) -> _Cause | None:
        """The limit of speed, acceleration or jerk that explains most of a miss."""
        wheels, robot = self._robot.wheels, self._robot.robot
        axis = 2 if seen.is_turn else 0
        asked = seen.wanted[axis] * seen.seconds
        if wheels is None or not asked:
            return None
        own, without_jerk = (
            1.0 - wheels.reach(seen.wanted, seen.seconds, has_jerk=has_jerk)[axis] / asked
            for has_jerk in (True, False)
        )
        if own < (1.0 - seen.share) / 2.0:
            return None
        if wheels.fastest[axis] < abs(seen.wanted[axis]) * (1.0 - _SAME):
            text, origin = self._speed_limit_of(wheels.fastest[axis], is_turn=seen.is_turn)
            return _Cause(text, origin, "command a lower speed, or raise the limit", is_limit=True)
        is_jerk = without_jerk < own / 2.0
        names = (_JERK_LIMITS if is_jerk else _ACCELERATION_LIMITS)[seen.is_turn]
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*names)
        if controller is None or given is None:
            return None
        kind = "jerk" if is_jerk else "acceleration"
        text = f"{controller.name} limits its {kind} with {given.name} = {given.text}"
        hint = "command it for longer, or raise the limit"
        return _Cause(text, given.origin, hint, is_fault=False, is_limit=True)

    def _steering_limit(self, seen: Miss) -> _Cause | None:
        """The limit of the steering angles that allows only wider curves than the commanded one."""
        robot, drive, settings = self._robot.robot, self._robot.drive, self._robot.settings
        if settings is None or not isinstance(drive, SteeredDrive) or not seen.is_turn:
            return None
        right, left = drive.curvatures
        x, _, yaw = seen.wanted
        sharpest = min(left, -right) if not x else left if yaw * x > 0.0 else -right
        sharpest = min(sharpest, settings.curvature)
        if sharpest == inf or abs(yaw) <= sharpest * abs(x) * (1.0 + _SAME):
            return None
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first("steering_limit")
        if given is not None and sharpest == settings.curvature:
            origin = given.origin
        else:
            module = min(drive.modules, key=lambda module: min(module.curvatures[1], -module.curvatures[0]))
            joint = robot.joints[module.steering or module.rolls]
            origin = joint.origin if joint.limit is None else joint.limit.origin
        text = f"its steering limits allow no curve of less than {1.0 / sharpest:.3g} m radius"
        return _Cause(text, origin, "command a wider curve, or raise the limit", is_limit=True)

    def _motor_acceleration(self) -> float:
        """The acceleration in m/s^2 that the torque limits of the driving joints allow on level ground,
        infinite without one. A limit also turns the wheels and rotors."""
        drive, settings = self._robot.drive, self._robot.settings
        if not isinstance(drive, DifferentialDrive) or settings is None or not drive.joints:
            return inf
        model, own = self._engine.model, settings.torque or inf
        mass = float(model.body_subtreemass[self._robot.body.index(self._robot.robot.root)])
        torque, turning = 0.0, 0.0
        for name in drive.joints:
            dof = self._robot.body.dof(name)
            torque += min(self._robot.robot.joints[name].effort_limit, own)
            body, axis = model.dof_bodyid[dof], drive.wheels[name].axis
            turning += float(model.dof_armature[dof]) + float(model.body_inertia[body] @ (axis * axis))
        return torque / drive.radius / (mass + turning / drive.radius**2)

    def _weakest_joint(self) -> str:
        drive, joints = self._robot.drive, self._robot.robot.joints
        names = drive.joints if isinstance(drive, DifferentialDrive) else ()
        return min(names, key=lambda joint: joints[joint].effort_limit, default="")

    def _slow_motor(self, seen: Miss) -> _Cause | None:
        """A torque limit with which the start takes so long that it explains the missing way: half of the
        speed for the longer time."""
        able = self._motor_acceleration()
        if able == inf or seen.is_turn:
            return None
        speed, ordinary = hypot(*seen.wanted[:2]), self._acceleration()
        start = min(speed / able, seen.seconds)
        missing = (start - speed / ordinary) / (2.0 * seen.seconds)
        if missing < _MOST * (1.0 - seen.share):
            return None
        limit, origin, most = self._torque_limit(self._weakest_joint())
        text = f"{limit} of '{self._weakest_joint()}' is {most:.3g} N m, which allows {able:.2g} m/s^2"
        return _Cause(text, origin, "write the motor's torque, or the robot's real mass", is_fault=False)

    def _weak_motor_for(self, missing: float) -> _Cause | None:
        """The torque limits, if they cause a part of the controller's acceleration only."""
        able, needed = self._motor_acceleration() - GRAVITY * sin(self._slope), self._acceleration()
        if 1.0 - able / needed < _MOST * missing:
            return None
        found = self._faults(_WEAK)
        if found is not None:
            return found
        limit, origin, most = self._torque_limit(self._weakest_joint())
        text = (
            f"{limit} of '{self._weakest_joint()}' is {most:.3g} N m, which allows {max(able, 0.0):.2g} m/s^2"
        )
        return _Cause(text, origin, "write the motor's torque, or the robot's real mass")

    def _why_fallen(self, twist: Twist) -> _Cause:
        """What tipped the robot: its start, its curve or the slope takes more than the acceleration at which
        it tips. A load that begins suddenly tips it with half of that."""
        (tips, off), slope = tipping(self._robot), GRAVITY * sin(self._slope)
        start, turn = self._acceleration() + slope, abs(twist[0] * twist[2]) + twist[2] * twist[2] * off
        if tips <= _SUDDEN * start:
            text = f"it tips over at {max(tips, 0.0):.2g} m/s^2, and starts with up to {start:.2g} m/s^2"
            return self._faults(_TIPS) or _Cause(
                text, self._heaviest, "lower the heavy parts, or start slowly"
            )
        if tips <= _SUDDEN * turn:
            text = f"it tips over at {tips:.2g} m/s^2, and its turn at {abs(twist[2]):.3g} rad/s takes"
            return _Cause(f"{text} {turn:.2g} m/s^2", None, "turn more slowly")
        return self._heavy_wheel(tips) or _unknown(
            f"the cause is not known; it was commanded to drive at {hypot(*twist[:2]):.3g} m/s and to turn at"
            f" {abs(twist[2]):.3g} rad/s"
        )

    @property
    def _heaviest(self) -> Origin | None:
        inertials = [link.inertial for link in self._robot.robot.links.values() if link.inertial]
        heaviest = max(inertials, key=lambda inertial: inertial.mass, default=None)
        return None if heaviest is None else heaviest.origin

    def _heavy_wheel(self, tips: float) -> _Cause | None:
        """A driving wheel with an inertia that is far too large: starting it turns the body backwards.

        The wheels at a / r need the torque I a / r, and the body tips at m h times its acceleration.
        """
        drive, model = self._robot.drive, self._engine.model
        if not isinstance(drive, DifferentialDrive) or self._engine.has_failed:
            return None
        _, data = self._engine.current()
        root = self._robot.body.index(self._robot.robot.root)
        mass = float(model.body_subtreemass[root])
        height = abs(float(data.subtree_com[root, 2] - self._robot.body.link_pose(drive.base).translation[2]))
        for wheel in drive.wheels.values():
            inertia = float(model.body_inertia[self._robot.body.index(wheel.link)].max())
            torque = len(drive.wheels) * inertia * self._acceleration() / drive.radius
            found = self._faults(("I108",), wheel.link)
            if found is not None and _SUDDEN * torque >= tips * mass * max(height, drive.radius):
                return found
        return None

    def _drive_fault(self, codes: Sequence[str]) -> _Cause | None:
        """The first of these faults of the plugin or controller that drives. The others are related."""
        faults = findings_of_drive(self._robot.robot, self._robot.drive)
        first = _first(codes, faults)
        if first is None:
            return None
        others = [f for f in faults if f.code in codes and f.origin != first.origin]
        more = tuple(Related(f"{f.message} ({f.code})", f.origin) for f in others if f.origin is not None)
        return replace(first, related=(*first.related, *more))

    def _faults(self, codes: Sequence[str], link: str = "") -> _Cause | None:
        """The first of these faults of the description; with `link`, only faults that name the link."""
        from kbot.checks.first_look import look_at_robot  # all rules, needed only if something goes wrong

        found = look_at_robot(self._robot.robot, codes)
        if link:
            return _first(codes, [fault for fault in found if fault.message.startswith(f"{link}: ")])
        # D128 of a visual is an info: a visual does not touch the ground
        return _first(codes, [f for f in found if f.code != "D128" or f.severity is Severity.WARNING])

    def _slipping_tracks(self, seen: OdometryError) -> _Cause | None:
        """The slip of tracks in a turn, which odometry of gz's TrackedVehicle does not take into account."""
        drive, controller = self._robot.drive, drive_controller(declared_drives(self._robot.robot))
        if not isinstance(drive, HolonomicDrive) or drive.efficiency == 1.0 or controller is None:
            return None
        turned = (1.0 - drive.efficiency) * seen.odometry_rotation
        is_of_heading = self._is_of_heading(seen, drive.separation / 2.0)
        if not is_of_heading or abs(turned) < _MOST * abs(seen.heading_error):
            return None
        given = controller.first("steering_efficiency")
        origin = controller.origin if given is None else given.origin
        text = (
            f"{controller.name} turns the tracks {1.0 / drive.efficiency:.3g} times as fast as without slip"
            f" (steering_efficiency {drive.efficiency:g}), and its odometry counts the slip as motion"
        )
        hint = "use another source of the heading, such as an IMU"
        return _Cause(text, origin, hint, is_fault=False)

    def _skids(self, seen: OdometryError) -> _Cause | None:
        """Several axles, whose wheels are dragged sideways in a turn.

        Such a base makes `_LEAST_TURN` to `_MOST_TURN` of a turn, about a point between its axles. So the
        middle is off by at most the distance of the axles, and by the heading's error on the way.
        """
        drive = self._robot.drive
        if not isinstance(drive, DifferentialDrive) or len(drive.left) < 2:
            return None
        turned, error = seen.odometry_rotation, abs(seen.odometry_rotation - seen.rotation)
        if turned < _IN_TURN or not _LEAST_TURN * turned <= seen.rotation <= _MOST_TURN * turned:
            return None
        ahead = [float(wheel.center @ drive.axle_in_base.rotation[:, 0]) for wheel in drive.wheels.values()]
        most = max(ahead) - min(ahead) + seen.distance * error + drive.separation / 2.0 * error
        if most < _MOST * seen.slip:
            return None
        is_of_heading = self._is_of_heading(seen, drive.separation / 2.0)
        return self._skid(turned / seen.rotation if is_of_heading else 1.0)

    def _skid(self, factor: float) -> _Cause:
        """The slip of several axles, with which the wheels turn by `factor` times the turn of the base."""
        drive, settings = self._robot.drive, self._robot.settings
        axles = len(drive.left) if isinstance(drive, DifferentialDrive) else 0
        why = f"a turn drags the wheels of {axles} axles across the ground"
        if factor == 1.0:
            text = f"{why}, so that the robot does not turn about their middle"
            return _Cause(text, None, "use another source of the position, such as a lidar", is_fault=False)
        if factor < 1.0 and settings is not None:
            why = f"they slip less than its wheel separation of {settings.separation:.4g} m assumes"
        text = f"it turns {_percent(1.0 / factor)} of what its wheels indicate, because {why}"
        hint = (
            f"give the drive a wheel separation that is {factor:.2g} times as large" if factor < inf else ""
        )
        controller = drive_controller(declared_drives(self._robot.robot))
        size = None if controller is None else controller.separation
        return _Cause(text, None if size is None else size.given.origin, hint, is_fault=False)

    def _dragging_part(self, link: str) -> _Cause:
        """A link other than wheels that drags on the ground, or the caster that scrubs."""
        drive = self._robot.drive
        is_caster = isinstance(drive, DifferentialDrive) and link in drive.casters
        found = self._faults(("D118",) if is_caster else _UNLOADS)
        text, origin = f"'{link}' drags on the ground", self._robot.robot.links[link].origin
        hint = "give it little friction" if is_caster else "raise it, or put a caster below it"
        return found or _Cause(text, origin, hint)

    def _askew_wheel(self, least: float) -> _Cause | None:
        """A driving wheel that rolls at an angle to the others: the sine of it is dragged across."""
        drive = self._robot.drive
        if not isinstance(drive, DifferentialDrive):
            return None
        leftward = drive.axle_in_base.rotation[:, 1]
        off = max(
            (float(np.linalg.norm(np.cross(w.axis, leftward))) for w in drive.wheels.values()), default=0.0
        )
        return self._faults(("D110",)) if off >= least else None

    def _loose_suspension(self, least: float) -> _Cause | None:
        """A joint above a wheel that gave way under the weight, because nothing holds it. It moves the wheel
        by the sine of its angle."""
        robot, drive, positions = self._robot.robot, self._robot.drive, self._robot.body.joint_positions
        if not isinstance(drive, DifferentialDrive):
            return None
        steering = drive.steering if isinstance(drive, SteeredDrive) else ()
        held = self._robot.joints.control.holds.union(steering)
        for wheel in drive.wheels.values():
            above = movable_above(robot, wheel.joint.parent)
            while above is not None:
                moved = abs(positions[above.name] - rest(above)) if above.name in positions else 0.0
                gives_way = moved > _GIVES_WAY and sin(min(moved, pi / 2.0)) >= least
                if above.type is JointType.REVOLUTE and above.name not in held and gives_way:
                    text = f"'{above.name}' gives way by {degrees(moved):.0f} degrees: nothing holds it"
                    return _Cause(text, above.origin, "add a controller that holds it")
                above = movable_above(robot, above.parent)
        return None

    def _slippery_wheel(self) -> _Cause | None:
        """The driving wheel with the least friction, if it has less than usual."""
        drive, model = self._robot.drive, self._engine.model
        if isinstance(drive, HolonomicDrive):  # its wheels slide freely, and the base has their friction
            friction = traction(self._robot.robot, drive).friction
            text = f"the coefficient of friction of the wheels is only {friction:g}"
            origin = next((self._robot.robot.links[link].origin for link in drive.tyres), None)
            return _Cause(text, origin, "raise their <mu1>") if friction < FRICTION else None
        frictions = {}
        for wheel in drive.wheels.values() if isinstance(drive, DifferentialDrive) else ():
            geoms = np.flatnonzero(model.geom_bodyid == self._robot.body.index(wheel.link))
            frictions[wheel.link] = float(model.geom_friction[geoms, 0].min(initial=FRICTION))
        link = min(frictions, key=frictions.__getitem__, default="")
        if not link or frictions[link] >= FRICTION:
            return None
        text = f"the coefficient of friction of '{link}' is only {frictions[link]:g}"
        return _Cause(text, self._robot.robot.links[link].origin, "raise its <mu1>")

    def _limits(self, seen: Standstill) -> _Cause:
        """The limit of speed, or of acceleration, that holds the wheels back."""
        wheels, robot = self._robot.wheels, self._robot.robot
        x, y, yaw = wheels.wanted if wheels is not None else STILL
        half = self._robot.drive.separation / 2.0 if isinstance(self._robot.drive, DifferentialDrive) else 0.0
        is_turn = half * abs(yaw) > hypot(x, y)
        unit, speed = ("rad/s", abs(yaw)) if is_turn else ("m/s", hypot(x, y))
        axis = 2 if is_turn else int(abs(y) > abs(x))
        fastest = wheels.fastest[axis] if wheels is not None else inf
        text = f"the limits of the drive allow only {_percent(seen.allowed)} of the commanded speed"
        if fastest < speed:
            limit, origin = self._speed_limit_of(fastest, is_turn=is_turn)
            return _Cause(f"{text}: {limit}", origin, "raise the velocity limit, or command a lower speed")
        settings = self._robot.settings
        if settings is None:
            return _unknown()
        limits = settings.limits
        most = limits.angular_acceleration if is_turn else limits.linear_acceleration
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*_ACCELERATION_LIMITS[is_turn])
        whose = "KBot's default limit" if given is None else "its limit"
        text = f"the start to {speed:g} {unit} takes {speed / most:.4g} s with {whose} of {most:.3g} {unit}^2"
        hint = "command a lower speed, in m/s and rad/s"
        return _Cause(text, None if given is None else given.origin, hint)

    def _why_weak(self) -> _Cause:
        seen = self._watch.weakness
        uphill, able = GRAVITY * sin(self._slope), self._motor_acceleration()
        if found := self._resistance():
            return found
        if uphill >= _MOST * able:
            return self._on_slope()
        weak = self._faults(_WEAK) if able < self._acceleration() else None
        return weak or (_unknown() if seen is None else self._weak_motor(seen))

    def _resistance(self) -> _Cause | None:
        """The damping and friction of a driving joint, if its torque limit is too small for these alone."""
        seen = self._watch.weakness
        if seen is None:
            return None
        damping, friction = resistance(self._robot.robot.joints[seen.joint])
        needed = damping * seen.commanded + friction
        if needed <= seen.most:
            return None
        name, origin, _ = self._torque_limit(seen.joint)
        text = (
            f"{name} of '{seen.joint}' is {seen.most:.3g} N m, but at {seen.commanded:.3g} rad/s its damping"
            f" and friction need {needed:.3g} N m, {needed / seen.most:.3g} times as much"
        )
        return _Cause(text, origin, f"write at least {needed:.3g} N m, or the joint's real <dynamics>")

    def _weak_motor(self, seen: Weakness) -> _Cause:
        """A driving joint whose motor is at its torque limit."""
        name, origin, most = self._torque_limit(seen.joint)
        text = f"the motor of '{seen.joint}' is at {name} of {most:.3g} N m"
        return _Cause(text, origin, "write the motor's torque, or the robot's real mass")

    def _torque_limit(self, joint: str) -> tuple[str, Origin | None, float]:
        """What limits the torque of a motor, where it is written, and to how many N m."""
        robot, settings = self._robot.robot, self._robot.settings
        own = inf if settings is None else settings.torque or inf
        if robot.joints[joint].effort_limit <= own:
            limit = robot.joints[joint].limit
            return (
                "the effort limit",
                limit.origin if limit is not None else None,
                robot.joints[joint].effort_limit,
            )
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*TORQUE)
        return "the drive's torque limit", given.origin if given is not None else None, own

    @property
    def _slope(self) -> float:
        """Angle in rad between the ground on which the robot rests and the plane across gravity."""
        if self._engine.has_failed or self._robot.body.root_qpos < 0:
            return 0.0
        _, normal = self._ground_below()
        gravity = self._engine.model.opt.gravity
        pull = float(np.linalg.norm(gravity))
        return acos(min(1.0, max(-1.0, -float(gravity @ normal) / pull))) if pull else 0.0

    def _on_slope(self) -> _Cause:
        text = f"the ground is not level: it rises by {degrees(self._slope):.0f} degrees"
        return _Cause(text, is_fault=False)


def _unknown(text: str = "the cause is not known", hint: str = "") -> _Cause:
    """No cause of the observation explains its size."""
    return _Cause(text, None, hint)


def _finding(code: str, what: str, cause: _Cause) -> Diagnostic:
    severity = Severity.WARNING if cause.is_fault else Severity.INFO
    return Diagnostic(code, severity, f"{what}: {cause.text}", cause.origin, cause.hint, cause.related)


def _link_of(model: mujoco.MjModel, geom: int) -> str:
    """The link of a robot's geometry."""
    return str(model.body(int(model.geom_bodyid[geom])).name).partition("/")[2]


def _in_degrees(radians: float, form: str, what: str = "") -> str:
    """An angle as text, or nothing if it is below 0.1 degrees."""
    angle = degrees(radians)
    return f"{angle:{form}} degrees{what}" if angle >= 0.1 else ""


def _joined(*texts: str) -> str:
    return " and ".join(filter(None, texts))


def _in_small_unit(seen: Excess) -> str:
    """What the command is if it means mm/s or degrees/s, or nothing if that does not fit the drive."""
    given = abs(seen.commanded)
    meant, small, unit = (
        (radians(given), "degrees/s", "rad/s") if seen.is_turn else (given / 1000.0, "mm/s", "m/s")
    )
    if not _SLOWEST * seen.allowed <= meant <= seen.allowed:
        return ""
    return f"{given:g} {small} are {meant:.3g} {unit}"


def _percent(share: float) -> str:
    return f"{round(share * 100.0, 0) + 0.0:.0f} %"  # 0 and not -0


def _share_of(seen: Miss) -> str:
    if seen.is_turn:
        return f"turns {_percent(seen.share)} of the commanded angle"
    return f"drives {_percent(seen.share)} of the commanded distance"


def _from_outside(seen: Explanation) -> _Cause | None:
    """The cause if something acted on the robot from outside."""
    if seen.touched:
        return _Cause(f"it touched '{seen.touched}' at {seen.touched_at:.1f} s", is_fault=False)
    if seen.disturbance:
        return _Cause(f"{seen.disturbance} acted on it", is_fault=False)
    if seen.flight is not None:
        return _Cause(f"it was in the air from {seen.flight:.1f} s on", is_fault=False)
    return None


def _first(codes: Sequence[str], faults: Sequence[Diagnostic]) -> _Cause | None:
    """The fault whose code comes first, as a cause."""
    fitting = [fault for fault in faults if fault.code in codes]
    if not fitting:
        return None
    found = min(fitting, key=lambda fault: codes.index(fault.code))
    is_fault = found.severity is not Severity.INFO
    return _Cause(f"{found.message} ({found.code})", found.origin, found.hint, is_fault, found.related)
