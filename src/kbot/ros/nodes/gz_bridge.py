"""ros_gz_bridge: publishes the simulation's topics under other names, in either direction."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from kbot.messages import Publisher, Subscription, Twist
from kbot.record.encodings.type_names import ros_name
from kbot.text import Diagnostic, KbotError, Origin, Severity
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:  # the engine, which reading a launch file does not need
    from kbot.sim import Simulation
    from kbot.sim.robot import SimulatedRobot


class Direction(StrEnum):
    """Which way messages go."""

    TO_ROS = "GZ_TO_ROS"
    TO_GZ = "ROS_TO_GZ"
    BOTH = "BIDIRECTIONAL"


@dataclass(frozen=True, slots=True)
class Bridged:
    """A topic of gz under a name of ROS; names are full."""

    gz: str
    ros: str
    ros_type: str
    direction: Direction
    origin: Origin


LOOK_RATE = 10.0
"""Hz at which it looks who listens."""
_STAMPED = "geometry_msgs/msg/TwistStamped"
"""Peers may say a command so, wherever a Twist is heard."""
_MODEL = re.compile(r"(?:/world/[^/]+)?/model/([^/]+)/(.+)")
_SENSOR = re.compile(r"link/[^/]+/sensor/([^/]+)/(.+)")


class GzBridge:
    """Hears on one name and says on the other; what nobody listens to is not asked for."""

    def __init__(self, simulation: Simulation, bridged: Iterable[Bridged]) -> None:
        self._simulation = simulation
        self._relays: list[_Relay] = []
        self.notes: list[Diagnostic] = []
        """What cannot be carried, at the lines that ask for it."""
        for rule in bridged:
            self._carry(rule)
        if self._relays:
            self._look()
            simulation.clock.every(LOOK_RATE, self._look)

    def _carry(self, rule: Bridged) -> None:
        bus = self._simulation.bus
        own = _own_name(self._simulation, rule.gz)
        if own is None:
            hint = did_you_mean(rule.gz, bus.topics) or "the plugin or sensor that does is not simulated"
            self._note(rule, f"nothing here says or hears {rule.gz} of gz", hint)
            return
        kind = bus.topics[own]
        either = (ros_name(kind), _STAMPED if kind is Twist else "")
        if rule.ros_type not in either:
            self._note(rule, f"{rule.gz} is carried as {ros_name(kind)}, not as {rule.ros_type}", "")
            return
        is_heard = own in bus.inputs
        if rule.direction is (Direction.TO_ROS if is_heard else Direction.TO_GZ):
            does = "heard" if is_heard else "said"
            self._note(rule, f"{rule.gz} is {does} by the simulation, which is the other way", "")
            return
        if rule.ros == own:
            return
        try:
            if is_heard:
                bus.subscribe(rule.ros, kind, lambda message: bus.publish(own, message))
            else:
                self._relays.append(_Relay(self._simulation, own, rule.ros, kind))
        except KbotError as error:
            self._note(rule, str(error), "")

    def _look(self) -> None:
        for relay in self._relays:
            relay.look()

    def _note(self, rule: Bridged, message: str, hint: str) -> None:
        self.notes.append(Diagnostic("L063", Severity.WARNING, message, rule.origin, hint))


class _Relay:
    def __init__(self, simulation: Simulation, source: str, target: str, kind: type) -> None:
        self._bus, self._source, self._kind = simulation.bus, source, kind
        latched = self._bus.is_latched(source)
        # Any: each topic has its own type
        self._publisher: Publisher[Any] = self._bus.advertise(target, kind, latched=latched)
        self._subscription: Subscription | None = None

    def look(self) -> None:
        if self._publisher.has_subscribers and self._subscription is None:
            self._subscription = self._bus.subscribe(self._source, self._kind, self._publisher.publish)
        elif not self._publisher.has_subscribers and self._subscription is not None:
            self._subscription.close()
            self._subscription = None


def _own_name(simulation: Simulation, gz: str) -> str | None:
    """The simulation's topic of a name of gz; None where there is none."""
    topics = simulation.bus.topics
    if gz in topics:
        return gz
    if re.fullmatch(r"/world/[^/]+/clock", gz):
        return "/clock"
    model = _MODEL.fullmatch(gz)
    if model is None:
        return None
    robot = simulation.robots.get(model[1])
    if robot is None:
        return None
    sensor = _SENSOR.fullmatch(model[2])
    if sensor is not None:
        return _sensor_topic(simulation, robot, sensor[1], sensor[2])
    names: dict[str, Callable[[SimulatedRobot], str]] = {
        "cmd_vel": lambda r: r.settings.command_topic if r.settings else "",
        "odometry": lambda r: r.settings.odometry_topic if r.settings else "",
        "tf": lambda r: "/tf",
        "pose": lambda r: "/tf",
        "joint_state": lambda r: "joint_states",
    }
    own = names[model[2]](robot) if model[2] in names else model[2]
    full = robot.naming.topic(own) if own else ""
    return full if full in topics else None


def _sensor_topic(simulation: Simulation, robot: SimulatedRobot, sensor: str, what: str) -> str | None:
    """A sensor without a `<topic>` has its label for one here, and in gz the path to it."""
    ours = {"image": "image_raw", "depth_image": "depth/image_raw"}.get(what, what)
    parts = (f"{sensor}/{ours}", f"{sensor}/{what}", sensor)
    candidates = (robot.naming.topic(part) for part in parts)
    return next((name for name in candidates if name in simulation.bus.topics), None)
