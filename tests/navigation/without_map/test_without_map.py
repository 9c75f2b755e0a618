"""Goals without a map: the robot gets its own sensors and its start pose, and nothing else."""

import json
import math
from dataclasses import replace

import pytest

from kbot.cli.main import main
from kbot.kinematics import PlanarPose
from kbot.model.load import load_robot
from kbot.navigation.goal_status import GoalState
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.navigation.simulated.motion_limits import motion_limits
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.without_map.go_to import go_to_without_map
from kbot.navigation.without_map.local_pilot import LocalPilot, local_navigator
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.builders import box, floor, wall
from kbot.world.world import World


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot", {"lidar": "true"}).require()


def _world(*bodies):
    return World("walls", (floor(), *bodies))


def _trap():
    """A U that is open towards the robot, with the goal behind it."""
    return _world(
        wall("back", (1.2, -0.5), (1.2, 0.5)),
        wall("left", (0.5, 0.5), (1.2, 0.5)),
        wall("right", (0.5, -0.5), (1.2, -0.5)),
    )


def _ring(x, y, half):
    corners = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    ends = zip(corners, corners[1:] + corners[:1], strict=True)
    return [wall(f"ring_{number}", *between) for number, between in enumerate(ends)]


def _run(words):
    with pytest.raises(SystemExit) as ended:
        main(words)
    return ended.value.code or 0


def test_a_goal_behind_an_unknown_trap_is_reached_without_a_contact(robot):
    simulation = Simulation(robot, _trap())
    trip = go_to_without_map(simulation, PlanarPose(2.0, 0.0), any_heading=True, arrive=0.1)
    assert trip.reached, trip.status
    assert trip.map == "none"
    assert not trip.collided
    assert trip.arrival is not None
    assert 2.2 < trip.distance < 6.0  # around the trap, and not in circles
    assert trip.off < 0.1


def test_a_goal_in_the_next_room_is_reached_with_its_heading(robot):
    simulation = Simulation(robot, "rooms")
    trip = go_to_without_map(simulation, PlanarPose(1.8, 1.8, -1.0), arrive=0.05)
    assert trip.reached, trip.status
    assert not trip.collided
    assert trip.turned_off < 0.05


def test_a_lidar_that_hangs_upside_down_and_is_turned_is_as_good(robot, tmp_path):
    file = tmp_path / "hanging.urdf"
    assert _run(["expand", "kbot", "lidar:=true", "-o", str(file)]) == 0
    text = file.read_text()
    joint = text.index('<joint name="lidar_joint"')
    upright = 'rpy="0 0 0"'
    at = text.index(upright, joint)
    file.write_text(text[:at] + f'rpy="{math.pi} 0 2.0"' + text[at + len(upright) :])
    hanging = load_robot(file).require()
    up = Simulation(hanging).link_pose("lidar_link").rotation[2, 2]
    assert up == pytest.approx(-1.0, abs=0.01)
    simulation = Simulation(hanging, _trap())
    trip = go_to_without_map(simulation, PlanarPose(2.0, 0.0), any_heading=True, arrive=0.1)
    assert trip.reached, trip.status
    assert not trip.collided


def test_a_door_that_closes_makes_the_robot_take_another(robot):
    simulation = Simulation(
        robot,
        _world(
            wall("right", (1.0, -4.0), (1.0, -0.25)),
            wall("middle", (1.0, 0.25), (1.0, 1.0)),
            wall("left", (1.0, 1.6), (1.0, 4.0)),
        ),
    )

    def close():
        if simulation.time == pytest.approx(1.0):
            simulation.models.spawn_thing("box", "door", 1.0, 0.0, size=(0.1, 0.45, 0.3))

    simulation.clock.every(1.0, close)
    crossed = []
    simulation.clock.every(50.0, lambda: crossed.append(simulation.ground_truth.pose))
    trip = go_to_without_map(simulation, PlanarPose(2.0, 0.0), any_heading=True, arrive=0.1)
    assert trip.reached, trip.status
    assert not trip.collided
    nearest = min(crossed, key=lambda pose: abs(pose.x - 1.0))
    assert 1.0 < nearest.y < 1.6


def test_the_same_run_twice_is_the_same(robot):
    poses = []
    for _ in range(2):
        simulation = Simulation(robot, _world(box("box", (0.2, 0.4, 0.3), 0.6, 0.1)))
        poses.append(go_to_without_map(simulation, PlanarPose(1.2, 0.0), any_heading=True, arrive=0.1).pose)
    assert poses[0] == poses[1]


def test_speeds_stay_below_max_speed(robot):
    simulation = Simulation(robot)
    speeds = []
    simulation.clock.every(50.0, lambda: speeds.append(simulation.robots.first.commanded_twist))
    trip = go_to_without_map(
        simulation, PlanarPose(-0.8, 0.3), any_heading=True, arrive=0.1, max_speed=(0.25, 0.8)
    )
    assert trip.reached, trip.status
    assert max(abs(speed.x) for speed in speeds) <= 0.25
    assert max(abs(speed.yaw) for speed in speeds) <= 0.8


def test_the_default_limits_are_those_that_the_robot_declares(robot):
    first = Simulation(robot).robots.first
    limits = motion_limits(first)
    # 28.57 rad/s at wheels with a radius of 0.035 m and a distance of 0.174 m
    assert limits.linear == pytest.approx(1.0)
    assert limits.angular == pytest.approx(1.0 / 0.087)
    assert limits.acceleration == pytest.approx(0.8)  # the default of 1 m/s^2, with a reserve
    assert motion_limits(first, (5.0, 2.0)).linear == limits.linear
    assert motion_limits(first, (5.0, 2.0)).angular == 2.0


def test_a_lidar_that_stops_stops_the_robot_with_the_reason(robot):
    simulation = Simulation(robot, _world(wall("wall", (3.0, -2.0), (3.0, 2.0))))
    sensors, _ = mount_declared(simulation)
    positions = []

    def stop():
        positions.append(simulation.ground_truth.pose.x)
        if len(positions) == 1:
            sensors["lidar"].close()

    simulation.clock.every(0.5, stop)  # first after 2 s
    trip = go_to_without_map(simulation, PlanarPose(6.0, 0.0), any_heading=True, arrive=0.1)
    assert trip.state is GoalState.STUCK
    assert trip.status.reason.startswith("the lidar has been silent for 2.")
    assert not trip.collided
    # it brakes within the time of a few scans: 0.2 s and 0.5 m from 1 m/s
    assert trip.pose.x - positions[0] < 0.9


def test_an_odometry_that_freezes_stops_the_robot_with_the_reason(robot):
    simulation = Simulation(robot, _world(wall("wall", (3.0, -2.0), (3.0, 2.0))))
    navigator, lidars = local_navigator(simulation)
    frozen = []

    def odometry():
        if simulation.time < 1.5 or not frozen:
            frozen[:] = [simulation.odometry]
        return frozen[0]

    navigator.go(PlanarPose(6.0, 0.0), any_heading=True)
    LocalPilot(simulation, navigator, lidars, odometry)
    collisions = CollisionWatch(simulation)
    simulation.run(4.0)
    assert navigator.status.state is GoalState.STUCK
    assert navigator.status.reason.startswith("the odometry reports no motion for 0.")
    assert abs(simulation.ground_truth.twist.x) < 0.01
    assert not collisions.collided


def test_a_robot_that_falls_over_gives_up(robot):
    simulation = Simulation(robot)
    navigator, lidars = local_navigator(simulation)
    navigator.go(PlanarPose(6.0, 0.0))
    pilot = LocalPilot(simulation, navigator, lidars)
    observed = []
    update = navigator.update

    def fallen(observation, scans=()):
        observed.append(update(replace(observation, fallen="the robot lies on its side"), scans))
        return observed[-1]

    navigator.update = fallen
    pilot.tick()
    assert str(navigator.status) == "stuck: the robot lies on its side"
    assert observed[0].linear.x == 0.0


def test_a_goal_inside_an_obstacle_is_given_up(robot):
    simulation = Simulation(robot, _world(box("box", (0.5, 0.5, 0.3), 1.0, 0.0)))
    trip = go_to_without_map(simulation, PlanarPose(0.85, 0.0), any_heading=True)
    assert trip.state is GoalState.STUCK
    assert trip.status.reason == "the goal is inside or too near an obstacle that the lidar detected"
    assert not trip.collided


def test_an_enclosed_goal_is_given_up(robot):
    simulation = Simulation(robot, _world(*_ring(0.0, 0.0, 0.5)))
    trip = go_to_without_map(simulation, PlanarPose(2.0, 0.0), any_heading=True, arrive=0.1)
    assert trip.state is GoalState.STUCK
    assert (
        trip.status.reason
        == "the obstacles that the lidar detected leave no way to the goal that is wide enough"
    )
    assert not trip.collided


def test_the_time_limit_ends_a_goal(robot):
    simulation = Simulation(robot)
    trip = go_to_without_map(simulation, PlanarPose(5.0, 0.0), timeout=2.0)
    assert trip.state is GoalState.STUCK
    assert trip.status.reason.startswith("out of time: not at the goal after 2.")
    assert trip.arrival is None


def test_the_robot_stops_by_its_own_estimate(robot):
    """Wheels 10 % larger than declared: the robot believes it is at the goal, and is 0.15 m too far."""
    simulation = Simulation(robot)

    def wrong():
        motion = simulation.odometry
        pose = motion.pose
        return replace(motion, pose=PlanarPose(pose.x / 1.1, pose.y / 1.1, pose.yaw))

    navigator, lidars = local_navigator(simulation)
    navigator.go(PlanarPose(1.5, 0.0), any_heading=True)
    LocalPilot(simulation, navigator, lidars, wrong)
    simulation.run(8.0)
    assert navigator.status.state is GoalState.REACHED
    assert simulation.ground_truth.pose.x == pytest.approx(1.65, abs=0.02)


def test_a_robot_without_a_lidar_is_refused_with_the_reason():
    simulation = Simulation(load_robot("kbot").require())
    with pytest.raises(KbotError, match="declares no level lidar"):
        go_to_without_map(simulation, PlanarPose(1.0, 0.0))


@pytest.mark.parametrize("more", [{"arrive": 0.0}, {"arrive": math.nan}, {"timeout": -1.0}])
def test_radius_and_timeout_must_be_above_zero(robot, more):
    with pytest.raises(KbotError, match="above 0"):
        go_to_without_map(Simulation(robot), PlanarPose(1.0, 0.0), **more)


def test_the_arrival_time_begins_with_the_movement(robot):
    simulation = Simulation(robot)
    trip = go_to(simulation, PlanarPose(1.0, 0.0, 1.5))
    # 0.9 m at 0.3 m/s, with 0.6 m/s^2 to stop; the turn at the goal does not count
    assert trip.arrival == pytest.approx(3.3, abs=0.4)
    assert trip.arrival < trip.time - 0.8
    assert trip.map == "given"


def test_json_of_a_goal_without_a_map(capsys):
    words = ["sim", "kbot", "lidar:=true", "--headless", "--goto", "0.8,0.3", "--no-map", "--json"]
    assert _run([*words, "--arrive", "0.1", "--max-speed", "0.5,2"]) == 0
    result = json.loads(capsys.readouterr().out)["navigation"]
    assert result["map"] == "none"
    assert result["state"] == "reached"
    assert result["reason"] == ""
    assert result["goal"] == {"x": 0.8, "y": 0.3, "yaw": None}
    assert result["collided"] is False
    assert result["off_rad"] is None
    assert 0.0 < result["off_m"] <= 0.1
    assert 1.0 < result["time_s"] < 10.0


def test_a_goal_that_is_not_reached_in_time_is_stuck(capsys):
    words = ["sim", "kbot", "lidar:=true", "--headless", "--goto", "5,0", "--no-map", "--json"]
    assert _run([*words, "--duration", "1.5"]) == 1
    result = json.loads(capsys.readouterr().out)["navigation"]
    assert result["state"] == "stuck"
    assert result["time_s"] is None
    assert result["reason"].startswith("out of time")


def test_arrive_and_max_speed_work_with_a_map(capsys):
    words = ["sim", "kbot", "--headless", "--goto", "1,0", "--json", "--pose", "0,0,0"]
    assert _run([*words, "--arrive", "0.2", "--max-speed", "0.5,1"]) == 0
    result = json.loads(capsys.readouterr().out)
    navigation = result["navigation"]
    assert navigation["map"] == "given"
    assert navigation["goal"]["yaw"] is None
    assert 0.0 < navigation["off_m"] <= 0.2
    assert abs(result["pose"]["yaw"]) < 0.1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--no-map"], "--no-map needs --goto"),
        (["--arrive", "0.1"], "--arrive needs --goto"),
        (["--max-speed", "1,1"], "--max-speed needs --goto"),
        (["--goto", "1,0", "--arrive", "0"], "--arrive takes a finite number of metres above 0"),
        (["--goto", "1,0", "--arrive", "nan"], "--arrive takes a finite number of metres above 0"),
        (["--goto", "1,0", "--max-speed", "1"], "--max-speed takes V,W in m/s and rad/s"),
        (["--goto", "1,0", "--max-speed", "1,0"], "--max-speed takes two numbers above 0"),
        (["--goto", "1,0", "--no-map"], "declares no level lidar"),
    ],
)
def test_options_that_do_not_fit_are_errors(capsys, words, message):
    assert _run(["sim", "kbot", "--headless", *words]) == 2
    assert message in capsys.readouterr().err
