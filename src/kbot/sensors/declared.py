"""Finds and mounts the sensors that a description declares.

They are `<gazebo reference><sensor>` of Gazebo Classic and gz, sensor interfaces of ros2_control, and plugins
of Gazebo Classic. Codes: W140 something is left out (warning), W141 an invalid value or an unknown link
(error).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.sensors.camera import Camera
from kbot.sensors.model_plugins import model_plugins
from kbot.sensors.readers import read_sensor
from kbot.sensors.ros2_control import ros2_control_sensors
from kbot.sensors.sdf_values import SensorValues
from kbot.sensors.sensor import Sensor, Spec, require_sensor_topic
from kbot.sim import Simulation
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.robot import SimulatedRobot
from kbot.text import DescriptionError, Diagnostic, Element, KbotError, Severity
from kbot.text.suggest import did_you_mean

Sensors = dict[str, Sensor[Any]]  # each measures messages of its own type
Mounted = tuple[Sensors, tuple[Diagnostic, ...]]

_KEY = "declared sensors"
_OTHERS = "declared sensors of others"


@dataclass(frozen=True, slots=True)
class Declared:
    """The sensors of a description in its order, and what there is to say about them."""

    specs: tuple[Spec, ...]
    diagnostics: tuple[Diagnostic, ...]


def declared_sensors(robot: RobotModel, naming: Naming = ROOT_NAMING) -> Declared:
    """What the description of a robot declares that the simulation calls `naming`. Never raises: what cannot
    be used is in the diagnostics."""
    diagnostics: list[Diagnostic] = []
    specs: list[Spec] = []
    for link, element in _elements(robot):
        values = SensorValues(element, diagnostics)
        known = robot.joints if element.attributes.get("type") == "force_torque" else robot.links
        if link not in known:
            what = "joint" if known is robot.joints else "link"
            hint = did_you_mean(link, known)
            values.error(f"there is no {what} '{link}'{': ' + hint if hint else ''}", element)
            continue
        before = sum(d.is_error for d in diagnostics)
        spec = read_sensor(values, link, naming)
        if spec is not None and sum(d.is_error for d in diagnostics) == before:
            specs.append(spec)
    specs += ros2_control_sensors(robot, diagnostics)
    specs += model_plugins(robot, naming, diagnostics)
    heard = []
    for spec in specs:
        try:
            for topic in spec.topics:
                require_sensor_topic(naming.topic(topic))
            heard.append(spec)
        except KbotError as error:
            diagnostics.append(_left_out(spec, error))
    return Declared(tuple(heard), tuple(diagnostics))


def mount_declared(simulation: Simulation, strict: bool = True) -> Mounted:
    """Mount every sensor that the robot's description declares: by name, and what was left out.

    Asked again, it hands out the same sensors. Cameras draw only while someone listens. Unless `strict`,
    sensors whose declarations have errors are left out too.

    Raises:
        DescriptionError: a declaration has errors; it carries all of them.
    """
    if _KEY in simulation.mounted:
        found: Mounted = simulation.mounted[_KEY]
        return found
    declared = declared_sensors(simulation.robot, simulation.robots.first.naming)
    if strict and any(d.is_error for d in declared.diagnostics):
        raise DescriptionError(declared.diagnostics)
    mounted: Sensors = {}
    said = list(declared.diagnostics)
    for spec in declared.specs:
        try:
            sensor = spec.mount(simulation)
            sensor.only_when_heard = isinstance(spec, Camera)
            mounted[spec.label] = sensor
        except KbotError as error:
            said.append(_left_out(spec, error))
    simulation.mounted[_KEY] = mounted, tuple(said)
    return mounted, tuple(said)


def mount_on_others(simulation: Simulation) -> None:
    """Mount the sensors that the descriptions of all robots but the first declare, each in its robot's
    namespace. A sensor that cannot be mounted is left out."""
    done: dict[str, SimulatedRobot] = simulation.mounted.setdefault(_OTHERS, {})
    new = {n: r for n, r in list(simulation.robots.items())[1:] if done.get(n) is not r}
    done.update(new)
    for name, robot in new.items():
        for spec in declared_sensors(robot.robot, robot.naming).specs:
            with suppress(KbotError):
                sensor = replace(spec, robot=name).mount(simulation)
                sensor.only_when_heard = isinstance(spec, Camera)


def _left_out(spec: Spec, error: KbotError) -> Diagnostic:
    message = f"{spec.label}: {str(error).removeprefix(f'{spec.label}: ')}: it is left out"
    return Diagnostic("W140", Severity.WARNING, message, spec.origin)


def _elements(robot: RobotModel) -> Iterator[tuple[str, Element]]:
    """Each `<sensor>`, and the link that it sits on."""
    for extension in extensions(robot, "gazebo"):
        for element in extension.elements("sensor"):
            yield extension.attributes.get("reference", robot.root), element
