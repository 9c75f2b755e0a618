"""Rules about sensors and their frames."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkShape
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.spatial import SpatialFrame, Vector, add, dot, norm, scale, subtract
from kbot.model import Box, Capsule, Cylinder, JointType, Sphere
from kbot.text import Element, Origin, Related, Severity
from kbot.text.suggest import did_you_mean


def distance_along(p: Vector, d: Vector, shape: object, half: Vector) -> float | None:
    """Distance along a ray to a primitive shape at the origin; None if the ray misses it or starts inside."""
    match shape:
        case Sphere(radius=r):
            return _ball(p, d, r)
        case Box():
            return _slab(p, d, half)
        case Cylinder(radius=r, length=length) | Capsule(radius=r, length=length):
            return _tube(p, d, r, length / 2.0)
    return None


def _ball(p: Vector, d: Vector, r: float) -> float | None:
    b, c = dot(p, d), dot(p, p) - r * r
    inner = b * b - c
    return -b - math.sqrt(inner) if c > 0.0 and inner > 0.0 and -b > 0.0 else None


def _slab(p: Vector, d: Vector, half: Vector) -> float | None:
    enter, leave = 0.0, math.inf
    for x, v, h in zip(p, d, half, strict=True):
        if abs(v) < 1e-12:
            if abs(x) >= h:
                return None
            continue
        a, b = sorted(((-h - x) / v, (h - x) / v))
        enter, leave = max(enter, a), min(leave, b)
    return enter if 0.0 < enter < leave else None


def _tube(p: Vector, d: Vector, r: float, half: float) -> float | None:
    a = d[0] * d[0] + d[1] * d[1]
    c = p[0] * p[0] + p[1] * p[1] - r * r
    if a < 1e-12:
        return None
    b = p[0] * d[0] + p[1] * d[1]
    inner = b * b - a * c
    if inner <= 0.0 or (c < 0.0 and abs(p[2]) < half):
        return None
    t = (-b - math.sqrt(inner)) / a
    return t if t > 0.0 and abs(p[2] + t * d[2]) < half else None


_BEAMS = 360
"""Beams that a lidar's angles are divided into: one per degree for a full circle."""


def own_body(
    context: Context, link: str, sensor: Element, angles: tuple[float, float], ranges: tuple[float, float]
) -> tuple[str, float, float, Origin] | None:
    """The link of the robot that most beams hit, with its nearest distance (m), share of beams and place.

    None if no beam hits the robot, or the sensor's `<pose>` is rotated or cannot be read.
    """
    frame = context.frames[link]
    pose = sensor.find("pose")
    if pose is not None:
        try:
            x, y, z, *rpy = (float(v) for v in pose.text.split())
        except ValueError:
            return None
        if any(rpy):
            return None
        frame = SpatialFrame(frame.rotation, frame.point((x, y, z)))
    cut = _in_plane(context, frame, set(rigid_links(context.robot, link)))
    # each beam's nearest hit: distance, link, place
    nearest_hits: dict[int, tuple[float, str, Origin]] = {}
    for name, part, shape in cut:
        start = shape.local(frame.translation)
        ahead = shape.local_direction(frame.direction((1.0, 0.0, 0.0)))
        left = shape.local_direction(frame.direction((0.0, 1.0, 0.0)))
        reach = norm(part.half)
        if norm(start) - reach > ranges[1]:
            continue
        for i in _beams_towards(frame.local(shape.translation), reach, angles):
            angle = angles[0] + (angles[1] - angles[0]) * i / _BEAMS
            direction = add(scale(ahead, math.cos(angle)), scale(left, math.sin(angle)))
            t = distance_along(start, direction, part.geometry, part.half)
            if t is not None and ranges[0] < t < ranges[1]:
                known = nearest_hits.get(i)
                if known is None or t < known[0]:
                    nearest_hits[i] = (t, name, part.origin)
    hits: dict[str, tuple[int, float, Origin]] = {}
    for i in sorted(nearest_hits):
        distance, name, place = nearest_hits[i]
        count, nearest, origin = hits.get(name, (0, math.inf, place))
        hits[name] = (count + 1, min(nearest, distance), origin)
    if not hits:
        return None
    name, (count, nearest, origin) = max(hits.items(), key=lambda item: item[1][0])
    return (name, nearest, count / _BEAMS, origin) if count else None


def _beams_towards(center: Vector, reach: float, angles: tuple[float, float]) -> Iterator[int]:
    """The beams that can hit a shape within `reach` of a point of the lidar's frame."""
    away, step = math.hypot(center[0], center[1]), (angles[1] - angles[0]) / _BEAMS
    if away <= reach or not 0.0 < step <= 2.0 * math.pi / _BEAMS * 1.01:
        yield from range(_BEAMS)
        return
    half, bearing = math.asin(reach / away), math.atan2(center[1], center[0])
    for turn in (-2.0 * math.pi, 0.0, 2.0 * math.pi):
        first = math.ceil((bearing + turn - half - angles[0]) / step)
        last = math.floor((bearing + turn + half - angles[0]) / step)
        yield from range(max(first, 0), min(last, _BEAMS - 1) + 1)


def _in_plane(
    context: Context, frame: SpatialFrame, own: set[str]
) -> list[tuple[str, LinkShape, SpatialFrame]]:
    """The shapes of other links that the lidar's plane cuts, and their poses in the root's frame."""
    up = frame.direction((0.0, 0.0, 1.0))
    cut = []
    for name, body in context.bodies.items():
        if name in own or name in context.unsure:
            continue
        link = context.frames[name]
        for part in body.collisions:
            height = dot(subtract(link.point(part.frame.translation), frame.translation), up)
            if abs(height) < part.support(link.local_direction(up)):
                cut.append((name, part, link.then(part.frame)))
    return cut


_CAMERAS = frozenset(
    {"camera", "depth", "depth_camera", "rgbd_camera", "rgbd", "multicamera", "wideanglecamera"}
)
_LIDARS = frozenset({"ray", "gpu_ray", "lidar", "gpu_lidar"})
_FRAME_TAGS = ("frameName", "frame_name", "frame_id", "gz_frame_id", "ignition_frame_id", "optical_frame_id")
_OUTSIDE = frozenset({"odom", "map", "world", "earth"})


def sensors(context: Context) -> Iterator[tuple[Element, str, Element]]:
    """Each `<sensor>` of a `<gazebo reference>`: the extension, the name of its link, the sensor."""
    for extension in context.robot.extensions:
        if extension.tag == "gazebo" and "reference" in extension.attributes:
            for sensor in extension.elements("sensor"):
                yield extension, extension.attributes["reference"], sensor


def _frames_of(sensor: Element) -> Iterator[Element]:
    for element in sensor.descendants():
        if element.tag in _FRAME_TAGS and element.text.strip():
            yield element


@rule("C101", "camera-no-optical-frame", Severity.WARNING, "robot")
def camera_no_optical_frame(context: Context) -> Found:
    """A camera publishes its images in a frame that is not an optical frame (REP 103).

    Why: Image pipelines expect z forward, x right and y down. In a body frame, with x forward and z up, point
    clouds and detections are turned on their side: what is in front of the camera appears above it.

    Example: A camera on `camera_link` without `camera_optical_link`.

    Fix: Add a frame that is turned by `rpy="${-pi/2} 0 ${-pi/2}"`, and name it in the sensor
    (`<gz_frame_id>`, `<optical_frame_id>` or `<frameName>`).

    Autofix: none.
    """
    for _, link, sensor in sensors(context):
        if (
            sensor.attributes.get("type") not in _CAMERAS
            or link not in context.robot.links
            or link in context.unsure
        ):
            continue
        names = [e.text.strip() for e in _frames_of(sensor)]
        if any("optical" in n for n in (*names, link)):
            continue
        if any(_is_optical(context, link, name) for name in (*rigid_links(context.robot, link), *names)):
            continue
        yield Finding(
            sensor.origin,
            f"{sensor.attributes.get('name', 'camera')}: image pipelines expect z forward, but '{link}' has "
            "x forward and no optical frame below it",
            'add a link on a fixed joint with <origin rpy="${-pi/2} 0 ${-pi/2}"/>, and name this link as the '
            "frame of the sensor",
            (Related(f"'{link}'", context.robot.links[link].origin),),
        )


def _is_optical(context: Context, link: str, name: str) -> bool:
    """Whether a frame's z axis points along the link's x axis."""
    if name not in context.frames:
        return False
    frame, own = context.frames[name], context.frames[link]
    forward = own.direction((1.0, 0.0, 0.0))
    return dot(frame.direction((0.0, 0.0, 1.0)), forward) > 0.99


@rule("C102", "lidar-sees-robot", Severity.WARNING, "robot")
def lidar_sees_robot(context: Context) -> Found:
    """The scanning plane of a lidar cuts the robot's own body.

    Why: The beams that hit the robot report an obstacle that moves with it. The costmap is blocked there, and
    mapping draws the obstacle everywhere.

    Example: A lidar at z = 0.1 behind a mast on the same plate.

    Fix: Raise the lidar, narrow its angles, or set the `<min>` of its range beyond the body.

    Autofix: none.
    """
    for _, link, sensor in sensors(context):
        if (
            sensor.attributes.get("type") not in _LIDARS
            or link not in context.frames
            or link in context.unsure
        ):
            continue
        scan = next((e for e in sensor.descendants() if e.tag in ("ray", "lidar")), None)
        if scan is None:
            continue
        low, high = (
            _value(scan, ("horizontal", "min_angle"), -math.pi),
            _value(scan, ("horizontal", "max_angle"), math.pi),
        )
        near, far = _value(scan, ("range", "min"), 0.0), _value(scan, ("range", "max"), 10.0)
        hit = own_body(context, link, sensor, (low, high), (near, far))
        if hit is not None:
            name, distance, share, origin = hit
            yield Finding(
                sensor.origin,
                f"{sensor.attributes.get('name', 'lidar')}: {share * 100.0:.2g} % of its beams hit "
                f"'{name}', the nearest at {distance * 1e3:.3g} mm",
                "raise it, narrow its angles, or set its minimum range beyond the body",
                (Related(f"the collision of '{name}'", origin),),
            )


def _value(element: Element, path: tuple[str, str], default: float) -> float:
    for found in element.descendants():
        if found.tag == path[0]:
            inner = found.find(path[1])
            try:
                return float(inner.text) if inner is not None else default
            except ValueError:
                return default
    return default


@rule("C103", "sensor-frame-unknown", Severity.WARNING, "robot")
def sensor_frame_unknown(context: Context) -> Found:
    """The frame of a sensor is not a link of the robot.

    Why: tf does not have the frame of the sensor's messages. rviz shows nothing, and navigation drops every
    message ("the message filter's queue is full").

    Example: `<frameName>lasr_link</frameName>`

    Fix: Name a link of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    links = context.robot.links
    for extension in context.robot.extensions:
        if extension.tag != "gazebo":
            continue
        for sensor in extension.elements("sensor"):
            for element in _frames_of(sensor):
                name = element.text.strip()
                if name.lstrip("/") in links or name in _OUTSIDE or "$" in name:
                    continue
                if name.rsplit("/", 1)[-1] in links:
                    continue
                yield Finding(
                    element.origin,
                    f"{sensor.attributes.get('name', 'sensor')}: "
                    f"its frame '{name}' is not a link of this robot",
                    did_you_mean(name, context.link_names),
                )


@rule("C104", "sensor-frame-lumped", Severity.INFO, "robot")
def sensor_frame_lumped(context: Context) -> Found:
    """A sensor is on a link that disappears in SDF, because its fixed joint is lumped.

    Why: Gazebo merges a link on a fixed joint into its parent. The sensor remains, but its frame does not. gz
    stamps its messages with a frame like `robot/base_link/lidar`, which does not exist in tf.

    Example: A gz lidar on `laser_frame` without `<gz_frame_id>`.

    Fix: Write `<gz_frame_id>laser_frame</gz_frame_id>` in the sensor, or `<gazebo reference="laser_joint">
    <preserveFixedJoint>true</preserveFixedJoint> </gazebo>`.

    Autofix: none.
    """
    robot = context.robot
    kept = {
        extension.attributes.get("reference", "")
        for extension in robot.extensions
        if extension.tag == "gazebo"
        and any(
            e.tag in ("preserveFixedJoint", "disableFixedJointLumping") and e.text.strip() in ("true", "1")
            for e in extension.elements()
        )
    }
    for _, link, sensor in sensors(context):
        joint = robot.parent_joint.get(link)
        if joint is None or joint.type is not JointType.FIXED or joint.name in kept or link in context.unsure:
            continue
        if any(True for _ in _frames_of(sensor)) or sensor.find("plugin") is not None:
            continue
        # gz does not simulate a plain ray, and in Gazebo Classic only a plugin publishes in ROS
        if (
            sensor.find("topic") is None
            and sensor.attributes.get("type") not in (_LIDARS - {"ray"}) | _CAMERAS
        ):
            continue
        yield Finding(
            sensor.origin,
            f"{sensor.attributes.get('name', 'sensor')}: '{link}' is merged into '{joint.parent}' in "
            "SDF, so its messages have a frame that is not in tf",
            f"add <gz_frame_id>{link}</gz_frame_id>",
            (Related(f"the fixed joint '{joint.name}'", joint.origin),),
        )


@rule("C105", "scan-angle-in-degrees", Severity.WARNING, "robot")
def scan_angle_in_degrees(context: Context) -> Found:
    """An angle of a lidar or camera is larger than one full turn, probably because it is in degrees.

    Why: SDF angles are in radians. -180..180 rad is 57 turns. The beams cover the same directions many times,
    and the points of a scan appear in wrong directions.

    Example: `<min_angle>-180</min_angle>`

    Fix: Write radians: `<min_angle>-3.14159</min_angle>`, `<horizontal_fov>1.047</horizontal_fov>`.

    Autofix: none.
    """
    for _, _, sensor in sensors(context):
        for element in sensor.descendants():
            if element.tag not in ("min_angle", "max_angle", "horizontal_fov"):
                continue
            try:
                angle = float(element.text)
            except ValueError:
                continue
            if abs(angle) > 2.0 * math.pi + 1e-3:
                yield Finding(
                    element.origin,
                    f"{sensor.attributes.get('name', 'sensor')}: {element.tag} {angle:g} rad is "
                    f"{abs(angle) / 2.0 / math.pi:.1f} turns: is it in degrees instead of radians?",
                    f"if it is in degrees, write {math.radians(angle):.5g}",
                )
