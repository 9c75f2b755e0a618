"""What a policy sees and commands: expected values are calculated by hand."""

import math
import subprocess
import sys

import numpy as np
import pytest

import kbot
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
from kbot.learn.interface.robot_interface import policy_interface
from kbot.learn.interface.targets import GoalTarget, PathTarget
from kbot.navigation.controller import Observation
from kbot.navigation.lidar_view import LidarView
from kbot.navigation.path import Path

GOAL = PolicyInterface("goal", linear=(0.0, 0.4), angular=(-2.0, 2.0))
HOLONOMIC = PolicyInterface("goal", linear=(-0.4, 0.4), angular=(-2.0, 2.0), lateral=(-0.3, 0.3))


def test_goal_is_seen_from_the_base():
    at = Observation(0.0, PlanarPose(1.0, 2.0, math.pi / 2), PlanarTwist(0.1, 0.0, -0.5))
    seen = GOAL.named(GOAL.observe(at, GoalTarget(1.0, 5.0), [0.5, -0.25]))
    assert seen == pytest.approx(
        {
            "goal_distance": 3.0, "goal_cos": 1.0, "goal_sin": 0.0,
            "linear_velocity": 0.1, "angular_velocity": -0.5,
            "last_linear": 0.5, "last_angular": -0.25,
        },
        abs=1e-6,
    )  # fmt: skip
    left = GOAL.named(GOAL.observe(at, GoalTarget(-1.0, 2.0), [0.0, 0.0]))
    assert (left["goal_distance"], left["goal_cos"], left["goal_sin"]) == pytest.approx(
        (2.0, 0.0, 1.0), abs=1e-6
    )


@pytest.mark.parametrize(
    ("sectors", "view", "seen"),
    [
        ((-math.pi, math.pi), (-math.pi, math.pi), True),
        ((-math.pi, math.pi), (-3.0, 3.0), False),
        ((0.0, 6.28), (-math.pi, math.pi), True),
        ((-0.5, 0.5), (-0.49, 0.49), True),
        ((-0.5, 0.5), (-0.4, 1.0), False),
        ((-0.5, 0.5), (-1.0, 0.4), False),
        # a lidar that looks back sees from 90 to 270 degrees, or from -270 to -90 degrees
        ((-3.0, -2.0), (math.pi / 2, math.pi * 3 / 2), True),
        ((2.0, 4.0), (-math.pi * 3 / 2, -math.pi / 2), True),
        ((-2.0, -1.0), (math.pi / 2, math.pi * 3 / 2), False),
    ],
)
def test_sectors_are_seen_in_every_notation_of_angles(sectors, view, seen):
    assert (Sectors(4, *sectors).unseen(LidarView(*view, 5.0)) == "") is seen


@pytest.mark.parametrize(
    ("yaw", "roll", "start"), [(0.0, 0.0, -1.0), (math.pi / 2, 0.0, math.pi / 2 - 1.0), (0.0, math.pi, -2.0)]
)
def test_the_view_of_a_lidar_turns_with_it(yaw, roll, start):
    """Its beams are from -1 to 2 rad. Upside down, they are from -2 to 1 rad."""
    pose = Transform.from_xyz_rpy((0.1, 0.2, 0.3), (roll, 0.0, yaw)).matrix
    view = LidarView.of_beams(-1.0, 2.0, 4.0, pose)
    assert (view.start, view.end, view.reach) == pytest.approx((start, start + 3.0, 4.0))
    assert LidarView.of_beams(2.0, -1.0, 4.0, pose) == view


def test_public_names_are_imported_at_their_first_use():
    import kbot.learn

    assert {name: getattr(kbot.learn, name).__name__ for name in kbot.learn.__all__} == {
        name: name for name in kbot.learn.__all__
    }
    code = "import sys, kbot.learn; assert not any(name.startswith('kbot.learn.') for name in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_number_is_limited_to_its_bounds():
    far = Observation(0.0, PlanarPose(), PlanarTwist(9.0, 0.0, -9.0))
    vector = GOAL.observe(far, GoalTarget(300.0, 400.0), [1.0, 1.0])
    seen = GOAL.named(vector)
    assert seen["goal_distance"] == 20.0
    assert seen["goal_sin"] == pytest.approx(0.8)
    assert seen["linear_velocity"] == pytest.approx(0.6), "1.5 times the highest command"
    assert seen["angular_velocity"] == -3.0
    assert vector.dtype == np.float32
    assert (GOAL.low <= vector).all()
    assert (vector <= GOAL.high).all()


def test_action_spans_the_bounds_of_the_speeds():
    assert GOAL.speeds([-1.0, 1.0]) == (0.0, 2.0, 0.0)
    assert GOAL.speeds([0.0, 0.0]) == (0.2, 0.0, 0.0)
    assert GOAL.speeds([7.0, -7.0]) == (0.4, -2.0, 0.0), "limited"
    assert HOLONOMIC.speeds([0.5, 0.0, -1.0]) == pytest.approx((0.2, 0.0, -0.3))
    twist = HOLONOMIC.twist([0.5, 0.25, -1.0])
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == pytest.approx((0.2, -0.3, 0.5))
    assert GOAL.speeds(GOAL.no_action) == (0.0, 0.0, 0.0)
    assert HOLONOMIC.speeds(HOLONOMIC.no_action) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("action", "part"),
    [
        ("ab", "2 numbers"),
        ([0.0], "must have 2 numbers (linear, angular)"),
        ([0.0, math.nan], "finite"),
        ([[0.0, 0.0]], "shape"),
    ],
)
def test_action_that_cannot_be_commanded_is_refused(action, part):
    with pytest.raises(kbot.KbotError, match=r"action") as caught:
        GOAL.speeds(action)
    assert part in str(caught.value)


def test_holonomic_base_sees_and_commands_sideways():
    assert [field.name for field in HOLONOMIC.actions] == ["linear", "angular", "lateral"]
    at = Observation(0.0, PlanarPose(), PlanarTwist(0.1, 0.2, 0.3))
    seen = HOLONOMIC.named(HOLONOMIC.observe(at, GoalTarget(1.0, 0.0), HOLONOMIC.no_action))
    assert seen["lateral_velocity"] == pytest.approx(0.2)
    assert seen["angular_velocity"] == pytest.approx(0.3)


def test_sectors_show_the_nearest_point():
    quarters = Sectors(4, reach=5.0)
    points = np.array([(1.0, 0.5), (3.0, 0.1), (-2.0, -0.1), (9.0, -9.0)])
    # counter-clockwise from behind: right behind, right ahead, left ahead, left behind
    assert quarters.nearest(points) == pytest.approx([math.hypot(2.0, 0.1), 5.0, math.hypot(1.0, 0.5), 5.0])
    assert quarters.nearest(np.empty((0, 2))).tolist() == [5.0] * 4
    # atan2 gives pi for -0.0 below the x axis too: both ends of the turn belong to a sector
    assert quarters.nearest(np.array([(-1.0, 0.0)])).min() == 1.0
    assert quarters.nearest(np.array([(-1.0, -0.0)])).min() == 1.0


def test_sectors_ignore_points_outside_of_the_view():
    ahead = Sectors(2, -math.pi / 4, math.pi / 4, 5.0)
    points = np.array([(0.0, 1.0), (-1.0, 0.0), (2.0, 1.0), (0.0, -1.0)])
    assert ahead.nearest(points) == pytest.approx([5.0, math.hypot(2.0, 1.0)])


def test_a_policy_with_a_lidar_needs_a_scan():
    interface = PolicyInterface("goal", (0.0, 1.0), (-1.0, 1.0), lidar=Sectors(8, reach=3.0))
    assert len(interface.inputs) == len(interface.low) == 3 + 2 + 2 + 8
    with pytest.raises(kbot.KbotError, match="no scan"):
        interface.observe(Observation(0.0, PlanarPose()), GoalTarget(1.0, 0.0), [0.0, 0.0])
    seen = Observation(0.0, PlanarPose(), obstacles=np.array([(0.5, 0.0)]))
    named = interface.named(interface.observe(seen, GoalTarget(1.0, 0.0), [0.0, 0.0]))
    assert [named[f"lidar_{at}"] for at in range(8)] == [3.0] * 4 + [0.5] + [3.0] * 3


def test_path_is_seen_from_the_place_that_was_reached():
    path = PathTarget(Path.through([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 2.0)]))
    assert path.length == 3.0
    interface = PolicyInterface("path", (0.0, 1.0), (-1.0, 1.0))
    at = Observation(0.0, PlanarPose(0.4, -0.1, 0.0))
    seen = interface.named(interface.observe(at, path, [0.0, 0.0]))
    assert (path.along, path.offset) == pytest.approx((0.4, 0.1))
    assert seen["path_remaining"] == pytest.approx(2.6)
    assert (seen["path_0.2_x"], seen["path_0.2_y"]) == pytest.approx((0.2, 0.1))
    # 0.8 m ahead of 0.4 is 0.2 m after the corner
    assert (seen["path_0.8_x"], seen["path_0.8_y"]) == pytest.approx((0.6, 0.3))
    path.advance(PlanarPose(0.1, 0.0))
    assert path.along == pytest.approx(0.4), "it never moves back"
    path.advance(PlanarPose(1.0, 2.0))
    assert path.along <= 0.9, "nor jumps to a later part that comes close"


@pytest.mark.parametrize(
    "interface", [GOAL, HOLONOMIC, PolicyInterface("path", (-1.0, 1.0), (-1.0, 1.0), None, Sectors(5))]
)
def test_text_of_an_interface_reads_back(interface):
    assert PolicyInterface.from_json(interface.to_json()) == interface


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[1]",
        '{"format": 1}',
        GOAL.to_json().replace("[0.0, 0.4]", "3"),
        GOAL.to_json().replace("[0.0, 0.4]", f"[0.0, {'9' * 400}]"),
        "[" * 100_000,
    ],
    ids=["empty", "object", "list", "format alone", "a number", "a huge number", "deep"],
)
def test_other_text_is_refused(text):
    with pytest.raises(kbot.KbotError, match="policy"):
        PolicyInterface.from_json(text)


def test_later_version_is_refused():
    with pytest.raises(kbot.KbotError, match="another version"):
        PolicyInterface.from_json(GOAL.to_json().replace('"format": 1', '"format": 2'))


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: Sectors(0), "lidar sectors must be a whole number"),
        (lambda: Sectors(True), "lidar sectors must be a whole number"),
        (lambda: Sectors(4, 0.0, 7.0), "span"),
        (lambda: Sectors(4, reach=math.inf), "reach"),
        (lambda: PolicyInterface("gaol", (0.0, 1.0), (-1.0, 1.0)), "did you mean 'goal'"),
        (lambda: PolicyInterface("goal", (1.0, 1.0), (-1.0, 1.0)), "linear speed"),
        (lambda: PolicyInterface("goal", (0.0, 1.0), (-1.0, math.nan)), "angular speed"),
        (lambda: PolicyInterface("goal", (0.0, 1.0), (-1.0, 1.0), rate=0.0), "rate"),
        (lambda: PolicyInterface("goal", (0.0, 1.0), (-1.0, 1.0), rate=1e-9), "rate"),
        (lambda: PathTarget(Path.through([(1.0, 1.0), (1.0, 1.0)])), "two different points"),
        (lambda: GoalTarget(math.inf, 0.0), "finite"),
    ],
)
def test_values_that_mean_nothing_are_refused(make, part):
    with pytest.raises(kbot.KbotError, match=part):
        make()


def test_target_of_another_kind_is_refused():
    with pytest.raises(kbot.KbotError, match="to a path, not to a goal"):
        PolicyInterface("path", (0.0, 1.0), (-1.0, 1.0)).observe(
            Observation(0.0, PlanarPose()), GoalTarget(1.0, 0.0), [0.0, 0.0]
        )


def test_interface_of_a_robot():
    plain = policy_interface(kbot.Simulation("kbot"), "goal")
    assert plain.lidar is None
    assert plain.lateral is None
    assert plain.linear[0] == 0.0
    with_lidar = policy_interface(kbot.Simulation(kbot.load("kbot", lidar=True)), "goal", sectors=12)
    assert with_lidar.lidar == Sectors(12, reach=5.0), "its 360 beams see all around"
    limited = policy_interface(kbot.Simulation("kbot"), "path", max_speed=(0.1, 0.5), reverse=True)
    assert (limited.linear, limited.angular) == ((-0.1, 0.1), (-0.5, 0.5))


def test_lidar_sectors_without_a_lidar_are_refused():
    with pytest.raises(kbot.KbotError, match="declares no level lidar"):
        policy_interface(kbot.Simulation("kbot"), "goal", sectors=12)


def test_inputs_need_neither_gymnasium_nor_onnxruntime():
    code = (
        "import sys; sys.modules['gymnasium'] = sys.modules['onnxruntime'] = None;"
        "import kbot.learn.interface.policy_interface, kbot.learn.interface.robot_interface"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
