"""Topics that sensors of several robots are heard on, told at their lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.sensors.sensor import Spec
from kbot.sim.robot import SimulatedRobot
from kbot.text import Diagnostic, Origin, Severity

_HINT = "give each robot a namespace, and write the topic without a / before it: each has its own then"


def shared_topics(declared: Iterable[tuple[SimulatedRobot, Iterable[Spec]]]) -> Iterator[Diagnostic]:
    """A warning for each topic that more than one of the robots says its sensors' readings on."""
    speakers: dict[str, dict[str, Spec]] = {}
    robots: dict[str, SimulatedRobot] = {}
    for robot, specs in declared:
        robots[robot.name] = robot
        for spec in specs:
            for topic in spec.topics:
                speakers.setdefault(robot.naming.topic(topic), {}).setdefault(robot.name, spec)
    for topic, sensors in speakers.items():
        if len(sensors) > 1:
            names = " and ".join(f"'{name}'" for name in sensors)
            message = f"the topic {topic} is that of a sensor of {names}: their readings are mixed on it"
            name, spec = list(sensors.items())[-1]
            origin = _where(robots[name], spec, topic)
            yield Diagnostic("W142", Severity.WARNING, message, origin, _HINT)


def _where(robot: SimulatedRobot, spec: Spec, topic: str) -> Origin | None:
    """The line that names a sensor's topic, else that of the sensor."""
    for extension in robot.robot.extensions:
        for element in extension.descendants():
            if element.origin == spec.origin:
                named = (e for e in element.descendants() if e.text.strip().endswith(topic))
                return next((e.origin for e in named), spec.origin)
    return spec.origin
