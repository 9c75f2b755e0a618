"""The kinds of displays. `web/src/displays/kinds.ts` is generated from this table.

A length whose `zero` is "auto" is 0 by default, which means that it fits the robot's size.
"""

from __future__ import annotations

from dataclasses import replace

from kbot.workbench.displays.property import (
    TOPIC,
    DisplayKind,
    choice,
    colour,
    frame,
    number,
    opacity,
    switch,
    text,
)

_COVARIANCE = (
    switch("covariance", "Covariance", False, "Covariance/Value"),
    number("covariance_alpha", "Covariance opacity", 0.3, 0.0, 1.0, rviz="Covariance/Position/Alpha"),
)
_SHAPE = (
    choice("shape", "Shape", ("arrow", "axes"), "Shape"),
    number("length", "Length", 0.0, 0.0, 100.0, "m", "Shaft Length", zero="auto"),
)
_POINTS = (
    choice("style", "Style", ("points", "squares", "spheres", "boxes"), "Style"),
    number("size", "Point size", 4.0, 1.0, 50.0, "px", "Size (Pixels)"),
    number("metres", "Shape size", 0.01, 0.0001, 100.0, "m", "Size (m)"),
    number("decay", "Decay time", 0.0, 0.0, 600.0, "s", "Decay Time"),
    colour("colour", "Colour", "#ff4d6d", "Color"),
)
_RANGE = (
    switch("auto", "Automatic range", True),
    number("low", "Minimum", 0.0, -1e6, 1e6),
    number("high", "Maximum", 10.0, -1e6, 1e6),
)
"""The values between which colours are interpolated."""
_NAMESPACES = (switch("show", "Show", True, "Namespaces"),)

TOPIC_KINDS = (
    DisplayKind(
        "LaserScan",
        "The points of a laser scan",
        (
            TOPIC,
            *_POINTS,
            choice("by", "Colour by", ("colour", "intensity", "distance", "x", "y", "z")),
            *_RANGE,
            opacity(),
            switch("beams", "Beams", False),
        ),
        topics=("sensor_msgs/msg/LaserScan",),
        rviz=("LaserScan",),
    ),
    DisplayKind(
        "PointCloud2",
        "The points of a point cloud",
        (
            TOPIC,
            *_POINTS,
            choice("by", "Colour by", ("z", "x", "y", "distance", "intensity", "rgb", "colour")),
            text("channel", "Intensity field", "Channel Name"),
            *_RANGE,
            opacity(),
        ),
        topics=("sensor_msgs/msg/PointCloud2",),
        rviz=("PointCloud2",),
    ),
    DisplayKind(
        "Path",
        "A planned or driven path",
        (
            TOPIC,
            colour("colour", "Colour", "#19ff00", "Color"),
            choice("style", "Line style", ("lines", "billboards"), "Line Style"),
            number("width", "Line width", 3.0, 1.0, 50.0, "px"),
            number("metres", "Billboard width", 0.03, 0.0001, 100.0, "m", "Line Width"),
            choice("poses", "Poses", ("none", "arrows", "axes"), "Pose Style"),
            opacity(),
        ),
        topics=("nav_msgs/msg/Path",),
        rviz=("Path",),
    ),
    DisplayKind(
        "Odometry",
        "The pose estimated from the wheels",
        (
            TOPIC,
            _SHAPE[0],
            replace(_SHAPE[1], rviz="Shape/Shaft Length"),
            colour("colour", "Colour", "#ff8a3d", "Shape/Color"),
            number("keep", "Keep", 100.0, 0.0, 10_000.0, rviz="Keep", zero="all"),
            number("distance", "Position tolerance", 0.05, 0.0, 100.0, "m", "Position Tolerance"),
            number("angle", "Angle tolerance", 0.1, 0.0, 3.2, "rad", "Angle Tolerance"),
            *_COVARIANCE,
            opacity(rviz="Shape/Alpha"),
        ),
        topics=("nav_msgs/msg/Odometry",),
        rviz=("Odometry",),
    ),
    DisplayKind(
        "Pose",
        "One pose, for example a goal",
        (TOPIC, *_SHAPE, colour("colour", "Colour", "#ff1900", "Color"), opacity()),
        topics=("geometry_msgs/msg/PoseStamped",),
        rviz=("Pose",),
    ),
    DisplayKind(
        "PoseWithCovariance",
        "One pose and its covariance",
        (
            TOPIC,
            *_SHAPE,
            colour("colour", "Colour", "#b583ff", "Color"),
            switch("covariance", "Covariance", True, "Covariance/Value"),
            _COVARIANCE[1],
            opacity(),
        ),
        topics=("geometry_msgs/msg/PoseWithCovarianceStamped",),
        rviz=("PoseWithCovariance",),
    ),
    DisplayKind(
        "PoseArray",
        "Many poses, for example of a particle filter",
        (
            TOPIC,
            _SHAPE[0],
            replace(_SHAPE[1], rviz="Arrow Length"),
            colour("colour", "Colour", "#ff1900", "Color"),
            opacity(),
        ),
        topics=("geometry_msgs/msg/PoseArray",),
        rviz=("PoseArray",),
    ),
    DisplayKind(
        "Twist",
        "A velocity: a straight arrow for its linear part, a curved one for its angular part",
        (
            TOPIC,
            number("linear_scale", "m per m/s", 0.5, 0.01, 100.0, rviz="Linear Arrow Scale"),
            number("angular_scale", "m per rad/s", 0.1, 0.01, 100.0, rviz="Angular Arrow Scale"),
            colour("linear", "Linear", "#46a758", "Linear Color"),
            colour("angular", "Angular", "#cccc33", "Angular Color"),
            opacity(),
        ),
        topics=("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"),
        rviz=("TwistStamped",),
    ),
    DisplayKind(
        "Wrench",
        "A force, and a torque about its axis",
        (
            TOPIC,
            number("linear_scale", "m per N", 0.05, 0.0001, 100.0, rviz="Force Arrow Scale"),
            number("angular_scale", "m per Nm", 0.1, 0.0001, 100.0, rviz="Torque Arrow Scale"),
            colour("linear", "Force", "#cc3333", "Force Color"),
            colour("angular", "Torque", "#cccc33", "Torque Color"),
            opacity(),
        ),
        topics=("geometry_msgs/msg/WrenchStamped",),
        rviz=("Wrench", "WrenchStamped"),
    ),
    DisplayKind(
        "Polygon",
        "A closed line, for example a robot's footprint",
        (
            TOPIC,
            colour("colour", "Colour", "#19ff00", "Color"),
            number("width", "Line width", 3.0, 1.0, 50.0, "px"),
            opacity(),
        ),
        topics=("geometry_msgs/msg/PolygonStamped",),
        rviz=("Polygon",),
    ),
    DisplayKind(
        "Map",
        "Free, occupied and unknown space",
        (
            TOPIC,
            choice("scheme", "Colours", ("map", "costmap", "raw"), "Color Scheme"),
            switch("behind", "Draw behind", False, "Draw Behind"),
            opacity(0.7),
        ),
        topics=("nav_msgs/msg/OccupancyGrid",),
        rviz=("Map",),
    ),
    DisplayKind(
        "Marker",
        "A shape that a program publishes",
        (TOPIC,),
        topics=("visualization_msgs/msg/Marker",),
        per_namespace=_NAMESPACES,
        rviz=("Marker",),
    ),
    DisplayKind(
        "MarkerArray",
        "Shapes that a program publishes",
        (TOPIC,),
        topics=("visualization_msgs/msg/MarkerArray",),
        per_namespace=_NAMESPACES,
        rviz=("MarkerArray",),
    ),
    DisplayKind(
        "Contacts",
        "The robot's contacts and their forces",
        (
            replace(TOPIC, initial="/contacts"),
            number("scale", "m per robot weight", 0.0, 0.0, 100.0, zero="auto"),
            colour("colour", "Colour", "#ffd60a"),
        ),
        topics=("visualization_msgs/msg/MarkerArray",),
    ),
    DisplayKind(
        "Image",
        "A camera's image",
        (
            TOPIC,
            switch("normalize", "Normalize range", True, "Normalize Range"),
            number("near", "Minimum", 0.0, 0.0, 1e3, "m", "Min Value"),
            number("far", "Maximum", 5.0, 0.0, 1e3, "m", "Max Value"),
        ),
        topics=("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"),
        rviz=("Image",),
    ),
    DisplayKind(
        "Camera",
        "The scene as a camera sees it, over its image",
        (
            TOPIC,
            choice(
                "rendering",
                "Image rendering",
                ("background and overlay", "background", "overlay"),
                "Image Rendering",
            ),
            number("alpha", "Overlay opacity", 0.5, 0.0, 1.0, rviz="Overlay Alpha"),
            number("zoom", "Zoom", 1.0, 0.1, 100.0, rviz="Zoom Factor"),
            number("far", "Far plane", 100.0, 0.1, 1e4, "m", "Far Plane Distance"),
        ),
        topics=("sensor_msgs/msg/Image",),
        per_display=(switch("show", "Show", True, "Visibility"),),
        rviz=("Camera",),
    ),
    DisplayKind(
        "Range",
        "A distance measured by ultrasound or infrared",
        (TOPIC, colour("colour", "Colour", "#ffffff", "Color"), opacity(0.5)),
        topics=("sensor_msgs/msg/Range",),
        rviz=("Range",),
    ),
    DisplayKind(
        "PointStamped",
        "A point, for example a clicked one",
        (
            TOPIC,
            number("radius", "Radius", 0.0, 0.0, 10.0, "m", "Radius", zero="auto"),
            colour("colour", "Colour", "#cc29cc", "Color"),
            opacity(),
        ),
        topics=("geometry_msgs/msg/PointStamped",),
        rviz=("PointStamped",),
    ),
)


GLOBALS = (
    frame("frame", "Fixed frame", "Fixed Frame"),
    colour("background", "Background", "", "Background Color"),
    number("light", "Light", 1.0, 0.0, 3.0),
    switch("floor", "Floor", True),
)
"""Options that apply to all displays."""

KINDS = (
    DisplayKind(
        "Grid",
        "Lines on the floor or in another plane",
        (
            number("cell", "Cell size", 0.0, 0.0, 100.0, "m", "Cell Size", zero="auto"),
            number("count", "Cells", 0.0, 0.0, 1000.0, rviz="Plane Cell Count", zero="auto"),
            number("normal_count", "Vertical cells", 0.0, 0.0, 100.0, rviz="Normal Cell Count"),
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
            choice("inertia_shape", "Inertia shape", ("box", "ellipsoid")),
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
            text("filter", "Include", "Filter (whitelist)"),
            text("without", "Exclude", "Filter (blacklist)"),
        ),
        single=True,
        rviz=("TF",),
    ),
    DisplayKind("Trail", "The robot's path", (colour("colour", "Colour", ""),), single=True),
    DisplayKind(
        "World",
        "The world's objects",
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
