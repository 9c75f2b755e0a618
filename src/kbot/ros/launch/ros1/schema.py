"""The tags of a ROS 1 launch file, their attributes, and the tags allowed in each."""

from __future__ import annotations

from collections.abc import Mapping

_NODE = (
    "pkg",
    "type",
    "name",
    "args",
    "machine",
    "output",
    "respawn",
    "respawn_delay",
    "required",
    "ns",
    "clear_params",
    "cwd",
    "launch-prefix",
)

ATTRIBUTES: Mapping[str, tuple[str, ...]] = {
    "launch": ("deprecated",),
    "arg": ("name", "value", "default", "doc"),
    "param": ("name", "value", "type", "textfile", "binfile", "command"),
    "rosparam": ("command", "ns", "file", "param", "subst_value"),
    "node": _NODE,
    "test": (*_NODE, "test-name", "time-limit", "retry"),
    "include": ("file", "ns", "clear_params", "pass_all_args"),
    "group": ("ns", "clear_params"),
    "remap": ("from", "to"),
    "env": ("name", "value"),
    "machine": ("name", "address", "env-loader", "ssh-port", "user", "password", "default", "timeout"),
    "master": ("auto", "start", "uri"),
}
"""The attributes of each tag, without `if` and `unless`, which every tag can have."""

REQUIRED: Mapping[str, tuple[str, ...]] = {
    "arg": ("name",),
    "param": ("name",),
    "node": ("pkg", "type", "name"),
    "test": ("pkg", "type", "test-name"),
    "include": ("file",),
    "remap": ("from", "to"),
    "env": ("name", "value"),
    "machine": ("name", "address"),
}

_TOP = tuple(tag for tag in ATTRIBUTES if tag != "launch")

CHILDREN: Mapping[str, tuple[str, ...]] = {
    "launch": _TOP,
    "group": _TOP,
    "node": ("remap", "param", "rosparam", "env"),
    "test": ("remap", "param", "rosparam", "env"),
    "include": ("arg", "env"),
}
