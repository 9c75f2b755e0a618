"""ROS 1's action follow_joint_trajectory on its topics: goals, feedback, results and rejections."""

import math

import pytest

from kbot.messages import actions as msg
from kbot.messages.action_server import MOST_KEPT
from kbot.messages.control import Duration, JointTrajectory, JointTrajectoryPoint
from kbot.messages.navigation import GoalID
from kbot.messages.types import Header, Time
from kbot.model.spawned import Setting, SpawnedController, with_controllers
from kbot.sim import Simulation
from kbot.text import KbotError

from .test_spawned import MANAGER, arm, transmission

TYPE = "position_controllers/JointTrajectoryController"
Result, Status = msg.FollowJointTrajectoryResult, msg.GoalStatus


class Client:
    """The topics of an actionlib client."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.results: list[msg.FollowJointTrajectoryActionResult] = []
        self.feedback: list[msg.FollowJointTrajectoryActionFeedback] = []
        self.status: list[msg.GoalStatusArray] = []
        stem = "/arm/follow/follow_joint_trajectory"
        hear = simulation.bus.subscribe
        hear(f"{stem}/result", msg.FollowJointTrajectoryActionResult, self.results.append)
        hear(f"{stem}/feedback", msg.FollowJointTrajectoryActionFeedback, self.feedback.append)
        hear(f"{stem}/status", msg.GoalStatusArray, self.status.append)
        self._stem = stem

    def send(self, goal: msg.FollowJointTrajectoryGoal, name: str = "one", stamp: int = 0) -> None:
        goal_id = GoalID(Time.from_nanoseconds(stamp), name)
        message = msg.FollowJointTrajectoryActionGoal(goal_id=goal_id, goal=goal)
        self.simulation.bus.publish(f"{self._stem}/goal", message)

    def cancel(self, name: str = "", stamp: int = 0) -> None:
        self.simulation.bus.publish(f"{self._stem}/cancel", GoalID(Time.from_nanoseconds(stamp), name))

    @property
    def ends(self) -> list[tuple[str, int, int]]:
        """Goal ID, status and code of each result."""
        return [(r.status.goal_id.id, r.status.status, r.result.error_code) for r in self.results]


@pytest.fixture
def client(urdf) -> Client:
    return made(urdf)


def made(urdf, active: bool = True, **constraints: object) -> Client:
    robot = urdf(arm(MANAGER + transmission("shoulder", "Position") + transmission("elbow", "Position")))
    values: dict[str, object] = {"type": TYPE, "joints": ["shoulder", "elbow"]}
    values |= {name.replace("__", "."): value for name, value in constraints.items()}
    settings = {name: Setting(value, robot.origin) for name, value in values.items()}
    spawned = SpawnedController("/arm/follow", settings, active, 1, robot.origin)
    return Client(Simulation(with_controllers(robot, [spawned])))


def point(seconds: float, *positions: float) -> JointTrajectoryPoint:
    still = (0.0,) * len(positions)
    return JointTrajectoryPoint(positions, still, time_from_start=Duration.from_seconds(seconds))


def goal(
    *points: JointTrajectoryPoint, joints=("shoulder", "elbow"), **more
) -> msg.FollowJointTrajectoryGoal:
    stamp = Time.from_nanoseconds(more.pop("stamp", 0))
    return msg.FollowJointTrajectoryGoal(JointTrajectory(Header(stamp), joints, points), **more)


def test_goal_is_followed_with_feedback_and_reached(client):
    sim = client.simulation
    client.send(goal(point(1.0, 0.4, -0.3)))
    assert [s.status for s in client.status[-1].status_list] == [Status.ACTIVE]
    sim.run(0.5)
    middle = client.feedback[-1].feedback
    # a cubic from rest to rest is half way at half time, at 1.5 times the mean speed
    assert middle.desired.positions == pytest.approx((0.2, -0.15), abs=1e-6)
    assert middle.desired.velocities == pytest.approx((0.6, -0.45), abs=1e-6)
    assert middle.actual.positions == pytest.approx((0.2, -0.15), abs=5e-3)
    assert middle.error.positions == pytest.approx(
        [d - a for d, a in zip(middle.desired.positions, middle.actual.positions, strict=True)]
    )
    assert not client.results
    sim.run(0.8)
    assert client.ends == [("one", Status.SUCCEEDED, Result.SUCCESSFUL)]
    assert len(client.feedback) == pytest.approx(20, abs=1)
    assert list(sim.joint_positions.values()) == pytest.approx((0.4, -0.3), abs=2e-3)


@pytest.mark.parametrize("seconds", [0.5, 2.0, 10.0])
def test_goal_of_positions_alone_is_reached_although_it_ends_at_full_speed(client, seconds):
    """At the end the joints must be at rest (`stopped_velocity_tolerance`).

    Gazebo stops its joints at once. Here they are at rest after their servos have stopped them.
    """
    sim = client.simulation
    for n, places in enumerate(((1.0, 1.5), (0.0, 0.0))):
        way = JointTrajectoryPoint(places, time_from_start=Duration.from_seconds(seconds))
        client.send(goal(way), f"goal{n}")
        sim.run(seconds + 0.5)
        assert client.ends[n] == (f"goal{n}", Status.SUCCEEDED, Result.SUCCESSFUL)
        assert list(sim.joint_positions.values()) == pytest.approx(places, abs=2e-3)
        assert list(sim.robots.first.body.joint_velocities.values()) == pytest.approx((0.0, 0.0), abs=0.01)


def test_failed_goals_are_reported(urdf):
    client = made(urdf)
    reports: list[str] = []
    client.simulation.journal.listeners.append(reports.append)
    client.send(goal(point(1.0, 0.1), joints=("shoulder",)), "bad")
    tolerance = (msg.JointTolerance("shoulder", 0.01),)
    client.send(goal(point(1.0, 0.4, 0.0), goal_tolerance=tolerance))
    client.simulation.disturbances.apply_body_wrench("upper", (0.0, 0.0, -5000.0), 5.0)
    client.simulation.run(2.0)
    refused, aborted = reports
    assert refused.startswith("/arm/follow: goal rejected: the trajectory lacks 'elbow'")
    assert aborted.startswith("/arm/follow: goal aborted: the position of 'shoulder' is off by")


def test_partial_trajectory_is_accepted_if_the_controller_allows_it(urdf):
    """With `allow_partial_joints_goal`, action and topic accept it. Else they reject it."""
    some = goal(point(0.5, 0.4), joints=("shoulder",))
    strict, partial = made(urdf), made(urdf, allow_partial_joints_goal=True)
    for client in (strict, partial):
        client.send(some)
        client.simulation.run(1.0)
    assert strict.ends == [("one", Status.REJECTED, Result.INVALID_JOINTS)]
    assert partial.ends == [("one", Status.SUCCEEDED, Result.SUCCESSFUL)]
    back = goal(point(0.5, 0.1), joints=("elbow",)).trajectory
    with pytest.raises(KbotError, match=r"lacks 'shoulder'.*allow_partial_joints_goal"):
        strict.simulation.bus.publish("/arm/follow/command", back)
    partial.simulation.bus.publish("/arm/follow/command", back)
    partial.simulation.run(1.0)
    assert partial.simulation.joint_positions == pytest.approx({"shoulder": 0.4, "elbow": 0.1}, abs=2e-3)
    assert strict.simulation.joint_positions == pytest.approx({"shoulder": 0.0, "elbow": 0.0}, abs=2e-3)


def test_goal_can_name_joints_in_another_order(client):
    client.send(goal(point(0.5, -0.3, 0.4), joints=("elbow", "shoulder")))
    client.simulation.run(1.0)
    assert client.simulation.joint_positions == pytest.approx({"shoulder": 0.4, "elbow": -0.3}, abs=2e-3)


@pytest.mark.parametrize(
    ("wanted", "code", "words"),
    [
        (goal(point(1.0, 0.1, 0.1), joints=("shoulder", "elbw")), Result.INVALID_JOINTS, "elbow"),
        (goal(point(1.0, 0.1), joints=("shoulder",)), Result.INVALID_JOINTS, "lacks 'elbow'"),
        (goal(point(1.0, 0.1), joints=()), Result.INVALID_JOINTS, "lacks"),
        (
            goal(point(1.0, 0.1, 0.2, 0.3), joints=("shoulder", "elbow", "elbow")),
            Result.INVALID_JOINTS,
            "twice",
        ),
        (goal(point(1.0, math.nan, 0.0)), Result.INVALID_GOAL, "finite"),
        (goal(point(1.0, math.inf, 0.0)), Result.INVALID_GOAL, "finite"),
        (goal(point(1.0, 0.1)), Result.INVALID_GOAL, "2 numbers"),
        (goal(point(1.0, 0.1, 0.1), point(1.0, 0.2, 0.2)), Result.INVALID_GOAL, "must increase"),
        (goal(point(-1.0, 0.1, 0.1)), Result.INVALID_GOAL, "at least 0 seconds"),
        (goal(point(1.0, 0.1, 0.1), stamp=1_000_000), Result.OLD_HEADER_TIMESTAMP, "ended before now"),
        (
            goal(point(1.0, 0.1, 0.1), path_tolerance=(msg.JointTolerance("elbow", math.nan),)),
            Result.INVALID_GOAL,
            "tolerances of 'elbow'",
        ),
    ],
)
def test_invalid_goal_is_rejected_and_the_active_goal_continues(client, wanted, code, words):
    client.simulation.run(2.0)
    client.send(goal(point(1.0, 0.4, -0.3)), "first")
    client.simulation.run(0.1)
    client.send(wanted, "bad")
    assert client.ends == [("bad", Status.REJECTED, code)]
    assert words in client.results[0].result.error_string
    client.simulation.run(1.4)
    assert client.ends[1:] == [("first", Status.SUCCEEDED, Result.SUCCESSFUL)]


def test_newer_goal_replaces_the_active_one(client):
    client.send(goal(point(2.0, 1.0, 1.0)), "old")
    client.simulation.run(0.3)
    client.send(goal(point(0.5, 0.0, 0.0)), "new")
    client.simulation.run(1.0)
    assert client.ends == [("old", Status.PREEMPTED, 0), ("new", Status.SUCCEEDED, 0)]
    assert client.simulation.joint_positions["shoulder"] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(
    ("name", "stamp", "ends"), [("", 0, 1), ("one", 0, 1), ("other", 0, 0), ("", 8, 1), ("", 3, 0)]
)
def test_cancel_ends_one_goal_all_goals_or_earlier_goals(client, name, stamp, ends):
    client.send(goal(point(1.0, 1.0, 1.0)), stamp=5)
    client.simulation.run(0.5)
    client.cancel(name, stamp)
    assert len(client.results) == ends
    client.simulation.run(1.0)
    reached = client.simulation.joint_positions["shoulder"]
    assert reached == pytest.approx(0.5 if ends else 1.0, abs=0.03)
    assert client.results[-1].status.status == (Status.PREEMPTED if ends else Status.SUCCEEDED)


def test_other_commands_and_a_reset_end_the_goal(client):
    client.send(goal(point(1.0, 1.0, 1.0)))
    client.simulation.run(0.3)
    client.simulation.robots.first.set_joint("elbow", 0.0)
    client.simulation.run(0.1)
    client.send(goal(point(1.0, 1.0, 1.0)), "two")
    client.simulation.run(0.3)
    client.simulation.reset()
    client.simulation.run(0.1)
    assert client.ends == [("one", Status.PREEMPTED, 0), ("two", Status.PREEMPTED, 0)]
    assert client.simulation.joint_positions["shoulder"] == pytest.approx(0.0, abs=2e-3)


def test_goal_is_aborted_with_the_code_of_the_violated_tolerance(urdf):
    """A torque of 1 kN m turns bars of 0.5 m and 1 kg away at once."""
    path = made(urdf, constraints__shoulder__trajectory=0.05)
    path.send(goal(point(1.0, 0.4, 0.0)))
    path.simulation.disturbances.apply_body_wrench("upper", (0.0, 0.0, -5000.0), 2.0)
    path.simulation.run(1.0)
    assert path.ends == [("one", Status.ABORTED, Result.PATH_TOLERANCE_VIOLATED)]
    assert "'shoulder' is off by" in path.results[0].result.error_string
    end = made(urdf)
    tolerance = (msg.JointTolerance("shoulder", 0.01),)
    end.send(
        goal(point(1.0, 0.4, 0.0), goal_tolerance=tolerance, goal_time_tolerance=Duration(0, 500_000_000))
    )
    end.simulation.disturbances.apply_body_wrench("upper", (0.0, 0.0, -5000.0), 5.0)
    end.simulation.run(1.4)
    assert not end.ends
    end.simulation.run(0.2)
    assert end.ends == [("one", Status.ABORTED, Result.GOAL_TOLERANCE_VIOLATED)]


def test_controller_that_was_not_started_rejects_goals(urdf):
    client = made(urdf, active=False)
    client.send(goal(point(1.0, 0.4, 0.0)))
    assert client.ends == [("one", Status.REJECTED, Result.INVALID_GOAL)]
    assert "not started" in client.results[0].result.error_string


def test_status_is_published_without_goals_and_drops_goals_after_five_seconds(client):
    client.simulation.run(1.0)
    assert len(client.status) == 5  # actionlib's 5 Hz, from which a client knows that there is a server
    for n in range(MOST_KEPT + 20):
        client.send(goal(point(1.0, math.nan, 0.0)), f"goal{n}")
    statuses = client.status[-1].status_list
    assert len(statuses) == MOST_KEPT
    assert statuses[-1].goal_id.id == f"goal{MOST_KEPT + 19}"
    client.simulation.run(5.5)
    assert client.status[-1].status_list == ()


def test_goals_without_ids_get_distinct_ids(client):
    client.send(goal(point(0.2, 0.1, 0.0)), "")
    client.simulation.run(0.6)
    client.send(goal(point(0.2, 0.0, 0.0)), "")
    client.simulation.run(0.6)
    assert [status for _, status, _ in client.ends] == [Status.SUCCEEDED] * 2
    assert len({name for name, _, _ in client.ends}) == 2


def test_goal_sent_twice_is_accepted_once(client):
    client.send(goal(point(0.2, 0.1, 0.0)))
    client.send(goal(point(0.2, 0.1, 0.0)))
    client.simulation.run(0.6)
    client.send(goal(point(0.2, 0.1, 0.0)))
    client.simulation.run(0.6)
    assert client.ends == [("one", Status.SUCCEEDED, 0)]


def test_effect_of_a_goal_is_in_the_journal(client):
    reported: list[str] = []
    client.simulation.journal.write = lambda what, numbers: reported.append(what)
    client.send(goal(point(1.0, 0.1, 0.0)))
    client.cancel()
    client.send(goal(point(1.0, math.nan, 0.0)), "bad")
    assert reported == ["follow_trajectory", "follow_trajectory"]


def test_goal_with_a_future_stamp_waits(client):
    client.send(goal(point(0.5, 0.4, 0.0), stamp=1_000_000_000))
    client.simulation.run(1.4)
    assert not client.ends
    client.simulation.run(0.4)
    assert client.ends == [("one", Status.SUCCEEDED, 0)]
