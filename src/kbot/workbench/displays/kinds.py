"""The kinds of displays; `web/src/displays/kinds.ts` is generated from here.

Lengths that are 0 by themselves suit the robot's size.
"""

from __future__ import annotations

from kbot.workbench.displays.property import (
    DisplayKind,
    choice,
    colour,
    frame,
    number,
    opacity,
    switch,
    text,
)
from kbot.workbench.displays.topic_kinds import TOPIC_KINDS

GLOBALS = (
    frame("frame", "Fixed frame", "Fixed Frame"),
    colour("background", "Background", "", "Background Color"),
    number("light", "Light", 1.0, 0.0, 3.0),
    switch("floor", "Floor", True),
)
"""What holds for all displays."""

KINDS = (
    DisplayKind(
        "Grid",
        "Lines on the floor, or anywhere",
        (
            number("cell", "Cell size", 0.0, 0.0, 100.0, "m", "Cell Size", zero="auto"),
            number("count", "Cells", 0.0, 0.0, 1000.0, rviz="Plane Cell Count", zero="auto"),
            number("normal_count", "Cells upwards", 0.0, 0.0, 100.0, rviz="Normal Cell Count"),
            choice("plane", "Plane", ("XY", "XZ", "YZ"), "Plane"),
            frame("frame", "Frame", "Reference Frame"),
            number("x", "x", 0.0, -1e3, 1e3, "m", "Offset/X"),
            number("y", "y", 0.0, -1e3, 1e3, "m", "Offset/Y"),
            number("z", "z", 0.0, -1e3, 1e3, "m", "Offset/Z"),
            colour("colour", "Colour", "", "Color"),
            opacity(),
        ),
        rviz=("Grid",),
    ),
    DisplayKind(
        "RobotModel",
        "The robot's shapes and masses",
        (
            switch("visual", "Visual", True, "Visual Enabled"),
            switch("collision", "Collision", False, "Collision Enabled"),
            switch("inertia", "Inertia", False, "Mass Properties/Inertia"),
            choice("inertia_shape", "Inertia as", ("box", "ellipsoid")),
            switch("mass", "Centre of mass", False, "Mass Properties/Mass"),
            switch("joints", "Joints", False),
            opacity(),
        ),
        single=True,
        per_link=(
            switch("show", "Show", True, "Value"),
            opacity(),
        ),
        rviz=("RobotModel",),
    ),
    DisplayKind(
        "TF",
        "Frames: their axes and names",
        (
            switch("axes", "Axes", False, "Show Axes"),
            switch("names", "Names", False, "Show Names"),
            switch("arrows", "Arrows", False, "Show Arrows"),
            number("length", "Length", 0.0, 0.0, 100.0, "m", zero="auto"),
            text("filter", "Only", "Filter (whitelist)"),
            text("without", "Without", "Filter (blacklist)"),
        ),
        single=True,
        rviz=("TF",),
    ),
    DisplayKind("Trail", "The way the robot took", (colour("colour", "Colour", ""),), single=True),
    DisplayKind(
        "World",
        "What stands in the world",
        (switch("shapes", "Shapes", True), opacity(rviz="")),
        single=True,
    ),
    DisplayKind(
        "Axes",
        "The axes of one frame",
        (
            frame("frame", "Frame", "Reference Frame"),
            number("length", "Length", 0.0, 0.0, 100.0, "m", "Length", zero="auto"),
            number("radius", "Radius", 0.0, 0.0, 10.0, "m", "Radius", zero="auto"),
        ),
        rviz=("Axes",),
    ),
    *TOPIC_KINDS,
)
