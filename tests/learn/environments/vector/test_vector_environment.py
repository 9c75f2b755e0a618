"""The vector environment equals Gymnasium's own vector environment of single ones, bit for bit."""

import gc
import os
import signal

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import kbot
from kbot.learn.environments.vector.group_process import GroupProcess

GOAL = "kbot/Goal-v0"
COUNT = 3
SHORT = {"world": "rooms", "time_limit": 0.5, "distance": (1.0, 2.0)}


def make(count=COUNT, **options):
    return gymnasium.make_vec(GOAL, num_envs=count, vectorization_mode="vector_entry_point", **options)


def peer(mode, **options):
    single = [lambda: gymnasium.make(GOAL, disable_env_checker=True, **options)] * COUNT
    return SyncVectorEnv(single, autoreset_mode=mode)


def assert_equal(ours, theirs):
    """The arrays, and all infos with their masks."""
    assert set(ours) == set(theirs)
    for key, value in ours.items():
        if isinstance(value, dict):
            assert_equal(value, theirs[key])
        elif value.dtype == object:
            for mine, other in zip(value, theirs[key], strict=True):
                assert np.array_equal(mine, other)
        else:
            assert np.array_equal(value, theirs[key]), key


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_equals_gymnasiums_vector_environment(mode, processes):
    ours, theirs = make(autoreset_mode=mode, processes=processes, **SHORT), peer(mode, **SHORT)
    seen, infos = ours.reset(seed=7)
    expected, expected_infos = theirs.reset(seed=7)
    assert seen.tobytes() == expected.tobytes()
    assert_equal(infos, expected_infos)
    random, ends = np.random.default_rng(1), 0
    for _ in range(12):
        actions = random.uniform(-1.0, 1.0, (COUNT, 2)).astype(np.float32)
        *arrays, infos = ours.step(actions)
        *expected, expected_infos = theirs.step(actions)
        for mine, other in zip(arrays, expected, strict=True):
            assert mine.dtype == other.dtype
            assert mine.tobytes() == other.tobytes()
        assert_equal(infos, expected_infos)
        ends += int(arrays[2].sum() + arrays[3].sum())
    assert ends >= COUNT, "episodes ended and began again"
    ours.close()
    theirs.close()


def test_without_autoreset_the_user_resets():
    ours = make(autoreset_mode="Disabled", processes=2, **SHORT)
    ours.reset(seed=7)
    still = np.array([[-1.0, 0.0]] * COUNT)
    for _ in range(5):
        _, _, _, truncated, _ = ours.step(still)
    assert truncated.all()
    with pytest.raises(kbot.KbotError, match=r"environments \[0, 1, 2\] are over"):
        ours.step(still)
    mask = np.array([True, False, True])
    ours.reset(seed=[1, None, 2], options={"reset_mask": mask})
    with pytest.raises(kbot.KbotError, match=r"environments \[1\] are over"):
        ours.step(still)
    ours.reset(options={"reset_mask": ~mask})
    assert not ours.step(still)[3].any()
    ours.close()


def test_a_seed_gives_the_same_bytes_also_after_other_episodes():
    ours = make(processes=2, world="boxes:seed={seed}", world_seeds=(1, 3))

    def run():
        found = [ours.reset(seed=5)[0].tobytes()]
        for index in range(10):
            found.append(ours.step(np.full((COUNT, 2), np.sin(index)))[0].tobytes())
        return found

    first = run()
    assert run() == first
    ours.close()


def test_steps_per_episode_are_limited():
    ours = make(count=1, max_episode_steps=3)
    ours.reset(seed=1)
    assert [bool(ours.step([[-1.0, 0.0]])[3][0]) for _ in range(3)] == [False, False, True]


def test_pictures_of_all_environments():
    ours = make(count=2, render_mode="rgb_array", processes=2)
    ours.reset(seed=1)
    assert [picture.shape for picture in ours.render()] == [(360, 480, 3)] * 2
    ours.close()


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"num_envs": 0}, "num_envs"),
        ({"processes": 0}, "processes"),
        ({"autoreset_mode": "sometimes"}, "NextStep"),
        ({"max_episode_steps": 0.5}, "max_episode_steps"),
        ({"render_mode": "human"}, "rgb_array"),
        ({"robbot": "kbot", "num_envs": 4, "processes": 2}, "did you mean 'robot'"),
    ],
)
def test_wrong_options_are_refused(options, part):
    with pytest.raises(kbot.KbotError) as caught:
        gymnasium.make_vec(GOAL, **options)
    assert part in str(caught.value)


@pytest.mark.parametrize("actions", [np.zeros((COUNT, 3)), np.full((COUNT, 2), np.nan)])
def test_wrong_actions_are_refused(actions):
    ours = make(processes=1)
    with pytest.raises(kbot.KbotError, match="call reset"):
        ours.step(np.zeros((COUNT, 2)))
    ours.reset(seed=1)
    with pytest.raises(kbot.KbotError, match="actions must"):
        ours.step(actions)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows has no SIGKILL")
def test_a_process_that_ended_is_reported():
    ours = make(processes=2)
    ours.reset(seed=1)
    os.kill(ours.unwrapped._groups[1]._process.pid, signal.SIGKILL)
    with pytest.raises(kbot.KbotError, match="process of the vector environment ended"):
        ours.step(np.zeros((COUNT, 2)))
    ours.close()


def test_an_internal_error_has_its_traceback():
    group = GroupProcess("no task", {}, 1, "NextStep", None)
    with pytest.raises(KeyError) as caught:
        group.receive()
    group.close()
    assert "in make_episodes" in caught.value.__notes__[0]


def test_processes_end_when_nobody_refers_to_the_environment():
    ours = make(processes=2)
    started = [psutil.Process(group._process.pid) for group in ours.unwrapped._groups[1:]]
    del ours
    gc.collect()
    assert not any(process.is_running() for process in started)
