"""Reads the parameters of ROS 2 nodes from dictionaries and files, and types values as launch_ros does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from kbot.kinematics.controller_files import node_parameters
from kbot.ros.launch.includes import charge_yaml
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.ros2.actions import ParameterFile, ParameterValue, PlacedParameter, is_value
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.markup import parse
from kbot.ros.launch.ros2.places import parameter_place
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.ros.launch.ros2.substitutions import is_true, performed
from kbot.ros.parameter_values import ROSPARAM
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, Source, Span, read_source
from kbot.text.yaml import Keys, YamlDocument, YamlError, load_yaml, read_yaml

Place = Callable[[Keys], Origin | None]

_TYPES = {"str": str, "int": int, "float": float, "bool": bool}


@dataclass(frozen=True, slots=True)
class PlacedValue:
    """The value of a parameter, and where it was written. None means the origin of its node."""

    value: Any  # Any: YAML and launch files give any type
    origin: Origin | None = None


Unusable = Callable[[DescriptionError, Origin], None]
"""Reports the error of a parameter file, which was named at the origin."""


def parameters_of(
    given: Iterable[object], node: str, context: LaunchContext, origin: Origin, unusable: Unusable
) -> tuple[dict[str, PlacedValue], tuple[str, ...]]:
    """The parameters of a node that was created at `origin`, by name, and the paths of its parameter files.

    Nested names are joined: `a.b`. Later values replace earlier ones.
    """
    found: dict[str, PlacedValue] = {}
    files: list[str] = []
    for item in given:
        if isinstance(item, PlacedParameter):
            found.update(_flat(item.values, context, _always(item.origin)))
        elif isinstance(item, Mapping):
            found.update(_flat(item, context, lambda keys: parameter_place(origin, keys[-1])))
        else:
            try:
                path = _path(item, context)
                found.update(parameters_of_file(path, node, context))
                files.append(path)
            except DescriptionError as error:
                unusable(error, getattr(item, "origin", None) or origin)
    return found, tuple(files)


def _always(origin: Origin) -> Place:
    return lambda keys: origin


def _path(item: object, context: LaunchContext) -> str:
    """The path of a parameter file. One with substitutions is written again with their values."""
    if not isinstance(item, ParameterFile):
        return performed(item, context)
    path = performed(item.file, context)
    if not is_true(performed(item.allow_substs, context)):
        return path
    text = read_source(path).text
    return scratch_file(performed(parse(text), context), ".yaml") if "$(" in text else path


def parameters_of_file(path: str, node: str | None, context: LaunchContext) -> dict[str, PlacedValue]:
    """The parameters of a node in a parameter file. For None, those of all nodes.

    Raises:
        DescriptionError: L033, it is not a parameter file; or it cannot be read.
        LaunchError: L070, it is too large, counted together with all files before it.
    """
    source = read_source(path)
    charge_yaml(context.budget, path, source.text)
    found = node_parameters(_read(source), node)
    return {name: _placed(setting.value, context, setting.origin) for name, setting in found.items()}


def read_parameter_file(path: str) -> dict[str, Any]:
    """The content of a parameter file, by node name.

    Raises:
        DescriptionError: L033, it is not a parameter file; or it cannot be read.
    """
    data: dict[str, Any] = _read(read_source(path)).data
    return data


def _read(source: Source) -> YamlDocument:
    try:
        document = read_yaml(source, ROSPARAM)
    except YamlError as error:
        message = f"the YAML cannot be read: {error}"
        raise DescriptionError([Diagnostic("L033", Severity.ERROR, message, Origin(error.span))]) from None
    if not isinstance(document.data, dict):
        message = f"{source.path} is not a parameter file of the form NODE: ros__parameters: …"
        where = Origin(Span(source, 0, 0))
        raise DescriptionError([Diagnostic("L033", Severity.ERROR, message, where)])
    return document


def _flat(
    values: Mapping[Any, object], context: LaunchContext, place: Place, keys: Keys = (), prefix: str = ""
) -> dict[str, PlacedValue]:
    """The parameters of a mapping by joined name. `place` gives the origin of a value from its keys."""
    found: dict[str, PlacedValue] = {}
    for key, value in values.items():
        own = performed(key, context) if is_value(key) else str(key)
        name, below = prefix + own, (*keys, str(key))
        if isinstance(value, Mapping):
            found.update(_flat(value, context, place, below, f"{name}."))
        else:
            found[name] = _placed(value, context, place(below))
    return found


def _placed(value: object, context: LaunchContext, origin: Origin | None) -> PlacedValue:
    try:
        return PlacedValue(plain(value, context), origin)
    except LaunchError as fault:
        if origin is None or fault.is_limit:  # the reporter must see that a limit is exceeded
            raise
        found = Diagnostic(fault.code, Severity.ERROR, fault.message, origin, fault.hint)
        raise DescriptionError([found]) from None


def plain(value: object, context: LaunchContext) -> Any:
    """The value of a parameter. The text of substitutions is read as YAML, unless a type is given."""
    if isinstance(value, ParameterValue):
        text = plain(value.value, context) if not is_value(value.value) else performed(value.value, context)
        return _typed(text, value.type)
    if isinstance(value, str | bool | int | float) or value is None:
        return value
    if is_value(value) and not (isinstance(value, list | tuple) and all(isinstance(v, str) for v in value)):
        return _typed(performed(value, context), None)
    if isinstance(value, list | tuple):
        return [plain(item, context) for item in value]
    return str(value)


def _typed(text: object, type_: object) -> Any:
    if not isinstance(text, str):
        return text
    if type_ is str:
        return text
    if type_ in (int, float, bool):
        wanted = getattr(type_, "__name__", "")
        value = load_yaml(text, ROSPARAM)
        if type_ is float and isinstance(value, int):
            value = float(value)
        if not isinstance(value, _TYPES[wanted]):
            raise LaunchError("L031", f"'{text}' is not of type {wanted}", "", text)
        return value
    try:
        value = load_yaml(text, ROSPARAM)
        return (
            text if isinstance(value, str) else value
        )  # not the value: YAML would fold the lines of a description
    except ValueError:
        hint = "if it is a string, use ParameterValue(…, value_type=str)"
        short = text if len(text) < 40 else text[:40] + "…"
        raise LaunchError("L031", f"the parameter is not valid YAML: {short}", hint) from None
