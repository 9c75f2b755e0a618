"""Runs Python launch files, with KBot's modules in place of ROS 2's.

The classes of `nav2_common` have the names and arguments of the originals.
"""

from __future__ import annotations

import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import IO, Any, TypeVar

from kbot.ros.launch.known_packages import stand_in_file
from kbot.ros.launch.launch_error import LaunchError, LaunchPackageError
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.python_packages import importable
from kbot.ros.launch.ros2 import actions, conditions, handlers, package_actions, substitutions
from kbot.ros.launch.ros2.conditions import Condition
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.parameters import read_parameter_file
from kbot.ros.launch.ros2.places import line_origin, place, register_running
from kbot.ros.launch.ros2.ros_environment import ros_environment
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.ros.launch.ros2.substitutions import Substitution, as_substitution, is_true, performed
from kbot.ros.launch.ros2.xacro_module import xacro_functions
from kbot.ros.parameter_values import convert
from kbot.text import Diagnostic, KbotError, Origin, Severity, Source, read_source
from kbot.text.errors import DescriptionError
from kbot.text.file_kind import ROBOT, kind_of_file
from kbot.text.suggest import did_you_mean

_T = TypeVar("_T")


class PythonFiles:
    """Runs Python launch files in one context."""

    def __init__(self, context: LaunchContext) -> None:
        self.context = context
        self._modules = modules_of(context)

    @contextmanager
    def modules_in_place(self) -> Iterator[None]:
        """Replace ROS 2's modules by KBot's within the block, also for functions that a launch file calls
        later. Modules of the workspace's packages can be imported too."""
        packages = self.context.packages.beside(self.context.file)
        with _in_place(self._modules), importable(packages), ros_environment():
            yield

    def load(self, source: Source) -> list[object]:
        """The entities that the file's `generate_launch_description()` returns.

        Raises:
            DescriptionError: L081, the file fails; L082, the function is missing or does not return a
                LaunchDescription.
        """
        register_running(source)
        # Any: a launch file defines values of any type
        namespace: dict[str, Any] = {"__name__": "launch_file", "__file__": source.path, "open": self._open}
        return self.guarded(source, lambda: self._entities(source, namespace))

    def _entities(self, source: Source, namespace: dict[str, Any]) -> list[object]:
        exec(compile(source.text, source.path, "exec"), namespace)  # noqa: S102 - the user trusts the file
        generate = namespace.get("generate_launch_description")
        if not callable(generate):
            message = "the launch file does not define generate_launch_description()"
            raise DescriptionError([Diagnostic("L082", Severity.ERROR, message, line_origin(source, 1))])
        description = generate()
        if not isinstance(description, actions.LaunchDescription):
            message = f"generate_launch_description() returned {type(description).__name__}"
            at = line_origin(source, getattr(getattr(generate, "__code__", None), "co_firstlineno", 1))
            raise DescriptionError(
                [Diagnostic("L082", Severity.ERROR, message, at, "return a LaunchDescription")]
            )
        return description.entities

    def guarded(self, source: Source, work: Callable[[], _T]) -> _T:
        """Run the user's code.

        Raises:
            DescriptionError: the error that the code raised, at its line of the launch file.
        """
        try:
            return work()
        except KbotError:
            raise
        except (KeyboardInterrupt, GeneratorExit):  # of the user and of Python, not of the file
            raise
        except LaunchError as fault:
            where = (_places(fault) or [line_origin(source, 1)])[-1]
            found = Diagnostic(fault.code, Severity.ERROR, fault.message, where, fault.hint)
        except SyntaxError as error:
            at = line_origin(source, error.lineno or 1)
            found = Diagnostic("L081", Severity.ERROR, f"not valid Python: {error.msg}", at)
        except BaseException as error:  # noqa: BLE001 - the user's program can raise any error
            message, hint = _explained(error)
            where = (_places(error) or [line_origin(source, 1)])[-1]
            found = Diagnostic("L081", Severity.ERROR, message, where, hint)
        raise DescriptionError([found])

    def _open(self, path: Any, mode: str = "r", *args: Any, **more: Any) -> IO[Any]:
        """`open`, which also remembers the file of each robot text."""
        # a missing .xml may be in the source of a package that is not built, where read_source finds it
        is_robot = kind_of_file(str(path)) == ROBOT or str(path).endswith(".xml")
        if mode in ("r", "rt") and is_robot:
            text = read_source(path).text
            self.context.descriptions[text] = RobotDescription(str(path), {})
            return StringIO(text)
        return open(path, mode, *args, **more)  # noqa: PTH123 - the caller closes it


@contextmanager
def _in_place(modules: Mapping[str, ModuleType]) -> Iterator[None]:
    replaced = {name.partition(".")[0] for name in modules}
    names = {name for name in sys.modules if name.partition(".")[0] in replaced}
    kept = {name: sys.modules.pop(name) for name in names}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def _places(error: BaseException) -> list[Origin]:
    """The lines of launch files in the traceback of an exception, the innermost last."""
    frames = traceback.extract_tb(error.__traceback__)
    return [found for frame in frames if (found := place(frame.filename, frame.lineno or 1))]


def _explained(error: BaseException) -> tuple[str, str]:
    """A message and a hint for an exception in a launch file."""
    frames = traceback.extract_tb(error.__traceback__)
    if isinstance(error, KeyError) and frames and frames[-1].filename in ("<frozen os>", os.__file__):
        name = error.args[0]
        return f"the environment variable {name} is not set", f"set it: {name}=VALUE kbot launch …"
    if isinstance(error, OSError) and isinstance(error.filename, str) and stand_in_file(error.filename):
        return f"{error.filename} does not exist", ""
    if isinstance(error, ModuleNotFoundError):
        hint = "install it in KBot's Python, or add its folder to PYTHONPATH"
        return f"the launch file needs the Python module '{error.name}', which is not installed", hint
    if isinstance(error, ImportError):
        missing = re.match(r"cannot import name '(\w+)'", str(error))
        module = sys.modules.get(error.name or "")
        if missing and isinstance(module, Module):
            return f"KBot does not provide {error.name}.{missing[1]}", did_you_mean(missing[1], vars(module))
    return f"the launch file fails: {type(error).__name__}: {error}", ""


def _named(kind: type, *modules: ModuleType) -> dict[str, Any]:
    """The subclasses of `kind` in the modules, by name."""
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


_WITH_SUBMODULES = (
    *("launch.actions", "launch.event_handlers", "launch.events", "launch.launch_description_sources"),
    *("launch.substitutions", "launch_ros.actions", "launch_ros.event_handlers", "launch_ros.substitutions"),
)
"""Each name in these modules can also be imported from its own submodule: `launch.substitutions.command`."""


def modules_of(context: LaunchContext) -> dict[str, ModuleType]:
    """The modules that launch files can import, by name."""
    ament = {
        "get_package_share_directory": context.share,
        "get_package_share_path": lambda n: Path(context.share(n)),
        "get_package_prefix": context.prefix,
        "PackageNotFoundError": LaunchPackageError,
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
            "SomeSubstitutionsType": Any,
            "Substitution": substitutions.Substitution,
            "Condition": conditions.Condition,
        },
        "launch.some_substitutions_type": {"SomeSubstitutionsType": Any},
        "launch.utilities": {
            "normalize_to_list_of_substitutions": lambda given: [as_substitution(given)],
            "perform_substitutions": lambda context, given: performed(given, context),
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
        "lifecycle_msgs.msg": {"Transition": package_actions.Transition},
        "controller_manager": {},
        "controller_manager.launch_utils": package_actions.CONTROLLER_HELPERS,
        "ros_gz_bridge": {},
        "ros_gz_bridge.actions": {"RosGzBridge": package_actions.ros_gz_bridge},
        "ros_gz_sim": {},
        "ros_gz_sim.actions": {
            "GzServer": package_actions.gz_server,
            "GzSpawnModel": package_actions.gz_spawn_model,
        },
        "nav2_common": {},
        "nav2_common.launch": {
            "RewrittenYaml": RewrittenYaml,
            "ReplaceString": ReplaceString,
            "HasNodeParams": HasNodeParams,
            "LaunchConfigAsBool": LaunchConfigAsBool,
        },
        "ament_index_python": ament,
        "ament_index_python.packages": ament,
        "ament_index_python.resources": {"has_resource": context.has_resource},
        "xacro": xacro_functions(context),
    }
    for name in _WITH_SUBMODULES:
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


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


class Module(ModuleType):
    """A module whose error for a missing name suggests a similar one."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        hint = did_you_mean(name, vars(self))
        raise AttributeError(f"KBot does not provide {self.__name__}.{name}" + (f": {hint}" if hint else ""))


class RewrittenYaml(Substitution):
    """The path of a copy of a parameter file with replaced values and keys, below `root_key` if it is
    given."""

    def __init__(
        self,
        source_file: object,
        param_rewrites: Mapping[str, object],
        root_key: object = None,
        key_rewrites: Mapping[str, object] | None = None,
        convert_types: bool = False,
        **_: object,
    ) -> None:
        self.source, self.root_key, self.convert_types = as_substitution(source_file), root_key, convert_types
        self.values, self.keys = dict(param_rewrites), dict(key_rewrites or {})

    def perform(self, context: LaunchContext) -> str:
        import yaml  # imported lazily: few launches rewrite YAML

        values = {name: performed(value, context) for name, value in self.values.items()}
        keys = {name: performed(value, context) for name, value in self.keys.items()}
        data = self._rewritten(read_parameter_file(self.source.perform(context)), "", values, keys)
        root = performed(self.root_key, context).strip("/") if self.root_key is not None else ""
        return scratch_file(yaml.safe_dump({root: data} if root else data), ".yaml")

    def _rewritten(
        self,
        value: Any,
        path: str,
        values: Mapping[str, str],
        keys: Mapping[str, str],
    ) -> Any:
        if isinstance(value, dict):
            return {
                keys.get(str(key), key): self._rewritten(item, f"{path}.{key}".lstrip("."), values, keys)
                for key, item in value.items()
            }
        name = path if path in values else path.rpartition(".")[2]
        if name not in values:
            return value
        return convert(values[name], "auto") if self.convert_types else values[name]


class ReplaceString(Substitution):
    """The path of a copy of a file with replaced texts. If `condition` is false, the path of the file
    itself."""

    def __init__(
        self, source_file: object, replacements: Mapping[str, object], condition: Condition | None = None
    ) -> None:
        self.source, self.replacements, self.condition = as_substitution(source_file), replacements, condition

    def perform(self, context: LaunchContext) -> str:
        path = self.source.perform(context)
        if self.condition is not None and not self.condition.evaluate(context):
            return path
        text = read_source(path).text
        for old, new in self.replacements.items():
            text = text.replace(old, performed(new, context))
        return scratch_file(text, "")


class HasNodeParams(Substitution):
    """Whether a parameter file has an entry for a node."""

    def __init__(self, source_file: object, node_name: object) -> None:
        self.source, self.node = as_substitution(source_file), as_substitution(node_name)

    def perform(self, context: LaunchContext) -> str:
        return str(self.node.perform(context) in read_parameter_file(self.source.perform(context)))


class LaunchConfigAsBool(Substitution):
    """A launch configuration as `True` or `False`."""

    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: LaunchContext) -> str:
        return str(is_true(context.launch_configurations.get(self.name, "false")))
