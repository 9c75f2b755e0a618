"""Faults while a robot drives without a map: it stops safely or drives on, and reports why."""

import math
from dataclasses import replace

import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.model.load import load_robot, resolve_robot_path
from kbot.navigation.goal_status import GoalState
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.without_map.local_pilot import LocalPilot, local_navigator
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.sim.injected_faults import Kick, SilentTopic, Slip
from kbot.world.builders import box, floor, wall
from kbot.world.world import World
from kbot.xacro import expand

IMU = """<gazebo reference="base_link"><sensor name="imu" type="imu">
<always_on>1</always_on><update_rate>100</update_rate><topic>imu</topic></sensor></gazebo></robot>"""


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot", {"lidar": "true"}).require()


@pytest.fixture(scope="module")
def robot_with_imu(tmp_path_factory):
    file = tmp_path_factory.mktemp("imu") / "robot.urdf"
    text = expand(resolve_robot_path("kbot"), {"lidar": "true"}).text
    file.write_text(text.replace("</robot>", IMU))
    return load_robot(file).require()


def _hall():
    """A hall of 8 m x 4 m with furniture, so that scans show motions in all directions."""
    return World(
        "hall",
        (
            floor(),
            wall("left", (-1.0, 2.0), (7.0, 2.0)),
            wall("right", (-1.0, -2.0), (7.0, -2.0)),
            wall("back", (-1.0, -2.0), (-1.0, 2.0)),
            wall("front", (7.0, -2.0), (7.0, 2.0)),
            box("crate", (0.4, 0.3, 0.4), 1.5, 1.0),
            box("shelf", (0.3, 0.8, 0.4), 3.0, -1.2),
            box("case", (0.5, 0.2, 0.4), 4.5, 1.3),
        ),
    )


GOAL = PlanarPose(5.5, 0.0)


def _drive(simulation, odometry=None):
    """Drive to GOAL. Returns its status, and whether the robot touched anything."""
    navigator, lidars = local_navigator(simulation)
    navigator.go(GOAL, any_heading=True, arrive=0.2)
    pilot, collisions = LocalPilot(simulation, navigator, lidars, odometry), CollisionWatch(simulation)
    while not navigator.status.state.is_end:
        simulation.run(0.05)
    simulation.cmd_vel(0.0, 0.0)
    pilot.close()
    simulation.run(0.5)
    return navigator.status, collisions.collided


def _off(simulation):
    pose = simulation.ground_truth.pose
    return math.hypot(pose.x - GOAL.x, pose.y - GOAL.y)


@pytest.mark.parametrize(
    ("topic", "reason"),
    [
        ("scan", "the lidar has been silent for 2."),
        ("odom", "the odometry reports no motion for 0."),
    ],
)
def test_a_silent_topic_stops_the_robot_with_the_reason(robot, topic, reason):
    simulation = Simulation(robot, _hall())
    mount_declared(simulation)
    simulation.disturbances.schedule(SilentTopic(topic), 2.0)
    status, collided = _drive(simulation)
    assert status.state is GoalState.STUCK
    assert status.reason.startswith(reason)
    assert not collided


def test_scans_that_are_lost_for_a_while_only_delay_the_robot(robot):
    simulation = Simulation(robot, _hall())
    mount_declared(simulation)
    simulation.disturbances.schedule(SilentTopic("scan"), 2.0, 1.0)
    status, collided = _drive(simulation)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2


def test_a_silent_imu_is_replaced_by_the_wheels(robot_with_imu):
    simulation = Simulation(robot_with_imu, _hall())
    mount_declared(simulation)
    simulation.disturbances.schedule(SilentTopic("imu"), 1.0)
    status, collided = _drive(simulation)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_odometry_that_is_wrong_by_a_tenth_is_corrected_by_the_scans(robot, scale):
    simulation = Simulation(robot, _hall())

    def odometry():
        motion = simulation.odometry
        return replace(motion, pose=PlanarPose(scale * motion.pose.x, scale * motion.pose.y, motion.pose.yaw))

    status, collided = _drive(simulation, odometry)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2  # by the wheels alone, 0.55 m


def test_a_wheel_that_is_larger_than_declared_is_corrected_by_the_scans(robot):
    """The odometry turns by 0.1 m / 0.174 m = 0.6 rad/m although the robot drives straight."""
    simulation = Simulation(robot, _hall())
    pose, last = [PlanarPose()], [simulation.odometry.pose]

    def odometry():
        motion = simulation.odometry
        step = last[0].inverse() @ motion.pose
        last[0] = motion.pose
        pose[0] = pose[0] @ replace(step, yaw=step.yaw + 0.57 * step.x)
        return replace(motion, pose=pose[0])

    status, collided = _drive(simulation, odometry)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2


def test_a_robot_that_is_pushed_aside_still_arrives(robot):
    simulation = Simulation(robot, _hall())
    simulation.disturbances.schedule(Kick((0.0, 1.5, 0.0), (0.0, 0.0, 3.0)), 3.0)
    status, collided = _drive(simulation)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2


def test_a_robot_that_is_carried_away_stops_with_the_reason(robot):
    simulation = Simulation(robot, _hall())
    where = []

    def carry():
        if simulation.time == pytest.approx(3.0):
            simulation.models.set_pose(5.0, -1.0, 2.5)
            where.append(simulation.ground_truth.pose)

    simulation.clock.every(1.0, carry)
    status, collided = _drive(simulation)
    assert (
        str(status)
        == "stuck: the scans do not fit those before: the robot was moved, and its pose is unknown"
    )
    assert not collided
    pose = simulation.ground_truth.pose
    assert math.hypot(pose.x - where[0].x, pose.y - where[0].y) < 0.8


def test_wheels_that_spin_while_the_robot_does_not_move_are_reported(robot):
    simulation = Simulation(robot, _hall())
    for wheel in ("left_wheel", "right_wheel"):
        simulation.disturbances.schedule(Slip(wheel, 0.0), 0.2)
    status, collided = _drive(simulation)
    assert status.state is GoalState.STUCK
    assert status.reason.endswith("the robot does not move: it is lifted, blocked or slips")
    assert not collided


def test_the_imu_of_a_robot_that_falls_over_ends_the_goal(robot_with_imu):
    simulation = Simulation(robot_with_imu)
    name = simulation.robots.first.name

    def tip():
        if simulation.time == pytest.approx(2.0):
            pose = simulation.link_pose("base_link")
            lying = Transform.from_xyz_rpy(pose.translation, (math.pi / 2.0, 0.0, 0.0))
            simulation.models.set_model_state(name, lying)

    simulation.clock.every(1.0, tip)
    status, _ = _drive(simulation)
    assert status.state is GoalState.STUCK
    assert status.reason.startswith("the robot lies on its side: its IMU measures a tilt of ")
    assert simulation.time < 4.0


def test_a_door_that_closes_for_good_is_reported(robot):
    simulation = Simulation(
        robot,
        World(
            "rooms",
            (
                floor(),
                wall("left", (1.5, 0.3), (1.5, 4.0)),
                wall("right", (1.5, -0.3), (1.5, -4.0)),
                wall("back", (-1.0, -4.0), (-1.0, 4.0)),
                wall("top", (-1.0, 1.5), (1.5, 1.5)),
                wall("bottom", (-1.0, -1.5), (1.5, -1.5)),
            ),
        ),
    )

    def close():
        if simulation.time == pytest.approx(1.0):
            simulation.models.spawn_thing("box", "door", 1.5, 0.0, size=(0.1, 0.6, 0.3))

    simulation.clock.every(1.0, close)
    status, collided = _drive(simulation)
    assert status.state is GoalState.STUCK
    assert status.reason.startswith("the obstacles that the lidar detected leave no way to the goal")
    assert not collided


def test_a_goal_that_is_moved_while_the_robot_drives_is_reached(robot):
    simulation = Simulation(robot, _hall())
    navigator, lidars = local_navigator(simulation)
    navigator.go(GOAL, any_heading=True, arrive=0.2)
    pilot, collisions = LocalPilot(simulation, navigator, lidars), CollisionWatch(simulation)
    simulation.run(3.0)
    navigator.go(PlanarPose(0.0, 1.2), any_heading=True, arrive=0.2)
    while not navigator.status.state.is_end:
        simulation.run(0.05)
    pilot.close()
    assert navigator.status.state is GoalState.REACHED
    assert not collisions.collided
    assert math.hypot(simulation.ground_truth.pose.x, simulation.ground_truth.pose.y - 1.2) < 0.2


def test_with_a_map_a_robot_that_is_carried_away_still_arrives(robot):
    simulation = Simulation(robot, _hall())

    def carry():
        if simulation.time == pytest.approx(3.0):
            simulation.models.set_pose(4.0, -1.0, 2.5)

    simulation.clock.every(1.0, carry)
    trip = go_to(simulation, GOAL)
    assert trip.reached, trip.status
    assert not trip.collided


def test_a_box_that_crosses_the_way_is_not_touched(robot):
    simulation = Simulation(robot, _hall())
    simulation.models.spawn_thing("box", "box", 2.5, -0.2, size=(0.3, 0.3, 0.4))

    def move():
        y = -0.2 + 0.8 * abs(math.remainder(simulation.time - 1.0, 4.0)) - 0.8
        pose = Transform.from_xyz_rpy((2.5, y, 0.001), (0.0, 0.0, 0.0))
        simulation.models.set_model_state("box", pose, (0.0, 0.8, 0.0))

    simulation.clock.every(50.0, move)
    status, collided = _drive(simulation)
    assert status.state is GoalState.REACHED
    assert not collided
    assert _off(simulation) < 0.2
