"""The registry of bridges. A new bridge needs a folder and a line here."""

from __future__ import annotations

from kbot.ros.bridges import foxglove, ros1, ros2, rosbridge, zenoh

BRIDGES = (ros1.KIND, ros2.KIND, zenoh.KIND, foxglove.KIND, rosbridge.KIND)
"""In the order in which `--help` lists them and KBot opens them."""


def bridges_with_peers() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of the bridges that `--bridges auto` opens, and why it does not open each other one."""
    reasons = {kind.name: kind.why_no_peer() for kind in BRIDGES}
    found = tuple(name for name, reason in reasons.items() if not reason)
    return found, tuple(f"{name}: {reason}" for name, reason in reasons.items() if reason)
