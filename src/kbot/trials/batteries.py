"""The batteries: scenarios for any base that drives, whose commands follow from its size and declared limits.

Each battery is a function of a robot's facts. Its docstring gives the formulas. Notation: L is the longer
side of the outline, r the radius of the wheels, b the separation of the wheels, m the mass, g gravity, v the
cruising speed (`cruising_speed`) and w the turning speed (`turning_speed`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.spatial import GRAVITY
from kbot.model import RobotModel
from kbot.navigation.controller import ControllerLimits
from kbot.sim.injected_faults import Payload
from kbot.sim.numbers import Vector
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.actions import Command, Goal, InjectFault, Push
from kbot.trials.commanded_motion import CommandedMotion
from kbot.trials.expectations import Bound, Expectation, NeverTouches, Reaches, Settles, StaysUpright
from kbot.trials.robot_facts import RobotFacts, robot_facts
from kbot.trials.scenario import Range, Scenario, Step
from kbot.world.builders import WALL_THICKNESS

POSITION = 0.03
"""Largest distance from the commanded end, as a share of the path. Wheels of 1.1 times the size give 0.1."""
HEADING, LEAST_HEADING = 0.03, math.radians(2.0)
"""Largest error of the heading, as a share of the commanded turn and in rad; the larger counts."""
ODOMETRY = 0.02
"""Largest error of odometry, as a share of the path. The robots of Borenstein and Feng (1996) were off by
about 2 % before calibration and by 0.2 % after it."""
SLIPPING_TURN = (0.2, 1.1)
"""Turn of a base that turns by slipping, as a share of the commanded turn. Coulomb's law gives less than 1,
and how much depends on the load of each tyre (see docs/explanation/wheels-on-the-ground.md)."""
AGREEMENT = 0.5
"""Least agreement of a motion with its command: 1 if all of it has the commanded direction, -1 if none has.
Where one curve follows another, a robot turns the old way until it has slowed down."""
LEVEL = 0.01
"""Largest tilt of a base at rest on level ground, in rad: a centimetre per metre."""
REST = 0.5
"""Seconds after the last commanded motion within which a robot is at rest."""
NAVIGATION_SPEED = ControllerLimits().linear
"""Speed in m/s of a robot that follows a path."""


class NotApplicable(KbotError):
    """A battery that a robot cannot run, with the reason."""


def cruising_speed(facts: RobotFacts) -> float:
    """The speed of most batteries, m/s: min(V / 2, sqrt(a L), sqrt(g r)).

    V is the declared top speed and a the limit of acceleration: the robot reaches the speed within L / 2. The
    third term is a Froude number of 1 for the wheels, which makes small and large robots comparable and holds
    for robots without declared limits.
    """
    limits = facts.settings.limits
    return min(
        facts.top_speeds[0] / 2.0,
        math.sqrt(limits.linear_acceleration * facts.size),
        math.sqrt(GRAVITY * facts.drive.radius),
    )


def turning_speed(facts: RobotFacts) -> float:
    """The speed of turns on the spot, rad/s: min(W / 2, 2 v / b, sqrt(pi / 4 c)).

    W is the declared top turning speed and c the limit of angular acceleration: the robot reaches the speed
    within an eighth of pi. The second term is a wheel at the cruising speed. Tyres that slip hop above 1
    rad/s (see `sim/recipe.py`), so such a base turns at 1 rad/s at most.
    """
    limits = facts.settings.limits
    return min(
        facts.top_speeds[2] / 2.0,
        2.0 * cruising_speed(facts) / facts.drive.separation,
        math.sqrt(math.pi / 4.0 * limits.angular_acceleration),
        1.0 if facts.slips else math.inf,
    )


def straight(facts: RobotFacts) -> Scenario:
    """Drive straight ahead.

    The command is v for 10 L. The end is where the commands lead within 3 % of the way. The heading stays
    within 2 degrees: wheels that differ by a share e turn the robot by e 10 L / b, for a tenth at least 1
    rad. Odometry is off by at most 2 %.
    """
    motion = CommandedMotion(facts)
    speed = cruising_speed(facts)
    motion.drive(speed, 0.0, 10.0 * facts.size / speed)
    motion.stop()
    return _commanded("straight", facts, motion)


def circle(facts: RobotFacts) -> Scenario:
    """Drive a circle to the left.

    The speed is v and the radius max(1.5 L, 1.2 R). R is the smallest radius of a base that steers.

    The robot returns to its start within 3 % of the circumference, after one turn to the left within 3 %. A
    separation that is wrong by a tenth turns it by 36 degrees too far, which moves the end by
    2 sin(18 degrees) / 2 pi, 10 % of the circumference.
    """
    motion = CommandedMotion(facts)
    _arc(motion, facts, 2.0 * math.pi)
    motion.stop()
    return _commanded("circle", facts, motion)


def figure_of_eight(facts: RobotFacts) -> Scenario:
    """Drive a circle to the left, then one to the right.

    The circles and the bounds are those of `circle`.
    """
    motion = CommandedMotion(facts)
    _arc(motion, facts, 2.0 * math.pi)
    _arc(motion, facts, -2.0 * math.pi)
    motion.stop()
    return _commanded("figure_of_eight", facts, motion)


def square(facts: RobotFacts) -> Scenario:
    """Drive the square path of UMBmark to the left, then to the right.

    The sides are 5 L long, and the robot stops at each corner.

    J. Borenstein and L. Feng, "Measurement and correction of systematic odometry errors in mobile robots",
    IEEE Transactions on Robotics and Automation 12 (1996): errors of the wheels' sizes and of their
    separation add up in one direction and cancel in the other, so both are driven. The largest error of
    odometry is at most 2 % of one square. The robot returns to its start within 3 % of the path.

    A base that cannot turn on the spot drives the corners as arcs, like those of `circle`. A base that drives
    sideways drives the second square without turning.
    """
    motion = CommandedMotion(facts)
    speed = cruising_speed(facts)
    seconds = 5.0 * facts.size / speed
    for sense in (1.0, -1.0):
        for side in range(4):
            if sense < 0.0 and facts.drives_sideways:
                angle = -side * math.pi / 2.0
                motion.drive(speed * round(math.cos(angle)), 0.0, seconds, speed * round(math.sin(angle)))
                motion.stop()
                continue
            motion.drive(speed, 0.0, seconds)
            if facts.turns_in_place:
                motion.stop()
                _turn(motion, facts, sense * math.pi / 2.0)
                motion.stop()
            else:
                _arc(motion, facts, sense * math.pi / 2.0)
    motion.stop()
    found = _commanded("square", facts, motion)
    if facts.slips:
        return found
    odometry = Bound("max_odometry_error", max=ODOMETRY * motion.path_length / 2.0)
    return replace(found, expect=(*found.expect, odometry))


def slope(facts: RobotFacts) -> Scenario:
    """Stand on a slope, drive up, and stop.

    The robot stands for 0.5 s, and then drives 4 L at v. The angle is at most 15 degrees. Its tangent is at
    most 0.6 of the steepest slope that the tyres climb with a friction of 1 (`RobotFacts.traction_slope`),
    and 0.5 of the slope on which the robot falls over. So tyres with half of this friction,
    and motors that cannot lift m g sin(angle), fail. The robot gets at least 90 % of the commanded way,
    because tyres slip more under load, and keeps its heading within 5 degrees.
    """
    tangents = math.tan(math.radians(15.0)), 0.6 * facts.traction_slope, 0.5 * facts.tipping_slope
    angle = math.floor(10.0 * math.degrees(math.atan(min(tangents))) + 1e-6) / 10.0
    if angle < 1.0:
        raise NotApplicable(
            f"'slope' does not apply: robot '{facts.robot.name}' slips or falls over on a slope of 1 degree"
        )
    motion = CommandedMotion(facts, at=0.5)
    motion.drive(cruising_speed(facts), 0.0, 4.0 * facts.size / cruising_speed(facts))
    motion.stop()
    motion.wait(1.0)
    way, turn = motion.path_length, math.radians(5.0)
    return Scenario(
        "slope",
        motion.time,
        motion.steps,
        (
            Bound("final_forward", min=0.9 * way, max=1.05 * way),
            Bound("final_turn", min=-turn, max=turn),
            StaysUpright(),
        ),
        world=f"incline:angle={angle:.1f}",
    )


def step(facts: RobotFacts) -> Scenario:
    """Drive onto a step, and stop on it.

    The speed is v / 2. The height of the step is a tenth of r, at most 1 cm. The robot is on the step at
    the end: its base is higher by the height of the step within a quarter. Its heading is within 10 degrees,
    and it gets three quarters of the commanded way: on an edge, casters take load from the tyres, which slip.
    """
    if facts.is_on_boxes:
        raise NotApplicable(
            f"'step' does not apply: the tracks of robot '{facts.robot.name}' are boxes, "
            "which cannot climb an edge"
        )
    size, speed = facts.size, 0.5 * cruising_speed(facts)
    rise = min(0.01, 0.1 * facts.drive.radius)
    start = PlanarPose(0.5 - facts.high[0] - 0.2 * size, -(facts.low[1] + facts.high[1]) / 2.0)
    motion = CommandedMotion(facts, start)
    motion.drive(speed, 0.0, 2.0 * size / speed)
    motion.stop()
    motion.wait(REST)
    return Scenario(
        "step",
        motion.time,
        motion.steps,
        (
            Bound("final_up", min=0.75 * rise, max=1.25 * rise),
            Bound("final_forward", min=0.75 * motion.path_length, max=1.05 * motion.path_length),
            Bound("final_turn", min=-math.radians(10.0), max=math.radians(10.0)),
            StaysUpright(),
        ),
        world=f"stairs:steps=1,height={rise:.5f},depth={_up(3.0 * size)},width={_up(4.0 * facts.width)}",
        start=start,
    )


def emergency_stop(facts: RobotFacts) -> Scenario:
    """Stop from the top speed: forwards, backwards, sideways, and turning.

    Each command is 1.5 times the declared top speed, until half a second after the robot has its speed, at
    most 10 s. Without a declared top speed it is 2 v, and without a declared turning speed 2 w. Only bases
    that drive sideways do so. Bases that cannot turn on the spot do not turn, nor do those that slip in turns
    unless they declare a turning speed.

    The robot ends where its declared limits lead within 3 % of the path, tilts by at most 10 degrees, and is
    at rest 0.5 s after its controller commands rest.
    """
    motion = CommandedMotion(facts)
    limits = facts.settings.limits
    linear, lateral, angular = facts.top_speeds
    speed, seconds = _beyond(linear, cruising_speed(facts), limits.linear_acceleration)
    for direction in (1.0, -1.0):
        motion.drive(direction * speed, 0.0, seconds)
        motion.stop()
        motion.wait(REST)
    if facts.drives_sideways:
        speed, seconds = _beyond(lateral, cruising_speed(facts), limits.lateral_acceleration)
        motion.drive(0.0, 0.0, seconds, speed)
        motion.stop()
        motion.wait(REST)
    if facts.turns_in_place and (math.isfinite(angular) or not facts.slips):
        rate, seconds = _beyond(angular, turning_speed(facts), limits.angular_acceleration)
        motion.drive(0.0, rate, seconds)
        motion.stop()
    return _commanded("emergency_stop", facts, motion, Bound("max_tilt", max=math.radians(10.0)))


def _beyond(top: float, usual: float, acceleration: float) -> tuple[float, float]:
    """A command beyond the top speed, and how long it takes to reach it."""
    speed = 1.5 * top if math.isfinite(top) else 2.0 * usual
    return speed, min(10.0, speed / acceleration + REST)


def push(facts: RobotFacts) -> Scenario:
    """Push the robot to the side and forwards.

    The push to the side makes the tyres slide, and the one forwards is held by the motors. The first force is
    1.5 m g: more than any tyre with a coefficient of friction of 1 holds. It acts at a third of the height of
    the centre of mass, where its moment and that of the friction m g cancel, so that all tyres keep their
    load. It lasts until the robot has the speed sqrt(2 g s), from which it slides by s = L / 4. A robot whose
    centre of mass is higher than its supports are wide could fall over, so s is at most half of the rise of
    the centre of mass that this takes: s = (sqrt(h^2 + e^2) - h) / 2 at the height h and the distance e from
    the outermost support. The second force is 0.2 m g for 0.5 s, at the ground.

    The robot stays upright and comes to rest. With its whole weight on such tyres it would move by 3 s in
    all. With a third of it, and the rest on casters that slide freely, it moves by 7 times as much, which is
    the bound.
    """
    height, room = facts.centre_height, facts.room_beside
    slide = facts.size / 4.0
    if height > room:
        slide = min(slide, (math.hypot(height, room) - height) / 2.0)
    speed = math.sqrt(2.0 * GRAVITY * slide)
    seconds = max(0.01, speed / (0.5 * GRAVITY))
    weight = facts.mass * GRAVITY
    steps = (
        Step(_push(facts, (0.0, 1.5 * weight, 0.0), seconds, height / 3.0), at=0.5),
        Step(_push(facts, (0.2 * weight, 0.0, 0.0), 0.5, 0.0), at=2.5),
    )
    way = 7.0 * 3.0 * slide
    return Scenario(
        "push",
        4.0,
        steps,
        (StaysUpright(), Settles(0.5 + REST), Bound("path_length", max=way + 0.1 * facts.size)),
    )


def payload(facts: RobotFacts) -> Scenario:
    """Drive and turn with a load of half of the mass.

    The robot drives 5 L at v, turns by 90 degrees and drives 5 L again. The load is above the centre of mass,
    at twice its height but not above the top. A base that cannot turn on the spot drives an arc as in
    `circle`, and one that slips does not turn. The bounds are those of `straight`, and the robot tilts by at
    most 5 degrees.
    """
    motion = CommandedMotion(facts)
    speed = cruising_speed(facts)
    seconds = 5.0 * facts.size / speed
    motion.drive(speed, 0.0, seconds)
    if not facts.slips:
        if facts.turns_in_place:
            motion.stop()
            _turn(motion, facts, math.pi / 2.0)
            motion.stop()
        else:
            _arc(motion, facts, math.pi / 2.0)
        motion.drive(speed, 0.0, seconds)
    motion.stop()
    x, y, _ = facts.centre_of_mass
    top = facts.ground + min(2.0 * facts.centre_height, facts.height)
    at = facts.heaviest_pose.inverse().apply((x, y, top)).tolist()
    load = Payload(facts.heaviest, facts.mass / 2.0, (at[0], at[1], at[2]))
    found = _commanded("payload", facts, motion, Bound("max_tilt", max=math.radians(5.0)))
    return replace(found, steps=(Step(InjectFault(load)), *found.steps))


def narrow_gate(facts: RobotFacts) -> Scenario:
    """Drive straight through a door into the next room.

    The way is from the middle of one room to that of the other. The door is 1.2 times as wide as the
    robot, and the rooms are 6 L, at least 1.2 m. The robot touches nothing. Wheels that differ by a tenth
    move it aside by 0.1 d^2 / 2 b over the distance d = 3 L to the door: more than half of its width.
    """
    size, speed = max(6.0 * facts.size, 1.2), cruising_speed(facts)
    motion = CommandedMotion(facts, PlanarPose(0.0, -(facts.low[1] + facts.high[1]) / 2.0))
    motion.drive(speed, 0.0, size / speed)
    motion.stop()
    found = _commanded("narrow_gate", facts, motion)
    return replace(
        found,
        world=f"rooms:columns=2,rows=1,size={_up(size)},door={_up(1.2 * facts.width + WALL_THICKNESS)}",
        start=motion.start,
    )


def rooms(facts: RobotFacts) -> Scenario:
    """Drive to a goal in the opposite of four rooms.

    The way leads through two doors. The doors are 2.5 times the reach plus 0.1 m wide, so that the robot can
    turn in them. The rooms are 6 times the reach plus 1.2 m. The robot reaches the goal in the time of twice
    the way at 0.3 m/s, its speed on a path, and touches nothing.
    """
    size, door = _up(6.0 * facts.reach + 1.2), _up(2.5 * facts.reach + 0.1)
    world = f"rooms:columns=2,rows=2,size={size},door={door}"
    return _to_goal("rooms", facts, Goal(size, size), world, 2.0 * size)


def maze(facts: RobotFacts) -> Scenario:
    """Drive to the opposite corner of a maze of 3 x 3 cells.

    There are two seeds. The cells are 3 times the reach plus 0.2 m. The way is at most through all cells. The
    bounds are those of `rooms`.
    """
    cell = _up(3.0 * facts.reach + 0.2)
    scenario = _to_goal(
        "maze", facts, Goal(2.0 * cell, 2.0 * cell), f"maze:size=3,seed={{seed}},cell={cell}", 8.0 * cell
    )
    return replace(scenario, seeds=(1, 2))


def standing_still(facts: RobotFacts) -> Scenario:
    """Stand without a command.

    It lasts for 2 s. The base is level within 0.01 rad, a centimetre per metre: a caster that is a tenth too
    low or too high tilts it by more. It moves by at most L / 200 and sinks by at most a twentieth of r.
    """
    return Scenario(
        "standing_still",
        2.0,
        (),
        (
            Bound("max_tilt", max=LEVEL),
            Bound("path_length", max=facts.size / 200.0),
            Bound("final_up", min=-0.05 * facts.drive.radius, max=0.05 * facts.drive.radius),
        ),
    )


Battery = Callable[[RobotFacts], Scenario]
BATTERIES: dict[str, Battery] = {
    each.__name__: each
    for each in (
        straight, circle, square, figure_of_eight, slope, step, emergency_stop, push, payload, narrow_gate,
        rooms, maze, standing_still,
    )
}  # fmt: skip
"""The batteries by name."""


def battery(name: str, robot: RobotModel) -> Scenario:
    """A battery for a robot. It names no robot: `run_trial` gets it.

    Raises: NotApplicable: the robot cannot run it. KbotError: the robot cannot drive, or there is no battery
    of this name.
    """
    return find_battery(name)(robot_facts(robot))


def find_battery(name: str) -> Battery:
    """Raises KbotError for an unknown name, with the nearest ones."""
    if name not in BATTERIES:
        raise KbotError(f"unknown battery '{name}': {suggest_or_list(name, BATTERIES)}")
    return BATTERIES[name]


def all_batteries(robot: RobotModel) -> tuple[Scenario, ...]:
    """The batteries that a robot can run. Raises KbotError: the robot cannot drive."""
    return tuple(made for made in _made(robot).values() if isinstance(made, Scenario))


def not_applicable(robot: RobotModel) -> dict[str, str]:
    """The batteries that a robot cannot run, with the reasons. Raises KbotError: the robot cannot drive."""
    return {name: str(made) for name, made in _made(robot).items() if isinstance(made, NotApplicable)}


def _made(robot: RobotModel) -> dict[str, Scenario | NotApplicable]:
    facts = robot_facts(robot)
    made: dict[str, Scenario | NotApplicable] = {}
    for name, make in BATTERIES.items():
        try:
            made[name] = make(facts)
        except NotApplicable as reason:
            made[name] = reason
    return made


def _commanded(name: str, facts: RobotFacts, motion: CommandedMotion, *more: Expectation) -> Scenario:
    """A scenario of commands with the bounds of `straight`. A base that slips in turns need only turn.

    A closed path ends where it begins also for a robot that turns or drives the wrong way, so each commanded
    motion must have the commanded direction.
    """
    end = motion.pose
    expect: list[Expectation] = list(_directions(motion))
    if not (facts.slips and motion.turned > 0.0):
        within = max(HEADING * motion.turned, LEAST_HEADING)
        expect += [
            Reaches(end.x, end.y, POSITION * motion.path_length),
            Bound("final_turn", end.yaw - within, end.yaw + within),
            Bound("odometry_error", max=ODOMETRY * motion.path_length),
        ]
    elif abs(end.yaw) > math.pi:
        expect.append(Bound("final_turn", *sorted(share * end.yaw for share in SLIPPING_TURN)))
    expect += [NeverTouches(), StaysUpright(), Settles(motion.settling + REST), *more]
    return Scenario(name, motion.time + REST, motion.steps, expect)


def _directions(motion: CommandedMotion) -> Iterator[Expectation]:
    """Each kind of motion that is commanded has the commanded direction."""
    commands = [step.action for step in motion.steps if isinstance(step.action, Command)]
    if any(command.linear for command in commands):
        yield Bound("forward_agreement", min=AGREEMENT)
    if any(command.lateral for command in commands):
        yield Bound("lateral_agreement", min=AGREEMENT)
    if any(command.angular for command in commands):
        yield Bound("turn_agreement", min=AGREEMENT)


def _arc(motion: CommandedMotion, facts: RobotFacts, angle: float) -> None:
    """Drive an arc by an angle in rad, to the left if it is positive."""
    speed, radius = cruising_speed(facts), max(1.5 * facts.size, 1.2 * facts.smallest_radius)
    seconds = motion.whole_ticks(abs(angle) / min(speed / radius, facts.top_speeds[2] / 2.0))
    rate = abs(angle) / seconds
    motion.drive(rate * radius, math.copysign(rate, angle), seconds)


def _turn(motion: CommandedMotion, facts: RobotFacts, angle: float) -> None:
    """Turn on the spot by an angle in rad, to the left if it is positive."""
    seconds = motion.whole_ticks(abs(angle) / turning_speed(facts))
    motion.drive(0.0, angle / seconds, seconds)


def _push(facts: RobotFacts, force: Vector, seconds: float, height: float) -> Push:
    """A push along a line at a height above the ground, through the middle of the heaviest link."""
    above = facts.ground + height - facts.heaviest_centre[2]
    return Push(force, seconds, facts.heaviest, (-above * force[1], above * force[0], 0.0))


def _to_goal(name: str, facts: RobotFacts, goal: Goal, world: str, way: float) -> Scenario:
    if facts.why_no_goals:
        raise NotApplicable(f"'{name}' does not apply: robot '{facts.robot.name}' {facts.why_no_goals}")
    seconds = math.ceil(2.0 * way / min(NAVIGATION_SPEED, facts.top_speeds[0])) + 10.0
    return Scenario(
        name,
        seconds,
        (Step(goal),),
        (Bound("goals_reached", min=1.0), Bound("goal_time", max=seconds), NeverTouches(), StaysUpright()),
        world=world,
        until={"goals_reached": Range(min=1.0)},
    )


def _up(length: float) -> float:
    """A length in m for the text of a world, rounded up to whole millimetres."""
    return math.ceil(1e3 * length) / 1e3
