"""Findings about a run: what `MotionWatch` observed, with the cause that `MotionCauses` finds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import degrees, inf, radians

import mujoco

from kbot.kinematics.transform import Transform
from kbot.model import Mesh
from kbot.model.shapes import span_along
from kbot.sim.cause import Cause, percent
from kbot.sim.command_watch import Miss
from kbot.sim.drive.twist_controller import STILL
from kbot.sim.engine.engine import Engine
from kbot.sim.motion_causes import MotionCauses
from kbot.sim.motion_watch import MotionWatch
from kbot.sim.robot import SimulatedRobot
from kbot.sim.statics import angle_between, ground_below, ground_contacts, joint_loads
from kbot.text import Diagnostic, Severity

_SLOPE = radians(3.0)
"""Tilt in rad above which the ground is not level. A robot tilts less when it starts and stops."""
_DEEP = 0.005
"""Metres below the floor that are reported. Stiff contacts sink in by 0.01 mm, and soft ones by a few mm."""
_LEANS = radians(15.0)
"""Angle to the ground in rad from which a robot that rests on another part than its wheels and casters has
tipped over. One whose caster is too short leans less."""
_SAG = 0.05
"""Distance in rad or m from its target at which a held joint sags, if it also cannot carry its load. A joint
that settles on its target is nearer."""
_BELOW_WORLD = 0.5
"""Metres below the lowest fixed shape at which the robot has left the world. Its height is that of its root
link's origin, which may be a little below its wheels."""


class MotionFindings:
    """The findings about the first robot of a simulation. Each cause is looked up once."""

    def __init__(
        self,
        watch: MotionWatch,
        engine: Engine,
        robot: SimulatedRobot,
        off_ground: Diagnostic | None,
    ) -> None:
        """`off_ground` is the finding about a start without ground below it, or in the ground."""
        self._off_ground = off_ground
        self._watch, self._engine, self._robot = watch, engine, robot
        self._causes = MotionCauses(engine, robot)
        self._restart()

    def _restart(self) -> None:
        self._restarts = self._watch.restarts
        self._known: dict[str, Cause] = {}
        self._sunk: Diagnostic | None = None
        self._lost_since = inf
        """When the robot began to fall out of the world, in s."""

    def find(self) -> tuple[Diagnostic, ...]:
        """What was observed since the last reset, and whether the robot is below the floor now."""
        if self._restarts != self._watch.restarts:
            self._restart()
        found = [self._jump(), self._depth(), self._fall(), self._excess(), self._standstill()]
        found.append(self._weakness())
        # a limit of the drive explains a missed command also beside an error of odometry
        limited = self._miss() if self._is_limited and not any(found) else None
        found += [self._odometry(adds_miss=limited is None), self._sag(), limited]
        if not any(found):
            found.append(self._miss())
        return tuple(finding for finding in found if finding is not None)

    def _cause(self, key: str, look_up: Callable[[], Cause]) -> Cause:
        """The cause of an observation, which is looked up once: forces change, and a look takes longer than a
        period of the page."""
        if key not in self._known:
            self._known[key] = look_up()
        return self._known[key]

    # what follows from what

    @property
    def _ended(self) -> float:
        """When a jump happened or the robot fell out of the world, in s. What comes later follows from it."""
        jump = self._watch.jump
        return min(self._lost_since, inf if jump is None else jump.since)

    def _is_consequence(self, since: float) -> bool:
        """Whether something that was observed first at a time (s) follows from a jump or a fall."""
        fall = self._watch.fall
        return self._ended <= since or (fall is not None and fall.since <= since)

    # observations of the watch

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

    def _odometry(self, *, adds_miss: bool) -> Diagnostic | None:
        """W301. With `adds_miss` it also reports a missed command, which has the same cause."""
        seen, still = self._watch.odometry_error, self._watch.standstill
        if seen is None or self._is_consequence(seen.since):
            return None
        if still is not None and still.wheels_turn and still.since <= seen.since:
            return None  # a consequence: odometry counts the turns of wheels that move nothing
        off = _joined(f"{seen.position_error * 1e3:.0f} mm", _in_degrees(abs(seen.heading_error), ".1f"))
        way = f"{seen.distance:.2f} m" if seen.distance >= 0.005 else ""
        driven = _joined(way, _in_degrees(seen.rotation, ".0f", " of turns")) or "no motion"
        what = f"odometry is {percent(seen.share)} off: {off} after {driven}, first at {seen.since:.1f} s"
        missed = self._watch.miss
        what += f"; the robot {_share_of(missed)}" if missed is not None and adds_miss else ""
        return _finding("W301", what, self._cause("W301", lambda: self._causes.of_odometry_error(seen)))

    def _standstill(self) -> Diagnostic | None:
        """W302."""
        seen, weakness = self._watch.standstill, self._watch.weakness
        if seen is None or self._is_consequence(seen.since):
            return None
        if self._watch.excess is not None and seen.is_limited:
            return None  # a consequence: the robot drives as fast as it can
        what = (
            f"the robot hardly moves after {seen.since:.1f} s: it drives {percent(seen.share)} of the "
            "commanded distance"
        )
        cause = self._cause("W302", lambda: self._causes.of_standstill(seen, weakness))
        return _finding("W302", what, cause)

    def _excess(self) -> Diagnostic | None:
        """W305."""
        seen = self._watch.excess
        if seen is None:
            return None
        unit = "rad/s" if seen.is_turn else "m/s"
        what = (
            f"the command of {abs(seen.commanded):g} {unit} since {seen.since:.1f} s is far above the "
            f"{seen.allowed:.3g} {unit} that the drive allows"
        )
        return _finding("W305", what, self._cause("W305", lambda: self._causes.of_excess(seen)))

    def _weakness(self) -> Diagnostic | None:
        """W306 of a motor that drives."""
        seen = self._watch.weakness
        if seen is None or self._is_consequence(seen.since) or self._watch.standstill is not None:
            return None  # a robot that hardly moves is one finding, with the motor as its cause
        what = (
            f"the motor of '{seen.joint}' is too weak after {seen.since:.1f} s: it turns at {seen.speed:.3g}"
            f" of the commanded {seen.commanded:.3g} rad/s"
        )
        return _finding("W306", what, self._cause("W306", lambda: self._causes.of_weakness(seen)))

    def _miss(self) -> Diagnostic | None:
        """W307. What acted on the robot from outside, or holds it, explains it without a finding."""
        seen, watch = self._watch.miss, self._watch
        if seen is None or watch.explanation.is_known or self._causes.is_attached or watch.tilt > _SLOPE:
            return None
        what = f"the robot {_share_of(seen)} in {seen.seconds:.1f} s"
        return _finding("W307", what, self._cause_of_miss(seen))

    def _cause_of_miss(self, seen: Miss) -> Cause:
        # each command may have another cause
        return self._cause(f"W307 {seen.is_turn} {seen.wanted}", lambda: self._causes.of_miss(seen))

    @property
    def _is_limited(self) -> bool:
        """Whether a limit of the drive explains why the robot missed its command."""
        seen = self._watch.miss
        return seen is not None and self._cause_of_miss(seen).is_limit

    def _fall(self) -> Diagnostic | None:
        """W303."""
        seen = self._watch.fall
        if seen is None:
            return self._lean() if self._ended == inf else None
        if self._ended <= seen.since:
            return None
        cause = self._cause("W303", lambda: self._causes.of_fall(seen.twist, seen.explanation))
        return _finding("W303", f"the robot fell over at {seen.since:.1f} s", cause)

    # observations at the time of the call

    def _lean(self) -> Diagnostic | None:
        """W303 of a robot that tipped only until a part of it touched the ground."""
        if self._engine.has_failed or self._robot.body.root_qpos < 0:
            return None
        resting, normal = ground_below(*self._engine.current(), self._robot)
        angle = angle_between(self._watch.up, normal)
        if angle < _LEANS or not resting:
            return None
        twist = self._robot.wheels.twist if self._robot.wheels is not None else STILL
        cause = self._cause("W303", lambda: self._causes.of_fall(twist, self._watch.explanation))
        what = f"the robot leans by {degrees(angle):.0f} degrees and rests on '{resting[0]}'"
        return _finding("W303", what, cause)

    def _sag(self) -> Diagnostic | None:
        """W306 of a joint that is held, but whose effort limit is below its load."""
        body, joints = self._robot.body, self._robot.joints
        if self._engine.has_failed:
            return None
        here, servos = body.joint_positions, joints.servos
        targets = {
            name: servos.commanded_position(name) for name in servos.joints if name in joints.control.holds
        }
        sagging = [name for name, target in targets.items() if abs(here[name] - target) > _SAG]
        loads = joint_loads(*self._engine.current(), self._robot, targets) if sagging else {}
        causes = ((name, self._causes.of_sag(name, loads[name])) for name in sagging)
        return next((_finding("W306", f"'{name}' sags", cause) for name, cause in causes if cause), None)

    def _depth(self) -> Diagnostic | None:
        """W304. It remains until a restart. After a jump, nothing new is reported."""
        if self._engine.has_failed or (self._watch.jump is not None and self._sunk is None):
            return None
        if self._sunk is None:
            model, data = self._engine.current()
            self._sunk = self._below_world(model, data)
            if self._sunk is None and self._start is None:
                self._sunk = self._below_floor(model, data)
        return self._sunk

    @property
    def _start(self) -> Diagnostic | None:
        """The finding about a start without ground, or in it, if the robot was not placed since."""
        return self._off_ground if self._watch.begun == 0.0 else None

    def _below_world(self, model: mujoco.MjModel, data: mujoco.MjData) -> Diagnostic | None:
        """W304 of a robot that fell through the floor, or off its edge."""
        watch = self._watch
        fixed = data.geom_xpos[model.body_weldid[model.geom_bodyid] == 0, 2]
        height = self._robot.body.link_pose(self._robot.robot.root).translation[2]
        if height > fixed.min(initial=0.0) - _BELOW_WORLD:
            return None
        self._lost_since = self._engine.time if watch.flight is None else watch.flight
        cause = self._causes.of_loss(self._lost_since if watch.has_touched else None, self._start)
        what = f"at {self._engine.time:.1f} s the robot is at z = {height:.1f} m and falls"
        return _finding("W304", what, cause)

    def _below_floor(self, model: mujoco.MjModel, data: mujoco.MjData) -> Diagnostic | None:
        """W304 of a shape that reaches into the floor, visible or in a contact."""
        contacts = ((contact.depth, contact.link) for contact in ground_contacts(model, data, self._robot))
        depth, link = max((*contacts, *self._depths_of_shapes(model, data)), default=(0.0, ""))
        if depth < _DEEP:
            return None
        what = f"'{link}' reaches {depth * 1e3:.0f} mm below the floor"
        return _finding("W304", what, self._causes.of_depth(link, depth))

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


def _finding(code: str, what: str, cause: Cause) -> Diagnostic:
    severity = Severity.WARNING if cause.is_fault else Severity.INFO
    return Diagnostic(code, severity, f"{what}: {cause.text}", cause.origin, cause.hint, cause.related)


def _in_degrees(radians: float, form: str, what: str = "") -> str:
    """An angle as text, or nothing if it is below 0.1 degrees."""
    angle = degrees(radians)
    return f"{angle:{form}} degrees{what}" if angle >= 0.1 else ""


def _joined(*texts: str) -> str:
    return " and ".join(filter(None, texts))


def _share_of(seen: Miss) -> str:
    what = "turns {} of the commanded angle" if seen.is_turn else "drives {} of the commanded distance"
    return what.format(percent(seen.share))
