"""Finds out what a file is: a robot, a launch file, a package manifest or a world.

Its content decides, as in ROS: `ros2 launch` runs `show_launch.xml` and `demo_launch.py`, and xacro expands a
file of any name. The name decides only if the content does not, for example in a file with a syntax error.
"""

from __future__ import annotations

import codecs
import os
import re

from kbot.text.files import check_regular

ROBOT, LAUNCH, PACKAGE, WORLD = "robot", "launch", "package", "sdf"
"""The kinds of files. That of an XML file is the name of its root element."""

_BEFORE_ROOT = re.compile(
    r"\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE(?:[^<>\[]|\[.*?\]\s*(?=>))*>", re.DOTALL | re.IGNORECASE
)
_ROOT = re.compile(r"<([A-Za-z_][\w:.-]*)")
_PYTHON = re.compile(r"^(?:def +|from +[\w.]+ +import\b.*\b)?generate_launch_description\b", re.MULTILINE)
"""A launch file in Python defines this function, or imports it."""
_YAML = re.compile(r"(?:[ \t\r]*(?:[#%].*|---.*)?\n)*[\"']?launch[\"']?\s*:")
"""A launch file in YAML has one key at its top level."""
MAY_BE_ROBOT = (".xacro", ".urdf", ".xml")
MAY_BE_LAUNCH = (".launch", ".xml", ".yaml", ".yml", ".py")
"""Endings of files that may be a robot or a launch file. A search reads no others."""
_BY_ENDING = {
    ".xacro": ROBOT,
    ".urdf": ROBOT,
    ".launch": LAUNCH,
    **{f".launch.{ending}": LAUNCH for ending in ("xml", "yaml", "yml", "py")},
    ".sdf": WORLD,
    ".world": WORLD,
}
_HEAD = 1 << 16
"""Bytes or characters of a file that are enough to find its kind, also after a long licence."""


def file_kind(path: str, text: str) -> str:
    """The kind of a file with this text: one of the names above, another root element, or empty."""
    text = text[:_HEAD]
    if path.endswith(".py"):
        found = LAUNCH if _PYTHON.search(text) else ""
    elif path.endswith((".yaml", ".yml")):
        found = LAUNCH if _YAML.match(text) else ""
    else:
        found = root_tag(text)
    if found or os.path.basename(path) == "package.xml":
        return found or PACKAGE
    return next((kind for ending, kind in _BY_ENDING.items() if path.endswith(ending)), "")


def kind_of_file(path: str) -> str:
    """The kind of a file on disk. Only its beginning is read. That of its name if it cannot be read."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            data = file.read(_HEAD)
    except (OSError, ValueError):
        data = b""
    encoding = "utf-16" if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8"
    return file_kind(path, data.decode(encoding, "replace"))


def root_tag(text: str) -> str:
    """The name of the root element of an XML text, empty if the text does not begin like XML."""
    at = 1 if text.startswith("\ufeff") else 0
    while before := _BEFORE_ROOT.match(text, at):
        at = before.end()
    root = _ROOT.match(text, at)
    return root[1] if root else ""


_INSTEAD = {
    LAUNCH: ("a launch file", "run it with kbot launch FILE, or give the robot file that it loads"),
    PACKAGE: ("a package manifest", "give the robot file of the package"),
    WORLD: (
        "a world or model in SDF",
        "KBot reads robots from URDF and xacro files. For an SDF world, use kbot sim --world FILE",
    ),
}


def not_a_robot(kind: str, name: str) -> tuple[str, str]:
    """The message and the hint of the error U001. `name` is the root element of the file, or its path."""
    what, hint = _INSTEAD.get(kind, ("", "a robot starts with <robot name='…'>"))
    return f"{name} is not a robot" + (f": it is {what}" if what else ""), hint
