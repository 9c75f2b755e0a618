"""Finds and mounts the sensors that a description declares.

A description declares sensors by `<gazebo reference><sensor>` (Gazebo Classic and gz), by sensor interfaces
of ros2_control, and by plugins of Gazebo Classic. Codes: W140 not simulated (warning), W141 an invalid value
or an unknown link (error).
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
    """The sensors of a description, in its order, and the findings about them."""

    specs: tuple[Spec, ...]
    diagnostics: tuple[Diagnostic, ...]


def declared_sensors(robot: RobotModel, naming: Naming = ROOT_NAMING) -> Declared:
    """Read the sensors that a robot's description declares. Errors are in the result's `diagnostics`.

    `naming` has the robot's names in the simulation.
    """
    diagnostics: list[Diagnostic] = []
    specs: list[Spec] = []
    for link, element in _elements(robot):
        values = SensorValues(element, diagnostics)
        known = robot.joints if element.attributes.get("type") == "force_torque" else robot.links
        if link not in known:
            what = "joint" if known is robot.joints else "link"
            hint = did_you_mean(link, known)
            values.error(f"unknown {what} '{link}'{': ' + hint if hint else ''}", element)
            continue
        before = sum(d.is_error for d in diagnostics)
        spec = read_sensor(values, link, naming)
        if spec is not None and sum(d.is_error for d in diagnostics) == before:
            specs.append(spec)
    specs += ros2_control_sensors(robot, diagnostics)
    specs += model_plugins(robot, naming, diagnostics)
    valid = []
    for spec in specs:
        try:
            for topic in spec.topics:
                require_sensor_topic(naming.topic(topic))
            valid.append(spec)
        except KbotError as error:
            diagnostics.append(_left_out(spec, error))
    return Declared(tuple(valid), tuple(diagnostics))


def mount_declared(simulation: Simulation, strict: bool = True) -> Mounted:
    """Mount every sensor that the first robot's description declares.

    Returns the sensors by name, and the findings. A second call returns the same sensors. Cameras render only
    while they have a subscriber. Without `strict`, declarations with errors are skipped.

    Raises:
        DescriptionError: a declaration has errors. It carries all of them.
    """
    if _KEY in simulation.mounted:
        found: Mounted = simulation.mounted[_KEY]
        return found
    declared = declared_sensors(simulation.robot, simulation.robots.first.naming)
    if strict and any(d.is_error for d in declared.diagnostics):
        raise DescriptionError(declared.diagnostics)
    mounted: Sensors = {}
    diagnostics = list(declared.diagnostics)
    for spec in declared.specs:
        try:
            sensor = spec.mount(simulation)
            sensor.only_with_subscribers = isinstance(spec, Camera)
            mounted[spec.label] = sensor
        except KbotError as error:
            diagnostics.append(_left_out(spec, error))
    simulation.mounted[_KEY] = mounted, tuple(diagnostics)
    return mounted, tuple(diagnostics)


def mount_on_others(simulation: Simulation) -> None:
    """Mount the sensors that the descriptions of all robots except the first declare.

    Each is in its robot's namespace. Sensors that cannot be mounted are skipped.
    """
    done: dict[str, SimulatedRobot] = simulation.mounted.setdefault(_OTHERS, {})
    new = {n: r for n, r in list(simulation.robots.items())[1:] if done.get(n) is not r}
    done.update(new)
    for name, robot in new.items():
        for spec in declared_sensors(robot.robot, robot.naming).specs:
            with suppress(KbotError):
                sensor = replace(spec, robot=name).mount(simulation)
                sensor.only_with_subscribers = isinstance(spec, Camera)


def _left_out(spec: Spec, error: KbotError) -> Diagnostic:
    message = f"{spec.label}: this sensor is ignored: {str(error).removeprefix(f'{spec.label}: ')}"
    return Diagnostic("W140", Severity.WARNING, message, spec.origin)


def _elements(robot: RobotModel) -> Iterator[tuple[str, Element]]:
    """Each `<sensor>`, with the link that it is mounted on."""
    for extension in extensions(robot, "gazebo"):
        for element in extension.elements("sensor"):
            yield extension.attributes.get("reference", robot.root), element
