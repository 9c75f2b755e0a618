"""Train a policy that drives to goals, and write it as an ONNX file.

Install what it needs in KBot's folder: pip install -e '.[learn,policy]' stable-baselines3 onnxscript
python train.py --steps 40000
"""

import argparse
from functools import partial

import gymnasium
import numpy as np
import task
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv, VecMonitor

from kbot.learn import PolicyInterface, save_policy

TIME_LIMIT = 20.0
"""s of an episode."""
NEAR = 0.3
"""m. The network sees near obstacles and goals on an exponential scale of this length, too."""


class Scaled(BaseFeaturesExtractor):
    """Scales what the policy sees to about -1 to 1. It is part of the exported network."""

    def __init__(self, space: gymnasium.spaces.Box, lengths: list[int], bounds: list[float]) -> None:
        super().__init__(space, len(bounds) + len(lengths))
        self.register_buffer("bounds", torch.tensor(bounds))
        self.register_buffer("lengths", torch.tensor(lengths))

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        near = torch.exp(torch.index_select(seen, 1, self.lengths) / -NEAR)
        return torch.cat([seen / self.bounds, near], dim=1)


class Deterministic(torch.nn.Module):
    """The policy without the random part that it needs to explore."""

    def __init__(self, model: SAC) -> None:
        super().__init__()
        self.actor = model.actor

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        actor = self.actor
        return torch.tanh(actor.mu(actor.latent_pi(actor.features_extractor(seen))))


def untrained(interface: PolicyInterface, environments: VecEnv) -> SAC:
    lengths = [at for at, field in enumerate(interface.inputs) if field.unit == "m"]
    bounds = [min(field.high, 4.0) for field in interface.inputs]
    extractor = {"lengths": lengths, "bounds": bounds}
    return SAC(
        "MlpPolicy",
        environments,
        learning_rate=5e-4,
        buffer_size=300_000,
        learning_starts=3_000,
        batch_size=256,
        gamma=0.98,
        train_freq=2,
        gradient_steps=2,
        ent_coef="auto_0.1",
        seed=0,
        device="cpu",
        policy_kwargs={
            "net_arch": [64, 64],
            "features_extractor_class": Scaled,
            "features_extractor_kwargs": extractor,
        },
    )


def export(model: SAC, interface: PolicyInterface, file: str) -> None:
    """Write the network with its inputs and actions."""
    seen = torch.zeros(1, len(interface.inputs))
    program = torch.onnx.export(Deterministic(model).eval(), (seen,), dynamo=True, verbose=False)
    save_policy(program.model_proto.SerializeToString(), interface, file)


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--steps", type=int, default=40_000)
    words.add_argument("--out", default="policy.onnx")
    words.add_argument("--log", default="episodes", help="NAME of the table NAME.monitor.csv")
    given = words.parse_args()
    torch.set_num_threads(1)
    interface = task.environment(task.TRAINING_ROOMS[0], TIME_LIMIT).get_wrapper_attr("interface")
    makers = [partial(task.environment, rooms, TIME_LIMIT) for rooms in task.TRAINING_ROOMS]
    environments = VecMonitor(SubprocVecEnv(makers), given.log, info_keywords=("is_success", "outcome"))
    model = untrained(interface, environments)
    for _ in range(10):
        model.learn(given.steps // 10, reset_num_timesteps=False)
        export(model, interface, given.out)
        ends = list(model.ep_success_buffer)
        share = np.mean(ends) if ends else 0.0
        print(
            f"{model.num_timesteps} steps: {share:.0%} of the last {len(ends)} episodes arrived", flush=True
        )


if __name__ == "__main__":
    main()
