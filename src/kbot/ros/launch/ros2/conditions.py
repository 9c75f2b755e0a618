"""The conditions of actions, with the names of `launch.conditions` in ROS 2."""

from __future__ import annotations

from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.substitutions import as_substitution, is_true, performed


class Condition:
    """Decides whether an action runs."""

    def __init__(self, predicate: object) -> None:
        self.predicate = as_substitution(predicate)

    def evaluate(self, context: LaunchContext) -> bool:
        return is_true(self.predicate.perform(context))


class IfCondition(Condition):
    pass


class UnlessCondition(Condition):
    def evaluate(self, context: LaunchContext) -> bool:
        return not super().evaluate(context)


class LaunchConfigurationEquals(Condition):
    def __init__(self, launch_configuration_name: str, expected_value: object) -> None:
        self.name, self.expected = launch_configuration_name, expected_value

    def evaluate(self, context: LaunchContext) -> bool:
        return self._matches(context)

    def _matches(self, context: LaunchContext) -> bool:
        actual = context.launch_configurations.get(self.name)
        return actual == (None if self.expected is None else performed(self.expected, context))


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    def evaluate(self, context: LaunchContext) -> bool:
        return not self._matches(context)
