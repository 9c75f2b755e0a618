"""Findings about a run: what `MotionWatch` observed, with the finding about the robot that explains it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import acos, degrees, inf, radians

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.declared import declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.drive.wheels import movable_above
from kbot.kinematics.transform import Transform
from kbot.model import JointType, Mesh
from kbot.model.shapes import span_along
from kbot.sim.command_watch import SHORT, Miss
from kbot.sim.drive.settings import TORQUE
from kbot.sim.engine.base_servo import traction
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.joints import resistance, rest
from kbot.sim.motion_watch import STUCK, Excess, Explanation, MotionWatch, OdometryError, Standstill
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot
from kbot.text import Diagnostic, Origin, Related, Severity

_SAME = 0.01
"""Share by which a declared size may differ, as in D105 and D106."""
_SLOPE = radians(3.0)
"""Tilt in rad above which the ground is a likely cause."""
_SLIPPERY = 0.3
"""Coefficient of friction below which a wheel slips in ordinary driving. A tyre on snow has 0.3."""
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
_SLIPS = ("D112", "D128", "D116", "D110", "D111", "D115")
_WEAK = ("D119", "D117")
_TIPS = ("D115", "D116", "D112", "G106")


@dataclass(frozen=True, slots=True)
class _Cause:
    """Why something happened, and at which line. `is_fault`: whether the description is the reason.

    `is_limit`: a limit of the drive, which explains a missed command, but no error of odometry."""

    text: str
    origin: Origin | None = None
    hint: str = ""
    is_fault: bool = True
    related: tuple[Related, ...] = ()
    is_limit: bool = False


class MotionFindings:
    """The findings about the first robot of a simulation. Each cause is looked up once."""

    def __init__(self, watch: MotionWatch, engine: Engine, robot: SimulatedRobot, contacts: Contacts) -> None:
        self._watch, self._engine, self._robot = watch, engine, robot
        # with KBot's own contacts no caster scrubs
        self._slips = _SLIPS if contacts is Contacts.RECIPE else ("D118", *_SLIPS)
        self._causes: dict[str, _Cause] = {}
        self._sunk: Diagnostic | None = None
        self._restarts = watch.restarts

    def find(self) -> tuple[Diagnostic, ...]:
        """What was observed since the last reset, and whether the robot is below the floor now."""
        found = [self._fall(), self._depth(), self._excess(), self._standstill(), self._weakness()]
        limited = self._miss() if self._is_limited and not any(found) else None
        found += [self._odometry(limited is None), self._sag(), limited]
        if not any(found):
            found.append(self._miss())
        return tuple(finding for finding in found if finding is not None)

    # observations

    def _odometry(self, explains_miss: bool) -> Diagnostic | None:
        seen, still = self._watch.odometry_error, self._watch.standstill
        if seen is None or self._follows_from_fall(seen.since):
            return None
        if still is not None and still.wheels_turn and still.since <= seen.since:
            return None  # a consequence: odometry counts the turns of wheels that move nothing
        off = _joined(f"{seen.position_error * 1e3:.0f} mm", _in_degrees(abs(seen.heading_error), ".1f"))
        way = f"{seen.distance:.2f} m" if seen.distance >= 0.005 else ""
        driven = _joined(way, _in_degrees(seen.rotation, ".0f", " of turns")) or "no motion"
        what = f"odometry is {_percent(seen.share)} off: {off} after {driven}, first at {seen.since:.1f} s"
        missed = self._watch.miss
        what += f"; the robot {_share_of(missed)}" if missed is not None and explains_miss else ""
        cause = self._cause("W301", seen.explanation, lambda: self._why_off(seen))
        return _finding("W301", what, cause)

    def _standstill(self) -> Diagnostic | None:
        seen = self._watch.standstill
        if seen is None or self._follows_from_fall(seen.since):
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
        if seen is None or self._follows_from_fall(seen.since) or self._watch.standstill is not None:
            return None  # a robot that hardly moves is one finding, with the motor as its cause
        what = (
            f"the motor of '{seen.joint}' is too weak after {seen.since:.1f} s: it turns at {seen.speed:.3g}"
            f" of the commanded {seen.commanded:.3g} rad/s"
        )
        return _finding("W306", what, self._cause("W306", seen.explanation, self._why_weak))

    def _miss(self) -> Diagnostic | None:
        """W307. What acted on the robot from outside, or holds it, explains it without a finding."""
        seen = self._watch.miss
        if seen is None or self._watch.explanation.is_known or self._attached() or self._slope():
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

    def _follows_from_fall(self, since: float) -> bool:
        fall = self._watch.fall
        return fall is not None and fall.since <= since

    def _fall(self) -> Diagnostic | None:
        seen = self._watch.fall
        if seen is None:
            return self._lean()
        cause = self._cause("W303", seen.explanation, self._why_fallen)
        return _finding("W303", f"the robot fell over at {seen.since:.1f} s", cause)

    def _lean(self) -> Diagnostic | None:
        """W303 of a robot that tipped only until a part of it touched the ground. Seen at this call."""
        if self._engine.has_failed or self._robot.body.root_qpos < 0:
            return None
        resting, normal = self._ground_below()
        angle = acos(min(1.0, float(self._watch.up @ normal)))
        if angle < _LEANS or not resting:
            return None
        cause = self._cause("W303", self._watch.explanation, self._why_fallen)
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
        if engine.has_failed:
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
        touches = [link for link in self._robot.robot.links.values() if link.collisions]
        if not touches:
            origin = self._robot.robot.origin
            return _finding(
                "W304", what, _Cause("no link has a <collision>", origin, "add <collision> to the links")
            )
        return _finding(
            "W304", what, _Cause("it drove off the edge of the ground, or fell through it", is_fault=False)
        )

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
        cause = faults or _Cause(
            "its contact is too soft for the weight" if collides else "it has no <collision>",
            self._robot.robot.links[link].origin,
            "raise <kp> of its surface" if collides else "add a <collision>, or move the link up",
        )
        return _finding("W304", f"'{link}' reaches {deepest * 1e3:.0f} mm below the floor", cause)

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
            self._restarts, self._sunk = self._watch.restarts, None
            self._causes.clear()

    def _attached(self) -> _Cause | None:
        """An attachment of the robot, which pulls it or holds it."""
        own = self._robot.body.prefix
        welds = self._engine.assembly.welds
        is_held = any(body.startswith(own) for weld in welds for body in (weld.first, weld.second))
        return _Cause("it is attached to something", is_fault=False) if is_held else None

    def _why_off(self, seen: OdometryError) -> _Cause:
        declared = [
            code
            for code, odometry, true, factor in (
                ("D106", seen.odometry_distance, seen.distance, self._declared_factors()[0]),
                ("D105", seen.odometry_rotation, seen.rotation, self._declared_factors()[1]),
            )
            if abs(odometry - true) > max(_SAME * true, 2.0 * abs(odometry - factor * true))
        ]
        return (
            self._slipping_tracks()
            or self._drive_fault((*_SIDES, *declared))
            or self._faults(self._slips)
            or self._slippery_wheel()
            or self._dragging_part()
            or self._skids(seen)
            or self._loose_suspension()
            or self._hanging_wheel()
            or self._slope()
            or _Cause(
                "the wheels slip",
                self._robot.robot.origin,
                "check the load on the wheels and their friction",
            )
        )

    def _declared_factors(self) -> tuple[float, float]:
        """By which factors odometry's distances and turns are off because of the declared sizes."""
        drive, settings = self._robot.drive, self._robot.settings
        if not isinstance(drive, DifferentialDrive) or settings is None:
            return 1.0, 1.0
        radius = settings.radius / drive.radius
        return radius, radius * drive.separation / settings.separation

    def _why_still(self, seen: Standstill) -> _Cause:
        if seen.allowed < 2.0 * STUCK:
            return self._limits(seen)
        if seen.wheels_turn:
            found = self._faults(self._slips) or self._slippery_wheel() or self._dragging_part()
            found = found or self._hanging_wheel()
            return found or self._slope() or _Cause("the wheels turn and slip", self._robot.robot.origin)
        if not self._has_motors:
            return (
                self._dragging_part()
                or self._slope()
                or _Cause("something holds it", self._robot.robot.origin)
            )
        found = self._resistance() or self._faults(_WEAK) or self._weak_motor() or self._slope()
        return found or _Cause(
            "its wheels do not turn", self._robot.robot.origin, "check what blocks the wheels"
        )

    @property
    def _has_motors(self) -> bool:
        """Whether joints drive the robot. A plugin may move the base itself, or turn tracks."""
        drive = self._robot.drive
        return isinstance(drive, DifferentialDrive) and bool(drive.joints)

    def _why_far(self, seen: Excess) -> _Cause:
        text, origin = self._speed_limit_of(seen)
        small = _in_small_unit(seen)
        hint = f"cmd_vel takes m/s and rad/s: {small}" if small else "command a lower speed, in m/s and rad/s"
        return _Cause(text, origin, hint)

    def _speed_limit_of(self, seen: Excess) -> tuple[str, Origin | None]:
        """What limits the speed, and where it is written: the controller, or the joint of a wheel."""
        robot, drive = self._robot.robot, self._robot.drive
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*_SPEED_LIMITS[seen.is_turn])
        if controller is not None and given is not None and given.number == seen.allowed:
            return f"{controller.name} limits it with {given.name}", given.origin
        joints = drive.joints if isinstance(drive, DifferentialDrive) else ()
        name = min(joints, key=lambda joint: robot.joints[joint].speed_limit, default="")
        limit = robot.joints[name].limit if name else None
        if limit is None:
            return "the controller limits the speed", robot.origin
        return f"'{name}' has a velocity limit of {robot.joints[name].speed_limit:g} rad/s", limit.origin

    def _why_missed(self, seen: Miss) -> _Cause:
        """The limits of the drive, the direction of its wheels, sizes that are off, weak motors, or slip."""
        off = abs(seen.share - seen.odometry)
        limits = self._limit_of(seen) or self._steering_limit(seen)
        if limits is not None and seen.share < 1.0:
            return limits
        found = self._drive_fault(("D132", *(("D106", "D105") if off > _SAME else ())))
        if found is not None:
            return found
        drive = self._robot.drive
        if isinstance(drive, SteeredDrive) and drive.sideways and (1.0 - seen.share) * seen.seconds < _STEERS:
            origin = self._robot.robot.joints[drive.steering[0]].origin
            return _Cause("its wheels first steer into this direction", origin, is_fault=False)
        if self._has_motors and seen.odometry < 1.0 - SHORT[seen.is_turn] and off < 1.0 - seen.odometry:
            slow = self._slippery_wheel() or self._slow_motor()
            return slow or _Cause("its wheels turn more slowly than commanded", self._robot.robot.origin)
        slips = self._faults(self._slips) or self._slippery_wheel() or self._dragging_part()
        text = "the wheels slip" if self._has_motors else "something holds it"
        found = slips or self._loose_suspension() or self._hanging_wheel()
        return found or _Cause(text, self._robot.robot.origin)

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
            excess = Excess(0.0, seen.wanted[axis], wheels.fastest[axis], seen.is_turn)
            text, origin = self._speed_limit_of(excess)
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

    def _slow_motor(self) -> _Cause | None:
        """A torque limit that the motors needed to start, or still need."""
        drive, settings = self._robot.drive, self._robot.settings
        if not isinstance(drive, DifferentialDrive) or settings is None:
            return None
        torque = settings.torque or inf
        name = min(drive.joints, key=lambda joint: self._robot.robot.joints[joint].effort_limit, default="")
        most = min(self._robot.robot.joints[name].effort_limit, torque) if name else inf
        if most == inf:
            return None
        limit, origin = self._torque_limit(name, most)
        text = f"{limit} of '{name}' is {most:.3g} N m, which is too little to start in an ordinary time"
        return _Cause(text, origin, "write the motor's torque, or the robot's real mass", is_fault=False)

    def _why_fallen(self) -> _Cause:
        text = "its centre of mass is too high for this acceleration, turning speed or slope"
        return (
            self._faults(_TIPS)
            or self._heavy_wheel()
            or _Cause(text, self._robot.robot.origin, "lower the heavy parts, or the acceleration")
        )

    def _heavy_wheel(self) -> _Cause | None:
        """A driving wheel with an inertia that is far too large: starting it turns the body backwards."""
        drive = self._robot.drive
        wheels = drive.wheels.values() if isinstance(drive, DifferentialDrive) else ()
        found = (self._faults(("I108",), wheel.link) for wheel in wheels)
        return next((cause for cause in found if cause is not None), None)

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

    def _slipping_tracks(self) -> _Cause | None:
        """The slip of tracks in a turn, which odometry of gz's TrackedVehicle does not take into account."""
        drive, controller = self._robot.drive, drive_controller(declared_drives(self._robot.robot))
        if not isinstance(drive, HolonomicDrive) or drive.efficiency == 1.0 or controller is None:
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
        """Several axles, whose wheels are dragged sideways in a turn."""
        drive, settings = self._robot.drive, self._robot.settings
        if not isinstance(drive, DifferentialDrive) or settings is None or len(drive.left) < 2:
            return None
        factor = seen.odometry_rotation / seen.rotation if seen.rotation else inf
        if seen.odometry_rotation > (1.0 + _SAME) * max(seen.rotation, 0.1):
            why = f"a turn drags the wheels of {len(drive.left)} axles across the ground"
        elif seen.odometry_rotation > 0.1 and factor < 1.0 - _SAME and settings.separation > drive.separation:
            why = f"they slip less than its wheel separation of {settings.separation:.4g} m assumes"
        else:
            return None
        text = f"it turns {_percent(1.0 / factor)} of what its wheels indicate, because {why}"
        hint = f"give the drive a wheel separation that is {factor:.2g} times as large"
        return _Cause(text, self._robot.robot.origin, hint if factor < inf else "", is_fault=False)

    def _dragging_part(self) -> _Cause | None:
        """A part other than wheels and casters that rests on the ground now."""
        resting, _ = self._ground_below()
        if not resting:
            return None
        text = f"'{resting[0]}' drags on the ground"
        return _Cause(text, self._robot.robot.links[resting[0]].origin, "raise it, or put a caster below it")

    def _loose_suspension(self) -> _Cause | None:
        """A joint above a wheel that gave way under the weight, because nothing holds it."""
        robot, drive, positions = self._robot.robot, self._robot.drive, self._robot.body.joint_positions
        if not isinstance(drive, DifferentialDrive):
            return None
        steering = drive.steering if isinstance(drive, SteeredDrive) else ()
        held = self._robot.joints.control.holds.union(steering)
        for wheel in drive.wheels.values():
            above = movable_above(robot, wheel.joint.parent)
            while above is not None:
                moved = abs(positions[above.name] - rest(above)) if above.name in positions else 0.0
                if above.type is JointType.REVOLUTE and above.name not in held and moved > _GIVES_WAY:
                    text = f"'{above.name}' gives way by {degrees(moved):.0f} degrees: nothing holds it"
                    return _Cause(text, above.origin, "add a controller that holds it")
                above = movable_above(robot, above.parent)
        return None

    def _hanging_wheel(self) -> _Cause | None:
        """A driving wheel that touches nothing now."""
        engine, drive = self._engine, self._robot.drive
        if not isinstance(drive, DifferentialDrive):
            return None
        model, data = engine.current()
        touching = set(model.geom_bodyid[np.unique(data.contact.geom)].tolist())
        for name in drive.joints if len(drive.joints) <= 2 else ():  # of four wheels one may hang
            wheel = drive.wheels[name]
            if self._robot.body.index(wheel.link) not in touching:
                origin = wheel.joint.pose.origin or wheel.joint.origin
                text = f"the wheel '{wheel.link}' does not touch the ground"
                return _Cause(text, origin, "lower the wheel, or raise what lifts it")
        return None

    def _slippery_wheel(self) -> _Cause | None:
        """A driving wheel with little friction."""
        drive, model = self._robot.drive, self._engine.model
        if isinstance(drive, HolonomicDrive):  # its wheels slide freely, and the base has their friction
            friction = traction(self._robot.robot, drive).friction
            text = f"the coefficient of friction of the wheels is only {friction:g}"
            slips = friction < _SLIPPERY
            return _Cause(text, self._robot.robot.origin, "raise their <mu1>") if slips else None
        for wheel in drive.wheels.values() if isinstance(drive, DifferentialDrive) else ():
            geoms = np.flatnonzero(model.geom_bodyid == self._robot.body.index(wheel.link))
            friction = float(model.geom_friction[geoms, 0].min(initial=1.0))
            if friction < _SLIPPERY:
                text = f"the coefficient of friction of '{wheel.link}' is only {friction:g}"
                return _Cause(text, self._robot.robot.links[wheel.link].origin, "raise its <mu1>")
        return None

    def _limits(self, seen: Standstill) -> _Cause:
        """The limit of speed that holds the wheels back."""
        robot, drive = self._robot.robot, self._robot.drive
        text = f"the limits of the drive allow only {_percent(seen.allowed)} of the commanded speed"
        joints = drive.joints if isinstance(drive, DifferentialDrive) else ()
        name = min(joints, key=lambda joint: robot.joints[joint].speed_limit, default="")
        limit = robot.joints[name].limit if name else None
        twist = self._robot.commanded_twist
        if (
            limit is None
            or not isinstance(drive, DifferentialDrive)
            or robot.joints[name].speed_limit > drive.rim_speed(twist.x, twist.y, twist.yaw) / drive.radius
        ):
            return _Cause(text, robot.origin, "command a lower speed, or raise the controller's limits")
        text += f": '{name}' has a velocity limit of {robot.joints[name].speed_limit:g} rad/s"
        return _Cause(text, limit.origin, "raise the velocity limit, or command a lower speed")

    def _why_weak(self) -> _Cause:
        found = self._resistance() or self._faults(_WEAK) or self._slope() or self._weak_motor()
        return found or _Cause("its load is too high")

    def _resistance(self) -> _Cause | None:
        """The damping and friction of a driving joint, if its torque limit is too small for these alone."""
        seen = self._watch.weakness
        if seen is None:
            return None
        damping, friction = resistance(self._robot.robot.joints[seen.joint])
        needed = damping * seen.commanded + friction
        if needed <= seen.most:
            return None
        name, origin = self._torque_limit(seen.joint, seen.most)
        text = (
            f"{name} of '{seen.joint}' is {seen.most:.3g} N m, but at {seen.commanded:.3g} rad/s its damping"
            f" and friction need {needed:.3g} N m, {needed / seen.most:.3g} times as much"
        )
        return _Cause(text, origin, f"write at least {needed:.3g} N m, or the joint's real <dynamics>")

    def _weak_motor(self) -> _Cause | None:
        """A driving joint whose motor is at its torque limit."""
        seen = self._watch.weakness
        if seen is None:
            return None
        name, origin = self._torque_limit(seen.joint, seen.most)
        text = f"the motor of '{seen.joint}' is at {name} of {seen.most:.3g} N m"
        return _Cause(text, origin, "write the motor's torque, or the robot's real mass")

    def _torque_limit(self, joint: str, most: float) -> tuple[str, Origin | None]:
        """What limits the torque of a motor to `most` N m, and where it is written."""
        robot = self._robot.robot
        if most == robot.joints[joint].effort_limit:
            limit = robot.joints[joint].limit
            return "the effort limit", limit.origin if limit is not None else None
        controller = drive_controller(declared_drives(robot))
        given = None if controller is None else controller.first(*TORQUE)
        return "the drive's torque limit", given.origin if given is not None else robot.origin

    def _slope(self) -> _Cause | None:
        tilt = self._watch.tilt
        text = f"the ground is not level: the robot tilted by up to {degrees(tilt):.0f} degrees"
        return _Cause(text, is_fault=False) if tilt > _SLOPE else None


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
    return None


def _first(codes: Sequence[str], faults: Sequence[Diagnostic]) -> _Cause | None:
    """The fault whose code comes first, as a cause."""
    fitting = [fault for fault in faults if fault.code in codes]
    if not fitting:
        return None
    found = min(fitting, key=lambda fault: codes.index(fault.code))
    is_fault = found.severity is not Severity.INFO
    return _Cause(f"{found.message} ({found.code})", found.origin, found.hint, is_fault, found.related)
