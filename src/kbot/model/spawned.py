"""The controllers that a launch spawns for a robot, attached to its model.

They stand in the robot's extensions as `<controllers>`, so that a recorded description and a copy of it
have them too. A ROS passes over the element.
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
    """A parameter's value and where it was written."""

    value: Any
    origin: Origin


@dataclass(frozen=True, slots=True)
class SpawnedController:
    """A controller of a controller manager.

    name       with its namespace, as `/rrbot/joint1_position_controller`
    settings   its parameters by dotted name, `type` among them where the launch knows it
    is_active  whether it is started, and not only loaded
    ros        1 or 2: whose controllers they are
    origin     where the launch names it
    """

    name: str
    settings: Mapping[str, Setting]
    is_active: bool
    ros: int
    origin: Origin


def with_controllers(robot: RobotModel, controllers: Iterable[SpawnedController]) -> RobotModel:
    """The robot with these controllers spawned, in the place of any that it had; itself for none."""
    children = [_element(controller) for controller in controllers]
    if not children:
        return robot
    source = children[0].source
    holder = Element(_TAG, {}, source, children[0].start)
    holder.children.extend(children)
    others = tuple(element for element in robot.extensions if element.tag != _TAG)
    return dataclasses.replace(robot, extensions=(*others, holder))


def spawned_controllers(robot: RobotModel) -> tuple[SpawnedController, ...]:
    """Those that `with_controllers` gave it, or that its description was written down with."""
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
    """An element whose attribute `written` comes from a place in a launch file or its YAML."""
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


def _value(text: str) -> Any:  # noqa: ANN401 - whatever YAML can hold
    try:
        return parse_json(text)
    except ValueError:
        return text
