"""What stands in the place of ROS 2's modules: their names, and what each can be asked for."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.ros2 import actions, conditions, handlers, nav2, neighbours, substitutions
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.xacro import xacro_functions
from kbot.text.suggest import did_you_mean


def _named(kind: type, *modules: ModuleType) -> dict[str, Any]:
    """The classes of a kind, by their names."""
    return {
        name: value
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, kind)
    }


_SUBSTITUTIONS = _named(substitutions.Substitution, substitutions)
_CONDITIONS = _named(conditions.Condition, conditions)
_ACTIONS = _named(actions.Action, actions, handlers)
_HANDLERS = _named(handlers.EventHandler, handlers)
_SOURCES = {
    f"{kind}LaunchDescriptionSource": actions.LaunchDescriptionSource
    for kind in ("Any", "Python", "Frontend", "XML", "YAML")
}

_IN_MODULES_OF_THEIR_OWN = (
    *("launch.actions", "launch.event_handlers", "launch.events", "launch.launch_description_sources"),
    *("launch.substitutions", "launch_ros.actions", "launch_ros.event_handlers", "launch_ros.substitutions"),
)
"""Each name of these can be had from a module of its own as well: `launch.substitutions.command`."""


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


class Module(ModuleType):
    """A module that says which name it lacks, and which it has."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        hint = did_you_mean(name, vars(self))
        raise AttributeError(f"KBot has no {self.__name__}.{name}" + (f": {hint}" if hint else ""))


def modules_of(context: LaunchContext) -> dict[str, ModuleType]:
    """The modules that launch files import, by name."""
    ament = {
        "get_package_share_directory": context.share,
        "get_package_share_path": lambda n: Path(context.share(n)),
        "get_package_prefix": context.prefix,
        "PackageNotFoundError": LaunchError,
    }
    finders = {
        name: type(name, (value,), {"find": lambda _, package: context.share(package)})
        for name, value in _SUBSTITUTIONS.items()
        if issubclass(value, substitutions.FindPackageShare)
    }
    found = {**_SUBSTITUTIONS, **finders, "FindPackage": finders["FindPackageShare"]}
    ros_actions = {
        **_ACTIONS,
        "PushROSNamespace": actions.PushRosNamespace,
        **dict.fromkeys(("LoadComposableNodes", "LifecycleTransition", "SetROSLogDir"), actions.Silent),
        **dict.fromkeys(("RosTimer", "ROSTimer"), actions.TimerAction),
    }
    contents: dict[str, Mapping[str, Any]] = {
        "launch": {
            **_ACTIONS,
            "LaunchDescription": actions.LaunchDescription,
            "LaunchContext": lambda *_, **__: context,
            "Substitution": substitutions.Substitution,
            "Condition": conditions.Condition,
        },
        "launch.actions": {**_ACTIONS, "Log": actions.Silent, "UnregisterEventHandler": actions.Silent},
        "launch.conditions": _CONDITIONS,
        "launch.substitutions": _SUBSTITUTIONS,
        "launch.event_handlers": _HANDLERS,
        "launch.events": {"Shutdown": actions.Shutdown, "matches_action": actions.Silent},
        "launch.event_handler": {"EventHandler": handlers.EventHandler},
        "launch.launch_description_sources": _SOURCES,
        "launch.launch_context": {"LaunchContext": lambda *_, **__: context},
        "launch.launch_description": {"LaunchDescription": actions.LaunchDescription},
        "launch_xml": {},
        "launch_xml.launch_description_sources": _SOURCES,
        "launch_yaml": {},
        "launch_yaml.launch_description_sources": _SOURCES,
        "launch_ros": {},
        "launch_ros.actions": ros_actions,
        "launch_ros.substitutions": found,
        "launch_ros.descriptions": {
            "ComposableNode": actions.Silent,
            "ParameterValue": actions.ParameterValue,
            "ParameterFile": actions.ParameterFile,
        },
        "launch_ros.parameter_descriptions": {
            "ParameterValue": actions.ParameterValue,
            "ParameterFile": actions.ParameterFile,
        },
        "launch_ros.event_handlers": {"OnStateTransition": handlers.OnShutdown},
        "launch_ros.events": {},
        "launch_ros.events.lifecycle": {"ChangeState": actions.Silent},
        "lifecycle_msgs": {},
        "lifecycle_msgs.msg": {"Transition": neighbours.Transition},
        "controller_manager": {},
        "controller_manager.launch_utils": neighbours.CONTROLLER_HELPERS,
        "ros_gz_bridge": {},
        "ros_gz_bridge.actions": {"RosGzBridge": neighbours.ros_gz_bridge},
        "ros_gz_sim": {},
        "ros_gz_sim.actions": {
            "GzServer": neighbours.gz_server,
            "GzSpawnModel": neighbours.gz_spawn_model,
        },
        "nav2_common": {},
        "nav2_common.launch": {
            "RewrittenYaml": nav2.RewrittenYaml,
            "ReplaceString": nav2.ReplaceString,
            "HasNodeParams": nav2.HasNodeParams,
            "LaunchConfigAsBool": nav2.LaunchConfigAsBool,
        },
        "ament_index_python": ament,
        "ament_index_python.packages": ament,
        "ament_index_python.resources": {"has_resource": context.has_resource},
        "xacro": xacro_functions(context),
    }
    for name in _IN_MODULES_OF_THEIR_OWN:
        contents |= {f"{name}.{_snake(part)}": {part: value} for part, value in contents[name].items()}
    modules: dict[str, ModuleType] = {}
    for name, values in contents.items():
        module = modules[name] = Module(name)
        vars(module).update(values)
        module.__path__ = []
        parent, _, child = name.rpartition(".")
        if parent:
            setattr(modules[parent], child, module)
    return modules
