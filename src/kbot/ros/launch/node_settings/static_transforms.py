"""Reads the arguments of static_transform_publisher, in the forms of ROS 1 (tf, tf2_ros) and ROS 2."""

from __future__ import annotations

import math
from collections.abc import Mapping

from kbot.ros.launch.node_arguments import number, read_options
from kbot.ros.launch.plan import PlannedNode
from kbot.text import Diagnostic, Severity
from kbot.tf.static_transforms import StaticTransform

_NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw", "roll", "pitch", "yaw")
_FLAGS: Mapping[str, int] = {f"--{name}": 1 for name in (*_NAMES, "frame-id", "child-frame-id")}


def read_static_transform(node: PlannedNode) -> tuple[StaticTransform | None, list[Diagnostic]]:
    """The transform that the node would publish. None if its arguments are invalid.

    The order is x y z yaw pitch roll or x y z qx qy qz qw, then the two frames, and for tf a period.
    """
    options = read_options(node, {} if "--" not in node.args else _FLAGS)
    notes = options.notes
    rest = [word for word in options.rest if ":=" not in word]
    if options.given:
        values = {name: options.number(f"--{name}", float(name == "qw")) for name in _NAMES}
        frames = options.text("--frame-id"), options.text("--child-frame-id")
        turned = any(options.has(f"--{name}") for name in ("roll", "pitch", "yaw"))
    else:
        if node.package == "tf" and len(rest) in (9, 10):
            rest.pop()  # the period: KBot publishes a static transform once
        names = {8: ("x", "y", "z", "yaw", "pitch", "roll"), 9: _NAMES[:7]}.get(len(rest))
        if names is None:
            return None, [_wrong_form(node, len(rest))]
        words = zip(names, rest, strict=False)
        values = dict.fromkeys(_NAMES, 0.0) | {n: number(node, w, n, 0.0, notes) for n, w in words}
        frames = rest[-2], rest[-1]
        turned = len(rest) == 8
    parent, child = ((frame or "").lstrip("/") for frame in frames)
    if not parent or not child:
        return None, [*notes, _wrong_form(node, len(rest))]
    xyzw = _quaternion(values) if turned else tuple(values[name] for name in ("qx", "qy", "qz", "qw"))
    length = math.hypot(*xyzw)
    if length < 1e-9:  # zero, apart from rounding
        message = "the quaternion 0 0 0 0 is not a rotation"
        return None, [*notes, Diagnostic("L062", Severity.ERROR, message, node.spans["args"])]
    x, y, z, w = (value / length for value in xyzw)
    return StaticTransform(parent, child, (values["x"], values["y"], values["z"]), (x, y, z, w)), notes


def _quaternion(values: Mapping[str, float]) -> tuple[float, float, float, float]:
    """The quaternion of roll, pitch and yaw about fixed axes, as in tf's setRPY."""
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(values[name] / 2), math.cos(values[name] / 2)) for name in ("roll", "pitch", "yaw")
    )
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _wrong_form(node: PlannedNode, count: int) -> Diagnostic:
    period = " PERIOD_MS" if node.package == "tf" else ""
    hint = f"use x y z yaw pitch roll FRAME CHILD{period}, or qx qy qz qw in place of the angles"
    message = f"static_transform_publisher does not accept these {count} values"
    return Diagnostic("L062", Severity.ERROR, message, node.spans.get("args", node.origin), hint)
