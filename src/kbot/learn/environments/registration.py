"""Registers the environments with Gymnasium: `kbot.gymnasium_hook` does it when both are imported."""

from __future__ import annotations

ENVIRONMENTS = {"kbot/Goal-v0": "goal", "kbot/Follow-v0": "follow", "kbot/Barn-v0": "barn"}
"""The task of each environment."""


def register() -> None:
    """Register all environments that are not registered yet."""
    from gymnasium.envs.registration import register as register_environment
    from gymnasium.envs.registration import registry

    for name, task in ENVIRONMENTS.items():
        if name not in registry:
            register_environment(
                name,
                entry_point="kbot.learn.environments.environment:KbotEnv",
                vector_entry_point="kbot.learn.environments.vector.vector_environment:KbotVectorEnv",
                kwargs={"task": task},
            )
