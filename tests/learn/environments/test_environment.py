"""The Gymnasium environments with one robot."""

import math
import pickle
import subprocess
import sys
from copy import deepcopy

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.environment import KbotEnv
from kbot.learn.environments.randomisation import Randomisation
from kbot.learn.interface.targets import GoalTarget
from kbot.navigation.controller import Observation
from kbot.navigation.simulated.lidars import LidarPoints, level_lidar
from kbot.navigation.simulated.pilot import Pilot

GOAL = "kbot/Goal-v0"
LIDAR = {"lidar": True}
"""The xacro argument with which the shipped robot has a lidar."""


def make(**options):
    return gymnasium.make(GOAL, disable_env_checker=True, **options).unwrapped


def towards_goal(seen):
    """Turns to the goal, then drives: arrives where nothing is in the way."""
    ahead, left = seen[1], seen[2]
    return np.array([1.0 if ahead > 0.9 else -1.0, np.clip(2.0 * math.atan2(left, ahead), -1.0, 1.0)])


def episode(environment, seed, steps=60):
    """The bytes of everything that an episode returns, with actions that depend on nothing."""
    random = np.random.default_rng(99)
    seen, _ = environment.reset(seed=seed)
    found = [seen.tobytes()]
    for _ in range(steps):
        seen, reward, terminated, truncated, _ = environment.step(random.uniform(-1.0, 1.0, 2))
        found += [seen.tobytes(), np.float64(reward).tobytes(), bytes([terminated, truncated])]
        if terminated or truncated:
            break
    return b"".join(found)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"world": "rooms", "properties": LIDAR, "lidar": 12},
        {"world": "boxes:seed={seed}", "pose": "odometry", "reverse": True},
    ],
)
def test_passes_the_checker_of_gymnasium(options):
    check_env(make(**options), skip_render_check=True)


def test_passes_the_checker_of_gymnasium_with_pictures(monkeypatch):
    monkeypatch.setattr("kbot.workbench.live_page.can_open_browser", lambda: False)
    environment = gymnasium.make(GOAL, world="rooms", render_mode="rgb_array", disable_env_checker=True)
    check_env(environment.unwrapped)


@pytest.mark.parametrize("imports", ["kbot, gymnasium", "gymnasium, kbot"])
def test_is_registered_in_any_order_of_imports(imports):
    code = f"import {imports}; gymnasium.spec('{GOAL}')"
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_is_registered_after_a_search_for_gymnasium():
    """Programs search for a module to know whether it is installed."""
    search = "import kbot, importlib.util as u; [u.find_spec('gymnasium') for _ in range(2)]"
    code = f"{search}; import gymnasium; gymnasium.spec('{GOAL}')"
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_gymnasium_imports_kbot_for_an_environment():
    code = f"import gymnasium; gymnasium.make('kbot:{GOAL}').reset(seed=1)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_import_does_not_import_gymnasium():
    subprocess.run(
        [sys.executable, "-c", "import sys, kbot; assert 'gymnasium' not in sys.modules"], check=True
    )


RANDOM = {
    "properties": {"wheel_radius": (0.03, 0.04)},
    "friction": (0.4, 1.0),
    "noise": {"position": 0.01, "heading": (0.0, 0.1), "lidar": (0.0, 0.05)},
    "delay": (0.0, 0.25),
}


@pytest.mark.parametrize(
    "options",
    [
        {"world": "rooms", "properties": LIDAR},
        {"world": "boxes:seed={seed}", "world_seeds": (1, 3), "properties": LIDAR, "randomise": RANDOM},
    ],
)
def test_a_seed_gives_the_same_bytes_also_after_other_episodes(options):
    environment = make(**options)
    first = episode(environment, 5)
    others = [episode(environment, seed) for seed in (6, 7)]
    assert episode(environment, 5) == first
    assert episode(make(**options), 5) == first
    assert first not in others


def test_episodes_without_a_seed_differ():
    environment = make()
    environment.reset(seed=1)
    starts = [environment.reset()[1]["goal"].tolist() for _ in range(3)]
    assert starts[0] != starts[1] != starts[2]


def test_arrives_and_is_rewarded_for_the_way():
    environment = make(distance=(1.0, 2.0), rewards={"change": 0.0})
    seen, info = environment.reset(seed=2)
    assert 1.0 <= info["way"] <= 2.0
    steps, terminated = 0, False
    while not terminated:
        seen, reward, terminated, truncated, info = environment.step(towards_goal(seen))
        assert not truncated
        assert reward == pytest.approx(sum(info["rewards"].values()))
        steps += 1
    assert info["outcome"] == "arrived"
    assert info["is_success"] is True
    assert info["time"] == pytest.approx(steps * 0.1)
    assert info["rewards"]["arrival"] == 10.0
    assert info["rewards"]["time"] == pytest.approx(-0.01), "0.1 s at -0.1"


def test_progress_adds_up_to_the_way():
    environment = make(distance=(1.0, 2.0))
    seen, info = environment.reset(seed=2)
    way, progress, terminated = info["way"], 0.0, False
    while not terminated:
        seen, _, terminated, _, info = environment.step(towards_goal(seen))
        progress += info["rewards"]["progress"]
    # the robot stops within 0.15 m of the goal, and the ways are read from a map with cells of 0.05 m
    assert way - 0.15 - 0.05 <= progress <= way


def test_touching_a_wall_terminates_and_running_out_of_time_truncates():
    environment = make(world="corridor:width=0.6", distance=(0.5, 3.0))
    environment.reset(seed=1)
    for _ in range(300):
        _, _, terminated, truncated, info = environment.step([1.0, 0.0])
        if terminated:
            break
    assert (terminated, truncated, info["outcome"]) == (True, False, "collided")
    assert info["rewards"]["failure"] == -10.0
    assert info["is_success"] is False
    with pytest.raises(kbot.KbotError, match="the episode is over"):
        environment.step([0.0, 0.0])
    late = make(time_limit=0.5)
    late.reset(seed=1)
    ends = [late.step([-1.0, 0.0])[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_a_failed_simulation_terminates():
    environment = make()
    environment.reset(seed=1)
    environment.simulation.engine.data.qvel[0] = 1e9
    after, _, terminated, truncated, info = environment.step([0.0, 0.0])
    assert (terminated, truncated, info["outcome"]) == (True, False, "diverged")
    assert np.isfinite(after).all()
    environment.reset(seed=1)
    assert environment.step([0.0, 0.0])[2:4] == (False, False)


def test_a_fall_terminates():
    environment = make()
    environment.reset(seed=1)
    tipped = kbot.Transform.from_xyz_rpy((0.0, 0.0, 0.3), (math.pi / 2, 0.0, 0.0))
    environment.simulation.models.set_model_state("kbot", tipped)
    for _ in range(10):
        _, _, terminated, _, info = environment.step([-1.0, 0.0])
        if terminated:
            break
    assert info["outcome"] == "fell"


def test_a_pilot_sees_and_drives_the_same():
    """A plain simulation with the same commands gives the same observations, and the same state."""
    environment = make(world="rooms", properties=LIDAR)
    seen, info = environment.reset(seed=4)
    interface, goal = environment.interface, GoalTarget(*info["goal"].tolist())
    plain = kbot.Simulation(kbot.load("kbot", lidar=True), world="rooms", seed=environment.simulation.seed)
    pilot = Pilot(plain, None, seen=LidarPoints(level_lidar(plain)))
    pilot.close()
    plain.models.set_pose(*info["start"].tolist())
    plain.run(0.1)
    last = interface.no_action
    for index in range(40):
        assert interface.observe(pilot.observe(), goal, last).tobytes() == seen.tobytes()
        last = np.array([-0.7, 0.3 * math.sin(index)], dtype=np.float32)
        linear, angular, _ = interface.speeds(last)
        plain.cmd_vel(linear, angular)
        plain.run(0.1)
        seen = environment.step(last)[0]
    assert plain.state_sha256() == environment.simulation.state_sha256()


def test_delay_and_friction_act():
    late = make(randomise={"delay": 0.25})
    late.reset(seed=1)
    speeds = []
    for _ in range(6):
        late.step([1.0, 0.0])
        speeds.append(late.simulation.robots.first.commanded_twist.x)
    assert speeds[:2] == [0.0, 0.0], "0.25 s is two actions and a half"
    assert min(speeds[2:]) > 0.0
    icy = make(randomise={"friction": 0.0})
    icy.reset(seed=1)
    for _ in range(10):
        icy.step([1.0, 0.0])
    assert abs(icy.simulation.ground_truth.twist.x) < 0.01


def test_properties_change_the_robot():
    environment = make(randomise={"properties": {"wheel_radius": (0.03, 0.05)}})
    radii = set()
    for seed in range(3):
        environment.reset(seed=seed)
        radii.add(environment.simulation.robots.first.drive.radius)
    assert len(radii) == 3
    assert all(0.03 <= radius <= 0.05 for radius in radii)


def test_noise_changes_what_is_seen_but_not_the_run():
    exact, noisy = make(), make(randomise={"noise": {"position": 0.1}})
    first, second = exact.reset(seed=1)[0], noisy.reset(seed=1)[0]
    assert first[0] != second[0]


def test_declared_noise_differs_between_episodes():
    """The shipped robot's lidar has noise. Robots at the same place see different numbers."""
    environment = gymnasium.make(
        "kbot/Follow-v0", path=[(0.0, 0.0), (1.0, 0.0)], world="rooms", properties=LIDAR
    ).unwrapped
    first, second = environment.reset(seed=1)[0], environment.reset(seed=2)[0]
    assert (first != second).any()
    np.testing.assert_array_equal(environment.reset(seed=1)[0], first)


def test_noise_of_the_lidar_is_along_its_beams():
    """A point 2 m left of a lidar, which is 1 m ahead of the base, moves to the left or right only."""
    points = np.array([[1.0, 2.0]])
    seen = Observation(0.0, PlanarPose(), obstacles=points, fault="frozen odometry")
    drawn = Randomisation.of({"noise": {"lidar": 0.1}}).draw(np.random.default_rng(1))
    noisy = drawn.seen(seen, np.random.default_rng(1), np.array([1.0, 0.0]))
    assert noisy.obstacles[0, 0] == 1.0
    assert 0.0 < abs(noisy.obstacles[0, 1] - 2.0) < 0.5
    assert noisy.fault == "frozen odometry"


def test_world_seeds_build_different_worlds():
    environment = make(world="boxes:seed={seed}", world_seeds=(3, 4))
    names = set()
    for seed in range(8):
        environment.reset(seed=seed)
        names.add(environment.simulation.world.bodies[1].pose.translation.tobytes())
    assert len(names) == 2


def test_pictures_show_the_robot_and_its_goal():
    environment = make(world="rooms", render_mode="rgb_array")
    environment.reset(seed=1)
    before = environment.render()
    greener = before[..., 1].astype(int) - before[..., [0, 2]].max(axis=2) > 40
    assert greener.sum() > 30  # the mark of the goal
    assert before.shape == (360, 480, 3)
    for _ in range(5):
        environment.step([1.0, 1.0])
    assert (environment.render() != before).any()


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"robbot": "kbot"}, "did you mean 'robot'"),
        ({"arive": 0.1}, "did you mean 'arrive'"),
        ({"robot": "no_such.xacro"}, "no_such.xacro"),
        ({"world": "roms"}, "did you mean 'rooms'"),
        ({"lidar": 12}, "declares no level lidar"),
        ({"lidar": -1, "properties": LIDAR}, "lidar sectors"),
        ({"rate": 0.0}, "rate"),
        ({"rate": math.inf}, "rate must be a finite number"),
        ({"rate": 30.0}, "whole number of time steps"),
        ({"rate": 1000.0}, "whole number of time steps of timestep 0.002 s: change rate or timestep"),
        ({"timestep": 1}, "rate 10 takes 0.1 s, which is not a whole number of time steps of timestep 1 s"),
        ({"time_limit": -1.0}, "time_limit"),
        ({"pose": "gps"}, "ground_truth"),
        ({"distance": 3.0}, "distance must be two numbers"),
        ({"robot": 5}, "robot must be one file or one result of kbot.load, not 5"),
        ({"world": None}, "world must be the name of a world"),
        ({"reverse": "maybe"}, "reverse must be True or False"),
        ({"lidar": 1.5}, "lidar must be a whole number"),
        ({"lidar": True, "properties": LIDAR}, "lidar must be a whole number"),
        ({"reach": -1.0}, "reach in m must be a finite number above 0"),
        ({"max_speed": 0}, "max_speed must be two finite numbers"),
        ({"max_speed": ("fast", 1.0)}, "max_speed must be two finite numbers"),
        ({"timestep": 0.0}, "timestep in s must be a finite number above 0"),
        ({"distance": (0.1, 3.0)}, "the lowest distance (0.1 m) must be greater than arrive (0.15 m)"),
        ({"arrive": 0.0}, "arrive"),
        ({"rewards": {"progres": 1.0}}, "did you mean 'progress'"),
        ({"rewards": {"progress": math.nan}}, "finite"),
        ({"world_seeds": (5, 1)}, "world_seeds"),
        ({"world": "rooms", "world_seeds": (1, 3)}, "write {seed} in world"),
        ({"randomise": {"noise": {"lidar": 0.01}}}, "the policy sees no lidar"),
        ({"randomise": {"frction": 1.0}}, "did you mean 'friction'"),
        ({"randomise": {"friction": (1.0, 0.5)}}, "friction"),
        ({"randomise": {"noise": {"lidars": 1.0}}}, "did you mean 'lidar'"),
        ({"randomise": {"delay": "long"}}, "delay must be a number or"),
        ({"render_mode": "ansi"}, "render_mode"),
        ({"max_speed": (0.0, 1.0)}, "limits"),
        ({"max_speed": (0.5, 2.0, 1.0)}, "max_speed must be two finite numbers"),
        ({"properties": [1]}, "properties must be a dict"),
        ({"packages": 3}, "packages must be folders"),
        ({"packages": [3]}, "packages must be folders"),
    ],
)
def test_wrong_options_are_refused(options, part):
    with pytest.raises(kbot.KbotError) as caught:
        KbotEnv("goal", **options)
    assert part in str(caught.value)


def test_a_robot_in_an_error_is_short():
    with pytest.raises(kbot.KbotError) as caught:
        KbotEnv("goal", robot=[kbot.load("kbot"), kbot.load("kbot")])
    assert str(caught.value).startswith("robot must be one file or one result of kbot.load, not [")
    assert len(str(caught.value)) < 200


def test_a_copy_has_the_options_and_its_own_episode():
    environment = gymnasium.make("kbot/Goal-v0", world="rooms", properties=LIDAR)
    environment.reset(seed=1)
    for copy in (pickle.loads(pickle.dumps(environment)), deepcopy(environment)):
        with pytest.raises(kbot.KbotError, match="call reset first"):
            copy.step(copy.action_space.sample())
        np.testing.assert_array_equal(copy.reset(seed=2)[0], environment.reset(seed=2)[0])


def test_unknown_property_is_refused_before_the_first_episode():
    with pytest.raises(kbot.KbotError, match="wheel_radiu"):
        make(randomise={"properties": {"wheel_radiu": (0.03, 0.05)}})


def test_warnings_about_the_description_are_issued_but_not_for_drawn_values():
    with pytest.warns(kbot.DescriptionWarning, match="caster_wheel_radius is set to 0.018"):
        make(properties={"caster_wheel_radius": 0.018})
    make(randomise={"properties": {"caster_wheel_radius": (0.017, 0.018)}}).reset(seed=1)


def test_robot_that_cannot_drive_is_refused(tmp_path):
    file = tmp_path / "box.urdf"
    file.write_text(
        '<robot name="box"><link name="base_link"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>'
    )
    with pytest.raises(kbot.KbotError, match="cannot drive"):
        make(robot=str(file))


def test_friction_of_a_base_that_slides_is_refused(tmp_path):
    file = tmp_path / "base.urdf"
    file.write_text(
        '<robot name="base"><link name="base_link"><inertial><origin xyz="0 0 0.1"/><mass value="10"/>'
        '<inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.5 0.4 0.2"/></geometry></collision></link>'
        '<gazebo><plugin name="drive" filename="libgazebo_ros_planar_move.so"/></gazebo></robot>'
    )
    with pytest.raises(kbot.KbotError, match="friction cannot be randomised for a holonomic base"):
        make(robot=str(file), randomise={"friction": (0.2, 0.8)})


def test_world_without_room_is_refused():
    with pytest.raises(kbot.KbotError, match=r"no place|no two places"):
        make(world="corridor:length=1,width=0.25").reset(seed=1)


def test_a_world_without_room_ends_the_last_episode():
    environment = make(world="corridor:width=0.{seed}", world_seeds=(3, 9), distance=(0.5, 1.0))
    environment.reset(seed=0)

    def reset_in_worlds():
        for seed in range(50):
            environment.reset(seed=seed)

    with pytest.raises(kbot.KbotError, match="no place"):
        reset_in_worlds()
    with pytest.raises(kbot.KbotError, match="call reset first"):
        environment.step([0.0, 0.0])


def test_the_page_shows_the_run_of_each_episode(monkeypatch):
    monkeypatch.setattr("kbot.workbench.live_page.can_open_browser", lambda: False)
    environment = make(world="boxes:seed={seed}", world_seeds=(1, 2), render_mode="human")
    shown = []
    for seed in range(3):
        environment.reset(seed=seed)
        environment.step([-1.0, 0.0])
        assert environment._page.url.startswith("http://127.0.0.1:")
        shown.append(environment._served is environment.simulation)
    environment.close()
    assert shown == [True, True, True]
    assert environment._page is None
