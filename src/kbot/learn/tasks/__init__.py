"""What a robot is trained to do: the start of an episode, its rewards and its end."""

from kbot.learn.tasks.goal import GoalTask
from kbot.learn.tasks.task import Task

TASKS: dict[str, type[Task]] = {"goal": GoalTask}
"""The tasks by name."""

__all__ = ["TASKS", "GoalTask", "Task"]
