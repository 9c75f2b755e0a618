"""Gymnasium environments, and the policies that are trained in them."""

from kbot.lazy_names import lazy_names, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
    from kbot.learn.interface.targets import GoalTarget, PathTarget
    from kbot.learn.policies.driving import go_to_with_policy, policy_goals
    from kbot.learn.policies.policy import Policy, PolicyController, save_policy

_HOMES = {
    "GoalTarget": "interface.targets",
    "PathTarget": "interface.targets",
    "Policy": "policies.policy",
    "PolicyController": "policies.policy",
    "PolicyInterface": "interface.policy_interface",
    "Sectors": "interface.policy_interface",
    "go_to_with_policy": "policies.driving",
    "policy_goals": "policies.driving",
    "save_policy": "policies.policy",
}

__all__ = [
    "GoalTarget",
    "PathTarget",
    "Policy",
    "PolicyController",
    "PolicyInterface",
    "Sectors",
    "go_to_with_policy",
    "policy_goals",
    "save_policy",
]

# imported on first use: the environments do not need the libraries of policies
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
