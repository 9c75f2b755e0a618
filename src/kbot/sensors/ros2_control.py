"""Reads the sensors of `<ros2_control>` by their state interfaces, as ROS 2's semantic components do."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.sensors.force_torque import ForceTorque
from kbot.sensors.imu import Imu
from kbot.sensors.position import Gps, GroundTruth
from kbot.sensors.proximity import Range
from kbot.sensors.readers import Keywords
from kbot.sensors.sdf_values import SensorValues
from kbot.sensors.sensor import Spec
from kbot.text import Diagnostic, Element, KbotError
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean


def ros2_control_sensors(robot: RobotModel, diagnostics: list[Diagnostic]) -> Iterator[Spec]:
    """The sensors that a description declares. Errors are added to `diagnostics`."""
    for extension in extensions(robot, "ros2_control"):
        for element in extension.elements("sensor"):
            spec = _read(robot, element, SensorValues(element, diagnostics))
            if spec is not None:
                yield spec


def _read(robot: RobotModel, element: Element, values: SensorValues) -> Spec | None:
    """Read a sensor. Its link is the parameter `frame_id`, by default the root. Its rate is `update_rate`."""
    interfaces = {e.attributes.get("name", "") for e in element.elements("state_interface")}
    params = {e.attributes.get("name", ""): e for e in element.elements("param")}
    link = params["frame_id"].text.strip() if "frame_id" in params else robot.root
    if link not in robot.links:
        hint = did_you_mean(link, robot.links)
        values.warn(
            f"this sensor is ignored: unknown link '{link}'{': ' + hint if hint else ''}", params["frame_id"]
        )
        return None
    common: Keywords = {
        "link": link,
        "name": element.attributes.get("name", ""),
        "origin": element.origin,
    }
    try:
        if "update_rate" in params:
            common["rate"] = _number(params["update_rate"])
        return _by_interfaces(robot, interfaces, common, params, values)
    except KbotError as error:
        values.error(str(error).removeprefix(f"{common['name']}: "), element)
        return None


def _by_interfaces(
    robot: RobotModel,
    interfaces: set[str],
    common: Keywords,
    params: dict[str, Element],
    values: SensorValues,
) -> Spec | None:
    stems = {name.partition(".")[0] for name in interfaces}
    if stems & {"angular_velocity", "linear_acceleration"}:
        return Imu(**common)
    if stems & {"force", "torque"}:
        link = common.pop("link")
        joint = next((j.name for j in robot.joints.values() if j.child == link), None)
        if joint is None:
            values.warn(
                f"this sensor is ignored: link '{link}' has no parent joint to measure force and torque in."
                " Name another link in <param name='frame_id'>",
                values.element,
            )
            return None
        return ForceTorque(joint=joint, **common)
    if interfaces & {"latitude", "longitude"}:
        return Gps(**common)
    if "range" in interfaces:
        bounds: Keywords = {
            name: _number(params[other])
            for name, other in (
                ("range_min", "min_range"), ("range_max", "max_range"), ("field_of_view", "field_of_view")
            )
            if other in params
        }  # fmt: skip
        return Range(**bounds, **common)
    if "position" in stems:
        return GroundTruth(**common)
    names = ", ".join(sorted(interfaces)) or "none"
    values.warn(f"a sensor with these state interfaces is not simulated: {names}", values.element)
    return None


def _number(element: Element) -> float:
    """Read a parameter. Raises KbotError if it is not a number."""
    try:
        return to_float(element.text)
    except ValueError:
        name = element.attributes.get("name", "")
        raise KbotError(f"{name} must be a number, not '{element.text.strip()}'") from None
