"""What a robot is trained to do: the start of an episode, its rewards and its end."""

from kbot.learn.tasks.barn import BarnTask
from kbot.learn.tasks.follow import FollowTask
from kbot.learn.tasks.goal import GoalTask
from kbot.learn.tasks.task import Task

TASKS: dict[str, type[Task]] = {"goal": GoalTask, "follow": FollowTask, "barn": BarnTask}
"""The tasks by name."""

__all__ = ["TASKS", "BarnTask", "FollowTask", "GoalTask", "Task"]
