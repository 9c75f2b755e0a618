"""The cache of what was used recently."""

import gc

import gymnasium

import kbot  # noqa: F401 - registers the environments
from kbot.learn.environments import recently_used
from kbot.learn.environments.recently_used import RecentlyUsed
from kbot.learn.environments.stage import Stage


def test_caches_share_one_limit(monkeypatch):
    monkeypatch.setattr(recently_used, "MOST_KEPT", 3)
    first, second, made = RecentlyUsed(), RecentlyUsed(), []

    def get(cache, key):
        return cache.get(key, lambda: made.append(key) or key)

    for cache, key in ((first, "a"), (first, "b"), (second, "c"), (first, "a"), (second, "d")):
        assert get(cache, key) == key
    assert made == ["a", "b", "c", "d"], "a was kept"
    get(first, "a")
    get(first, "b")
    assert made == ["a", "b", "c", "d", "b"], "b was used before c and a, and was dropped for d"


def stages():
    gc.collect()
    return sum(isinstance(each, Stage) for each in gc.get_objects())


def test_environments_of_a_process_keep_few_stages(monkeypatch):
    monkeypatch.setattr(recently_used, "MOST_KEPT", 4)
    before = stages()
    environments = [
        gymnasium.make("kbot/Goal-v0", world="boxes:seed={seed}", disable_env_checker=True) for _ in range(3)
    ]
    for seed in range(12):
        environments[seed % 3].reset(seed=seed)
    assert stages() - before <= 4 + 3, "besides those that are in use"


def test_stages_with_drawn_values_are_not_kept():
    before = stages()
    environment = gymnasium.make(
        "kbot/Goal-v0", randomise={"properties": {"wheel_radius": (0.03, 0.04)}}, disable_env_checker=True
    )
    for seed in range(4):
        environment.reset(seed=seed)
    assert stages() - before == 2, "the first one, and the one in use"
