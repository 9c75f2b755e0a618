"""Parses a node's command line as roslaunch and ros2 launch write it: name, remaps and parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from kbot.kinematics.controller_files import node_parameters
from kbot.messages.bus import absolute
from kbot.ros.parameter_values import ROSPARAM, ParameterValue, convert
from kbot.text import DescriptionError, KbotError, read_source
from kbot.text.yaml import YamlError, load_yaml, read_yaml


@dataclass(frozen=True)
class NodeArguments:
    """A node's name, namespace, remaps and parameters. `rest` are the program's other arguments."""

    name: str
    namespace: str = "/"
    remaps: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    rest: tuple[str, ...] = ()

    @property
    def full_name(self) -> str:
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def resolve(self, name: str) -> str:
        """The full name of a topic or parameter, after remapping.

        `~x` is in the node's own namespace, `x` in the namespace that the node is in.

        Raises:
            KbotError: it is not a valid name.
        """
        full = self._full(name)
        for source, target in self.remaps.items():
            if self._full(source) == full:
                return self._full(target)
        return full

    def _full(self, name: str) -> str:
        if name.startswith("~"):
            return absolute(name[1:].lstrip("/"), self.full_name)
        return absolute(name, self.namespace)


def read_arguments(name: str, words: Sequence[str], environment: Mapping[str, str]) -> NodeArguments:
    """Parse `name:=value`, `_param:=value`, `__name:=x` and `__ns:=x` of ROS 1, and `--ros-args` of ROS 2.

    Raises:
        KbotError: an option lacks its value, or a parameter file cannot be read.
    """
    reader = _Reader(name, environment.get("ROS_NAMESPACE", "/"))
    reader.read(list(words))
    return reader.arguments()


class _Reader:
    def __init__(self, name: str, namespace: str) -> None:
        self._name, self._namespace = name, namespace
        self._remaps: dict[str, str] = {}
        self._parameters: dict[str, ParameterValue] = {}
        self._files: list[str] = []
        self._rest: list[str] = []

    def arguments(self) -> NodeArguments:
        namespace = "/" + self._namespace.strip("/")
        node = f"{namespace.rstrip('/')}/{self._name}"
        parameters: dict[str, ParameterValue] = {}
        for file in self._files:
            parameters.update(_parameters_of(file, node))
        return NodeArguments(
            self._name, namespace, self._remaps, {**parameters, **self._parameters}, tuple(self._rest)
        )

    def read(self, words: list[str]) -> None:
        is_ros_2 = False
        while words:
            word = words.pop(0)
            if word == "--ros-args":
                is_ros_2 = True
            elif word == "--" and is_ros_2:
                is_ros_2 = False
            elif is_ros_2:
                self._ros_2(word, words)
            elif ":=" in word:
                self._ros_1(*word.split(":=", 1))
            else:
                self._rest.append(word)

    def _ros_1(self, key: str, value: str) -> None:
        if key in ("__name", "__ns"):
            self._set_name(key, value)
        elif key.startswith("__"):
            return  # roslaunch adds others, such as __log, which have no effect here
        elif key.startswith("_"):
            self._parameters[key[1:]] = convert(value, "auto")
        else:
            self._remaps[key] = value

    def _ros_2(self, word: str, words: list[str]) -> None:
        if word not in ("-r", "--remap", "-p", "--param", "--params-file", "--log-level"):
            return  # other flags of rcl, such as --enable-rosout-logs, have no effect here
        if not words:
            raise KbotError(f"{word} needs a value")
        value = words.pop(0)
        if word == "--params-file":
            self._files.append(value)
        elif word == "--log-level":
            return
        else:
            key, mark, text = value.partition(":=")
            if not mark:
                raise KbotError(f"{word} needs NAME:=VALUE, not '{value}'")
            if word in ("-p", "--param"):
                self._parameters[key] = load_yaml(text, ROSPARAM)
            elif key in ("__node", "__name", "__ns"):
                self._set_name(key, text)
            else:
                self._remaps[key.rpartition(":")[2]] = text

    def _set_name(self, key: str, value: str) -> None:
        if key == "__ns":
            self._namespace = value
        else:
            self._name = value


def _parameters_of(file: str, node: str) -> dict[str, ParameterValue]:
    """The parameters of a node in a ROS 2 parameter file."""
    try:
        document = read_yaml(read_source(file), ROSPARAM)
    except DescriptionError as error:
        raise KbotError(f"--params-file: {error.diagnostics[0].message}") from None
    except YamlError as error:
        raise KbotError(f"--params-file {error.span}: {error.problem}") from None
    return {name: setting.value for name, setting in node_parameters(document, node).items()}
