"""The map of a trial, and the source lines of the robot that a failure concerns, for reports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.navigation.space.footprint import outline
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.diagnostic import Related
from kbot.trials.actions import DriveWithPolicy, Goal
from kbot.trials.expectations import PassesThrough, Reaches
from kbot.trials.results import MeasureResult
from kbot.trials.scenario import Scenario
from kbot.trials.trace import Trace
from kbot.world.footprints import footprint
from kbot.world.world import FURTHEST, Shape

MOST_OUTLINES = 2000
"""Outlines of a map. The largest worlds of real robots have a few hundred."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Outlined:
    """A part of a world seen from above: its corners in m, and whether the robot drives on it."""

    name: str
    corners: tuple[Point, ...]
    is_ground: bool


@dataclass(frozen=True, slots=True)
class Target:
    """A place in the world in m: one to reach (`reach`) or to pass (`pass`) within a distance, or a goal."""

    kind: str
    x: float
    y: float
    within: float = 0.0


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a path is drawn on.

    world    the world's name
    parts    what is in it, where it is at the end of the run
    robot    corners of the robot's outline in the base's frame, in m
    targets  where the robot is expected
    """

    world: str
    parts: tuple[Outlined, ...] = ()
    robot: tuple[Point, ...] = ()
    targets: tuple[Target, ...] = ()


def surroundings(simulation: Simulation, scenario: Scenario | None = None) -> Surroundings:
    """The map of a simulation now, with the targets of a scenario."""
    first = simulation.robots.first
    try:
        robot = _points(outline(first.robot, first.base).corners.tolist())
    except KbotError:
        robot = ()  # it has no collision shape
    targets = tuple(_targets(scenario)) if scenario is not None else ()
    return Surroundings(simulation.world.name, tuple(_parts(simulation))[:MOST_OUTLINES], robot, targets)


def concerned_lines(
    robot: RobotModel, measures: Sequence[MeasureResult], trace: Trace
) -> tuple[Related, ...]:
    """The source lines of the links and joints that failures name: what touched, and measures of one part."""
    found: list[Related] = []
    failed = {measure.name for measure in measures if not measure.passed}
    if "contacts" in failed:
        for thing, name in trace.touched_with.items():
            link = robot.links.get(name)
            if link is not None:
                where = link.collisions[0].geometry.origin if link.collisions else link.origin
                found.append(Related(f"link '{name}' touches '{thing}'", where))
    for measure in sorted(failed):
        family, _, part = measure.partition("/")
        if part in robot.links:
            found.append(Related(f"link '{part}' of {family}", robot.links[part].origin))
        elif part in robot.joints:
            found.append(Related(f"joint '{part}' of {family}", robot.joints[part].origin))
    if "joint_overshoot" in failed:
        for name, (low, high) in trace.joint_limits.items():
            positions, joint = trace.joints[name], robot.joints.get(name)
            if joint is not None and (positions.min() < low or positions.max() > high):
                where = joint.limit.origin if joint.limit is not None else joint.origin
                found.append(Related(f"limits of joint '{name}'", where))
    return tuple(found)


def _parts(simulation: Simulation) -> Iterator[Outlined]:
    now = simulation.models.body_poses()
    for body in simulation.world.bodies:
        pose = now.get(body.name, body.pose)
        for part in body.parts:
            corners = _outline(part.shape, pose @ part.pose) if part.solid else ()
            if len(corners) > 2:
                yield Outlined(body.name, corners, part.ground)


def _outline(shape: Shape, pose: Transform) -> tuple[Point, ...]:
    found = footprint(shape, pose, -FURTHEST, FURTHEST)
    return () if found is None else _points(found.tolist())


def _points(rows: Sequence[Sequence[float]]) -> tuple[Point, ...]:
    return tuple((x, y) for x, y in rows)


def _targets(scenario: Scenario) -> Iterator[Target]:
    for step in scenario.steps:
        if isinstance(step.action, Goal):
            yield Target("goal", step.action.x, step.action.y)
        elif isinstance(step.action, DriveWithPolicy):
            yield Target("goal", step.action.goal.x, step.action.goal.y, step.action.arrive)
    for expected in scenario.expect:
        if isinstance(expected, Reaches):
            yield Target("reach", expected.x, expected.y, expected.within)
        elif isinstance(expected, PassesThrough):
            yield Target("pass", expected.x, expected.y, expected.within)
