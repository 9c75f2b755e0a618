"""The plugins and controllers of a description that drive its wheels, and their parameters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

from kbot.kinematics.controller_files import (
    DIFF_DRIVE,
    MECANUM_DRIVE,
    OMNI_DRIVE,
    STEERING,
    Parameter,
    Parameters,
    controller_files,
    controller_parameters,
)
from kbot.kinematics.drive.programs import (
    Program,
    program_of_controller,
    program_of_plugin,
    tag_parameter,
    tags_of,
    words_of,
)
from kbot.model import Joint, RobotModel
from kbot.model.extensions import gazebo_plugins, hardware_joints
from kbot.model.spawned import spawned_controllers
from kbot.text import DiagnosticCollector, Element, Origin

SEPARATION = (
    *("wheelSeparation", "wheel_separation", "tracks_separation"),
    *("traction_track_width", "rear_wheel_track"),
)
WHEELBASE = ("wheel_base", "wheelbase", "wheel_separation_h")
DIAMETER = ("wheelDiameter", "wheel_diameter")
RADII = (
    "wheel_radius",
    "kinematics.wheels_radius",
    "traction_wheels_radius",
    "traction_wheel_radius",
    "rear_wheels_radius",
    "rear_wheel_radius",
)
"""Names of the wheel radius. The second is that of ROS 2's mecanum_drive_controller, the others are those of
its controllers that steer."""
WHEELBASE_MULTIPLIER = "wheel_separation_h_multiplier"
"""A parameter of ROS 1's ackermann_steering_controller."""
SIDE_MULTIPLIERS = ("left_wheel_radius_multiplier", "right_wheel_radius_multiplier")
SPANS = (
    ("wheel_separation_x", "wheel_separation_y"),
    ("wheelbase", "wheel_separation"),
    ("wheel_base", "wheel_separation"),
)
"""Names of the distances between mecanum wheels along x and along y."""
LEVERS = ("kinematics.sum_of_robot_center_projection_on_X_Y_axis", "robot_radius")
"""Names of the lever of holonomic wheels: half the sum of both distances between mecanum wheels, or the
distance of an omni wheel from the middle."""

_LEFT_TAGS = ("leftJoint", "left_joint", "leftFrontJoint", "leftRearJoint")
_RIGHT_TAGS = ("rightJoint", "right_joint", "rightFrontJoint", "rightRearJoint")
_LEFT_KEYS, _RIGHT_KEYS = ("left_wheel_names", "left_wheel"), ("right_wheel_names", "right_wheel")
"""Parameters of diff_drive_controller: ROS 2's and ROS 1's."""
_TRACTION = (
    *("left_joint", "right_joint", "rear_left_joint", "rear_right_joint", "actuatedWheel"),
    *("leftRearJoint", "rightRearJoint", "leftFrontJoint", "rightFrontJoint"),
    *("traction_joints_names", "traction_joint_name", "rear_wheels_names", "rear_wheel_name", "rear_wheel"),
)
"""Tags and parameters with which the drive of a car or tricycle names driving joints."""
_STEERS = re.compile("steer|hinge|front_wheels?_names?", re.IGNORECASE)
"""Those with which it names steering joints."""

_CORNERS = tuple(
    re.compile(rf"{end}_{side}(_wheel)?(_command)?(_joint)?(_name)?")
    for end in ("front", "(rear|back)")
    for side in ("left", "right")
)
"""Tags and parameters that name the joints of mecanum wheels: front left, front right, rear left, rear right.
gz writes `front_left_joint`, ROS 1 `front_left_wheel_joint`, ROS 2 `front_left_wheel_command_joint_name`."""


class Holonomic(StrEnum):
    """How a plugin or controller moves a base whose wheels are not two sides.

    body     it moves the base itself, and the wheels only carry it
    mecanum  it turns four mecanum wheels
    omni     it turns omni wheels that are spaced equally on a circle
    tracks   it turns the belts of tracks, which drive forwards and turn, but not sideways
    roller   no plugin moves it, but its wheels have rollers that turn on joints of their own
    """

    BODY = "body"
    MECANUM = "mecanum"
    OMNI = "omni"
    TRACKS = "tracks"
    ROLLER = "roller"


_HOLONOMIC_PLUGINS = {
    "planarmove": Holonomic.BODY,
    "forcebasedmove": Holonomic.BODY,
    "velocitycontrol": Holonomic.BODY,
    "mecanumdrive": Holonomic.MECANUM,
    "trackedvehicle": Holonomic.TRACKS,
}
"""By a part of the file's name, without `_` and `-`: planar_move of Gazebo Classic, force_based_move of
hector and its copies, VelocityControl, MecanumDrive and TrackedVehicle of gz."""
_HOLONOMIC_CONTROLLERS = {
    MECANUM_DRIVE.rpartition("/")[2]: Holonomic.MECANUM,
    OMNI_DRIVE.rpartition("/")[2]: Holonomic.OMNI,
}


class Size(NamedTuple):
    """A size in m that a controller computes with, the tag or parameter that gives it, and the multipliers
    that it is multiplied by: their mean, if each side has its own."""

    value: float
    given: Parameter
    factors: tuple[Parameter, ...] = ()


@dataclass(frozen=True, slots=True)
class DeclaredDrive:
    """A plugin or controller that drives wheels.

    name         name of the plugin, or of the controller with its namespace
    origin       the plugin, or where the controller is listed or its parameters begin
    plugin       the plugin's element, None for a controller
    is_steering  True for the drive of a car or tricycle, which does not have two sides
    ros          1 or 2, the ROS that the controller is for
    left, right  the joints that it names, as written; a tag without text has an empty name. For tracks their
                 links
    given        its tags or parameters by name, those inside a tag as `tag.name`; the first of several tags
                 with one name
    is_running   True for a plugin, and for a controller that the controller manager lists and starts
    holonomic    how it moves a base whose wheels are not two sides, None for other drives
    wheels       the joints that a holonomic drive names: the four corners in the order of `_CORNERS`, or the
                 omni wheels counterclockwise
    traction     the joints that the drive of a car or tricycle names as driving
    steering     the joints that it names as steering
    """

    name: str
    origin: Origin
    plugin: Element | None
    is_steering: bool
    ros: int
    left: tuple[Parameter, ...]
    right: tuple[Parameter, ...]
    given: Mapping[str, Parameter]
    is_running: bool
    holonomic: Holonomic | None = None
    wheels: tuple[Parameter, ...] = ()
    traction: tuple[str, ...] = ()
    steering: tuple[str, ...] = ()

    def first(self, *names: str) -> Parameter | None:
        """The first given one of these tags or parameters."""
        return next((self.given[name] for name in names if name in self.given), None)

    @property
    def sides(self) -> Mapping[str, tuple[Parameter, ...]]:
        return {"left": self.left, "right": self.right}

    def place(self, side: str) -> Origin:
        """Where it names the joints of a side, or should name them."""
        keys = {"left": _LEFT_KEYS, "right": _RIGHT_KEYS}[side]
        given = self.first(*keys) if self.plugin is None else None
        return given.key if given is not None else self.origin

    @property
    def has_sides(self) -> bool:
        """Whether it drives left and right wheels, as a differential drive does."""
        return not self.is_steering and self.holonomic is None

    @property
    def ignores_sideways(self) -> bool:
        """Whether it moves the base but ignores linear.y, as copies of planar_move do for skid steering."""
        axis = self.given.get("enableYAxis")
        return axis is not None and axis.boolean is False

    @property
    def separation(self) -> Size | None:
        """The distance between left and right wheels with which it computes."""
        given = self.first(*SEPARATION)
        if given is None or given.number is None:
            return None
        return self._multiplied(given, given.number, "wheel_separation_multiplier")

    @property
    def span(self) -> Size | None:
        """The `separation` of a `HolonomicDrive` with mecanum or omni wheels with which it computes."""
        half = self.first(*LEVERS)
        if half is not None and half.number is not None:
            return Size(2.0 * half.number, half)
        sizes = self.spans
        return Size(sizes[0].value + sizes[1].value, sizes[0].given) if sizes is not None else None

    @property
    def spans(self) -> tuple[Size, Size] | None:
        """The distances between mecanum wheels along x and along y with which it computes."""
        for names in SPANS:
            along, across = (self.first(name) for name in names)
            if along is None or across is None or along.number is None or across.number is None:
                continue
            x, y = (self.span_multiplier(name) for name in names)
            return self._multiplied(along, along.number, x), self._multiplied(across, across.number, y)
        return None

    def span_multiplier(self, name: str) -> str:
        """The parameter that multiplies a distance between mecanum wheels: its own, or the common one."""
        own = f"{name}_multiplier"
        return own if own in self.given else "wheel_separation_multiplier"

    @property
    def wheelbase(self) -> Size | None:
        """The distance between the axles with which the drive of a car or tricycle computes."""
        given = self.first(*WHEELBASE) if self.is_steering else None
        if given is None or given.number is None:
            return None
        return self._multiplied(given, given.number, WHEELBASE_MULTIPLIER)

    @property
    def radius(self) -> Size | None:
        """The radius of the wheels with which it computes. A radius takes precedence over a diameter."""
        radius, diameter = self.first(*RADII), self.first(*DIAMETER)
        if radius is not None and radius.number:
            return self._multiplied(radius, radius.number, *self.radius_multipliers)
        if diameter is not None and diameter.number is not None:
            return Size(diameter.number / 2.0, diameter)
        return None

    @property
    def radius_multipliers(self) -> tuple[str, ...]:
        """The parameters that multiply the wheel radius: one, or those of the left and the right side.

        ROS 2's diff_drive_controller has only those of the sides (diff_drive_controller_parameter.yaml). That
        of ROS 1 ignores them if `wheel_radius_multiplier` is given (diff_drive_controller.cpp), and its
        controllers that steer have only that one."""
        if self.ros == 2 and self.has_sides:
            return SIDE_MULTIPLIERS
        is_common = "wheel_radius_multiplier" in self.given or not self.has_sides
        return ("wheel_radius_multiplier",) if is_common else SIDE_MULTIPLIERS

    def _multiplied(self, given: Parameter, number: float, *names: str) -> Size:
        """A size times the mean of the multipliers of these names. One that is not given is 1."""
        factors = [self.given.get(name) for name in names]
        numbers = [1.0 if f is None or f.number is None else f.number for f in factors]
        used = tuple(f for f in factors if f is not None and f.number is not None)
        return Size(number * sum(numbers) / len(numbers), given, used)

    @property
    def steering_efficiency(self) -> float:
        """The share of the difference between the speeds of its tracks that turns a tracked vehicle.

        The tracks slip for the rest. gz's TrackedVehicle turns them faster by this share."""
        given = self.first("steering_efficiency")
        return given.number if given is not None and given.number and given.number > 0.0 else 0.5

    @property
    def program(self) -> Program | None:
        """What KBot knows of its settings. None if it is not a plugin or controller that KBot knows."""
        if self.plugin is not None:
            return program_of_plugin(words_of(self.plugin), self.given)
        kind = self.given.get("type")
        return program_of_controller(DIFF_DRIVE if kind is None else kind.text, self.ros)

    @property
    def base_frame(self) -> Parameter | None:
        """The link whose motion its odometry reports."""
        if self.plugin is None:
            return self.given.get("base_frame_id")
        return self.first("robotBaseFrame", "robot_base_frame", "child_frame_id")

    @property
    def publishes_joints(self) -> Parameter | None:
        """The tag by which a plugin publishes the wheels' joint states."""
        states = self.given.get("publishWheelJointState") if self.plugin is not None else None
        return states if states is not None and states.boolean else None

    @property
    def publishes_tf(self) -> bool:
        """Whether a plugin publishes the wheels' transforms."""
        tag = self.first("publishWheelTF", "publish_wheel_tf") if self.plugin is not None else None
        return tag is not None and tag.boolean is True


def declared_drives(robot: RobotModel) -> tuple[DeclaredDrive, ...]:
    """Drive plugins in the order of the description, then controllers.

    If a launch spawns controllers, only those count. Otherwise a section of a parameter file that names
    wheels counts too, because a spawner can set its type. Errors of the files are not reported here."""
    plugins = [found for plugin in gazebo_plugins(robot) if (found := _of_plugin(plugin)) is not None]
    return (*plugins, *_of_parameters(robot))


def track_controllers(robot: RobotModel) -> dict[str, Mapping[str, Parameter]]:
    """The tags of each TrackController of gz, by the link whose belt it turns."""
    plugins = [plugin for plugin in gazebo_plugins(robot) if "trackcontroller" in words_of(plugin)]
    tags = [{element.tag: tag_parameter(element) for element in plugin.elements()} for plugin in plugins]
    return {given["link"].text: given for given in tags if "link" in given}


def drive_controller(controllers: Iterable[DeclaredDrive]) -> DeclaredDrive | None:
    """The one that drives the robot: a plugin before a controller, and two sides before a steering drive."""
    running = [c for c in controllers if c.is_running]
    plugins = [c for c in running if c.plugin is not None]
    sided = [c for c in plugins if not c.is_steering]
    return next(iter((*sided, *plugins, *running)), None)


def commanded_joints(robot: RobotModel, interface: str) -> list[Joint]:
    """The movable joints with this command interface, such as `velocity`, in a `<ros2_control>`."""
    names = [
        joint.attributes.get("name", "")
        for joint in hardware_joints(robot)
        if any(c.attributes.get("name") == interface for c in joint.elements("command_interface"))
    ]
    return movable(robot, names)


def movable(robot: RobotModel, names: Iterable[str]) -> list[Joint]:
    """The joints of these names that have a position, each once."""
    joints = (robot.joints.get(name) for name in dict.fromkeys(names))
    return [joint for joint in joints if joint is not None and joint.has_position]


def _of_plugin(plugin: Element) -> DeclaredDrive | None:
    words = words_of(plugin)
    tags = [tag_parameter(element) for element in plugin.elements()]
    holonomic = _holonomic_plugin(plugin)
    if holonomic is Holonomic.TRACKS:
        left, right = _tracks(plugin, "left_track"), _tracks(plugin, "right_track")
    else:
        left = tuple(tag for tag in tags if tag.name in _LEFT_TAGS)
        right = tuple(tag for tag in tags if tag.name in _RIGHT_TAGS)
    is_steering = holonomic is None and not _has_two_sides(plugin, words, has_joints=bool(left or right))
    if is_steering and not any(word in words for word in ("ackerman", "tricycle")):
        return None
    if is_steering or holonomic not in (None, Holonomic.TRACKS):
        left = right = ()
    return DeclaredDrive(
        plugin.attributes.get("name", "the drive plugin"),
        plugin.origin,
        plugin,
        is_steering,
        2,
        left,
        right,
        tags_of(plugin),
        is_running=True,
        holonomic=holonomic,
        wheels=_corners(tags) if holonomic is Holonomic.MECANUM else (),
        traction=tuple(tag.text for tag in tags if tag.name in _TRACTION) if is_steering else (),
        steering=tuple(tag.text for tag in tags if _STEERS.search(tag.name)) if is_steering else (),
    )


def _holonomic_plugin(plugin: Element) -> Holonomic | None:
    """How a plugin drives sideways, by its file or, in gz, by its class: its name can be anything."""
    file, name = plugin.attributes.get("filename", ""), plugin.attributes.get("name", "")
    words = (file + (name if "systems::" in name else "")).lower().replace("_", "").replace("-", "")
    return next((kind for word, kind in _HOLONOMIC_PLUGINS.items() if word in words), None)


def _tracks(plugin: Element, side: str) -> tuple[Parameter, ...]:
    """The links of the tracks on a side of gz's TrackedVehicle."""
    return tuple(tag_parameter(link) for track in plugin.elements(side) for link in track.elements("link"))


def _corners(given: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The tags or parameters that name the joints of mecanum wheels, as many as are given."""
    found = (next((p for p in given if corner.fullmatch(p.name)), None) for corner in _CORNERS)
    return tuple(parameter for parameter in found if parameter is not None)


def _has_two_sides(plugin: Element, words: str, *, has_joints: bool) -> bool:
    """Whether a plugin is a differential or skid-steer drive.

    Its name alone is not enough: another plugin, such as gazebo_ros_control, may be named
    `diff_drive_control`."""
    if not any(word in words for word in ("diffdrive", "skidsteer")):
        return False
    file = plugin.attributes.get("filename", "").lower().replace("_", "").replace("-", "")
    is_by_file = any(word in file for word in ("diffdrive", "skidsteer"))
    return is_by_file or has_joints or "systems::" in words


def _of_parameters(robot: RobotModel) -> Iterator[DeclaredDrive]:
    listed = []
    for found in controller_parameters(robot, DiagnosticCollector()):
        holonomic = _holonomic_controller(found.kind)
        if found.kind == DIFF_DRIVE:
            listed.append(found)
            yield _of_controller(found, is_running=found.is_active and not found.lacking())
        elif holonomic is not None:
            yield _of_holonomic_controller(found, holonomic)
        elif _steers(found.kind):
            listed.append(found)
            yield _of_steering_controller(found)
    if spawned_controllers(robot):
        return
    known = {name for found in listed for name in (found.controller, "*", "**")}
    for file in controller_files(robot):
        for node, given in file.nodes():
            origin = next((parameter.key for parameter in given.values()), file.named)
            unlisted = Parameters("", node, given, origin)
            controller = _of_controller(unlisted, is_running=False)
            if node not in known and (controller.left or controller.right):
                yield controller
            kind = given.get("type")  # a spawner reads the type there too
            if node not in known and kind is not None and _steers(kind.text):
                yield _of_steering_controller(replace(unlisted, kind=kind.text))


def _of_controller(found: Parameters, *, is_running: bool) -> DeclaredDrive:
    left, right = (
        next((found.given[key].names() for key in keys if key in found.given), ())
        for keys in (_LEFT_KEYS, _RIGHT_KEYS)
    )
    return DeclaredDrive(
        found.controller, found.place(), None, False, found.ros, left, right, found.given, is_running
    )


def _steers(kind: str) -> bool:
    """Whether a type of controller is that of a car or tricycle."""
    return kind.partition("/")[0] in STEERING


def _of_steering_controller(found: Parameters) -> DeclaredDrive:
    named = [(key, name.text) for key, given in found.given.items() for name in given.names()]
    return DeclaredDrive(
        found.controller,
        found.place(),
        None,
        True,
        found.ros,
        (),
        (),
        found.given,
        found.is_active,
        traction=tuple(name for key, name in named if key in _TRACTION),
        steering=tuple(name for key, name in named if _STEERS.search(key)),
    )


def _holonomic_controller(kind: str) -> Holonomic | None:
    """How a type of controller drives sideways. Copies in other packages have the same class names."""
    return _HOLONOMIC_CONTROLLERS.get(kind.rpartition("/")[2])


def _of_holonomic_controller(found: Parameters, kind: Holonomic) -> DeclaredDrive:
    names = found.given.get("wheel_names")
    wheels = (
        _corners(tuple(found.given.values()))
        if kind is Holonomic.MECANUM
        else names.names()
        if names is not None
        else ()
    )
    return DeclaredDrive(
        found.controller,
        found.place(),
        None,
        False,
        found.ros,
        (),
        (),
        found.given,
        found.is_active,
        kind,
        wheels,
    )
