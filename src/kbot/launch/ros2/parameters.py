"""Parameters of a ROS 2 node: dictionaries, files and values typed as launch_ros types them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from kbot.launch import names
from kbot.launch.ros2.actions import ParameterFile, ParameterValue, is_value
from kbot.launch.ros2.context import Context
from kbot.launch.ros2.substitutions import performed
from kbot.launch.substitution import Fault
from kbot.launch.values import load_yaml
from kbot.text import read_source

_TYPES = {"str": str, "int": int, "float": float, "bool": bool}


def parameters_of(given: Iterable[Any], node: str, context: Context) -> dict[str, Any]:
    """The parameters of a node, by name (`a.b` for nested ones); later ones replace earlier ones."""
    found: dict[str, Any] = {}
    for item in given:
        if isinstance(item, Mapping):
            found.update(_flat(item, context))
        else:
            found.update(parameters_of_file(_path(item, context), node, context))
    return found


def parameter_files(given: Iterable[Any], context: Context) -> tuple[str, ...]:
    """The paths of the files among the parameters of a node."""
    return tuple(_path(item, context) for item in given if not isinstance(item, Mapping))


def _path(item: Any, context: Context) -> str:
    return performed(item.file if isinstance(item, ParameterFile) else item, context)


def parameters_of_file(path: str, node: str, context: Context) -> dict[str, Any]:
    """What a parameter file says of a node.

    Raises:
        Fault: L033, it is no parameter file.
        DescriptionError: it cannot be read.
    """
    found: dict[str, Any] = {}
    _collect(read_parameter_file(path), "", node, found, context)
    return found


def read_parameter_file(path: str) -> dict[str, Any]:
    """The whole of a parameter file, nodes by name.

    Raises:
        Fault: L033, it is no parameter file.
        DescriptionError: it cannot be read.
    """
    try:
        data = load_yaml(read_source(path).text)
    except ValueError as error:
        raise Fault("L033", f"the YAML in {path} cannot be read: {error}") from None
    if not isinstance(data, dict):
        raise Fault("L033", f"{path} is no parameter file: NODE: ros__parameters: … is expected")
    return data


def _collect(
    data: Mapping[str, Any], prefix: str, node: str, found: dict[str, Any], context: Context
) -> None:
    for key, value in data.items():
        if not isinstance(value, dict):
            continue
        name = f"{prefix}/{str(key).strip('/')}"
        if "ros__parameters" in value:
            if names.matches(name, node) or node == "/**":
                found.update(_flat(value["ros__parameters"] or {}, context))
        else:
            _collect(value, name, node, found, context)


def _flat(values: Mapping[Any, Any], context: Context, prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in values.items():
        name = prefix + (performed(key, context) if is_value(key) else str(key))
        if isinstance(value, Mapping):
            found.update(_flat(value, context, f"{name}."))
        else:
            found[name] = plain(value, context)
    return found


def plain(value: Any, context: Context) -> Any:
    """A parameter's value: texts made of substitutions are read as YAML, unless a type is said."""
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


def _typed(text: Any, type_: Any) -> Any:
    if not isinstance(text, str):
        return text
    if type_ is str:
        return text
    if type_ in (int, float, bool):
        wanted = getattr(type_, "__name__", "")
        value = load_yaml(text)
        if type_ is float and isinstance(value, int):
            value = float(value)
        if not isinstance(value, _TYPES[wanted]):
            raise Fault("L031", f"'{text}' is no {wanted}", "", text)
        return value
    try:
        value = load_yaml(text)
        return text if isinstance(value, str) else value  # YAML would fold the lines of a description
    except ValueError:
        hint = "say that it is a text: ParameterValue(…, value_type=str)"
        short = text if len(text) < 40 else text[:40] + "…"
        raise Fault("L031", f"the parameter's text is read as YAML, and is none: {short}", hint) from None
