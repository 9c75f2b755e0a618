"""The plugins and controllers that drive a robot's wheels, and what each was told of its geometry.

Gazebo Classic (`libgazebo_ros_diff_drive.so`, `…_skid_steer_drive.so`), gz (`DiffDrive`), and
ros2_control's `diff_drive_controller` in the YAML that the description's own plugin names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kbot.kinematics.controllers import LEFT_TAGS, RIGHT_TAGS
from kbot.model import Robot
from kbot.text import Element, KbotError, Origin, Source, Span, read_source
from kbot.text.yaml import check_nesting

if TYPE_CHECKING:
    from kbot.xacro import Packages


@dataclass(frozen=True, slots=True)
class Word:
    """A text that a driver was given, and where. `key` is the tag or YAML key whose value it is."""

    text: str
    origin: Origin
    key: str = ""

    @property
    def number(self) -> float | None:
        try:
            return float(self.text)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class Driver:
    """One plugin or controller: which joints are its left and right, and the sizes it reckons with.

    `separation` and `radius` in m, with multipliers and diameters already worked in; None where they
    are not given. `base_frame` is a link; `publishes` the joints whose state it publishes.
    """

    name: str
    kind: str
    origin: Origin
    sides: Mapping[str, tuple[Word, ...]]
    separation: float | None
    separation_word: Word | None
    radius: float | None
    radius_word: Word | None
    base_frame: Word | None
    publishes_joints: Word | None
    publishes_tf: bool


def find_drivers(robot: Robot, packages: Packages) -> Iterator[Driver]:
    for extension in robot.extensions:
        if extension.tag != "gazebo":
            continue
        for plugin in extension.elements("plugin"):
            yield from _from_plugin(plugin, packages)


def drive_kind(plugin: Element) -> str:
    """ "classic", "gz" or "skid" for a plugin that drives wheels, else an empty text."""
    file = plugin.attributes.get("filename", "").lower()
    name = plugin.attributes.get("name", "").lower()
    if "skid_steer" in file:
        return "skid"
    if "gazebo_ros_diff_drive" in file:
        return "classic"
    if "diff-drive-system" in file or "diffdrive" in name.replace("_", ""):
        return "gz" if "systems::diffdrive" in name or "diff-drive-system" in file else ""
    return ""


def _from_plugin(plugin: Element, packages: Packages) -> Iterator[Driver]:
    kind = drive_kind(plugin)
    if kind:
        yield _plugin_driver(plugin, kind)
    for parameters in plugin.elements("parameters"):
        path = parameters.text.strip()
        if path.endswith((".yaml", ".yml")):
            yield from _from_yaml(_resolved(path, packages))


def _resolved(path: str, packages: Packages) -> str:
    if "://" in path:
        return packages.resolve(path) or path
    return path


def _plugin_driver(plugin: Element, kind: str) -> Driver:
    words: dict[str, Word] = {}
    sides: dict[str, list[Word]] = {"left": [], "right": []}
    for element in plugin.elements():
        word = Word(element.text.strip(), element.origin, element.tag)
        words.setdefault(element.tag, word)
        if element.tag in LEFT_TAGS:
            sides["left"].append(word)
        elif element.tag in RIGHT_TAGS:
            sides["right"].append(word)
    separation = next((words[t] for t in ("wheelSeparation", "wheel_separation") if t in words), None)
    diameter = next((words[t] for t in ("wheelDiameter", "wheel_diameter") if t in words), None)
    radius = diameter or words.get("wheel_radius")
    size = radius.number if radius else None
    base = next(
        (words[t] for t in ("robotBaseFrame", "robot_base_frame", "child_frame_id") if t in words), None
    )
    states = next(
        (w for t in ("publishWheelJointState",) if (w := words.get(t)) and w.text in ("true", "1")), None
    )
    wheel_tf = next((w for t in ("publishWheelTF", "publish_wheel_tf") if (w := words.get(t))), None)
    return Driver(
        name=plugin.attributes.get("name", kind),
        kind=kind,
        origin=plugin.origin,
        sides={side: tuple(found) for side, found in sides.items()},
        separation=separation.number if separation else None,
        separation_word=separation,
        radius=size / 2.0 if size is not None and diameter else size,
        radius_word=radius,
        base_frame=base,
        publishes_joints=states,
        publishes_tf=wheel_tf is not None and wheel_tf.text in ("true", "1"),
    )


def _from_yaml(path: str) -> Iterator[Driver]:
    try:
        source = read_source(path)
    except KbotError:
        return
    tree = compose(source)
    for key, node in mapping(tree):
        parameters = _parameters(node)
        sides = {
            "left": _names(source, parameters, "left_wheel_names", "left_wheel"),
            "right": _names(source, parameters, "right_wheel_names", "right_wheel"),
        }
        if not any(sides.values()):
            continue
        separation = _scalar(source, parameters, "wheel_separation")
        radius = _scalar(source, parameters, "wheel_radius")
        yield Driver(
            name=str(key.value),
            kind="ros2_control",
            origin=_word(source, key).origin,
            sides=sides,
            separation=_times(separation, _scalar(source, parameters, "wheel_separation_multiplier")),
            separation_word=separation,
            radius=_times(radius, _scalar(source, parameters, "left_wheel_radius_multiplier")),
            radius_word=radius,
            base_frame=_scalar(source, parameters, "base_frame_id"),
            publishes_joints=None,
            publishes_tf=False,
        )


def compose(source: Source) -> Any:  # noqa: ANN401 - a node of PyYAML, which has no common type
    """The YAML node tree of a source; None if it is not YAML or nested too deeply."""
    import yaml  # only for a file of controllers: start-up time

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        check_nesting(source.text)
        return yaml.compose(source.text, Loader=loader)
    except yaml.YAMLError:
        return None


def mapping(node: object) -> list[tuple[Any, Any]]:
    """Key and value nodes of a YAML mapping; nothing for another node."""
    return getattr(node, "value", []) if type(node).__name__ == "MappingNode" else []


def _parameters(node: object) -> dict[str, Any]:
    found = {str(key.value): value for key, value in mapping(node)}
    inner = found.get("ros__parameters")
    return {str(key.value): value for key, value in mapping(inner)} if inner is not None else found


def _names(source: Source, parameters: Mapping[str, Any], *keys: str) -> tuple[Word, ...]:
    for key in keys:
        if key in parameters:
            node = parameters[key]
            items = node.value if type(node).__name__ == "SequenceNode" else [node]
            return tuple(_word(source, item, key) for item in items)
    return ()


def _scalar(source: Source, parameters: Mapping[str, Any], key: str) -> Word | None:
    return _word(source, parameters[key], key) if key in parameters else None


def _word(source: Source, node: Any, key: str = "") -> Word:  # noqa: ANN401 - a node of PyYAML
    start = source.offset(node.start_mark.line + 1, node.start_mark.column + 1)
    end = source.offset(node.end_mark.line + 1, node.end_mark.column + 1)
    return Word(str(node.value), Origin(Span(source, start, end)), key)


def _times(word: Word | None, factor: Word | None) -> float | None:
    if word is None or word.number is None:
        return None
    return word.number * (factor.number if factor and factor.number is not None else 1.0)
