"""Load a robot description, check it, and drive the robot in a simulation.

    import kbot
    robot = kbot.load("robot.xacro", wheel_radius=0.04)
    robot.pose("left_wheel", in_frame="base_footprint").translation

    sim = kbot.Simulation(robot, world="empty", seed=1)
    sim.cmd_vel(0.2, 0.5)
    sim.run(5.0)
    sim.odometry.pose

Names are imported at their first use, so that `import kbot` is fast.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in typing, which is slow to import
if TYPE_CHECKING:
    from kbot import (
        checks,
        kinematics,
        learn,
        messages,
        model,
        navigation,
        record,
        ros,
        sensors,
        sim,
        sweep,
        templates,
        text,
        trials,
        world,
        xacro,
    )
    from kbot.kinematics import PlanarPose, Transform
    from kbot.robot import DescriptionWarning, Robot, load
    from kbot.ros.client import Node
    from kbot.sim import Simulation
    from kbot.text import DescriptionError, Diagnostic, KbotError
    from kbot.world import World, load_world

    __version__: str

_HOMES = {
    "DescriptionError": "kbot.text",
    "DescriptionWarning": "kbot.robot",
    "Diagnostic": "kbot.text",
    "Node": "kbot.ros.client",
    "KbotError": "kbot.text",
    "PlanarPose": "kbot.kinematics",
    "Robot": "kbot.robot",
    "Simulation": "kbot.sim",
    "Transform": "kbot.kinematics",
    "World": "kbot.world",
    "load": "kbot.robot",
    "load_world": "kbot.world",
}

__all__ = [
    "DescriptionError",
    "DescriptionWarning",
    "Diagnostic",
    "KbotError",
    "Node",
    "PlanarPose",
    "Robot",
    "Simulation",
    "Transform",
    "World",
    "__version__",
    "checks",
    "kinematics",
    "learn",
    "load",
    "load_world",
    "messages",
    "model",
    "navigation",
    "record",
    "ros",
    "sensors",
    "sim",
    "sweep",
    "templates",
    "text",
    "trials",
    "world",
    "xacro",
]


def __getattr__(name: str) -> object:
    from importlib import import_module  # imported lazily, for a fast start-up

    value: object
    if name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    elif name == "__version__":
        from importlib.metadata import version

        value = version("kbot")
    elif name in __all__:
        value = import_module(f"kbot.{name}")
    else:
        raise AttributeError(f"module 'kbot' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


def _register_environments() -> None:
    from kbot.gymnasium_hook import register_with_gymnasium

    register_with_gymnasium()


_register_environments()
