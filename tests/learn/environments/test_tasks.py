"""The tasks besides driving to a goal: following a path, and the BARN challenge."""

import itertools
import json
import math
import os

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import kbot
from kbot.learn.environments.tasks.barn_worlds import metric, read_barn_worlds

FOLLOW, BARN = "kbot/Follow-v0", "kbot/Barn-v0"
PATH = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.6)]


def make(name, **options):
    return gymnasium.make(name, disable_env_checker=True, **options).unwrapped


def along(environment, seen):
    """Turns to the point 0.2 m ahead on the path, then drives. With a larger gain, the robot turns too far in
    the 0.1 s of an action, and turns to and fro."""
    named = environment.interface.named(seen)
    bearing = math.atan2(named["path_0.2_y"], named["path_0.2_x"])
    return np.array([0.0 if abs(bearing) < 0.5 else -1.0, 0.25 * bearing])


@pytest.mark.parametrize("options", [{}, {"path": PATH}, {"world": "rooms", "properties": {"lidar": True}}])
def test_following_passes_the_checker_of_gymnasium(options):
    check_env(make(FOLLOW, **options), skip_render_check=True)


def test_follows_a_given_path_to_its_end():
    environment = make(FOLLOW, path=PATH)
    seen, info = environment.reset(seed=1)
    assert info["start"] == pytest.approx([0.0, 0.0, 0.0])
    assert info["way"] == pytest.approx(1.6)
    progress, offset, terminated = 0.0, 0.0, False
    while not terminated:
        seen, _, terminated, truncated, info = environment.step(along(environment, seen))
        assert not truncated
        progress += info["rewards"]["progress"]
        offset += info["rewards"]["offset"]
    assert info["outcome"] == "arrived"
    assert 1.5 <= progress <= 1.6, "it arrives within 0.1 m of the end"
    assert -0.1 * info["time"] < offset <= 0.0, "it is less than 0.1 m from the path, on average"


def test_a_path_may_repeat_points():
    _, info = make(FOLLOW, path=[(0.0, 0.0), (0.0, 0.0), (0.0, 2.0)]).reset(seed=1)
    assert info["start"] == pytest.approx([0.0, 0.0, math.pi / 2])


def test_random_paths_of_a_narrow_range_of_distances():
    """The lengths of a way there and back differ by up to 1e-11 m, so that no way may be exactly as long."""
    environment = make(FOLLOW, world="rooms", corners=10, distance=(0.25, 0.25))
    for seed in range(3):
        assert environment.reset(seed=seed)[1]["way"] == pytest.approx(2.5, rel=0.05)


def test_leaving_the_path_terminates():
    environment = make(FOLLOW, path=[(0.0, 0.0), (-2.0, 0.0)], offset=0.2)
    environment.reset(seed=1)
    environment.simulation.models.set_pose(-0.5, 0.25, 0.0)
    _, _, terminated, _, info = environment.step([-1.0, 0.0])
    assert (terminated, info["outcome"]) == (True, "left the path")
    assert info["rewards"]["failure"] == -10.0


def test_random_paths_lead_around_obstacles():
    environment = make(FOLLOW, world="rooms", corners=2, distance=(1.0, 3.0))
    lengths = set()
    for seed in range(4):
        _, info = environment.reset(seed=seed)
        path, grid = info["path"], environment._episodes.stage.places.grid
        assert 2.0 - 0.2 <= info["way"] <= 6.0 + 0.2
        for start, end in itertools.pairwise(path):
            for share in np.linspace(0.0, 1.0, 50):
                assert grid.value(*(start + share * (end - start))) == 0
        lengths.add(info["way"])
    assert len(lengths) == 4


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"path": [(0.0, 0.0)]}, "two different points"),
        ({"path": "there"}, "path needs points"),
        ({"corners": 0}, "corners"),
        ({"corners": 1.5}, "whole number"),
        ({"offset": -1.0}, "offset"),
        ({"distance": (0.0, 1.0)}, "lowest distance"),
        ({"path": PATH, "corners": 2}, "corners has no effect"),
        ({"path": PATH, "distance": (1.0, 2.0)}, "distance has no effect"),
    ],
)
def test_wrong_paths_are_refused(options, part):
    with pytest.raises(kbot.KbotError, match=part):
        make(FOLLOW, **options)


ROWS = ["#" * 30, *["#" + "." * 28 + "#"] * 10, "#" * 30]


@pytest.fixture
def small_barn(tmp_path):
    """A folder with one world of the challenge's format: a fence around the first 1.8 m."""
    path = [[-2.25, 3.0 + 2.0 * index] for index in range(5)]
    (tmp_path / "worlds.json").write_text(f'{{"7": {{"rows": {ROWS}, "path": {path}}}}}'.replace("'", '"'))
    return tmp_path


def test_worlds_are_built_from_their_rows(small_barn):
    (barn,) = read_barn_worlds(str(small_barn)).values()
    assert len(barn.world.bodies) == 1 + 2 * 30 + 10 * 2
    first = next(body for body in barn.world.bodies if body.name == "post_0_0")
    assert first.pose.translation == pytest.approx([-4.425, 0.075, 0.5])
    assert barn.optimal_time == pytest.approx(5.0), "10 m at 2 m/s"


def test_metric_of_the_challenge():
    assert metric(5.0, 3.0) == 0.5
    assert metric(5.0, 20.0) == 0.25
    assert metric(5.0, 90.0) == pytest.approx(0.125)
    assert metric(5.0, None) == 0.0


@pytest.mark.parametrize(("folder", "part"), [(3, "the path of a folder"), ("", "needs the option folder")])
def test_a_folder_of_another_type_is_refused(folder, part):
    with pytest.raises(kbot.KbotError, match=part):
        make(BARN, folder=folder)


@pytest.mark.parametrize("options", [{}, {"properties": {"lidar": True}}])
def test_barn_passes_the_checker_of_gymnasium(options, small_barn):
    check_env(make(BARN, folder=small_barn, robot="kbot", **options), skip_render_check=True)


def test_another_robot_drives_in_a_world_of_the_challenge(small_barn):
    environment = make(BARN, folder=small_barn, robot="kbot", time_limit=0.5)
    _, info = environment.reset(seed=1)
    assert info["world"] == "7"
    assert info["start"] == pytest.approx([-2.25, 3.0, math.pi / 2])
    assert info["way"] == pytest.approx(10.0, rel=0.03), "steps lead to sixteen neighbours only"
    for _ in range(5):
        *_, truncated, info = environment.step([1.0, 0.0])
    assert truncated
    assert info["metric"] == 0.0


def test_another_robot_has_the_time_limit_of_the_challenge(small_barn):
    assert make(BARN, folder=small_barn, robot="kbot")._episodes.options.time_limit == 100.0


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({}, "needs the option folder"),
        ({"folder": "/no/such/folder"}, "cannot be read"),
        ({"folder": "HERE", "worlds": [8]}, "has no world '8'"),
        ({"folder": "HERE", "worlds": []}, "at least one world"),
        ({"folder": "HERE", "worlds": "12"}, "worlds must be a list of numbers"),
        ({"folder": "HERE", "worlds": 5}, "worlds must be a list of numbers"),
        ({"folder": "HERE", "world": "rooms"}, "world has no effect"),
    ],
)
def test_wrong_folders_are_refused(options, part, small_barn):
    options = {name: small_barn if value == "HERE" else value for name, value in options.items()}
    with pytest.raises(kbot.KbotError, match=part):
        make(BARN, robot="kbot", **options)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[]", "not an object"),
        ("{", "Expecting property name"),
        ("[" * 200_000, "nested too deeply"),
        ('{"1": 3}', "the rows of world 1"),
        ('{"1": {"rows": 3}}', "the rows of world 1"),
        ('{"1": {"rows": ["#", 3], "path": [[0, 0]]}}', "the rows of world 1"),
        (json.dumps({"1": {"rows": ["#" * 2000] * 2000, "path": [[0, 0]]}}), "the rows of world 1"),
        ('{"1": {"rows": ["#"]}}', "the path of world 1"),
        ('{"1": {"rows": ["#"], "path": []}}', "the path of world 1"),
        ('{"1": {"rows": ["#"], "path": [[0, 1, 2]]}}', "the path of world 1"),
        ('{"1": {"rows": ["#"], "path": [["0", 1]]}}', "the path of world 1"),
        ('{"1": {"rows": ["#"], "path": [[NaN, 1]]}}', "the path of world 1"),
        ('{"1": {"rows": ["#"], "path": [[0, 1' + "0" * 400 + "]]}}", "the path of world 1"),
    ],
)
def test_file_of_another_format_is_refused(tmp_path, text, reason):
    (tmp_path / "worlds.json").write_text(text)
    with pytest.raises(kbot.KbotError, match=f"does not hold worlds of BARN: .*{reason}"):
        make(BARN, robot="kbot", folder=tmp_path)


def test_worlds_are_read_again_when_their_file_changes(small_barn):
    before = read_barn_worlds(small_barn)
    assert read_barn_worlds(small_barn)["7"] is before["7"]
    file = small_barn / "worlds.json"
    file.write_text(file.read_text().replace('"7"', '"8"'))
    os.utime(file, ns=(0, 0))
    assert list(read_barn_worlds(small_barn)) == ["8"]


def test_the_challenges_robot_drives_in_its_worlds(shared):
    environment = make(BARN, folder=shared / "barn", worlds=[1, 2, 4], lidar=24)
    seen, info = environment.reset(seed=1)
    assert info["world"] in {"1", "2", "4"}
    interface = environment.interface
    assert interface.linear == (0.0, 2.0)
    assert interface.angular == (-4.0, 4.0)
    assert len(seen) == 3 + 2 + 2 + 24
    named = interface.named(seen)
    assert named["goal_distance"] == pytest.approx(10.0, abs=0.01)
    # the lidar looks 270 degrees around, and the nearest sector of the fence behind is beyond it
    assert min(named[f"lidar_{at}"] for at in range(24)) < 5.0
    before = environment.simulation.ground_truth.pose.y
    for _ in range(5):
        environment.step([0.0, 0.0])
    assert environment.simulation.ground_truth.pose.y > before + 0.2
