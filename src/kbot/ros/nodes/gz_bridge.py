"""ros_gz_bridge: connects the simulation's topics to topics with other names, in either direction."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from kbot.messages import Twist
from kbot.record.encodings.type_names import ros_name
from kbot.ros.nodes.relays import Relays
from kbot.text import Diagnostic, KbotError, Origin, Severity
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:  # the engine, which reading a launch file does not need
    from kbot.sim import Simulation
    from kbot.sim.robot import SimulatedRobot


class Direction(StrEnum):
    """The direction of messages, as ros_gz_bridge's configuration writes it."""

    TO_ROS = "GZ_TO_ROS"
    TO_GZ = "ROS_TO_GZ"
    BOTH = "BIDIRECTIONAL"


@dataclass(frozen=True, slots=True)
class Bridged:
    """A gz topic and the ROS topic it is connected to. Names are full."""

    gz: str
    ros: str
    ros_type: str
    direction: Direction
    origin: Origin


_STAMPED = "geometry_msgs/msg/TwistStamped"
"""The link to peers converts it to a Twist for topics of that type."""
_MODEL = re.compile(r"(?:/world/[^/]+)?/model/([^/]+)/(.+)")
_SENSOR = re.compile(r"link/[^/]+/sensor/([^/]+)/(.+)")


class GzBridge:
    """Subscribes to one name and publishes on the other."""

    def __init__(self, simulation: Simulation, bridged: Iterable[Bridged]) -> None:
        self._simulation = simulation
        self._relays = Relays(simulation)
        self.notes: list[Diagnostic] = []
        """What cannot be bridged, at the line that configures it."""
        for rule in bridged:
            self._connect(rule)

    def _connect(self, rule: Bridged) -> None:
        bus = self._simulation.bus
        own = _own_name(self._simulation, rule.gz)
        if own is None:
            hint = did_you_mean(rule.gz, bus.topics) or "KBot does not simulate its plugin or sensor"
            self._note(rule, f"the simulation has no gz topic {rule.gz}", hint)
            return
        kind = bus.topics[own]
        if rule.ros_type not in (ros_name(kind), _STAMPED if kind is Twist else ""):
            self._note(rule, f"{rule.gz} has the type {ros_name(kind)}, not {rule.ros_type}", "")
            return
        is_input = own in bus.inputs
        if rule.direction is (Direction.TO_ROS if is_input else Direction.TO_GZ):
            does = "subscribes to" if is_input else "publishes"
            wanted = Direction.TO_GZ if is_input else Direction.TO_ROS
            self._note(rule, f"the simulation {does} {rule.gz}, so its direction must be {wanted}", "")
            return
        if rule.ros == own:
            return
        try:
            if is_input:
                bus.subscribe(rule.ros, kind, lambda message: bus.publish(own, message))
            else:
                self._relays.add(own, rule.ros, kind)
        except KbotError as error:
            self._note(rule, str(error), "")

    def _note(self, rule: Bridged, message: str, hint: str) -> None:
        self.notes.append(Diagnostic("L063", Severity.WARNING, message, rule.origin, hint))


def _own_name(simulation: Simulation, gz: str) -> str | None:
    """The simulation's topic for the name of a gz topic; None if there is none."""
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
    """The topic of a sensor without a `<topic>`: KBot uses the sensor's label, gz the path to the sensor."""
    ours = {"image": "image_raw", "depth_image": "depth/image_raw"}.get(what, what)
    parts = (f"{sensor}/{ours}", f"{sensor}/{what}", sensor)
    candidates = (robot.naming.topic(part) for part in parts)
    return next((name for name in candidates if name in simulation.bus.topics), None)
