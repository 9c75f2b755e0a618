"""Runs a launch file in Python, with modules of our own in the place of ROS 2's."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import IO, Any

from kbot.launch.faults import Fault
from kbot.launch.plan import Description
from kbot.launch.ros2 import actions, nav2, substitutions
from kbot.launch.ros2.context import Context
from kbot.launch.ros2.places import line_origin, place, running
from kbot.text import Diagnostic, KbotError, Origin, Severity, Source, read_source
from kbot.text.errors import DescriptionError
from kbot.text.suggest import did_you_mean

_SUBSTITUTIONS = {
    name: value
    for name, value in vars(substitutions).items()
    if isinstance(value, type) and issubclass(value, substitutions.Substitution)
}
_CONDITIONS = {
    name: value
    for name, value in vars(substitutions).items()
    if isinstance(value, type) and issubclass(value, substitutions.Condition)
}
_ACTIONS = {
    name: value
    for name, value in vars(actions).items()
    if isinstance(value, type) and issubclass(value, actions.Action)
}
_HANDLERS = {
    name: value
    for name, value in vars(actions).items()
    if isinstance(value, type) and issubclass(value, actions.EventHandler)
} | dict.fromkeys(("OnProcessIO", "OnExecutionComplete"), actions.OnShutdown)
_SOURCES = {
    f"{kind}LaunchDescriptionSource": actions.LaunchDescriptionSource
    for kind in ("Any", "Python", "Frontend", "XML", "YAML")
}


class _Module(ModuleType):
    """A module that says which name it lacks, and which it has."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        hint = did_you_mean(name, vars(self))
        raise AttributeError(f"KBot has no {self.__name__}.{name}" + (f": {hint}" if hint else ""))


def _modules(context: Context) -> dict[str, ModuleType]:
    """The modules that launch files import, by name."""
    ament = {
        "get_package_share_directory": context.share,
        "get_package_share_path": lambda n: Path(context.share(n)),
    }
    ros_actions = {
        **_ACTIONS,
        "PushROSNamespace": actions.PushRosNamespace,
        "LoadComposableNodes": actions.Silent,
        "RosTimer": actions.TimerAction,
    }
    contents: dict[str, Mapping[str, Any]] = {
        "launch": {
            **_ACTIONS,
            "LaunchDescription": actions.LaunchDescription,
            "LaunchContext": lambda *_, **__: context,
            "Substitution": substitutions.Substitution,
            "Condition": substitutions.Condition,
        },
        "launch.actions": {**_ACTIONS, "Log": actions.Silent, "ResetLaunchConfigurations": actions.Silent},
        "launch.conditions": _CONDITIONS,
        "launch.substitutions": _SUBSTITUTIONS,
        "launch.event_handlers": _HANDLERS,
        "launch.events": {"Shutdown": actions.Shutdown},
        "launch.launch_description_sources": _SOURCES,
        "launch.launch_context": {"LaunchContext": lambda *_, **__: context},
        "launch.launch_description": {"LaunchDescription": actions.LaunchDescription},
        "launch_xml": {},
        "launch_xml.launch_description_sources": _SOURCES,
        "launch_yaml": {},
        "launch_yaml.launch_description_sources": _SOURCES,
        "launch_ros": {},
        "launch_ros.actions": ros_actions,
        "launch_ros.substitutions": _SUBSTITUTIONS,
        "launch_ros.descriptions": {
            "ComposableNode": actions.Silent,
            "ParameterValue": actions.ParameterValue,
            "ParameterFile": actions.ParameterFile,
        },
        "launch_ros.parameter_descriptions": {
            "ParameterValue": actions.ParameterValue,
            "ParameterFile": actions.ParameterFile,
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
        "xacro": _Xacro(context).functions(),
    }
    modules: dict[str, ModuleType] = {}
    for name, values in contents.items():
        module = modules[name] = _Module(name)
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


@contextmanager
def _in_place(modules: Mapping[str, ModuleType]) -> Iterator[None]:
    names = {name for name in sys.modules if name.partition(".")[0] in {n.partition(".")[0] for n in modules}}
    kept = {name: sys.modules.pop(name) for name in names}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def _places(error: BaseException) -> list[Origin]:
    """The lines of launch files that an exception came through, the innermost last."""
    frames = traceback.extract_tb(error.__traceback__)
    return [found for frame in frames if (found := place(frame.filename, frame.lineno or 1))]


class PythonFiles:
    """Runs launch files in Python within one context."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self._modules = _modules(context)

    @contextmanager
    def modules_in_place(self) -> Iterator[None]:
        """ROS 2's modules replaced by ours, also for what a launch file calls later."""
        with _in_place(self._modules):
            yield

    def load(self, source: Source) -> list[object]:
        """The entities of a file's `generate_launch_description()`.

        Raises:
            DescriptionError: L081 it fails, L082 it has no such function.
        """
        running(source)
        namespace: dict[str, Any] = {"__name__": "launch_file", "__file__": source.path, "open": self._open}
        return self.guarded(source, lambda: self._entities(source, namespace))

    def _entities(self, source: Source, namespace: dict[str, Any]) -> list[object]:
        exec(compile(source.text, source.path, "exec"), namespace)  # noqa: S102 - trust was asked for
        generate = namespace.get("generate_launch_description")
        if not callable(generate):
            message = "a launch file in Python has a function generate_launch_description()"
            raise DescriptionError([Diagnostic("L082", Severity.ERROR, message, line_origin(source, 1))])
        description = generate()
        return description.entities if isinstance(description, actions.LaunchDescription) else []

    def guarded(self, source: Source, work: Callable[[], list[object]]) -> list[object]:
        """Runs the user's code; what it raises is an error at the line of the launch file that did it."""
        try:
            return work()
        except KbotError:
            raise
        except Fault as fault:
            where = (_places(fault) or [line_origin(source, 1)])[-1]
            found = Diagnostic(fault.code, Severity.ERROR, fault.message, where, fault.hint)
        except SyntaxError as error:
            at = line_origin(source, error.lineno or 1)
            found = Diagnostic("L081", Severity.ERROR, f"not valid Python: {error.msg}", at)
        except Exception as error:  # noqa: BLE001 - whatever a stranger's program raises
            message = f"the launch file fails: {type(error).__name__}: {error}"
            found = Diagnostic(
                "L081", Severity.ERROR, message, (_places(error) or [line_origin(source, 1)])[-1]
            )
        raise DescriptionError([found])

    def _open(self, path: Any, mode: str = "r", *args: Any, **more: Any) -> IO[Any]:
        """`open`, remembering which text came from which robot file."""
        if mode in ("r", "rt") and Path(path).suffix in (".urdf", ".xacro", ".xml"):
            text = read_source(path).text
            self.context.descriptions[text] = Description(str(path), {})
            return StringIO(text)
        return open(path, mode, *args, **more)  # noqa: PTH123 - the caller closes it
