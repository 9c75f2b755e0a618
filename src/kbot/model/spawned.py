"""Stores the controllers that a launch spawns in the robot's model.

They are a `<controllers>` element in the robot's extensions, so that recorded descriptions and copies contain
them too. ROS ignores the element.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from kbot.model.robot import RobotModel
from kbot.text import Element, Origin
from kbot.text.json_text import parse_json

_TAG = "controllers"


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter's value and its origin."""

    value: Any
    origin: Origin


@dataclass(frozen=True, slots=True)
class SpawnedController:
    """A controller of a controller manager.

    name       with its namespace, for example `/rrbot/joint1_position_controller`
    settings   its parameters by dotted name, including `type` if the launch has it
    is_active  whether it is started, not only loaded
    ros        the ROS version, 1 or 2
    origin     the place in the launch that names it
    """

    name: str
    settings: Mapping[str, Setting]
    is_active: bool
    ros: int
    origin: Origin


def with_controllers(robot: RobotModel, controllers: Iterable[SpawnedController]) -> RobotModel:
    """The robot with these controllers instead of its previous ones. Without any, the robot itself."""
    children = [_element(controller) for controller in controllers]
    if not children:
        return robot
    source = children[0].source
    holder = Element(_TAG, {}, source, children[0].start)
    holder.children.extend(children)
    others = tuple(element for element in robot.extensions if element.tag != _TAG)
    return dataclasses.replace(robot, extensions=(*others, holder))


def spawned_controllers(robot: RobotModel) -> tuple[SpawnedController, ...]:
    """The controllers in the robot's model or description."""
    return tuple(
        _controller(element)
        for holder in robot.extensions
        if holder.tag == _TAG
        for element in holder.elements("controller")
    )


def _element(controller: SpawnedController) -> Element:
    state = "active" if controller.is_active else "loaded"
    attributes = {"name": controller.name, "state": state, "ros": str(controller.ros)}
    element = _at(controller.origin, "controller", attributes, "name")
    for name, setting in controller.settings.items():
        value = json.dumps(setting.value, default=str)
        element.children.append(_at(setting.origin, "param", {"name": name, "value": value}, "value"))
    return element


def _at(origin: Origin, tag: str, attributes: dict[str, str], written: str) -> Element:
    """An element whose attribute `written` has its origin in a launch file or its YAML."""
    element = Element(tag, attributes, origin.span.source, origin.span.start, call=origin.call)
    element.moved = {written: origin}
    return element


def _controller(element: Element) -> SpawnedController:
    given = element.attributes
    settings = {
        param.attributes.get("name", ""): Setting(
            _value(param.attributes.get("value", "")), param.attribute_origin("value")
        )
        for param in element.elements("param")
    }
    is_active = given.get("state", "active") == "active"
    ros = 1 if given.get("ros") == "1" else 2
    return SpawnedController(
        given.get("name", ""), settings, is_active, ros, element.attribute_origin("name")
    )


def _value(text: str) -> Any:  # noqa: ANN401 - any YAML value
    try:
        return parse_json(text)
    except ValueError:
        return text
