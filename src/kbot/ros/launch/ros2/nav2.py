"""The substitutions of nav2_common, which Nav2's launch files import: parameter files that are rewritten.

The names and arguments are those of `nav2_common.launch`. As there, each result is a file of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kbot.ros.launch.ros2.conditions import Condition
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.parameters import read_parameter_file
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.ros.launch.ros2.substitutions import Substitution, as_substitution, is_true, performed
from kbot.ros.parameter_values import convert
from kbot.text import read_source


class RewrittenYaml(Substitution):
    """A parameter file with values, and names of keys, replaced, beneath `root_key` where that is given."""

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
        import yaml

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
    """A file with texts replaced; the file itself where `condition` says no."""

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
    """Whether a parameter file speaks of a node."""

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
