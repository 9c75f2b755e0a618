"""What a robot is trained to do: the start of an episode, its rewards and its end."""

from kbot.learn.environments.tasks.barn import BarnTask
from kbot.learn.environments.tasks.follow import FollowTask
from kbot.learn.environments.tasks.goal import GoalTask
from kbot.learn.environments.tasks.task import Task

TASKS: dict[str, type[Task]] = {"goal": GoalTask, "follow": FollowTask, "barn": BarnTask}
"""The tasks by name."""

__all__ = ["TASKS", "BarnTask", "FollowTask", "GoalTask", "Task"]
