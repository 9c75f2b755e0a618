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
    """Where the node is in the graph, and what it is told. `rest` are the program's own words."""

    name: str
    namespace: str = "/"
    remaps: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    rest: tuple[str, ...] = ()

    @property
    def full_name(self) -> str:
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def resolve(self, name: str) -> str:
        """The full name of a topic or parameter: `~x` is the node's own, `x` stands beside it, and remaps
        count.

        Raises:
            KbotError: it is no name.
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
    """`name:=value`, `_param:=value`, `__name:=x` and `__ns:=x` of ROS 1, and `--ros-args` of ROS 2.

    Raises:
        KbotError: a word that lacks what must follow it, or a parameter file that cannot be read.
    """
    found = _Reader(name, environment.get("ROS_NAMESPACE", "/"))
    found.read(list(words))
    return found.arguments()


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
            self._place(key, value)
        elif key.startswith("__"):
            return  # __log and its like are roslaunch's own
        elif key.startswith("_"):
            self._parameters[key[1:]] = convert(value, "auto")
        else:
            self._remaps[key] = value

    def _ros_2(self, word: str, words: list[str]) -> None:
        if word not in ("-r", "--remap", "-p", "--param", "--params-file", "--log-level"):
            return  # flags of rcl that say nothing here
        if not words:
            raise KbotError(f"{word} is followed by a value")
        value = words.pop(0)
        if word == "--params-file":
            self._files.append(value)
        elif word == "--log-level":
            return
        else:
            key, mark, text = value.partition(":=")
            if not mark:
                raise KbotError(f"{word} is followed by NAME:=VALUE, not '{value}'")
            if word in ("-p", "--param"):
                self._parameters[key] = load_yaml(text, ROSPARAM)
            elif key in ("__node", "__name", "__ns"):
                self._place(key, text)
            else:
                self._remaps[key.rpartition(":")[2]] = text

    def _place(self, key: str, value: str) -> None:
        if key == "__ns":
            self._namespace = value
        else:
            self._name = value


def _parameters_of(file: str, node: str) -> dict[str, ParameterValue]:
    """A node's parameters in a parameter file of ROS 2."""
    try:
        document = read_yaml(read_source(file), ROSPARAM)
    except DescriptionError as error:
        raise KbotError(f"--params-file: {error.diagnostics[0].message}") from None
    except YamlError as error:
        raise KbotError(f"--params-file {error.span}: {error.problem}") from None
    return {name: setting.value for name, setting in node_parameters(document, node).items()}
