"""Robots that turn about another point than their base's origin reach their goals exactly."""

import json
import math

import numpy as np
import pytest

from kbot.cli.main import main
from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import arc
from kbot.navigation.controller import Observation, twist
from kbot.navigation.followers.go_to_pose import GoToPose
from kbot.navigation.goal_status import GoalState
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.with_map.navigator import Navigator
from kbot.navigation.with_map.turning_centre import TurningCentre
from kbot.sim.report import heading
from kbot.world.occupancy import OccupancyGrid

STEP = 0.02


def _moved(pose, wanted, centre):
    """The pose of an ideal robot whose point `centre` moves with the twist."""
    at_centre = pose @ PlanarPose(*centre) @ arc(wanted.linear.x * STEP, wanted.angular.z * STEP)
    return at_centre @ PlanarPose(-centre[0], -centre[1])


def _go(goal, centre, seconds=120.0, acceleration=math.inf):
    """The final status of a goal, and the pose and the time then.

    `acceleration` (m/s^2) limits driving only: a robot with weak motors turns at once and rolls on meanwhile.
    """
    grid = OccupancyGrid(np.zeros((160, 160), np.int8), 0.05, PlanarPose(-4.0, -4.0))
    navigator, pose, last = Navigator(GridPlanner(grid, 0.2)), PlanarPose(), PlanarTwist()
    status = navigator.go(PlanarPose(*goal))
    for tick in range(int(seconds / STEP)):
        wanted = navigator.update(Observation(tick * STEP, pose, last))
        status = navigator.status
        if status.state.is_end:
            break
        change = acceleration * STEP
        speed = min(max(wanted.linear.x, last.x - change), last.x + change)
        pose = _moved(pose, twist(speed, wanted.angular.z), centre)
        last = PlanarTwist(speed, 0.0, wanted.angular.z)
    return status, pose, tick * STEP


@pytest.mark.parametrize("centre", [(0.07, 0.0), (-0.1, 0.0), (0.04, -0.05)])
def test_the_turning_centre_is_learned_from_a_turn(centre):
    watched, pose = TurningCentre(), PlanarPose(1.0, 2.0, 0.4)
    assert watched.in_base == PlanarPose()
    for speed in [0.5] * 40 + [-0.8] * 10:
        wanted = twist(0.0, speed)
        watched.watch(Observation(0.0, pose), wanted)
        pose = _moved(pose, wanted, centre)
    watched.watch(Observation(0.0, pose), twist(0.3, 0.0))
    pose = _moved(pose, twist(0.3, 0.0), centre)
    watched.watch(Observation(0.0, pose), twist(0.0, 0.0))
    assert (watched.in_base.x, watched.in_base.y) == pytest.approx(centre, abs=1e-3)


def test_the_turning_centre_is_learned_once_the_robot_no_longer_rolls():
    """The robot rolls another 2 cm at first, as if it turned about a point that is farther to its left."""
    watched, pose, speed = TurningCentre(), PlanarPose(), 0.2
    for tick in range(200):
        observation = Observation(tick * STEP, pose, PlanarTwist(speed, 0.0, 0.5))
        watched.watch(observation, twist(0.0, 0.5))
        pose = _moved(pose, twist(speed, 0.5), (0.05, 0.0))
        speed = max(0.0, speed - 0.02)
    watched.watch(Observation(200 * STEP, pose), twist(0.3, 0.0))
    assert (watched.in_base.x, watched.in_base.y) == pytest.approx((0.05, 0.0), abs=1e-6)


def test_the_turning_centre_is_not_learned_from_a_robot_that_is_placed_elsewhere():
    watched, pose = TurningCentre(), PlanarPose()
    for _ in range(100):
        watched.watch(Observation(0.0, pose), twist(0.0, 0.5))
        pose = _moved(pose, twist(0.0, 0.5), (0.0, 0.0))
    watched.interrupt()
    watched.watch(Observation(0.0, PlanarPose(5.0, 5.0, 3.0)), twist(0.0, 0.5))
    watched.watch(Observation(0.0, PlanarPose(5.0, 5.0, 3.0)), twist(0.3, 0.0))
    assert math.hypot(watched.in_base.x, watched.in_base.y) < 1e-6


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.07, 0.0), (-0.1, 0.0), (0.04, -0.03)])
@pytest.mark.parametrize("goal", [(0.0, -1.0, math.pi / 2), (1.0, 1.0, 0.0), (-1.0, 0.0, 0.0)])
def test_the_robot_reaches_the_goal_with_any_turning_centre(goal, centre):
    status, pose, _ = _go(goal, centre)
    assert status.state is GoalState.REACHED, status
    assert math.hypot(pose.x - goal[0], pose.y - goal[1]) <= 0.01
    assert abs(wrap(pose.yaw - goal[2])) <= 0.02


@pytest.mark.parametrize(("x", "y"), [(-0.02, -0.098), (-0.005, -0.098), (-0.03, 0.095), (0.0, 0.0995)])
def test_the_robot_reaches_a_near_goal_beside_it(x, y):
    """The turn moves the base, so that the goal changes from ahead to behind, and is more than 10 cm away."""
    controller, pose, last = GoToPose(PlanarPose(x, y), any_heading=True), PlanarPose(), PlanarTwist()
    for tick in range(50):
        wanted = controller.update(Observation(tick * STEP, pose, last))
        pose = _moved(pose, wanted, (-0.12, 0.0))
        last = PlanarTwist(wanted.linear.x, 0.0, wanted.angular.z)
    assert controller.is_done


@pytest.mark.parametrize(
    "goal", [(0.0, -1.0, math.pi / 2), (1.0, 1.0, 0.0), (0.1, 0.1, 1.0), (2.0, 0.5, 3.0)]
)
def test_a_robot_that_brakes_too_late_reaches_the_goal_after_a_correction(goal):
    status, pose, seconds = _go(goal, (0.0, 0.0), acceleration=0.2)
    assert status.state is GoalState.REACHED, status
    assert math.hypot(pose.x - goal[0], pose.y - goal[1]) <= 0.01
    # at full speed, six half turns, and a correction of some centimetres
    assert seconds < math.hypot(goal[0], goal[1]) / 0.3 + 6 * math.pi / 2.0 + 3.0


def test_a_robot_with_skidding_wheels_is_at_the_goal_that_it_reports_as_reached(tmp_path, capsys):
    """Four wheels around a point 0.1 m ahead of the base's origin: a turn moves the origin by 0.1 m per
    radian."""
    inertia = '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/>'
    wheels = "".join(
        f'<link name="{name}"><inertial><mass value="0.5"/>{inertia}</inertial><collision>'
        f'<origin rpy="{math.pi / 2} 0 0"/><geometry><cylinder radius="0.08" length="0.05"/></geometry>'
        f'</collision></link><joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
        f'<child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
        for name, x, y in (
            ("front_left", 0.25, 0.18), ("front_right", 0.25, -0.18),
            ("rear_left", -0.05, 0.18), ("rear_right", -0.05, -0.18),
        )
    )  # fmt: skip
    file = tmp_path / "skid.urdf"
    file.write_text(
        '<robot name="skid"><link name="base_link"><inertial><origin xyz="0.11 0 0.05"/><mass value="6"/>'
        '<inertia ixx="0.1" iyy="0.15" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f"{wheels}</robot>"
    )
    with pytest.raises(SystemExit) as ended:
        main(["sim", str(file), "--headless", "--goto", "0,-1,1.57", "--json"])
    assert (ended.value.code or 0) == 0
    report = json.loads(capsys.readouterr().out)
    pose, navigation = report["pose"], report["navigation"]
    assert navigation["off_m"] == pytest.approx(math.hypot(pose["x"], pose["y"] + 1.0))
    assert navigation["off_m"] < 0.01
    assert navigation["off_rad"] == pytest.approx(abs(wrap(pose["yaw"] - 1.57)))
    assert navigation["off_rad"] < 0.02


@pytest.mark.parametrize(
    ("degrees", "read"),
    [(-269.097, 90.903), (180.0, 180.0), (-180.0, 180.0), (-179.99999, 180.0), (725.0, 5.0)],
)
def test_a_heading_is_reported_within_half_a_turn(degrees, read):
    assert heading(math.radians(degrees), 3) == read
