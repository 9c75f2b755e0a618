"""The sizes, masses and declared limits of a robot, from which the commands of its batteries follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import center_of_mass, total_mass, with_mass
from kbot.kinematics.drive.declared import Holonomic
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.kinematics.drive.wheels import LEVEL, Caster, links_on_ground
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import Box, Capsule, Cylinder, RobotModel, Sphere
from kbot.navigation.simulated.mobility import why_no_goals
from kbot.navigation.space.footprint import corners_of_shapes, height, outline, turning_radius
from kbot.sim.drive.drive_controller import twist_controller
from kbot.sim.drive.settings import DriveSettings
from kbot.sim.drive.twist_controller import Twist, TwistController
from kbot.sim.naming import Naming
from kbot.sim.numbers import Vector
from kbot.sim.preparation import prepare
from kbot.sim.recipe import SLEW_PERIOD, Contacts
from kbot.text import KbotError

Point = tuple[float, float]


class DriveKind(StrEnum):
    """How a base drives."""

    DIFFERENTIAL = "differential"
    SKID_STEERED = "skid-steered"
    STEERED = "steered"
    HOLONOMIC = "holonomic"
    TRACKED = "tracked"


@dataclass(frozen=True, slots=True, eq=False)
class RobotFacts:
    """The facts of a robot, joints at zero, in m, kg and rad. Points are in the frame of the base.

    drive, settings  how it moves, and the limits that its controller declares
    low, high        the corners x, y of the box around its outline
    height           of its shapes
    reach            distance from the base's origin to the furthest point seen from above
    ground           height of the ground
    mass             of all links
    centre_of_mass   x, y, z
    heaviest         the link with the largest mass
    heaviest_pose    its pose in the base's frame
    heaviest_centre  its centre of mass
    supports         the links on the ground, with the points x, y on which they stand
    """

    robot: RobotModel
    drive: DifferentialDrive
    settings: DriveSettings
    low: Point
    high: Point
    height: float
    reach: float
    ground: float
    mass: float
    centre_of_mass: Vector
    heaviest: str
    heaviest_pose: Transform
    heaviest_centre: Vector
    supports: Mapping[str, tuple[Point, ...]]

    @property
    def kind(self) -> DriveKind:
        drive = self.drive
        if isinstance(drive, SteeredDrive):
            return DriveKind.STEERED
        if isinstance(drive, HolonomicDrive):
            return DriveKind.TRACKED if drive.kind is Holonomic.TRACKS else DriveKind.HOLONOMIC
        return DriveKind.SKID_STEERED if len(drive.left) > 1 else DriveKind.DIFFERENTIAL

    @property
    def slips(self) -> bool:
        """Whether the base turns by slipping, so that it turns less than commanded."""
        return self.kind in (DriveKind.SKID_STEERED, DriveKind.TRACKED)

    @property
    def width(self) -> float:
        return self.high[1] - self.low[1]

    @property
    def size(self) -> float:
        """The longer side of the outline."""
        return max(self.high[0] - self.low[0], self.width)

    def twist_controller(self) -> TwistController:
        """Follows commands within the limits of the robot's controller, a `SLEW_PERIOD` at a time."""
        return twist_controller(self.robot, self.drive, self.settings, SLEW_PERIOD)

    @property
    def top_speeds(self) -> Twist:
        """The declared highest speeds forwards, sideways and of turns, infinite without a declared one."""
        return self.twist_controller().fastest

    @property
    def why_no_goals(self) -> str:
        """Why it does not drive to the goals of the batteries, whose worlds are as wide as its turning
        circle; empty if it does."""
        if not self.turns_in_place:
            return "steers: the passages are only wide enough for robots that turn on the spot"
        return why_no_goals(self.drive)

    @property
    def turns_in_place(self) -> bool:
        return not isinstance(self.drive, SteeredDrive) or self.drive.turns_in_place

    @property
    def is_on_boxes(self) -> bool:
        """Whether it drives on tracks that are boxes, which cannot climb an edge."""
        shapes = [each.geometry for tread in self.drive.tyres for each in self.robot.links[tread].collisions]
        return self.kind is DriveKind.TRACKED and all(isinstance(shape, Box) for shape in shapes)

    @property
    def smallest_radius(self) -> float:
        """Radius of the smallest circle in both directions; 0 for a base that turns on the spot."""
        own = self.settings.with_controller_sizes(self.drive)
        if not isinstance(self.drive, SteeredDrive) or not isinstance(own, SteeredDrive):
            return 0.0
        right, left = self.drive.curvatures
        sharpest = min(-right, left, own.sharpest)
        return 1.0 / sharpest if sharpest > 0.0 else math.inf

    @property
    def drives_sideways(self) -> bool:
        return isinstance(self.drive, HolonomicDrive | SteeredDrive) and self.drive.sideways

    @property
    def centre_height(self) -> float:
        """Height of the centre of mass above the ground."""
        return max(self.centre_of_mass[2] - self.ground, 0.0)

    @property
    def tipping_slope(self) -> float:
        """Tangent of the uphill slope on which the robot falls over backwards, because its centre of mass is
        above its rearmost support."""
        behind = self.centre_of_mass[0] - min(x for x, _ in self._points)
        return behind / self.centre_height if self.centre_height > 0.0 else math.inf

    @property
    def _points(self) -> list[Point]:
        return [point for points in self.supports.values() for point in points]

    @property
    def room_beside(self) -> float:
        """The smallest distance along y from the centre of mass to the outermost supports."""
        ys = [y for _, y in self._points]
        return max(0.0, min(self.centre_of_mass[1] - min(ys), max(ys) - self.centre_of_mass[1]))

    @property
    def traction_slope(self) -> float:
        """Tangent of the steepest slope that the tyres climb with a coefficient of friction of 1, at most 1.

        Statics of a robot with friction only on its driven axle: of the weight m g, this axle carries
        N = m g cos(a) (s - h/b tan(a)), where s is its share on level ground, h the height of the centre of
        mass, and b the distance by which it is ahead of the other supports. It holds the robot as long as
        m g sin(a) <= N, so tan(a) <= s / (1 + h/b). With supports before and behind the driven axle the share
        is not determined, and half is assumed.
        """
        drive = self.drive
        driven = [drive.wheels[name] for name in drive.joints if name in drive.wheels]
        links = {wheel.link for wheel in driven}
        others = [x for link, points in self.supports.items() if link not in links for x, _ in points]
        if isinstance(drive, HolonomicDrive) or not others or not driven:
            return 1.0
        axle, other = float(np.mean([wheel.center[0] for wheel in driven])), float(np.mean(others))
        if min(others) < axle < max(others) or axle == other:
            return 0.5
        share = (self.centre_of_mass[0] - other) / (axle - other)
        resisting = 1.0 + self.centre_height / (axle - other)
        return min(1.0, max(0.0, share / resisting)) if resisting > 0.0 else 1.0


def robot_facts(robot: RobotModel) -> RobotFacts:
    """The facts of a robot. Raises KbotError: it cannot drive, or has no size or mass."""
    prepared = prepare(robot, Naming(robot.name), PlanarPose(), None, Contacts.RECIPE)
    robot, drive, settings = prepared.robot, prepared.drive, prepared.settings
    if isinstance(drive, NoDrive) or settings is None:
        reason = drive.reason if isinstance(drive, NoDrive) else "it has no drive"
        raise KbotError(f"robot '{robot.name}' cannot drive: {reason}")
    base = drive.base
    corners = outline(robot, base).corners
    tree = FrameTree(robot)
    centre = center_of_mass(tree, base)
    if centre is None:
        raise KbotError(f"robot '{robot.name}' has no mass")
    heaviest, inertial = max(with_mass(robot), key=lambda pair: pair[1].mass)
    heaviest_pose = tree.pose(heaviest, base)
    standing = links_on_ground(tree, base)
    ground = min(carrier.bottom for carrier in standing)
    return RobotFacts(
        robot=robot,
        drive=drive,
        settings=settings,
        low=_xy(corners.min(axis=0)),
        high=_xy(corners.max(axis=0)),
        height=height(robot, base),
        reach=turning_radius(robot, base),
        ground=ground,
        mass=total_mass(robot),
        centre_of_mass=_xyz(centre),
        heaviest=heaviest,
        heaviest_pose=heaviest_pose,
        heaviest_centre=_xyz(heaviest_pose.apply(inertial.pose.xyz)),
        supports={carrier.link: _points_of(carrier, robot, base) for carrier in standing},
    )


def _points_of(carrier: Caster, robot: RobotModel, base: str) -> tuple[Point, ...]:
    """Where a link on the ground stands: below the middle of a wheel or ball, else on the lower corners of
    the box around its shapes."""
    if isinstance(carrier.shape, Cylinder | Sphere | Capsule):
        return (_xy(carrier.center),)
    corners = [point for link, point in corners_of_shapes(robot, base) if link == carrier.link]
    return tuple((x, y) for x, y, z in corners if z <= carrier.bottom + LEVEL)


def _xy(point: NDArray[np.float64]) -> Point:
    return float(point[0]), float(point[1])


def _xyz(point: NDArray[np.float64]) -> Vector:
    return float(point[0]), float(point[1]), float(point[2])
