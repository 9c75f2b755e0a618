"""Finds the drive of a robot (two-sided, steered or holonomic), and converts twists to wheel speeds and back.

In a steered base, such as a car or a robot whose four wheels all steer, each wheel points where it moves:
see `wheel_module.py`.

A tracked vehicle turns by the difference between the speeds of its tracks, as a differential drive does, but
all of each track is on the ground and slips (Pecka, Zimmermann and Svoboda, Fast Simulation of Vehicles with
Non-deformable Tracks, IROS 2017).

A holonomic base also moves sideways. The rim of each of its wheels moves at a fixed linear combination of the
twist, from which gz's MecanumDrive, mecanum_drive_controller and omni_wheel_drive_controller compute the
speeds of the wheels (Lynch and Park, Modern Robotics, 13.2)."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, brief
from kbot.kinematics.drive.declared import (
    DeclaredDrive,
    Holonomic,
    commanded_joints,
    declared_drives,
    drive_controller,
    movable,
)
from kbot.kinematics.drive.wheel_module import UPRIGHT, WheelModule, mount, placed
from kbot.kinematics.drive.wheels import (
    Pair,
    Wheel,
    carrier,
    casters_of,
    find_wheel,
    is_caster,
    largest,
    leftward,
    links_on_ground,
    movable_above,
    pairs_of,
    rigid_links,
)
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.planar_pose import PlanarPose, integrate
from kbot.kinematics.transform import Transform
from kbot.model import Cylinder, Joint, JointType, RobotModel, Sphere
from kbot.model.extensions import joints_with_motors

Array = NDArray[np.float64]

_LYING = 0.1
"""Largest upward component of the axis of a cylinder that stands on the ground as a wheel."""
_PARALLEL = 0.99
"""Cosine of the angle between two axles that are parallel."""
_MECANUM = ((1.0, -1.0, -1.0), (1.0, 1.0, 1.0), (1.0, 1.0, -1.0), (1.0, -1.0, 1.0))
"""The `directions` of mecanum wheels: front left, front right, rear left, rear right."""
_FEWEST_ROLLERS = 4
"""The joints on a wheel that are not parallel to its axle are its rollers if there are this many."""
_NOMINAL = 0.05
"""Radius in m of what carries a base without round wheels. It only scales the page's speed and tolerances."""


@dataclass(frozen=True, slots=True, repr=False)
class DifferentialDrive(Brief):
    """Two sides of equal wheels on parallel axles.

    left, right   the driving joints, front to rear, on the sides that the plugin or controller names, or else
                  on the sides where the wheels are
    forward       the sign of a joint's speed that drives forwards
    wheels        the wheel of each driving joint
    radius        of the wheels in m, positive
    separation    distance in m between the middles of left and right wheels, positive
    base          the link whose frame `axle_in_base` and the wheels are in
    axle_in_base  the frame in the middle of the wheels, x forward, y to the wheels on the left
    casters       the links that carry the robot without driving it
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    forward: Mapping[str, float]
    wheels: Mapping[str, Wheel]
    radius: float
    separation: float
    base: str
    axle_in_base: Transform
    casters: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        return self.left + self.right

    @property
    def sides(self) -> Mapping[str, tuple[str, ...]]:
        return {"left": self.left, "right": self.right}

    @property
    def tyres(self) -> tuple[str, ...]:
        """The links whose friction drives the base."""
        return tuple(wheel.link for wheel in self.wheels.values())

    @property
    def carriers(self) -> tuple[str, ...]:
        """The links on which the base stands, also those of its wheels."""
        return (*(wheel.link for wheel in self.wheels.values()), *self.casters)

    @property
    def mistakes(self) -> dict[str, str]:
        """Errors of the plugin or controller by joint, because of which the robot does not move as
        commanded."""
        found: dict[str, str] = {}
        axle_from_base, leftward = self.axle_in_base.inverse(), self.axle_in_base.rotation[:, 1]
        for side, names in self.sides.items():
            for name in names:
                wheel = self.wheels[name]
                true = "left" if axle_from_base.apply(wheel.center)[1] > 0.0 else "right"
                if (wheel.axis @ leftward) * self.forward[name] < 0.0:
                    found[name] = (
                        f"the axis of '{name}' points to the right: a positive speed drives backwards"
                    )
                elif side != true:
                    y = f"{float(wheel.center[1]) * 1e3:.4g} mm"
                    what = f"its {side} joint '{name}' turns the wheel at y = {y}, on the {true}"
                    found[name] = f"{what}: turns are reversed"
        return found

    @property
    def axle_in_base_planar(self) -> PlanarPose:
        """The pose of the axle's middle on the ground plane of the base."""
        x, y, _ = self.axle_in_base.translation
        return PlanarPose(float(x), float(y), self.axle_in_base.yaw)

    def rim_speed(self, x: float, y: float, yaw: float) -> float:
        """The highest speed in m/s of a wheel's rim during a twist of the axle's middle (m/s, m/s, rad/s).

        It is exact for two sides and for mecanum wheels, and an upper bound for omni wheels.
        """
        return abs(x) + abs(y) + abs(yaw) * (self.separation / 2.0)

    def wheel_speeds(self, linear: float, angular: float) -> tuple[float, float]:
        """Left and right wheel speeds in rad/s, forwards positive, with which the axle's middle moves at
        `linear` m/s and the robot turns at `angular` rad/s."""
        half = angular * self.separation / 2.0
        return (linear - half) / self.radius, (linear + half) / self.radius

    def twist(self, left: float, right: float) -> tuple[float, float]:
        """Linear (m/s) and angular (rad/s) speed of the axle's middle, from wheel speeds in rad/s."""
        return (
            (left + right) * self.radius / 2.0,
            (right - left) * self.radius / self.separation,
        )

    def joint_velocities(self, linear: float, angular: float) -> dict[str, float]:
        """The speed of each driving joint in rad/s, with the sign of its axis."""
        left, right = self.wheel_speeds(linear, angular)
        speeds = {name: left * self.forward[name] for name in self.left}
        speeds.update({name: right * self.forward[name] for name in self.right})
        return speeds

    def integrate(self, pose: PlanarPose, left: float, right: float) -> PlanarPose:
        """The base's pose after its left and right wheels turned by `left` and `right` rad, forwards
        positive.

        It is exact for constant speeds, also for a base that is not on the axle.
        """
        return integrate(
            pose, left * self.radius, right * self.radius, self.separation, self.axle_in_base_planar
        )

    def _shown(self) -> Iterator[str]:
        yield f"left={brief(self.left)}"
        yield f"right={brief(self.right)}"
        yield f"radius={self.radius:g}"
        yield f"separation={self.separation:g}"


@dataclass(frozen=True, slots=True, repr=False)
class SteeredDrive(DifferentialDrive):
    """A base with wheels that steer.

    With a fixed axle, as on a car, the base cannot move along this axle. `axle_in_base` is in its middle, and
    its wheels are `left` and `right`. Without one, `axle_in_base` is in the middle of all wheels.

    modules   the wheels on the ground, fixed and steered
    traction  the joints that drive
    reason    why it is not a differential drive
    sharpest  the largest curvature (1/m) that its controller commands
    """

    modules: tuple[WheelModule, ...]
    traction: tuple[str, ...]
    reason: str
    sharpest: float = math.inf

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that drive."""
        return self.traction

    @property
    def steering(self) -> tuple[str, ...]:
        """The joints that steer."""
        return tuple(dict.fromkeys(m.steering for m in self.modules if m.steering is not None))

    @property
    def sideways(self) -> bool:
        """Whether the base drives sideways, because all wheels steer in every direction."""
        return all(module.steering is not None and module.turns_everywhere for module in self.modules)

    @property
    def curvatures(self) -> tuple[float, float]:
        """The curvatures (1/m) of the sharpest curves to the right and to the left. They are infinite if the
        base turns on the spot."""
        rights, lefts = zip(*(module.curvatures for module in self.modules), strict=True)
        return max(*rights, -self.sharpest), min(*lefts, self.sharpest)

    @property
    def turns_in_place(self) -> bool:
        """Whether the base can turn on the spot."""
        return self.curvatures == (-math.inf, math.inf)

    @property
    def wheelbase(self) -> float:
        """The distance in m from the rear wheels to the front wheels."""
        ahead = [module.x for module in self.modules]
        return max(ahead) - min(ahead)

    def with_sizes(
        self, radius: float, separation: float, wheelbase: float, curvature: float, rate: float
    ) -> SteeredDrive:
        """The drive of a controller that computes with these sizes in m, right or wrong.

        It drives curves of at most `curvature` (1/m), and steers at most at `rate` (rad/s).
        """
        sizes = wheelbase / self.wheelbase, separation / self.separation, radius / self.radius
        modules = tuple(module.scaled(*sizes, rate) for module in self.modules)
        return replace(self, radius=radius, separation=separation, modules=modules, sharpest=curvature)


@dataclass(frozen=True, slots=True, repr=False)
class HolonomicDrive(DifferentialDrive):
    """A base that drives forwards and sideways and turns, all at once. It does not have two sides.

    `radius` is that of its wheels. `separation` is the wheel separation of a differential drive whose wheels
    turn equally fast when the robot turns on the spot: the sum of the distances between mecanum wheels along
    x and along y, or twice the distance of an omni wheel from the middle. For tracks it is their distance.

    kind        how its plugin or controller moves it
    directions  the driving joints; none for tracks, and if the plugin moves the base itself. The rim of a
                wheel with the direction a, b, c moves at a x + b y + c yaw separation / 2 in a twist of
                `axle_in_base`
    sideways    False for tracks, and if the plugin ignores sideways commands
    treads      the links that touch the ground instead of wheels: tracks, or the rollers of wheels
    efficiency  the share of the difference between the speeds of tracks that turns the base. They slip for
                the rest
    """

    kind: Holonomic
    directions: Mapping[str, tuple[float, float, float]]
    sideways: bool
    treads: tuple[str, ...] = ()
    efficiency: float = 1.0

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that drive."""
        return tuple(self.directions)

    @property
    def tyres(self) -> tuple[str, ...]:
        """The links whose friction drives the base, unless its plugin moves it."""
        return self.treads or tuple(wheel.link for wheel in self.wheels.values())

    @property
    def carriers(self) -> tuple[str, ...]:
        """The links on which the base stands, also those of its wheels."""
        return (*(wheel.link for wheel in self.wheels.values()), *self.treads, *self.casters)

    @property
    def reason(self) -> str:
        """Why it is not a differential drive."""
        if self.kind is Holonomic.TRACKS:
            return "it drives on tracks"
        return "it is a holonomic base, which has no left and right side"

    @property
    def wheels_from_twist(self) -> Array:
        """The speed of each driving joint in rad/s from a twist in m/s, m/s and rad/s, as a matrix (n, 3)."""
        rims = np.array([*self.directions.values()]).reshape(-1, 3)
        matrix: Array = rims * (1.0, 1.0, self.separation / 2.0) / self.radius
        return matrix


@dataclass(frozen=True, slots=True)
class NoDrive:
    """Why a robot does not drive, in one sentence."""

    reason: str


def find_drive(
    robot: RobotModel, tree: FrameTree | None = None
) -> DifferentialDrive | SteeredDrive | HolonomicDrive | NoDrive:
    """The drive of a robot: two-sided, steered or holonomic, or the reason why it has none. Never raises.

    A base is holonomic only if its plugin or controller is, or if it has neither and rollers on its wheels.

    The driving joints are the first of these that form a drive: the joints that a drive plugin names, the
    joints that ros2_control commands by velocity, the largest pairs of wheels rigidly on the base, and those
    on a suspension. The sides are those that the plugin or controller names."""
    tree = tree or FrameTree(robot)
    controllers = declared_drives(robot)
    running = drive_controller(controllers)
    if running is not None and running.holonomic is not None:
        return _holonomic(tree, running, running.holonomic)
    if running is None:
        on_rollers = _on_rollers(tree)
        if on_rollers is not None:
            return on_rollers
    plugins = [c for c in controllers if c.plugin is not None and c.has_sides]
    left, right = _sides(plugins)
    by_plugin = drive_of(robot, tree, movable(robot, [*left, *right]))
    if isinstance(by_plugin, DifferentialDrive) or named_twice(left, right) is not None:
        return with_sides(by_plugin, left, right)
    others = [c for c in controllers if c.plugin is None and c.has_sides]
    controller = None if plugins else drive_controller(others)
    sides = _sides([controller] if controller is not None else [])
    if isinstance(drive_of(robot, tree, movable(robot, [*sides[0], *sides[1]])), NoDrive):
        steered = _steered(robot, tree, controllers)
        if steered is not None:
            return steered
    found = _two_sided(robot, tree)
    named = (robot.joints[name] for name in (*left, *right) if name in robot.joints)
    fixed = next((joint for joint in named if joint.type is JointType.FIXED), None)
    if isinstance(found, NoDrive) and fixed is not None:
        return NoDrive(f"its drive names '{fixed.name}', which is fixed and does not turn ({fixed.origin})")
    return with_sides(found, *sides)


def _sides(controllers: Iterable[DeclaredDrive]) -> tuple[list[str], list[str]]:
    """The joints that controllers name as left and as right. The first controller that names a joint
    decides."""
    left, right = list[str](), list[str]()
    for controller in controllers:
        known = {*left, *right}
        for side, named in ((left, controller.left), (right, controller.right)):
            side += [joint.text for joint in named if joint.text and joint.text not in known]
    return left, right


def _two_sided(robot: RobotModel, tree: FrameTree) -> DifferentialDrive | NoDrive:
    """The differential drive of joints that no plugin names."""
    turning = [j for j in robot.joints.values() if j.type is JointType.CONTINUOUS]
    if not turning:
        return NoDrive(_why_nothing_turns(robot))
    if not any(link.collisions or link.inertial for link in robot.links.values()):
        return NoDrive("no link has a mass or a collision shape: the description is only for display")
    rigid = [joint for joint in turning if movable_above(robot, joint.parent) is None]
    suspended = [joint for joint in turning if joint not in rigid and _is_suspended(tree, joint)]
    result: DifferentialDrive | NoDrive | None = None
    for joints in (commanded_joints(robot, "velocity"), rigid, suspended):
        if joints:
            found = drive_of(robot, tree, joints)
            if isinstance(found, DifferentialDrive):
                return found
            result = result or found
    return result or NoDrive(f"'{turning[0].name}' turns, but is mounted on another movable joint")


def base_link(robot: RobotModel, wheel_parent: str) -> str:
    """The frame of odometry (REP 105): `base_footprint` or `base_link` if it is rigidly connected to the body
    that carries the wheels, else that body's link."""
    body = carrier(robot, wheel_parent)
    for name in ("base_footprint", "base_link"):
        if name in robot.links and carrier(robot, name) == body:
            return name
    return body


def _why_nothing_turns(robot: RobotModel) -> str:
    others = [f"'{j.name}' is {j.type}" for j in robot.joints.values() if j.is_movable]
    if not others:
        return f"the robot has no movable joint ({robot.origin})"
    more = f" and {len(others) - 3} more" if len(others) > 3 else ""
    return f"the robot has no continuous joint for a wheel: {', '.join(others[:3])}{more}"


def _is_suspended(tree: FrameTree, joint: Joint) -> bool:
    """Whether only springs and rockers are between the joint and the root, and nothing that steers it."""
    robot = tree.robot
    above = movable_above(robot, joint.parent)
    while above is not None:
        axis = tree.pose(above.child).rotation @ unit_axis(above)
        rocks = above.type is JointType.REVOLUTE and abs(axis[2]) < 0.5
        if not rocks and above.type is not JointType.PRISMATIC:
            return False
        above = movable_above(robot, above.parent)
    return True


def drive_of(robot: RobotModel, tree: FrameTree, joints: Sequence[Joint]) -> DifferentialDrive | NoDrive:
    """The drive of the wheels on `joints`, or on some of them."""
    if not joints:
        return NoDrive("no driving joint is named")
    base = base_link(robot, joints[0].parent)
    found = [find_wheel(tree, joint, base) for joint in joints]
    wheels = [wheel for wheel in found if not wheel.flaw]
    flaws = [f"'{w.joint.name}': {w.flaw} ({w.joint.origin})" for w in found if w.flaw]
    if not wheels:
        return NoDrive(f"no joint turns a wheel: {flaws[0]}")
    pairs = pairs_of(wheels)
    if not pairs:
        alone = wheels[0].joint
        reason = f"'{alone.name}' has no wheel of equal size on the other side ({alone.origin})"
        return NoDrive("; ".join([reason, *flaws[:1]]))
    return _build(tree, base, largest(pairs))


def _build(tree: FrameTree, base: str, pairs: Sequence[Pair]) -> DifferentialDrive:
    lefts, rights = [pair.left for pair in pairs], [pair.right for pair in pairs]
    left = leftward(lefts[0])
    middle_left = np.array([w.center for w in lefts]).mean(axis=0)
    middle_right = np.array([w.center for w in rights]).mean(axis=0)
    middle = (middle_left + middle_right) / 2.0
    axle = Transform.from_xyz_rpy(middle.tolist(), (0.0, 0.0, math.atan2(-left[0], left[1])))
    wheels = {w.joint.name: w for w in lefts + rights}
    radius = sum(w.radius for w in wheels.values()) / len(wheels)
    casters = casters_of(tree, base, float(axle.translation[2]) - radius, radius, lefts + rights)
    return DifferentialDrive(
        left=tuple(w.joint.name for w in lefts),
        right=tuple(w.joint.name for w in rights),
        forward={name: 1.0 if w.axis @ left > 0.0 else -1.0 for name, w in wheels.items()},
        wheels=wheels,
        radius=radius,
        separation=float((middle_left - middle_right) @ left),
        base=base,
        axle_in_base=axle,
        casters=tuple(c.link for c in casters if c.touches and not c.is_off_ground),
    )


def _steered(
    robot: RobotModel, tree: FrameTree, controllers: Sequence[DeclaredDrive]
) -> SteeredDrive | NoDrive | None:
    """The drive of a base with wheels that steer. None if no wheel on the ground does."""
    named = [name for c in controllers for name in c.traction]
    traction = [*movable(robot, named), *commanded_joints(robot, "velocity")]
    commanded = {joint.name for joint in commanded_joints(robot, "position")}
    commanded.update(name for c in controllers for name in c.steering)
    motors = joints_with_motors(robot)
    turning = [joint for joint in robot.joints.values() if joint.type is JointType.CONTINUOUS]
    on_base = [joint for joint in turning if movable_above(robot, joint.parent) is None]
    if isinstance(drive_of(robot, tree, on_base), DifferentialDrive):
        # beside a fixed axle, casters stay casters, also if all wheels have a transmission
        motors = {name for name in motors if name in robot.joints and not is_caster(robot.joints[name])}
    base = base_link(robot, robot.root)
    found, flaw = list[tuple[Wheel, Joint | None]](), ""
    for joint in dict.fromkeys([*turning, *traction]):
        by, belongs = mount(tree, joint, commanded, motors)
        wheel = find_wheel(tree, joint, base)
        bodies = [robot.links[name] for name in rigid_links(robot, joint.child)]
        if not any(body.inertial or body.collisions for body in bodies):
            continue  # a virtual wheel, which a controller commands and real wheels mimic
        if belongs and not wheel.flaw:
            found.append((wheel, by))
        elif by is not None:
            flaw = flaw or f"'{joint.name}': {wheel.flaw}"
    rolling = {by.name for _, by in found if by is not None}
    found += [(wheel, wheel.joint) for wheel in _fixed_on_steering(tree, base, rolling)]
    ground = min((wheel.bottom for wheel, _ in found), default=0.0)
    found = [(wheel, by) for wheel, by in found if wheel.bottom - ground < wheel.radius / 2.0]
    steered = [(wheel, by) for wheel, by in found if by is not None]
    if not steered:
        return None
    first, by = steered[0]
    reason = f"the wheel on '{first.joint.name}' is steered by '{by.name}', as on a car"
    fixed = [wheel.joint for wheel, by in found if by is None]
    if not fixed and all(other is by for _, other in steered):
        if flaw:
            return NoDrive(f"{reason}, but {flaw}")
        # the base turns against its wheels by this joint, and not by the direction of the wheels
        what = "a base that KBot does not drive"
        return NoDrive(f"its wheels swivel together on '{by.name}' ({by.origin}), {what}")
    axle = drive_of(robot, tree, fixed) if fixed else _middle(tree, base, [wheel for wheel, _ in found])
    if isinstance(axle, NoDrive):
        return NoDrive(f"{reason}, but {flaw or f'it has no fixed axle: {axle.reason}'}")
    # wheels beside the axle, such as support wheels, roll freely
    mounted = {
        wheel.joint.name: (wheel, by)
        for wheel, by in found
        if by is not None or wheel.joint.name in axle.wheels
    }
    modules = tuple(placed(tree, base, axle.axle_in_base, wheel, by) for wheel, by in mounted.values())
    if not fixed and all(module.turns_everywhere for module in modules):
        # such wheels may point in any direction at position 0, and the base drives along its own axes
        middle = axle.axle_in_base.translation.tolist()
        axle = replace(axle, axle_in_base=Transform.from_xyz_rpy(middle, (0.0, 0.0, 0.0)))
        modules = tuple(placed(tree, base, axle.axle_in_base, wheel, by) for wheel, by in mounted.values())
    ahead = [abs(module.x) for module in modules if module.steering is not None]
    if (min(ahead) if fixed else max(ahead)) < axle.radius:
        return NoDrive(f"{reason}, but {flaw or 'a steered wheel is beside the middle of the axle'}")
    driven = tuple(dict.fromkeys(joint.name for joint in traction if joint.name in mounted))
    own = {field.name: getattr(axle, field.name) for field in fields(DifferentialDrive)}
    own["wheels"] = {name: wheel for name, (wheel, _) in mounted.items()}
    own["forward"] = {module.rolls: module.forward for module in modules}
    links = {wheel.link for wheel, _ in mounted.values()}
    own["casters"] = tuple(link for link in axle.casters if link not in links)
    if not driven:
        # a wheel whose joint has dry friction is geared: it would not roll freely
        geared = (n for n in mounted if (d := robot.joints[n].dynamics) is not None and d.friction > 0.0)
        rolling_joints = tuple(name for name, (wheel, by) in mounted.items() if wheel.joint is not by)
        driven = tuple(dict.fromkeys((*axle.joints, *geared))) if fixed else rolling_joints
    return SteeredDrive(**own, modules=modules, traction=driven, reason=reason)


def _fixed_on_steering(tree: FrameTree, base: str, others: Collection[str]) -> Iterator[Wheel]:
    """Wheels that steer but have no joint to roll on: cylinders that are fixed to an upright revolute joint.

    `others` are the joints that steer a wheel that rolls.
    """
    robot = tree.robot
    for joint in robot.joints.values():
        is_free = joint.type is JointType.REVOLUTE and joint.name not in others
        if not is_free or abs((tree.pose(joint.child, base).rotation @ unit_axis(joint))[2]) < UPRIGHT:
            continue
        for link in rigid_links(robot, joint.child):
            for collision in robot.links[link].collisions:
                shape, pose = collision.geometry, tree.pose(link, base) @ Transform.of(collision.pose)
                axis = pose.rotation[:, 2]
                if isinstance(shape, Cylinder) and abs(axis[2]) < _LYING:
                    yield Wheel(joint, pose.translation, axis, shape.radius, shape.length, shape, "")


def _middle(tree: FrameTree, base: str, wheels: Sequence[Wheel]) -> DifferentialDrive:
    """The frame in the middle of wheels that all steer, which have no left and right side."""
    middle = np.mean([wheel.center for wheel in wheels], axis=0)
    left = leftward(wheels[0])
    is_parallel = all(abs(wheel.axis @ left) > _PARALLEL for wheel in wheels)
    yaw = math.atan2(-left[0], left[1]) if is_parallel else 0.0
    radius = sum(wheel.radius for wheel in wheels) / len(wheels)
    lever = max(float(np.hypot(*(wheel.center - middle)[:2])) for wheel in wheels)
    casters = casters_of(tree, base, float(middle[2]) - radius, radius, wheels)
    return DifferentialDrive(
        left=(),
        right=(),
        forward={},
        wheels={wheel.joint.name: wheel for wheel in wheels},
        radius=radius,
        separation=2.0 * lever,
        base=base,
        axle_in_base=Transform.from_xyz_rpy(middle.tolist(), (0.0, 0.0, yaw)),
        casters=tuple(c.link for c in casters if c.touches and not c.is_off_ground),
    )


def _holonomic(tree: FrameTree, declared: DeclaredDrive, kind: Holonomic) -> HolonomicDrive | NoDrive:
    """The base that a plugin or controller moves in every direction."""
    if kind is Holonomic.BODY:
        return _moved_base(tree, sideways=not declared.ignores_sideways)
    if kind is Holonomic.TRACKS:
        return _tracked(tree, declared)
    robot, count = tree.robot, len(declared.wheels)
    if count < 3 or (kind is Holonomic.MECANUM and count < 4):
        needed = "four mecanum wheels" if kind is Holonomic.MECANUM else "three or more omni wheels"
        return NoDrive(f"{declared.name} does not name the joints of {needed}")
    names = [parameter.text for parameter in declared.wheels]
    joints = movable(robot, names)
    if len(joints) < count:
        turning = {joint.name for joint in joints}
        other = next((name for name in names if name not in turning), None)
        if other is not None:
            return NoDrive(f"{declared.name} names '{other}', which is not a joint that turns")
        twice = next(name for name in names if names.count(name) > 1)
        return NoDrive(f"{declared.name} names '{twice}' for more than one wheel")
    base = base_link(robot, joints[0].parent)
    wheels = {joint.name: find_wheel(tree, joint, base) for joint in joints}
    radii = [wheel.radius for wheel in wheels.values() if wheel.radius]
    if not radii and declared.radius is not None and declared.radius.value > 0.0:
        radii = [declared.radius.value]  # meshes of rollers are not round
    middle = np.mean([wheel.center for wheel in wheels.values()], axis=0)
    aside = np.abs([wheel.center[:2] - middle[:2] for wheel in wheels.values()])
    directions: tuple[tuple[float, float, float], ...]
    if kind is Holonomic.MECANUM:
        lever, directions = float(aside.sum(axis=1).mean()), _MECANUM
    else:
        lever, directions = float(np.hypot(*aside.T).mean()), _omni_directions(declared, count)
    if not radii or not lever:
        flaw = next(iter(wheels.values())).flaw or "all wheels are in one place"
        return NoDrive(f"'{joints[0].name}' turns no wheel: {flaw}")
    radius = sum(radii) / len(radii)
    by_wheel = dict(zip(wheels, directions, strict=True))
    return _on_wheels(tree, base, kind, wheels, by_wheel, middle, radius, lever)


def _on_wheels(
    tree: FrameTree,
    base: str,
    kind: Holonomic,
    wheels: Mapping[str, Wheel],
    directions: Mapping[str, tuple[float, float, float]],
    middle: Array,
    radius: float,
    lever: float,
    treads: tuple[str, ...] = (),
) -> HolonomicDrive:
    """The holonomic drive of wheels around a `middle`, which they turn by a `lever` in m."""
    casters = casters_of(tree, base, float(middle[2]) - radius, radius, list(wheels.values()))
    return HolonomicDrive(
        left=(),
        right=(),
        forward=dict.fromkeys(wheels, 1.0),
        wheels=wheels,
        radius=radius,
        separation=2.0 * lever,
        base=base,
        axle_in_base=Transform.from_xyz_rpy(middle.tolist(), (0.0, 0.0, 0.0)),
        casters=tuple(c.link for c in casters if c.touches and not c.is_off_ground and c.link not in treads),
        kind=kind,
        directions=directions,
        sideways=True,
        treads=treads,
    )


def _on_rollers(tree: FrameTree) -> HolonomicDrive | None:
    """The base on mecanum or omni wheels whose rollers are links. None if it does not have three."""
    robot = tree.robot
    turning = [joint for joint in robot.joints.values() if joint.type is JointType.CONTINUOUS]
    rollers: dict[str, list[Joint]] = {}
    for joint in turning:
        above = movable_above(robot, joint.parent)
        if above is not None and above in turning and abs(_cosine(tree, joint, above)) < _PARALLEL:
            rollers.setdefault(above.name, []).append(joint)
    joints = [robot.joints[name] for name, found in rollers.items() if len(found) >= _FEWEST_ROLLERS]
    if len(joints) < 3:
        return None
    base = base_link(robot, joints[0].parent)
    wheels, slopes = dict[str, Wheel](), list[float]()
    for joint in joints:
        wheel = find_wheel(tree, joint, base)
        on_wheel = [find_wheel(tree, roller, base) for roller in rollers[joint.name]]
        ways = [roller.center - wheel.center for roller in on_wheel]
        radial = [way - wheel.axis * float(way @ wheel.axis) for way in ways]
        outer = max(float(np.linalg.norm(r)) + w.radius for r, w in zip(radial, on_wheel, strict=True))
        wheels[joint.name] = replace(wheel, radius=outer, flaw="")
        slopes.append(_slope_of_rollers(wheel, on_wheel, radial))
    middle = np.mean([wheel.center for wheel in wheels.values()], axis=0)
    rims = [
        _rim(wheel, slope, wheel.center - middle)
        for wheel, slope in zip(wheels.values(), slopes, strict=True)
    ]
    lever = float(np.mean([abs(rim[2]) for rim in rims]))
    if np.linalg.matrix_rank(np.array(rims), tol=1e-6) != 3:
        return None  # all rollers are parallel, for example
    radius = float(np.mean([wheel.radius for wheel in wheels.values()]))
    treads = tuple(roller.child for joint in joints for roller in rollers[joint.name])
    directions = {name: (x, y, turn / lever) for name, (x, y, turn) in zip(wheels, rims, strict=True)}
    return _on_wheels(tree, base, Holonomic.ROLLER, wheels, directions, middle, radius, lever, treads)


def _cosine(tree: FrameTree, a: Joint, b: Joint) -> float:
    """The cosine of the angle between the axes of two joints."""
    axes = [tree.pose(joint.child).rotation @ unit_axis(joint) for joint in (a, b)]
    return float(axes[0] @ axes[1])


def _slope_of_rollers(wheel: Wheel, rollers: Sequence[Wheel], radial: Sequence[Array]) -> float:
    """The tangent of the angle between the rollers and the rolling direction of their wheel.

    It is 0 for an omni wheel, and 1 or -1 for a mecanum wheel. `radial` are the vectors from the axle to the
    rollers."""
    slopes = []
    for roller, out in zip(rollers, radial, strict=True):
        along_rim = float(roller.axis @ np.cross(wheel.axis, out)) / (float(np.linalg.norm(out)) or 1.0)
        slopes.append(float(roller.axis @ wheel.axis) / (along_rim or math.inf))
    return float(np.median(slopes))


def _rim(wheel: Wheel, slope: float, place: Array) -> tuple[float, float, float]:
    """The speed of a wheel's rim from x, y and yaw of a twist.

    The roller on the ground turns freely, so that only the motion along its axle counts (Lynch and Park,
    Modern Robotics, 13.2). At the bottom, the axle of a roller is along `slope * axis - forward`, where
    `forward` is the rolling direction of the wheel."""
    ax, ay, _ = wheel.axis.tolist()
    x, y = ay + slope * -ax, -ax - slope * ay
    return x, y, float(place[0] * y - place[1] * x)


def _omni_directions(declared: DeclaredDrive, count: int) -> tuple[tuple[float, float, float], ...]:
    """The `directions` of omni wheels: equal angles counterclockwise, from the angle `wheel_offset` on."""
    given = declared.first("wheel_offset")
    first = (given.number if given is not None else None) or 0.0
    angles = [first + 2.0 * math.pi * index / count for index in range(count)]
    return tuple((math.sin(angle), -math.cos(angle), -1.0) for angle in angles)


def _moved_base(tree: FrameTree, *, sideways: bool) -> HolonomicDrive | NoDrive:
    """The base that a plugin moves itself. The twist is that of the base's frame."""
    base = base_link(tree.robot, tree.robot.root)
    standing = links_on_ground(tree, base)
    if not standing:
        return NoDrive("no link has a collision shape on which the base can stand")
    round_shapes = [c.shape.radius for c in standing if isinstance(c.shape, Cylinder | Sphere)]
    radius = sum(round_shapes) / len(round_shapes) if round_shapes else _NOMINAL
    lever = float(np.mean([math.hypot(c.center[0], c.center[1]) for c in standing]))
    ground = min(caster.bottom for caster in standing)
    return HolonomicDrive(
        left=(),
        right=(),
        forward={},
        wheels={},
        radius=radius,
        separation=2.0 * max(lever, radius),
        base=base,
        axle_in_base=Transform.from_xyz_rpy((0.0, 0.0, ground + radius), (0.0, 0.0, 0.0)),
        casters=tuple(caster.link for caster in standing),
        kind=Holonomic.BODY,
        directions={},
        sideways=sideways,
    )


def _tracked(tree: FrameTree, declared: DeclaredDrive) -> HolonomicDrive | NoDrive:
    """The base on tracks. As in gz, it turns about the origin of its `<body_link>`, or else of its root."""
    robot = tree.robot
    sides = [[track.text for track in side] for side in (declared.left, declared.right)]
    for side, names in zip(("left", "right"), sides, strict=True):
        if not names:
            return NoDrive(f"{declared.name} does not name a {side} track")
        unknown = next((name for name in names if name not in robot.links), None)
        if unknown is not None:
            return NoDrive(f"{declared.name} names the track '{unknown}', which is not a link")
    given = declared.first("body_link")
    body = given.text if given is not None else robot.root
    if body not in robot.links:
        return NoDrive(f"{declared.name} names the body '{body}', which is not a link")
    base = base_link(robot, sides[0][0])
    standing = {caster.link: caster for caster in links_on_ground(tree, base)}
    left, right = ([standing[name] for name in names if name in standing] for names in sides)
    if not left or not right:
        missing = "left" if not left else "right"
        return NoDrive(f"no {missing} track of {declared.name} has a collision shape on the ground")
    base_from_body = tree.pose(body, in_frame=base)
    x, y, _ = base_from_body.translation.tolist()
    across = base_from_body.rotation[:, 1]
    middles = [float(np.mean([caster.center @ across for caster in side])) for side in (left, right)]
    radius = _NOMINAL
    return HolonomicDrive(
        left=(),
        right=(),
        forward={},
        wheels={},
        radius=radius,
        separation=abs(middles[0] - middles[1]),
        base=base,
        axle_in_base=Transform.from_xyz_rpy((x, y, left[0].bottom + radius), (0.0, 0.0, base_from_body.yaw)),
        casters=(),
        kind=Holonomic.TRACKS,
        directions={},
        sideways=False,
        treads=(*sides[0], *sides[1]),
        efficiency=declared.steering_efficiency,
    )


def named_twice(left: Sequence[str], right: Sequence[str]) -> tuple[str, str] | None:
    """A joint that is named twice, and a description for messages; None if each joint is named once.

    gazebo_ros_diff_drive and diff_drive_controller do not start with such names.
    """
    sides: dict[str, str] = {}
    for side, names in (("left", left), ("right", right)):
        for name in names:
            before = sides.get(name)
            if before is not None:
                twice = f"twice as {side}" if before == side else "both as left and as right"
                return name, f"the joint '{name}' {twice}"
            sides[name] = side
    return None


def with_sides(
    drive: DifferentialDrive | NoDrive, left: Sequence[str], right: Sequence[str]
) -> DifferentialDrive | NoDrive:
    """The drive with the sides that its plugin or controller names.

    The plugin decides which joints are left and right, and not their position. gazebo_ros_diff_drive, gz's
    DiffDrive and diff_drive_controller all command (v - w s/2)/r to the joints named left and (v + w s/2)/r
    to those named right, and compute the turn of their odometry from right minus left. With exchanged names
    the robot therefore turns against the command, while the odometry agrees with the command. The speed is
    that of the joint: if its axis points to the right, a positive speed drives backwards. A joint that is not
    named stays on the side of its wheel, and its speed has the sign that its axis requires.
    """
    twice = named_twice(left, right)
    if twice is not None:
        return NoDrive(f"its drive names {twice[1]}")
    if isinstance(drive, NoDrive):
        return drive
    ahead = drive.axle_in_base.rotation[:, 0]
    joints = sorted(drive.joints, key=lambda name: -float(drive.wheels[name].center @ ahead))
    lefts = tuple(n for n in joints if n in left or (n in drive.left and n not in right))
    rights = tuple(n for n in joints if n not in lefts)
    if not lefts or not rights:
        return NoDrive(f"its drive does not name a {'right' if lefts else 'left'} joint")
    named = dict.fromkeys((*left, *right), 1.0)
    forward = {name: named.get(name, sign) for name, sign in drive.forward.items()}
    return replace(drive, left=lefts, right=rights, forward=forward)
