"""What stands in the place of ROS 2's modules: their names, and what each can be asked for."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from kbot.launch.faults import Fault
from kbot.launch.plan import Description
from kbot.launch.ros2 import actions, conditions, handlers, nav2, neighbours, substitutions
from kbot.launch.ros2.context import Context
from kbot.text import read_source
from kbot.text.suggest import did_you_mean

_SUBSTITUTIONS = {
    name: value
    for name, value in vars(substitutions).items()
    if isinstance(value, type) and issubclass(value, substitutions.Substitution)
}
_CONDITIONS = {
    name: value
    for name, value in vars(conditions).items()
    if isinstance(value, type) and issubclass(value, conditions.Condition)
}
_ACTIONS = {
    name: value
    for name, value in {**vars(actions), **vars(handlers)}.items()
    if isinstance(value, type) and issubclass(value, actions.Action)
}
_HANDLERS = {
    name: value
    for name, value in vars(handlers).items()
    if isinstance(value, type) and issubclass(value, handlers.EventHandler)
} | dict.fromkeys(("OnProcessIO", "OnExecutionComplete"), handlers.OnShutdown)
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


def modules_of(context: Context) -> dict[str, ModuleType]:
    """The modules that launch files import, by name."""
    ament = {
        "get_package_share_directory": context.share,
        "get_package_share_path": lambda n: Path(context.share(n)),
        "get_package_prefix": lambda n: str(Path(context.share(n)).parents[1]),
        "PackageNotFoundError": Fault,
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
        "xacro": _Xacro(context).functions(),
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


class _Document:
    """What xacro.process_file and xacro.parse give, as far as launch files use it."""

    def __init__(self, text: str, path: str = "") -> None:
        self.text, self.path = text, path

    def toxml(self, *_: object, **__: object) -> str:
        return self.text

    toprettyxml = toxml


class _Xacro:
    def __init__(self, context: Context) -> None:
        self.context = context

    def process_file(
        self, path: object, mappings: Mapping[str, object] | None = None, **_: object
    ) -> _Document:
        from kbot.xacro import expand

        arguments = {str(name): str(value) for name, value in (mappings or {}).items()}
        expansion = expand(str(path), arguments, packages=self.context.packages.beside(str(path)))
        for diagnostic in expansion.diagnostics:
            self.context.note(diagnostic)
        self.context.descriptions[expansion.text] = Description(str(path), arguments)
        return _Document(expansion.text)

    def functions(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in ("process_file", "process", "parse", "process_doc")}

    def parse(self, source: object, filename: object = None) -> _Document:
        """A document that is not expanded yet, of an open file or of one that is named."""
        text = source.read() if hasattr(source, "read") else read_source(str(filename)).text
        known = self.context.descriptions.get(text)
        return _Document(text, str(filename) if filename else known.path if known else "")

    def process_doc(
        self, document: _Document, mappings: Mapping[str, object] | None = None, **more: object
    ) -> None:
        document.text = self.process_file(document.path, mappings, **more).text

    def process(self, path: object, mappings: Mapping[str, object] | None = None, **more: object) -> str:
        return self.process_file(path, mappings, **more).text
