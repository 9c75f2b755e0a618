"""The environment variables that every installation of ROS sets, with values for a machine without ROS.

The names are those that ros_environment, ament_cmake_core and catkin export in their setup files.
The values are never exported: programs of a launch file choose their version of ROS by these variables.
"""

from __future__ import annotations

from kbot.text.notes import note

STAND_IN_PREFIX = "/opt/ros/stand-in"
"""The install prefix of ROS packages that are not installed. It does not exist."""

_VALUES: dict[int, dict[str, str]] = {
    1: {
        "ROS_DISTRO": "noetic",
        "ROS_VERSION": "1",
        "ROS_PYTHON_VERSION": "3",
        "ROS_PACKAGE_PATH": f"{STAND_IN_PREFIX}/share",
        "ROS_ROOT": f"{STAND_IN_PREFIX}/share/ros",
        "ROS_ETC_DIR": f"{STAND_IN_PREFIX}/etc/ros",
        "ROS_MASTER_URI": "http://localhost:11311",
        "CMAKE_PREFIX_PATH": STAND_IN_PREFIX,
    },
    2: {
        "ROS_DISTRO": "jazzy",
        "ROS_VERSION": "2",
        "ROS_PYTHON_VERSION": "3",
        "AMENT_PREFIX_PATH": STAND_IN_PREFIX,
        "COLCON_PREFIX_PATH": STAND_IN_PREFIX,
        "CMAKE_PREFIX_PATH": STAND_IN_PREFIX,
    },
}
"""By the version of ROS. The releases are those with long-term support at the time of writing."""


def ros_value(name: str, version: int = 2) -> str | None:
    """The value of a variable that ROS sets, for an environment that does not have it. None for any other
    variable.

    Sends a note, because the value may differ from that of the user's ROS.
    """
    value = _VALUES[version].get(name)
    if value is not None:
        note(f"the environment variable {name} is not set: KBot uses '{value}'. Set it to use another value")
    return value
