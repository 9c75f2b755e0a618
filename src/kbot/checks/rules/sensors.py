"""Rules about sensors and their frames."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.scan_plane import own_body
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.spatial import dot
from kbot.model import JointType
from kbot.text import Element, Related, Severity
from kbot.text.suggest import did_you_mean

_CAMERAS = frozenset(
    {"camera", "depth", "depth_camera", "rgbd_camera", "rgbd", "multicamera", "wideanglecamera"}
)
_LIDARS = frozenset({"ray", "gpu_ray", "lidar", "gpu_lidar"})
_FRAME_TAGS = ("frameName", "frame_name", "frame_id", "gz_frame_id", "ignition_frame_id", "optical_frame_id")
_OUTSIDE = frozenset({"odom", "map", "world", "earth"})


def sensors(context: Context) -> Iterator[tuple[Element, str, Element]]:
    """Each `<sensor>` of a `<gazebo reference>`: the extension, the link it is on, the sensor."""
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
    """A camera whose images are published in a frame that is not an optical one (REP 103).

    Why: image pipelines take z forward, x right, y down. In a body frame (x forward, z up) point clouds and
    detections come out lying on their side: what is in front appears above.

    Example: a camera on `camera_link` without `camera_optical_link`.

    Fix: add a frame turned by `rpy="${-pi/2} 0 ${-pi/2}"` and name it in the sensor
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
            f"{sensor.attributes.get('name', 'camera')}: '{link}' has no optical frame beneath it: "
            "images would be "
            "taken with x forward for z forward",
            'add a link joined by <origin rpy="${-pi/2} 0 ${-pi/2}"/> and name it as the sensor\'s frame',
            (Related(f"'{link}'", context.robot.links[link].origin),),
        )


def _is_optical(context: Context, link: str, name: str) -> bool:
    """Whether a frame's z looks along the link's x, and its x to the link's right."""
    if name not in context.frames:
        return False
    frame, own = context.frames[name], context.frames[link]
    forward = own.direction((1.0, 0.0, 0.0))
    return dot(frame.direction((0.0, 0.0, 1.0)), forward) > 0.99


@rule("C102", "lidar-sees-robot", Severity.WARNING, "robot")
def lidar_sees_robot(context: Context) -> Found:
    """A lidar whose scanning plane cuts the robot's own body.

    Why: the beams that hit it report an obstacle that comes along wherever the robot goes: the costmap blocks
    it, and mapping draws it all over.

    Example: a lidar at z = 0.1 behind a mast that stands on the same plate.

    Fix: raise it, narrow its angles, or set `<min>` of its range beyond the body.

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
                f"{sensor.attributes.get('name', 'lidar')}: {share * 100.0:.2g} % of its beams end on "
                f"'{name}', the "
                f"nearest {distance * 1e3:.3g} mm away",
                "raise it, narrow its angles, or set its least range beyond the body",
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
    """A sensor's frame that is no link of the robot.

    Why: its messages carry a frame that tf does not know: rviz shows nothing, navigation drops each message
    ("the message filter's queue is full").

    Example: `<frameName>lasr_link</frameName>`

    Fix: name a link of this robot.

    Autofix: safe, where the name is a slip of one known name: it is written.
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
                    f"{sensor.attributes.get('name', 'sensor')}: its frame '{name}' is no link of this robot",
                    did_you_mean(name, links),
                )


@rule("C104", "sensor-frame-lumped", Severity.INFO, "robot")
def sensor_frame_lumped(context: Context) -> Found:
    """A sensor on a link that is lost when the description is made into SDF, its fixed joint being lumped.

    Why: Gazebo merges a link on a fixed joint into its parent. The sensor lives on, its frame does not:
    gz stamps its messages with `robot/base_link/lidar`, which is no frame of tf.

    Example: a gz lidar on `laser_frame`, without `<gz_frame_id>`.

    Fix: `<gz_frame_id>laser_frame</gz_frame_id>` in the sensor, or
    `<gazebo reference="laser_joint"> <preserveFixedJoint>true</preserveFixedJoint> </gazebo>`.

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
        if sensor.find("topic") is None and sensor.attributes.get("type") not in _LIDARS | _CAMERAS:
            continue
        yield Finding(
            sensor.origin,
            f"{sensor.attributes.get('name', 'sensor')}: '{link}' is merged into '{joint.parent}' in "
            "SDF, and its "
            "messages carry a frame that tf does not know",
            f"add <gz_frame_id>{link}</gz_frame_id>",
            (Related(f"the fixed joint '{joint.name}'", joint.origin),),
        )


@rule("C105", "scan-angle-in-degrees", Severity.WARNING, "robot")
def scan_angle_in_degrees(context: Context) -> Found:
    """A lidar's or camera's angle beyond a full turn: degrees where radians are meant.

    Why: -180..180 rad is 57 turns: the beams are spread over the same directions again and again, and a point
    of the scan is shown anywhere but where it was hit.

    Example: `<min_angle>-180</min_angle>`

    Fix: write radians: `<min_angle>-3.14159</min_angle>`, `<horizontal_fov>1.047</horizontal_fov>`.

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
                    f"{abs(angle) / 2.0 / math.pi:.1f} turns: degrees where radians are meant?",
                    f"as degrees it is {math.radians(angle):.5g} rad",
                )
