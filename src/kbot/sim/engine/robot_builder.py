"""Builds a robot in the engine's model: bodies, joints, shapes, surfaces and servos."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import mujoco
import numpy as np

from kbot.kinematics.bodies import total_mass
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.kinematics.drive.wheels import Wheel
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Collision, Link, RobotModel
from kbot.sim.engine import contacts as touch
from kbot.sim.engine.base_servo import add_base_servo
from kbot.sim.engine.bounds import check_bounds
from kbot.sim.engine.geometry import Meshes, add_shape, wxyz
from kbot.sim.engine.inertia import check_masses, held_joints, is_fixed, lone_links, set_inertial
from kbot.sim.engine.joints import add_joint, add_mimics, held_pose
from kbot.sim.engine.plane_contacts import add_plane_shapes
from kbot.sim.engine.servo import add_drive_servos, add_joint_servos, add_steering_servos
from kbot.sim.engine.surfaces import DEFAULT_SURFACE, ContactSurface, link_surfaces
from kbot.sim.recipe import CASTER_FRICTION, Contacts
from kbot.text import DiagnosticCollector, KbotError

_SHORT = 1e-3
"""Half length of a tyre's capsule, as a share of its radius. Both of its ends touch the ground."""


@dataclass(frozen=True)
class RobotPlan:
    """All that the engine needs to build a robot: its name, description, drive, contacts and start pose.

    `others`: whether there are other robots. `torque`: its own drive's torque limit of a wheel in N m.
    """

    name: str
    robot: RobotModel
    drive: DifferentialDrive | NoDrive
    contacts: Contacts
    pose: Transform
    others: bool
    torque: float | None = None

    @property
    def prefix(self) -> str:
        """The prefix of the names of its bodies and joints in the engine."""
        return f"{self.name}/"


def add_robot(
    spec: mujoco.MjSpec,
    plan: RobotPlan,
    grounds: Sequence[mujoco.MjsGeom],
    planes: int,
    findings: DiagnosticCollector,
) -> None:
    """Add a robot to the engine's model, whose ground are the shapes `grounds`.

    `planes` are the contact bits of the world's planes. Errors of the description go to `findings`.
    """
    robot, prefix = plan.robot, plan.prefix
    check_bounds(robot, findings)
    findings.require()
    check_masses(robot, findings)
    shapes = _Shapes(spec, plan, grounds, planes, findings)
    root = spec.worldbody.add_body(name=prefix + robot.root, pos=plan.pose.translation, quat=wxyz(plan.pose))
    root.ipos = (0.0, 0.0, 0.0)  # of a root without mass: by default the engine uses the start pose
    held, lone = held_joints(robot), lone_links(robot)
    if not is_fixed(robot):
        root.add_freejoint(name=prefix)
    waiting = [(robot.root, root)]
    while waiting:
        name, body = waiting.pop()
        link = robot.links[name]
        set_inertial(body, link, name in lone, findings)
        shapes.add(body, link)
        for joint in robot.child_joints[name]:
            pose = held_pose(joint) if joint.name in held else Transform.of(joint.pose)
            child = body.add_body(name=prefix + joint.child, pos=pose.translation, quat=wxyz(pose))
            if joint.name not in held:
                add_joint(child, joint, prefix, findings)
            waiting.append((joint.child, child))
    driven: tuple[str, ...] = ()
    if isinstance(plan.drive, DifferentialDrive):
        driven = plan.drive.joints
        friction = [shapes.surfaces.get(link, DEFAULT_SURFACE).friction for link in plan.drive.tyres]
        grip = min(friction, default=0.0)
        add_drive_servos(spec, robot, plan.drive, prefix, plan.contacts, grip, plan.torque)
    if isinstance(plan.drive, HolonomicDrive):
        add_base_servo(spec, robot, plan.drive, prefix)
    if isinstance(plan.drive, SteeredDrive):
        driven = (*driven, *plan.drive.steering)
        add_steering_servos(spec, robot, plan.drive, prefix)
    add_joint_servos(spec, robot, (*driven, *held), prefix)
    add_mimics(spec, robot, held, driven, prefix, findings)
    shapes.exclude_self_collisions()
    shapes.meshes.finish()


class _Shapes:
    """The shapes of one robot's links."""

    def __init__(
        self,
        spec: mujoco.MjSpec,
        plan: RobotPlan,
        grounds: Sequence[mujoco.MjsGeom],
        planes: int,
        findings: DiagnosticCollector,
    ) -> None:
        self.spec, self.plan, self.grounds, self.planes, self.findings = spec, plan, grounds, planes, findings
        self.meshes = Meshes(spec)
        self.touching: list[str] = []
        self.mass = total_mass(plan.robot)
        self.tyres: dict[str, tuple[float, Transform]] = {}
        skidding = _skidding(plan)
        self.surfaces = link_surfaces(plan.robot, findings, skidding)
        self.skidding = {link: _frictions(plan, wheel, self.surfaces) for link, wheel in skidding.items()}
        """The friction across and along the rolling direction of tyres that slide in turns."""
        self.sliding: tuple[str, ...] = ()
        """The links without friction."""
        if isinstance(plan.drive, DifferentialDrive) and plan.contacts is Contacts.RECIPE:
            self.sliding = plan.drive.casters
            self.tyres = _tyres(plan.robot, plan.drive)
        if isinstance(plan.drive, HolonomicDrive):
            self.sliding = plan.drive.carriers

    def add(self, body: mujoco.MjsBody, link: Link) -> None:
        surface = self.surfaces.get(link.name, DEFAULT_SURFACE)
        friction = CASTER_FRICTION if link.name in self.sliding else surface.friction
        if not surface.gravity:
            body.gravcomp = 1.0
        tyre = self.tyres.get(link.name)
        if tyre is not None:
            radius, pose = tyre
            geom = body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=pose.translation, size=(radius, 0, 0), mass=0.0
            )
            touch.set_surface(geom, friction)
            touch.as_tyre(geom)
            if link.name in self.skidding:
                self._let_skid(geom, link)
        for collision in link.collisions:
            geom = self._shape(body, link, collision)
            if geom is None:
                continue
            touch.set_surface(geom, friction)
            if (
                surface.stiffness is not None
                and self.plan.contacts is Contacts.AS_WRITTEN
                and self.mass > 0.0
            ):
                touch.set_spring(geom, surface.stiffness, surface.damping, self.mass)
            if tyre is not None:
                touch.as_rim(geom, self.plan.others)
            else:
                touch.as_robot(geom, self.plan.others)
            if surface.self_collide:
                touch.with_self_collision(geom)
            add_plane_shapes(body, geom, self.planes)
            if link.name not in self.touching:
                self.touching.append(link.name)

    def _let_skid(self, tyre: mujoco.MjsGeom, link: Link) -> None:
        """Let a tyre slide in turns.

        If its friction depends on direction, a short capsule replaces the sphere: the contact of a capsule
        with a plane is aligned with its axis.
        """
        across, along = self.skidding[link.name]
        tyre.name = f"{self.plan.prefix}{link.name}#tyre"
        if across != along and isinstance(self.plan.drive, DifferentialDrive):
            wheel = next(w for w in self.plan.drive.wheels.values() if w.link == link.name)
            tyre.type = mujoco.mjtGeom.mjGEOM_CAPSULE
            tyre.size = (tyre.size[0], _SHORT * tyre.size[0], 0.0)
            link_from_base = FrameTree(self.plan.robot).pose(self.plan.drive.base, in_frame=link.name)
            mujoco.mju_quatZ2Vec(tyre.quat, link_from_base.rotation @ wheel.axis)
        for ground in self.grounds:
            touch.add_skidding(self.spec, ground, tyre, across, along)

    def _shape(self, body: mujoco.MjsBody, link: Link, collision: Collision) -> mujoco.MjsGeom | None:
        pose = Transform.of(collision.pose)
        try:
            return add_shape(self.meshes, body, collision.geometry, pose)
        except KbotError as error:
            self.findings.warning(
                "W106",
                f"link '{link.name}': this collision shape is ignored: {error}",
                collision.geometry.origin,
                cause=str(error),
            )
            return None

    def exclude_self_collisions(self) -> None:
        """Disable collisions between a robot's own links, as in Gazebo.

        With one robot the contact bits do that already. With several, the engine needs a list of pairs.
        """
        if not self.touching and not is_fixed(self.plan.robot):
            self.findings.warning(
                "W107",
                f"robot '{self.plan.robot.name}' has no <collision> and will fall through the ground",
                self.plan.robot.origin,
                "give at least the wheels a <collision>",
            )
        if not self.plan.others:
            return
        for index, name in enumerate(self.touching):
            for other in self.touching[index + 1 :]:
                if not (self._has_self_collision(name) and self._has_self_collision(other)):
                    prefix = self.plan.prefix
                    self.spec.add_exclude(bodyname1=prefix + name, bodyname2=prefix + other)

    def _has_self_collision(self, link: str) -> bool:
        return self.surfaces.get(link, DEFAULT_SURFACE).self_collide


def _skidding(plan: RobotPlan) -> dict[str, Wheel]:
    """The wheels, by link, of a skid-steer robot, which has wheels behind each other on both sides, and those
    of a car that have no joint to roll on."""
    drive = plan.drive
    if isinstance(drive, SteeredDrive) and plan.contacts is Contacts.RECIPE:
        sliding = (drive.wheels[module.rolls] for module in drive.modules if module.slides)
        return {wheel.link: wheel for wheel in sliding}
    if type(drive) is not DifferentialDrive or len(drive.left) < 2 or plan.contacts is Contacts.AS_WRITTEN:
        return {}
    return {wheel.link: wheel for wheel in drive.wheels.values()}


def _frictions(plan: RobotPlan, wheel: Wheel, surfaces: Mapping[str, ContactSurface]) -> tuple[float, float]:
    """The friction of a wheel across and along its rolling direction."""
    surface, link = surfaces.get(wheel.link, DEFAULT_SURFACE), plan.robot.links[wheel.link]
    if isinstance(plan.drive, SteeredDrive):
        return surface.friction, 0.0  # in place of the joint that is missing
    if surface.direction is None or not isinstance(plan.drive, DifferentialDrive):
        return surface.friction, surface.friction
    link_from_base = FrameTree(plan.robot).pose(plan.drive.base, in_frame=wheel.link)
    link_from_shape = Transform.of(link.collisions[0].pose) if link.collisions else Transform.identity()
    first = link_from_shape.rotation @ np.array(surface.direction)
    along_axle = abs(first @ (link_from_base.rotation @ wheel.axis)) / np.linalg.norm(first)
    # a direction that turns with the wheel meets the ground along the rolling direction
    both = surface.friction, surface.second_friction
    return both if along_axle > sqrt(0.5) else (both[1], both[0])


def _tyres(robot: RobotModel, drive: DifferentialDrive) -> dict[str, tuple[float, Transform]]:
    """Radius and `link_from_sphere` of the sphere with which each drive wheel touches the ground."""
    tree = FrameTree(robot)
    tyres = {}
    for wheel in drive.wheels.values():
        link_from_base = tree.pose(drive.base, in_frame=wheel.link)
        x, y, z = link_from_base.apply(wheel.center).tolist()
        # the size of a wheel of a holonomic base may be unknown, because its rollers are a mesh
        tyres[wheel.link] = wheel.radius or drive.radius, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, 0.0))
    return tyres
