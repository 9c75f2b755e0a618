"""Policies: reading, writing, and the controller that drives with them."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
from kbot.learn.policies.network import read_network, with_metadata
from kbot.learn.policies.policy import INTERFACE_KEY, Policy, PolicyController, policy_of, save_policy
from kbot.navigation import Observation, ObstacleGuard, Outline, Pilot
from kbot.navigation.lidar_view import LidarView
from kbot.text import KbotError

from .networks import linear, towards_goal

BLIND = PolicyInterface("goal", linear=(0.0, 0.4), angular=(-2.0, 2.0))
"""Sees the goal (3 numbers), the measured speeds (2) and its last action (2)."""
HOME = PlanarPose()
SEEING = replace(BLIND, lidar=Sectors(4, reach=3.0))


@pytest.fixture
def blind(tmp_path: Path) -> Policy:
    return save_policy(towards_goal(BLIND), BLIND, tmp_path / "policy.onnx")


def at(time: float, pose: PlanarPose = HOME, **others: object) -> Observation:
    return Observation(time, pose, **others)


def test_a_policy_is_read_as_it_was_written(tmp_path: Path, blind: Policy) -> None:
    again = Policy.read(tmp_path / "policy.onnx")
    assert again == blind
    assert again.interface == BLIND


def test_a_policy_without_a_description_needs_an_interface(tmp_path: Path) -> None:
    (tmp_path / "bare.onnx").write_bytes(towards_goal(BLIND))
    policy = Policy.read(str(tmp_path / "bare.onnx"))
    assert policy.interface is None
    with pytest.raises(KbotError, match="does not describe its inputs"):
        PolicyController(policy, PlanarPose(1.0, 0.0))
    assert policy.with_interface(BLIND).interface == BLIND


def test_another_shape_is_one_error(tmp_path: Path) -> None:
    file = tmp_path / "policy.onnx"
    with pytest.raises(
        KbotError, match=r"input has 7 numbers instead of 11 \(goal_distance, goal_cos, goal_sin"
    ):
        save_policy(towards_goal(BLIND), SEEING, file)
    assert not file.exists()
    with pytest.raises(KbotError, match=r"output has 3 numbers instead of 2 \(linear, angular\)"):
        save_policy(linear(np.zeros((3, 7)), np.zeros(3)), BLIND, file)
    file.write_bytes(with_metadata(towards_goal(BLIND), {INTERFACE_KEY: SEEING.to_json()}))
    with pytest.raises(KbotError, match=f"^policy {file}: the network's input has 7 numbers instead of 11"):
        Policy.read(file)


LONG = "x" * 10_000


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "{}",
        '{"format": 99}',
        json.dumps({"format": 1, "target": "moon"}),
        json.dumps({"format": LONG}),
        *(
            json.dumps(json.loads(SEEING.to_json()) | {key: LONG})
            for key in ("target", "linear", "lateral", "lidar", "rate")
        ),
        json.dumps(json.loads(SEEING.to_json()) | {"linear": [LONG, LONG]}),
        json.dumps(json.loads(SEEING.to_json()) | {"lidar": {LONG: 1}}),
        json.dumps(json.loads(SEEING.to_json()) | {"lidar": {"count": LONG}}),
        json.dumps(json.loads(SEEING.to_json()) | {"lidar": {"count": 1, "start": LONG}}),
        json.dumps(json.loads(SEEING.to_json()) | {"lidar": {"count": 1, "reach": LONG}}),
        json.dumps(json.loads(SEEING.to_json()) | {"lidar": {"count": int("9" * 4000)}}),
        SEEING.to_json().replace("3.0", "9" * 4000),
    ],
)
def test_a_wrong_description_is_one_error(tmp_path: Path, text: str) -> None:
    file = tmp_path / "policy.onnx"
    file.write_bytes(with_metadata(towards_goal(BLIND), {INTERFACE_KEY: text}))
    with pytest.raises(KbotError, match=f"^policy {file}: ") as caught:
        Policy.read(file)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + len(str(file))


def test_a_file_that_cannot_be_read_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"nothing\.onnx cannot be read: No such file or directory$"):
        Policy.read(tmp_path / "nothing.onnx")
    with pytest.raises(KbotError, match="cannot be read: "):
        Policy.read(tmp_path)
    large = tmp_path / "large.onnx"
    with large.open("wb") as stream:
        stream.truncate(33 * 1024 * 1024)
    with pytest.raises(KbotError, match=r"cannot be read: it is larger than 33554432 bytes$"):
        Policy.read(large)
    (tmp_path / "text.onnx").write_text("a policy\n")
    with pytest.raises(KbotError, match=r"is not an ONNX file$"):
        Policy.read(tmp_path / "text.onnx")


def test_the_command_is_that_of_the_network(blind: Policy) -> None:
    """A goal at 30 degrees to the left: sin = 0.5, times 2 is 1, the fastest turn of 2 rad/s. The number 0 is
    half of the highest speed."""
    controller = PolicyController(blind, PlanarPose(2.0 * math.cos(math.pi / 6), 1.0))
    command = controller.update(at(0.0))
    assert (command.linear.x, command.angular.z) == pytest.approx((0.2, 2.0), abs=1e-6)
    assert controller.status == "driving"


def test_the_policy_computes_at_its_own_rate() -> None:
    """The network returns its last action plus 0.25, so each computation is visible."""
    weights = np.zeros((2, 7))
    weights[0, 5] = 1.0  # last_linear
    policy = policy_of(
        with_metadata(linear(weights, np.array([0.25, 0.0])), {INTERFACE_KEY: BLIND.to_json()})
    )
    controller = PolicyController(policy, PlanarPose(9.0, 0.0))
    speeds = [controller.update(at(tick / 20.0)).linear.x for tick in range(8)]
    # from -1, the number of no motion, by 0.25 for every second tick: a quarter of 0.2 m/s
    assert speeds == pytest.approx([0.05, 0.05, 0.1, 0.1, 0.15, 0.15, 0.2, 0.2])


def test_it_stops_within_the_arrival_radius(blind: Policy) -> None:
    """At 0.24 m, because odometry may be wrong by a fifth of the radius."""
    controller = PolicyController(blind, PlanarPose(1.0, 0.0), arrive=0.3)
    assert controller.update(at(0.0)).linear.x > 0.0
    assert controller.update(at(0.1, PlanarPose(0.75, 0.0))).linear.x > 0.0
    command = controller.update(at(0.2, PlanarPose(0.77, 0.0)))
    assert (command.linear.x, command.angular.z) == (0.0, 0.0)
    assert controller.is_done
    assert controller.status == "reached"
    assert controller.update(at(0.3, PlanarPose(0.0, 0.0))).linear.x == 0.0


@pytest.mark.parametrize(
    ("bias", "message"),
    [
        (math.nan, r"output 'angular' is not finite: nan"),
        (math.inf, r"output 'angular' is not finite: inf"),
        (1.5, r"output 'angular' is out of range: 1\.5 instead of a number from -1 to 1"),
        (-1.01, r"output 'angular' is out of range: -1\.01"),
    ],
)
def test_an_invalid_output_stops_the_robot(bias: float, message: str) -> None:
    network = linear(np.zeros((2, 7)), np.array([0.0, bias]), clipped=False)
    controller = PolicyController(Policy(read_network(network)).with_interface(BLIND), PlanarPose(1.0, 0.0))
    command = controller.update(at(0.0))
    assert (command.linear.x, command.angular.z) == (0.0, 0.0)
    assert controller.status == "stuck"
    assert re.search(message, controller.status.reason)
    assert controller.update(at(0.1)).linear.x == 0.0


def test_rounding_beyond_one_is_limited() -> None:
    network = linear(np.zeros((2, 7)), np.array([1.0001, 0.0]), clipped=False)
    controller = PolicyController(Policy(read_network(network)).with_interface(BLIND), PlanarPose(1.0, 0.0))
    assert controller.update(at(0.0)).linear.x == 0.4


def test_it_gives_up_at_the_time_limit(blind: Policy) -> None:
    controller = PolicyController(blind, PlanarPose(1.0, 0.0), timeout=5.0)
    controller.update(at(3.0))
    assert controller.update(at(7.9)).linear.x > 0.0
    assert controller.update(at(8.1)).linear.x == 0.0
    assert str(controller.status) == "stuck: out of time: not at the goal after 5.1 s, 1.00 m left"
    # 1 m at 0.4 m/s takes 2.5 s; 8 times that and 60 s are 80 s
    controller = PolicyController(blind, PlanarPose(1.0, 0.0))
    controller.update(at(0.0))
    assert controller.update(at(79.9)).linear.x > 0.0
    assert controller.update(at(80.1)).linear.x == 0.0


def test_time_that_jumps_back_cancels_the_goal(blind: Policy) -> None:
    """A simulation was reset, so the robot is elsewhere."""
    controller = PolicyController(blind, PlanarPose(9.0, 0.0))
    assert controller.update(at(60.0)).linear.x > 0.0
    assert controller.update(at(0.05)).linear.x == 0.0
    assert str(controller.status) == "cancelled: the simulation was reset"


def test_it_stands_still_while_the_lidar_is_silent() -> None:
    policy = Policy(read_network(towards_goal(SEEING))).with_interface(SEEING)
    controller = PolicyController(policy, PlanarPose(1.0, 0.0))
    wall = np.array([[2.0, 0.0]])
    assert controller.update(at(0.0)).linear.x == 0.0  # there was no scan yet
    assert controller.update(at(0.1, obstacles=wall, obstacles_age=0.05)).linear.x > 0.0
    assert controller.update(at(0.7, obstacles=wall, obstacles_age=0.65)).linear.x == 0.0
    assert controller.status == "driving"
    assert controller.update(at(0.8, obstacles=wall, obstacles_age=0.05)).linear.x > 0.0
    assert controller.update(at(2.7, obstacles=wall, obstacles_age=1.95)).linear.x == 0.0
    assert controller.status == "driving"
    assert controller.update(at(2.9, obstacles=wall, obstacles_age=2.15)).linear.x == 0.0
    assert str(controller.status) == "stuck: the lidar has been silent for 2.1 s"


def test_a_slow_lidar_may_be_silent_for_longer() -> None:
    """A scan each 2.5 s: the robot stops after 6.25 s, and gives up after 25 s."""
    policy = Policy(read_network(towards_goal(SEEING))).with_interface(SEEING)
    controller = PolicyController(policy, PlanarPose(9.0, 0.0), silence=6.25)
    wall = np.array([[2.0, 0.0]])
    assert controller.update(at(0.0, obstacles=wall, obstacles_age=0.0)).linear.x > 0.0
    assert controller.update(at(6.2, obstacles=wall, obstacles_age=6.2)).linear.x > 0.0
    assert controller.update(at(24.9, obstacles=wall, obstacles_age=24.9)).linear.x == 0.0
    assert controller.status == "driving"
    assert controller.update(at(25.1, obstacles=wall, obstacles_age=25.1)).linear.x == 0.0
    assert str(controller.status) == "stuck: the lidar has been silent for 25.1 s"


@pytest.mark.parametrize(
    ("view", "message"),
    [
        (LidarView(-3 / 4 * math.pi, 3 / 4 * math.pi, 3.0), "but the lidar only from -135 to 135 degrees"),
        (LidarView(-math.pi, math.pi, 2.0), "obstacles up to 3 m, but the lidar only up to 2 m"),
        (LidarView(math.nan, math.nan, 3.0), "but the lidar only from nan to nan degrees"),
    ],
)
def test_a_lidar_that_sees_less_than_the_policy_ends_the_goal(view: LidarView, message: str) -> None:
    policy = Policy(read_network(towards_goal(SEEING))).with_interface(SEEING)
    controller = PolicyController(policy, PlanarPose(1.0, 0.0))
    wall = np.array([[2.0, 0.0]])
    full = LidarView(-math.pi, math.pi, 3.0)
    assert controller.update(at(0.0, obstacles=wall, obstacles_age=0.0, view=full)).linear.x > 0.0
    assert controller.update(at(0.1, obstacles=wall, obstacles_age=0.0, view=view)).linear.x == 0.0
    assert controller.status == "refused"
    assert message in controller.status.reason


def test_a_pilot_that_is_too_slow_for_the_policy_is_refused(blind: Policy) -> None:
    fast = Policy(blind.network, replace(BLIND, rate=60.0))
    controller = ObstacleGuard(PolicyController(fast, PlanarPose(1.0, 0.0)), Outline(np.eye(3, 2)))
    with pytest.raises(KbotError, match=r"updated 60 times per second, but the pilot's rate is 50 Hz"):
        Pilot(kbot.Simulation("kbot"), controller)
    Pilot(kbot.Simulation("kbot"), controller, rate=60.0)


def test_a_robot_that_fell_over_gives_up(blind: Policy) -> None:
    controller = PolicyController(blind, PlanarPose(1.0, 0.0))
    assert controller.update(at(0.0, fallen="the robot lies on its side")).linear.x == 0.0
    assert str(controller.status) == "stuck: the robot lies on its side"


@pytest.mark.parametrize(
    ("goal", "others", "message"),
    [
        (PlanarPose(math.nan, 0.0), {}, "finite x and y"),
        (PlanarPose(1e9, 0.0), {}, "further than"),
        (
            PlanarPose(1.0, 0.0),
            {"arrive": 0.0},
            "the arrival radius must be a finite number above 0, not 0.0",
        ),
        (PlanarPose(1.0, 0.0), {"timeout": math.inf}, "the timeout must be a finite number above 0, not inf"),
    ],
)
def test_wrong_numbers_are_one_error(
    blind: Policy, goal: PlanarPose, others: dict[str, float], message: str
) -> None:
    with pytest.raises(KbotError, match=message):
        PolicyController(blind, goal, **others)


def test_a_policy_that_follows_paths_drives_to_no_goal() -> None:
    interface = replace(BLIND, target="path")
    network = linear(np.zeros((2, len(interface.inputs))), np.zeros(2))
    with pytest.raises(KbotError, match="the policy follows a path, and cannot drive to a goal"):
        PolicyController(Policy(read_network(network)).with_interface(interface), PlanarPose(1.0, 0.0))


def test_the_measured_speed_reaches_the_network() -> None:
    weights = np.zeros((2, 7))
    weights[0, 3], weights[1, 4] = 1.0, 1.0  # linear_velocity, angular_velocity
    policy = Policy(read_network(linear(weights, np.zeros(2)))).with_interface(BLIND)
    command = PolicyController(policy, PlanarPose(1.0, 0.0)).update(
        at(0.0, twist=PlanarTwist(0.5, 0.0, -0.25))
    )
    # 0.5 is three quarters of the way from 0 to 0.4 m/s, and -0.25 of 2 rad/s is -0.5 rad/s
    assert (command.linear.x, command.angular.z) == pytest.approx((0.3, -0.5), abs=1e-6)
