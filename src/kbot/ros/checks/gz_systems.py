"""Systems that gz needs for a robot's sensors, and that its world does not load."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from kbot.model import Robot
from kbot.ros.launch.node_settings.gazebo import read_gazebo
from kbot.ros.launch.plan import Plan
from kbot.text import DescriptionError, Diagnostic, Element, Related, Severity, read_source
from kbot.text.installed import find_file
from kbot.text.xml import parse_document

_FILE = re.compile(r"(?:lib)?(?:gz-sim|ignition-gazebo)\d*-(.+)-system(?:\.so)?")
_RENDERED = (
    "camera", "depth_camera", "gpu_lidar", "gpu_ray", "lidar", "ray", "rgbd_camera", "segmentation_camera",
    "thermal_camera",
)  # fmt: skip
_SYSTEMS = {
    **dict.fromkeys(_RENDERED, ("sensors", "Sensors")),
    "imu": ("imu", "Imu"),
    "contact": ("contact", "Contact"),
    "force_torque": ("forcetorque", "ForceTorque"),
    "gps": ("navsat", "NavSat"),
    "navsat": ("navsat", "NavSat"),
    "logical_camera": ("logical-camera", "LogicalCamera"),
}
"""The file and the class of the system that each type of sensor is the work of."""


def missing_systems(plan: Plan, robots: Iterable[Robot]) -> Iterator[Diagnostic]:
    """Where a launch starts gz in a world that lists its plugins: which sensors of its robots are silent.

    A world without plugins has those of gz's own configuration, which is the user's.
    """
    is_gz = any(one.package in ("ros_gz_sim", "ros_ign_gazebo") for one in plan.included)
    if not is_gz and not any(node.type in ("gz", "ign") for node in plan.nodes):
        return
    path = find_file(read_gazebo(plan)[0].world)
    world = _world(path) if path is not None else None
    if world is None or not any(True for _ in world.elements("plugin")):
        return
    robots = list(robots)
    roots = [world, *(extension for robot in robots for extension in robot.extensions)]
    loaded = {match[1] for root in roots for plugin in _plugins(root) if (match := _FILE.fullmatch(plugin))}
    without: dict[tuple[str, str], list[Element]] = {}
    for robot in robots:
        for sensor in (s for e in robot.extensions for s in e.descendants() if s.tag == "sensor"):
            system = _SYSTEMS.get(sensor.attributes.get("type", ""))
            if system is not None and system[0] not in loaded:
                without.setdefault(system, []).append(sensor)
    for (file, name), lost in without.items():
        names = ", ".join(f"'{sensor.attributes.get('name', '')}'" for sensor in lost[:4])
        yield Diagnostic(
            "L065",
            Severity.INFO,
            f"the world has no plugin gz-sim-{file}-system: in gz nothing is heard of {names}",
            world.origin,
            f'add <plugin filename="gz-sim-{file}-system" name="gz::sim::systems::{name}"/>'
            + (" with a <render_engine>" if file == "sensors" else ""),
            (Related(f"the sensor {names.partition(',')[0]}", lost[0].origin),),
        )


def _world(path: str) -> Element | None:
    try:
        return parse_document(read_source(path)).root.find("world")
    except DescriptionError:
        return None  # said where it is loaded


def _plugins(root: Element) -> Iterator[str]:
    """The file names of the plugins in and beneath an element."""
    return (e.attributes.get("filename", "") for e in root.descendants() if e.tag == "plugin")
