"""Poses and velocities of models and links, as Gazebo's topics and services report them.

A model is a robot or a body of the world. A link is named `robot::link`; `link` alone is of the first robot.
"""

from __future__ import annotations

import math
from functools import partial

import mujoco
import numpy as np

from kbot.kinematics.transform import Transform
from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.messages.bus import Publisher
from kbot.sim import Simulation
from kbot.text import KbotError

TOPICS_RATE = 50.0
"""Hz at which the states of models and links are published."""
_UPRIGHT = math.cos(math.radians(45.0))
"""Least vertical component of the normal of ground."""
_SINKS = 0.002
"""Most metres that a robot at rest sinks into the ground in a soft contact."""
WORLD = frozenset({"", "world", "map"})
"""Names of the world's frame, as Gazebo accepts them."""


class GazeboTopics:
    """Publishes `/gazebo/model_states` and `/gazebo/link_states`, subscribes to `/gazebo/set_model_state`."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        bus = simulation.bus
        advertise = partial(bus.advertise, rate=TOPICS_RATE)
        self._models: Publisher[srv.ModelStates] = advertise("/gazebo/model_states", srv.ModelStates)
        self._links: Publisher[srv.LinkStates] = advertise("/gazebo/link_states", srv.LinkStates)
        self._commands = bus.subscribe("/gazebo/set_model_state", srv.ModelState, self._set)
        self._timer = simulation.clock.every(TOPICS_RATE, self._publish)

    def close(self) -> None:
        self._timer.cancel()
        self._commands.close()

    def _publish(self) -> None:
        sim = self._simulation
        if self._models.has_subscribers:
            names, fixed = tuple(models_of(sim)), _fixed(sim)
            states = [_state_of(sim, name, fixed) for name in names]
            self._models.publish(
                srv.ModelStates(names, tuple(s[0] for s in states), tuple(s[1] for s in states))
            )
        if self._links.has_subscribers:
            links = [(name, link) for name, robot in sim.robots.items() for link in robot.robot.links]
            moving = [link_state(sim, name, link) for name, link in links]
            names = tuple(f"{name}::{link}" for name, link in links)
            self._links.publish(
                srv.LinkStates(names, tuple(s[0] for s in moving), tuple(s[1] for s in moving))
            )

    def _set(self, state: srv.ModelState) -> None:
        put(self._simulation, state.model_name, state.pose, state.twist, state.reference_frame)


def models_of(simulation: Simulation) -> list[str]:
    return [*simulation.robots, *(body.name for body in simulation.world.bodies)]


def state_of(simulation: Simulation, model: str) -> tuple[msg.Pose, msg.Twist]:
    """Pose and velocity of a model in the world. A fixed body has the pose that the world gives it."""
    return _state_of(simulation, model, _fixed(simulation))


def _fixed(simulation: Simulation) -> dict[str, Transform]:
    moving = simulation.models.body_poses()
    return {body.name: body.pose for body in simulation.world.bodies if body.name not in moving}


def _state_of(simulation: Simulation, model: str, fixed: dict[str, Transform]) -> tuple[msg.Pose, msg.Twist]:
    if model in fixed:
        return _pose(fixed[model]), msg.Twist()
    state = simulation.models.get_model_state(model)
    return _pose(state.pose), msg.Twist(msg.Vector3(*state.linear), msg.Vector3(*state.angular))


def link_state(simulation: Simulation, robot: str, link: str) -> tuple[msg.Pose, msg.Twist]:
    simulated = simulation.robots.named(robot)
    pose = simulated.body.link_pose(link)
    model, data = simulation.engine.current()
    speeds = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, simulated.body.index(link), speeds, 0)
    wx, wy, wz, x, y, z = speeds.tolist()
    return _pose(pose), msg.Twist(msg.Vector3(x, y, z), msg.Vector3(wx, wy, wz))


def relative_state(simulation: Simulation, model: str, frame: str) -> tuple[msg.Pose, msg.Twist]:
    if model not in models_of(simulation):
        simulation.models.get_model_state(model)  # raises an error that suggests similar names
    return seen_from(world_from_frame(simulation, frame), *state_of(simulation, model))


def seen_from(frame: Transform, pose: msg.Pose, twist: msg.Twist) -> tuple[msg.Pose, msg.Twist]:
    """A pose and a twist in another frame. The twist is rotated into its axes; the frame's own velocity is
    not subtracted."""
    turn = frame.rotation.T
    linear, angular = turn @ np.array(xyz(twist.linear)), turn @ np.array(xyz(twist.angular))
    return (
        _pose(frame.inverse() @ _transform(pose)),
        msg.Twist(msg.Vector3(*linear.tolist()), msg.Vector3(*angular.tolist())),
    )


def put(simulation: Simulation, model: str, pose: msg.Pose, twist: msg.Twist, frame: str) -> None:
    """Set the pose and velocity of a model, given in a frame.

    A robot that is then in the ground is raised onto it. Gazebo pushes it out slowly, MuJoCo with a jump of
    up to a metre. Programs that place a robot at z = 0 rely on that."""
    base = world_from_frame(simulation, frame)
    turn = base.rotation
    place = base @ _transform(pose)
    linear = tuple((turn @ np.array(xyz(twist.linear))).tolist())
    angular = tuple((turn @ np.array(xyz(twist.angular))).tolist())
    simulation.models.set_model_state(model, place, linear, angular)
    depth = _depth_in_ground(simulation, model) if model in simulation.robots else 0.0
    if depth > _SINKS:
        raised = Transform.from_xyz_rpy((0.0, 0.0, depth), (0.0, 0.0, 0.0)) @ place
        simulation.models.set_model_state(model, raised, linear, angular)


def _depth_in_ground(simulation: Simulation, name: str) -> float:
    """How deep in m a robot is in fixed ground."""
    robot = simulation.robots.named(name)
    model, current = simulation.engine.current()
    data = mujoco.MjData(model)  # a copy, because the run must not depend on who looks at its contacts
    data.qpos[:] = current.qpos
    mujoco.mj_fwdPosition(model, data)
    tree = model.body_rootid[robot.body.index(robot.robot.root)]
    deepest = 0.0
    for contact in data.contact:
        first, second = model.geom_bodyid[contact.geom]
        up = abs(float(contact.frame[2]))
        if up < _UPRIGHT or tree not in (model.body_rootid[first], model.body_rootid[second]):
            continue
        if 0 in (model.body_weldid[first], model.body_weldid[second]):
            deepest = max(deepest, -float(contact.dist) / up)
    return deepest


def in_world(simulation: Simulation, pose: msg.Pose, frame: str) -> Transform:
    return world_from_frame(simulation, frame) @ _transform(pose)


def world_from_frame(simulation: Simulation, name: str) -> Transform:
    """The transform to the world from the frame of the world, a model or a link."""
    if name in WORLD:
        return Transform.identity()
    if name in models_of(simulation):
        return _transform(state_of(simulation, name)[0])
    robot, link = link_named(simulation, name)
    return simulation.robots.named(robot).body.link_pose(link)


def link_named(simulation: Simulation, name: str) -> tuple[str, str]:
    robot, mark, link = name.rpartition("::")
    found = simulation.robots.named(robot if mark else None)
    found.body.index(link)  # raises if the robot does not have the link
    return found.name, link


def _transform(pose: msg.Pose) -> Transform:
    q = pose.orientation
    quaternion = (q.x, q.y, q.z, q.w)
    try:
        # a ROS 1 message without an orientation has zeros, which Gazebo reads as the identity
        return Transform.from_quaternion_xyzw(
            quaternion if any(quaternion) else (0.0, 0.0, 0.0, 1.0), xyz(pose.position)
        )
    except ValueError as error:
        raise KbotError(f"invalid pose: {error}") from None


def _pose(transform: Transform) -> msg.Pose:
    return msg.Pose(msg.Point(*transform.translation.tolist()), msg.Quaternion(*transform.quaternion_xyzw))


def xyz(vector: msg.Vector3 | msg.Point) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
