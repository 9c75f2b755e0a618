"""The action move_base: goals, feedback, results, preemption and cancelling on the topics of actionlib."""

import math

import pytest

from kbot.kinematics import PlanarPose
from kbot.messages import Header
from kbot.messages import actions as msg
from kbot.messages.action_server import REPLACED, TOO_OLD
from kbot.messages.navigation import GoalID, Path
from kbot.messages.types import Time
from kbot.model.load import load_robot
from kbot.navigation import NavigationTopics, to_pose_stamped
from kbot.sim import Simulation

Status = msg.GoalStatus


class Client:
    """The topics of an actionlib client."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.navigation = NavigationTopics(simulation)
        self.results: list[msg.MoveBaseActionResult] = []
        self.feedback: list[msg.MoveBaseActionFeedback] = []
        self.status: list[msg.GoalStatusArray] = []
        subscribe = simulation.bus.subscribe
        subscribe("move_base/result", msg.MoveBaseActionResult, self.results.append)
        subscribe("move_base/feedback", msg.MoveBaseActionFeedback, self.feedback.append)
        subscribe("move_base/status", msg.GoalStatusArray, self.status.append)

    def send(self, x: float, y: float, name: str = "one", stamp: float = 0.0, frame: str = "map") -> None:
        goal = msg.MoveBaseGoal(to_pose_stamped(PlanarPose(x, y, 0.5), Header(frame_id=frame)))
        self._publish("goal", msg.MoveBaseActionGoal(goal_id=_id(name, stamp), goal=goal))

    def cancel(self, name: str = "", stamp: float = 0.0) -> None:
        self._publish("cancel", _id(name, stamp))

    def _publish(self, topic: str, message: object) -> None:
        self.simulation.bus.publish(f"move_base/{topic}", message)

    @property
    def ends(self) -> list[tuple[str, int, str]]:
        """Goal ID, status and text of each result."""
        return [(r.status.goal_id.id, r.status.status, r.status.text) for r in self.results]

    @property
    def active(self) -> list[str]:
        return [s.goal_id.id for s in self.status[-1].status_list if s.status == Status.ACTIVE]


def _id(name: str, stamp: float) -> GoalID:
    return GoalID(Time.from_nanoseconds(round(stamp * 1e9)), name)


@pytest.fixture
def client() -> Client:
    return Client(Simulation(load_robot("kbot").require(), "maze:size=3,seed=3"))


def test_goal_is_reached_with_feedback_and_the_text_of_move_base(client):
    paths = []
    client.simulation.bus.subscribe("move_base/NavfnROS/plan", Path, paths.append)
    client.send(0.6, 0.6)
    assert client.active == ["one"]
    client.simulation.run(2.0)
    assert len(client.feedback) == pytest.approx(40, abs=1)  # 20 Hz
    last = client.feedback[-1]
    assert (last.status.goal_id.id, last.status.status) == ("one", Status.ACTIVE)
    seen = last.feedback.base_position
    assert seen.header.frame_id == "odom"
    assert seen.header.stamp.seconds == pytest.approx(2.0, abs=0.05)
    odometry = client.simulation.odometry.pose
    assert (seen.pose.position.x, seen.pose.position.y) == pytest.approx((odometry.x, odometry.y), abs=0.02)
    client.simulation.run(20.0)
    assert client.ends == [("one", Status.SUCCEEDED, "Goal reached.")]
    end = paths[0].poses[-1].pose.position
    assert (end.x, end.y) == pytest.approx((0.6, 0.6))
    count = len(client.feedback)
    client.simulation.run(1.0)
    assert len(client.feedback) == count


def test_status_is_published_at_5_hz_and_forgets_a_goal_after_5_s(client):
    client.send(0.3, 0.0)
    client.simulation.run(0.1)
    client.status.clear()
    client.simulation.run(2.0)
    assert len(client.status) == pytest.approx(10, abs=1)
    client.simulation.run(4.9)
    assert not client.status[-1].status_list


def test_new_goal_preempts_the_active_one(client):
    client.send(1.2, 1.2)
    client.simulation.run(1.0)
    client.send(0.0, 0.0, "two")
    assert client.ends == [("one", Status.PREEMPTED, REPLACED)]
    assert client.active == ["two"]
    client.simulation.run(20.0)
    assert client.ends[1:] == [("two", Status.SUCCEEDED, "Goal reached.")]


def test_goal_on_the_simple_topic_preempts_and_has_an_id(client):
    client.send(1.2, 1.2)
    client.simulation.run(0.5)
    goal = to_pose_stamped(PlanarPose(0.0, 0.0, 0.0), Header(frame_id="map"))
    client.simulation.bus.publish("move_base_simple/goal", goal)
    assert client.ends == [("one", Status.PREEMPTED, REPLACED)]
    (name,) = client.active
    client.cancel(name)
    assert client.ends[1][:2] == (name, Status.PREEMPTED)


def test_goal_from_python_preempts_the_action(client):
    client.send(1.2, 1.2)
    client.simulation.run(0.5)
    client.navigation.goals.go(PlanarPose(0.0, 0.0, 0.0))
    assert client.ends == [("one", Status.PREEMPTED, REPLACED)]
    client.cancel()
    assert client.navigation.goals.status == "cancelled"


@pytest.mark.parametrize("cancel", [{"name": "one"}, {}, {"stamp": 5.0}])
def test_cancelled_goal_is_preempted_and_the_robot_stops(client, cancel):
    client.simulation.run(1.0)
    client.send(1.2, 1.2, stamp=1.0)
    client.simulation.run(2.0)
    client.cancel(**cancel)
    assert client.ends == [("one", Status.PREEMPTED, "cancelled by its sender")]
    client.simulation.run(0.5)
    assert abs(client.simulation.ground_truth.twist.x) < 1e-3


@pytest.mark.parametrize("cancel", [{"name": "two"}, {"stamp": 0.5}])
def test_cancel_of_another_goal_changes_nothing(client, cancel):
    client.simulation.run(1.0)
    client.send(0.6, 0.6, stamp=1.0)
    client.cancel(**cancel)
    client.simulation.run(20.0)
    assert client.ends == [("one", Status.SUCCEEDED, "Goal reached.")]


def test_goal_from_before_a_cancel_or_before_the_active_goal_is_recalled(client):
    client.simulation.run(2.0)
    client.cancel(stamp=1.0)
    client.send(0.6, 0.6, "late", stamp=0.9)
    assert client.ends == [("late", Status.RECALLED, TOO_OLD)]
    client.send(0.6, 0.6, "new", stamp=2.0)
    client.send(0.0, 0.0, "old", stamp=1.5)
    assert client.ends[1:] == [("old", Status.RECALLED, REPLACED)]
    assert client.active == ["new"]


def test_repeated_goal_is_ignored(client):
    for _ in range(2):
        client.send(0.6, 0.6)
    client.simulation.run(20.0)
    client.send(0.6, 0.6)
    assert len(client.ends) == 1


@pytest.mark.parametrize(
    ("goal", "status", "text"),
    [
        ((0.3, 0.0), Status.ABORTED, "the goal is inside an obstacle"),
        ((math.nan, 0.0), Status.REJECTED, "a goal needs a finite x and y"),
    ],
)
def test_impossible_goal_ends_with_its_reason(client, goal, status, text):
    client.send(*goal)
    client.simulation.run(0.1)
    ((name, ended, words),) = client.ends
    assert (name, ended) == ("one", status)
    assert words.startswith(text)


def test_goal_in_an_unknown_frame_is_rejected_and_the_active_goal_continues(client):
    client.send(0.6, 0.6)
    client.send(0.0, 0.0, "two", frame="camera_lnk")
    ((name, status, text),) = client.ends
    assert (name, status) == ("two", Status.REJECTED)
    assert "'camera_lnk', which does not exist" in text
    assert client.active == ["one"]


def test_reset_cancels_the_goal_and_later_goals_are_accepted(client):
    client.simulation.run(2.0)
    client.send(1.2, 1.2, stamp=2.0)
    client.simulation.run(0.5)
    client.cancel("two", stamp=1.9)
    client.simulation.reset()
    client.simulation.run(0.1)
    assert client.ends == [("one", Status.PREEMPTED, "the simulation was reset")]
    client.send(0.6, 0.6, "three", stamp=0.1)
    assert client.active == ["three"]


def test_closed_navigation_preempts_the_goal_and_has_no_topics(client):
    client.send(1.2, 1.2)
    client.navigation.close()
    assert client.ends == [("one", Status.PREEMPTED, "navigation was closed")]
    client.send(0.6, 0.6, "two")
    client.simulation.run(0.5)
    assert len(client.ends) == 1
