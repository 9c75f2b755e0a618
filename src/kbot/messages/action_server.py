"""The server of an action on the topics of ROS 1's actionlib, for one goal at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from kbot.messages.actions import GoalStatus, GoalStatusArray
from kbot.messages.bus import Bus
from kbot.messages.clock import NANOSECONDS, Clock, Timer
from kbot.messages.navigation import GoalID
from kbot.messages.types import Header
from kbot.text import KbotError

STATUS_RATE = 5.0
"""Hz at which actionlib publishes the status of all goals."""
KEPT, MOST_KEPT = 5 * NANOSECONDS, 100
"""How long, in ns, a finished goal stays in the status, and how many finished goals do."""

ACCEPTED = "This goal has been accepted by the simple action server"
REPLACED = "This goal was canceled because another goal was received by the simple action server"
TOO_OLD = (
    "This goal handle was canceled by the action server because its timestamp is before the timestamp of the "
    "last cancel request"
)
"""The texts of actionlib."""


class ActionTypes(NamedTuple):
    """The message classes of an action's topics, and the result of a goal that has no other."""

    goal: type[Any]
    result: type[Any]
    feedback: type[Any]
    no_result: object


class GoalRejected(KbotError):
    """A goal that the server does not accept, with the result that its client gets."""

    def __init__(self, text: str, result: object) -> None:
        super().__init__(text)
        self.result = result


class _Ended(NamedTuple):
    status: GoalStatus
    since: int


class ActionServer:
    """Accepts goals, and publishes their status, feedback and result, as actionlib's SimpleActionServer does.

    A new goal preempts the active one. A cancel names a goal, or all goals up to a time, or all goals. The
    owner ends the active goal by `end`.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        name: str,
        types: ActionTypes,
        accept: Callable[[Any], None],
        cancel: Callable[[], None],
    ) -> None:
        """Subscribe and publish under the action's `name`.

        Args: accept: begins a goal, or raises `GoalRejected`. cancel: ends the active goal, if there is one,
        because a client cancelled it."""
        self._clock, self._types, self._accept, self._cancel = clock, types, accept, cancel
        self._active: GoalID | None = None
        self._ended: list[_Ended] = []
        self._named = self._last_cancel = 0
        self._timer: Timer | None = None
        self._status = bus.advertise(f"{name}/status", GoalStatusArray, on_subscribe=self._begin_status)
        self._feedback = bus.advertise(f"{name}/feedback", types.feedback)
        self._result = bus.advertise(f"{name}/result", types.result)
        self._subscriptions = (
            bus.subscribe(f"{name}/goal", types.goal, self.take),
            bus.subscribe(f"{name}/cancel", GoalID, self._take_cancel),
        )

    def close(self) -> None:
        """Accept no more goals. The owner ends the active one before."""
        for topic in (self._status, self._feedback, self._result, *self._subscriptions):
            topic.close()
        if self._timer is not None:
            self._timer.cancel()

    @property
    def is_active(self) -> bool:
        """Whether there is a goal that has not ended."""
        return self._active is not None

    def take(self, message: Any) -> None:  # noqa: ANN401 - of the action's type
        """Process a goal message. A goal without an ID gets one. A goal that is known is ignored."""
        goal_id: GoalID = message.goal_id
        if not goal_id.id:
            self._named += 1
            goal_id = GoalID(goal_id.stamp, f"goal-{self._named}-{self._clock.nanoseconds}")
        if goal_id.id in self._known():
            return
        stamp = goal_id.stamp.nanoseconds
        if self._last_cancel > self._clock.nanoseconds:
            self._last_cancel = 0  # the time was reset
        if 0 < stamp <= self._last_cancel:
            self._close(goal_id, GoalStatus.RECALLED, TOO_OLD, self._types.no_result)
            return
        if self._active is not None and 0 < stamp < self._active.stamp.nanoseconds:
            self._close(goal_id, GoalStatus.RECALLED, REPLACED, self._types.no_result)
            return
        try:
            self._accept(message.goal)
        except GoalRejected as error:
            self._close(goal_id, GoalStatus.REJECTED, str(error), error.result)
            return
        self.end(GoalStatus.PREEMPTED, REPLACED)
        self._active = goal_id
        self._publish_status()

    def end(self, status: int, text: str, result: object = None) -> None:
        """End the active goal, if there is one, and publish its result."""
        if self._active is not None:
            ended, self._active = self._active, None
            self._close(ended, status, text, self._types.no_result if result is None else result)

    @property
    def has_listeners(self) -> bool:
        """Whether anything subscribes to the feedback."""
        return self._feedback.has_subscribers

    def publish_feedback(self, feedback: object) -> None:
        """Publish feedback on the active goal."""
        if self._active is not None:
            status = GoalStatus(self._active, GoalStatus.ACTIVE, ACCEPTED)
            self._feedback.publish(self._types.feedback(Header(self._clock.stamp), status, feedback))

    def _known(self) -> set[str]:
        active = {self._active.id} if self._active is not None else set()
        return active | {ended.status.goal_id.id for ended in self._ended}

    def _take_cancel(self, wanted: GoalID) -> None:
        """Cancel the goal with an ID, all goals up to a time stamp, or with neither all goals."""
        stamp = wanted.stamp.nanoseconds
        self._last_cancel = max(self._last_cancel, stamp)
        active = self._active
        is_named = active is not None and wanted.id == active.id
        is_old = active is not None and 0 < active.stamp.nanoseconds <= stamp
        if is_named or is_old or (not wanted.id and not stamp):
            self._cancel()

    def _close(self, goal_id: GoalID, status: int, text: str, result: object) -> None:
        """Publish the result of a goal that ended."""
        ended = GoalStatus(goal_id, status, text)
        self._ended = [*self._ended[1 - MOST_KEPT :], _Ended(ended, self._clock.nanoseconds)]
        self._result.publish(self._types.result(Header(self._clock.stamp), ended, result))
        self._publish_status()

    def _begin_status(self) -> None:
        """Publish the status regularly from the first subscriber on: a timer slows the simulation down."""
        if self._timer is None:
            self._timer = self._clock.every(STATUS_RATE, self._publish_status)

    def _publish_status(self) -> None:
        now = self._clock.nanoseconds
        self._ended = [ended for ended in self._ended if 0 <= now - ended.since <= KEPT]
        if not self._status.has_subscribers:
            return
        goals = [ended.status for ended in self._ended]
        if self._active is not None:
            goals.append(GoalStatus(self._active, GoalStatus.ACTIVE, ACCEPTED))
        self._status.publish(GoalStatusArray(Header(self._clock.stamp), tuple(goals)))
