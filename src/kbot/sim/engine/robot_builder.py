"""Builds a robot in the engine's model: bodies, joints, shapes, surfaces and servos."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from kbot.kinematics.bodies import total_mass
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Collision, Link, RobotModel
from kbot.sim.engine import contacts as touch
from kbot.sim.engine.base_servo import add_base_servo
from kbot.sim.engine.bounds import check_bounds
from kbot.sim.engine.geometry import add_shape, wxyz
from kbot.sim.engine.inertia import check_masses, held_joints, is_fixed, lone_links, set_inertial
from kbot.sim.engine.joints import add_joint, add_mimics, held_pose
from kbot.sim.engine.servo import add_drive_servos, add_joint_servos
from kbot.sim.engine.surfaces import DEFAULT_SURFACE, link_surfaces
from kbot.sim.recipe import CASTER_FRICTION, Contacts
from kbot.text import DiagnosticCollector, KbotError


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


def add_robot(spec: mujoco.MjSpec, plan: RobotPlan, findings: DiagnosticCollector) -> None:
    """Add a robot to the engine's model. Errors of the description go to `findings`."""
    robot, prefix = plan.robot, plan.prefix
    check_bounds(robot, findings)
    findings.require()
    check_masses(robot, findings)
    shapes = _Shapes(spec, plan, findings)
    root = spec.worldbody.add_body(name=prefix + robot.root, pos=plan.pose.translation, quat=wxyz(plan.pose))
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
    add_mimics(spec, robot, held, prefix, findings)
    driven: tuple[str, ...] = ()
    if isinstance(plan.drive, DifferentialDrive):
        driven = plan.drive.joints
        friction = [shapes.surfaces.get(link, DEFAULT_SURFACE).friction for link in plan.drive.tyres]
        grip = min(friction, default=0.0)
        add_drive_servos(spec, robot, plan.drive, prefix, plan.contacts, grip, plan.torque)
    if isinstance(plan.drive, HolonomicDrive):
        add_base_servo(spec, robot, plan.drive, prefix)
    add_joint_servos(spec, robot, (*driven, *held), prefix)
    shapes.exclude_self_collisions()


class _Shapes:
    """The shapes of one robot's links."""

    def __init__(self, spec: mujoco.MjSpec, plan: RobotPlan, findings: DiagnosticCollector) -> None:
        self.spec, self.plan, self.findings = spec, plan, findings
        self.touching: list[str] = []
        self.mass = total_mass(plan.robot)
        self.surfaces = link_surfaces(plan.robot, findings)
        self.tyres: dict[str, tuple[float, Transform]] = {}
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
            if link.name not in self.touching:
                self.touching.append(link.name)

    def _shape(self, body: mujoco.MjsBody, link: Link, collision: Collision) -> mujoco.MjsGeom | None:
        pose = Transform.of(collision.pose)
        try:
            return add_shape(self.spec, body, collision.geometry, pose)
        except KbotError as error:
            self.findings.warning(
                "W106",
                f"link '{link.name}': this collision shape is ignored: {error}",
                collision.geometry.origin,
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
