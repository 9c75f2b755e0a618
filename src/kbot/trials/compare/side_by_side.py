"""Shows two robots in one scene, side by side, with the same commands."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.kinematics.bodies import robot_bounds
from kbot.kinematics.frames import FrameTree
from kbot.model import RobotModel
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.trials.actions import Command
from kbot.trials.compare.comparison import Comparison
from kbot.trials.scenario import Scenario

AFTER = "after"
"""The name of the second robot, and the namespace of its topics."""
_GAP = 1.0
"""Free space in widths of the wider robot between both."""


class SideBySide:
    """Two robots on an empty plane. The second one is to the right of the first."""

    def __init__(self, before: RobotModel, after: RobotModel, scenario: Scenario) -> None:
        """Place both robots at the start.

        Raises:
            DescriptionError: a robot cannot be simulated.
        """
        self._scenario = scenario
        self.simulation = Simulation(before)
        right = -(1.0 + _GAP) * max(_width(before), _width(after))
        self._second = self.simulation.models.spawn_model(after, AFTER, y=right)

    def drive(self) -> None:
        """Give both robots the commands of the scenario."""
        for step in self._scenario.steps:
            if isinstance(step.action, Command):
                self._advance_to(step.at)
                command = step.action
                for robot in (self.simulation.robots.first, self._second):
                    robot.cmd_vel(command.linear, command.angular, command.lateral)
        self._advance_to(self._scenario.duration)

    def _advance_to(self, seconds: float) -> None:
        """Advance to the step nearest to a time, unless it is in the past."""
        simulation = self.simulation
        simulation.step(max(0, round(seconds / simulation.timestep) - simulation.steps))


def choose_scenario(scenarios: Sequence[Scenario], comparison: Comparison) -> Scenario:
    """The scenario with the largest difference that only commands robots on an empty plane.

    Raises:
        KbotError: there is none.
    """
    of_commands = {
        each.name: each
        for each in scenarios
        if each.world == "empty" and all(isinstance(s.action, Command) and not s.when for s in each.steps)
    }
    order = dict.fromkeys([*(d.scenario for d in comparison.significant), *of_commands])
    chosen = next((of_commands[name] for name in order if name in of_commands), None)
    if chosen is None:
        raise KbotError(
            "no scenario can be shown side by side: it needs the world 'empty', and commands at given times"
        )
    return chosen


def _width(robot: RobotModel) -> float:
    bounds = robot_bounds(FrameTree(robot))
    return 0.5 if bounds is None else float((bounds[1] - bounds[0])[:2].max())
