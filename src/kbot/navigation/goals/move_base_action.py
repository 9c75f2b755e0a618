"""The action move_base of ROS 1's navigation, on the topics of actionlib."""

from __future__ import annotations

from collections.abc import Callable

from kbot.messages import actions as msg
from kbot.messages.action_server import REPLACED, ActionServer, ActionTypes, GoalRejected
from kbot.messages.clock import Timer
from kbot.messages.navigation import PoseStamped
from kbot.messages.types import Header
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.goals.goals import Goals
from kbot.navigation.path import to_pose_stamped
from kbot.sim import Simulation
from kbot.text import KbotError

ACTION = "move_base"
ACTION_TOPICS = tuple(f"{ACTION}/{topic}" for topic in ("goal", "cancel", "status", "feedback", "result"))
FEEDBACK_RATE = 20.0
"""Hz: the default controller_frequency of move_base, which publishes feedback at that rate."""
REACHED = "Goal reached."
"""The text of move_base."""
TYPES = ActionTypes(
    msg.MoveBaseActionGoal, msg.MoveBaseActionResult, msg.MoveBaseActionFeedback, msg.MoveBaseResult()
)
STATUS = {
    GoalState.REACHED: msg.GoalStatus.SUCCEEDED,
    GoalState.STUCK: msg.GoalStatus.ABORTED,
    GoalState.REFUSED: msg.GoalStatus.ABORTED,
    GoalState.CANCELLED: msg.GoalStatus.PREEMPTED,
}
"""The status of a goal that ended. actionlib has no way from active to rejected."""


class MoveBaseAction:
    """Goals by actionlib: their status, result, and feedback with the robot's pose."""

    def __init__(
        self, simulation: Simulation, goals: Goals, go: Callable[[PoseStamped], None], odometry_frame: str
    ) -> None:
        """`go` begins a goal of `goals`, or raises KbotError. The feedback is in the `odometry_frame`."""
        self._simulation, self._goals, self._go, self._frame = simulation, goals, go, odometry_frame
        self._count = goals.count
        """The number of the action's goal among all goals."""
        self._server = ActionServer(
            simulation.bus, simulation.clock, ACTION, TYPES, self._accept, self._goals.cancel
        )
        self._timer: Timer | None = None
        goals.watch(self._look)

    def close(self) -> None:
        """Accept no more goals."""
        self._goals.unwatch(self._look)
        self._stop_feedback()
        self._server.close()

    def take(self, pose: PoseStamped) -> None:
        """Process a goal that has no ID, as move_base does with `move_base_simple/goal`."""
        self._server.take(msg.MoveBaseActionGoal(pose.header, goal=msg.MoveBaseGoal(pose)))

    def _accept(self, goal: msg.MoveBaseGoal) -> None:
        try:
            self._go(goal.target_pose)
        except KbotError as error:
            raise GoalRejected(str(error), TYPES.no_result) from None
        status = self._goals.status
        if status is not None and status.state.is_end:
            raise GoalRejected(status.reason, TYPES.no_result)
        self._count = self._goals.count
        if self._timer is None:
            self._timer = self._simulation.clock.every(FEEDBACK_RATE, self._publish_feedback)

    def _look(self) -> None:
        """End the action's goal if it has ended, or if another goal has replaced it."""
        if self._server.is_active and self._goals.count != self._count:
            self._end(msg.GoalStatus.PREEMPTED, REPLACED)
        status = self._goals.status
        if self._server.is_active and status is not None and status.state.is_end:
            self._end(STATUS[status.state], _text(status))

    def _end(self, status: int, text: str) -> None:
        self._stop_feedback()
        self._server.end(status, text)

    def _stop_feedback(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _publish_feedback(self) -> None:
        if self._server.has_listeners:
            header = Header(self._simulation.clock.stamp, self._frame)
            pose = to_pose_stamped(self._simulation.odometry.pose, header)
            self._server.publish_feedback(msg.MoveBaseFeedback(pose))


def _text(status: GoalReport) -> str:
    return REACHED if status.state is GoalState.REACHED else status.reason
