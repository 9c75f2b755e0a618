"""The kinds of displays; `web/src/displays/kinds.ts` is generated from here."""

from __future__ import annotations

from kbot.workbench.displays.property import (
    OPACITY,
    TOPIC,
    DisplayKind,
    colour,
    number,
    switch,
    text,
)

KINDS = (
    DisplayKind(
        "Grid",
        "Lines on the floor",
        (
            number("cell", "Cell size", 0.0, 0.0, 100.0, "m", rviz="Cell Size"),
            colour("colour", "Colour", "", rviz="Color"),
        ),
        single=True,
        rviz="Grid",
    ),
    DisplayKind(
        "RobotModel",
        "The robot's shapes and masses",
        (
            switch("visual", "Visual", True, rviz="Visual Enabled"),
            switch("collision", "Collision", False, rviz="Collision Enabled"),
            switch("inertia", "Inertia", False, rviz="Mass Properties/Inertia"),
        ),
        single=True,
        rviz="RobotModel",
    ),
    DisplayKind(
        "TF",
        "Frames: their axes and names",
        (
            switch("axes", "Axes", False, rviz="Show Axes"),
            switch("names", "Names", False, rviz="Show Names"),
            text("filter", "Filter", rviz="Filter (whitelist)"),
        ),
        single=True,
        rviz="TF",
    ),
    DisplayKind("Trail", "The way the robot took", (), single=True),
    DisplayKind(
        "LaserScan",
        "What a lidar sees",
        (
            TOPIC,
            number("size", "Size", 4.0, 1.0, 50.0, "px", rviz="Size (Pixels)"),
            colour("colour", "Colour", "#ff4d6d", rviz="Color"),
            OPACITY,
        ),
        topic="sensor_msgs/msg/LaserScan",
        rviz="LaserScan",
    ),
)
