"""Reads the settings of joint_state_publisher."""

from __future__ import annotations

import math

from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.plan import Param, Plan, PlannedNode
from kbot.ros.nodes.joint_state_publisher import RATE, Dependent, JointStateSettings
from kbot.ros.parameter_values import ParameterValue
from kbot.text import Diagnostic, Severity
from kbot.text.suggest import did_you_mean

_KNOWN = (
    *("rate", "source_list", "use_mimic_tags", "use_smallest_joint_limits", "zeros", "dependent_joints"),
    *("publish_default_positions", "publish_default_velocities", "publish_default_efforts", "delta"),
    *("num_rows", "use_gui", "robot_description", "use_sim_time", "source_timeout", "ignore_unknown_links"),
)


def read_joint_states(plan: Plan) -> tuple[JointStateSettings, list[Diagnostic]]:
    """The settings of the first joint_state_publisher of a launch, and findings about them."""
    notes: list[Diagnostic] = []
    for node in plan.nodes:
        if role(node.package, node.type) is Role.JOINT_STATE:
            return _Reader(plan, node, notes).read(), notes
    return JointStateSettings(), notes


class _Reader:
    def __init__(self, plan: Plan, node: PlannedNode, notes: list[Diagnostic]) -> None:
        # ROS 2 writes nested names with dots
        self._params = {name.replace(".", "/"): param for name, param in plan.params_of(node).items()}
        self._notes = notes

    def read(self) -> JointStateSettings:
        for name, param in self._params.items():
            first = name.split("/")[0]
            if first not in _KNOWN:
                hint = did_you_mean(first, _KNOWN) or f"use one of: {', '.join(_KNOWN)}"
                self._note(param, f"joint_state_publisher has no parameter '{first}'", hint)
        rate = self._number("rate", RATE)
        sources = self._value("source_list", [])
        return JointStateSettings(
            rate=rate if rate > 0.0 else RATE,
            zeros={name: self._number(f"zeros/{name}", 0.0) for name in self._below("zeros")},
            dependent=self._dependent(),
            sources=tuple(map(str, sources)) if isinstance(sources, list) else (),
            use_mimic_tags=bool(self._value("use_mimic_tags", True)),
        )

    def _dependent(self) -> dict[str, Dependent]:
        found: dict[str, Dependent] = {}
        for joint in self._below("dependent_joints"):
            base = f"dependent_joints/{joint}"
            parent = self._value(f"{base}/parent", "")
            if not parent:
                params = [p for name, p in self._params.items() if name.startswith(base)]
                self._note(params[0], f"the dependent joint '{joint}' has no parent", f"set {base}/parent")
                continue
            factor, offset = self._number(f"{base}/factor", 1.0), self._number(f"{base}/offset", 0.0)
            found[joint] = Dependent(str(parent), factor, offset)
        return found

    def _below(self, name: str) -> list[str]:
        """The names one level below a parameter name."""
        names = (key.split("/")[1] for key in self._params if key.startswith(f"{name}/"))
        return list(dict.fromkeys(names))

    def _value(self, name: str, default: ParameterValue) -> ParameterValue:
        param = self._params.get(name)
        return default if param is None else param.value

    def _number(self, name: str, default: float) -> float:
        param = self._params.get(name)
        if param is None:
            return default
        value = param.value
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
        self._note(param, f"{name} must be a finite number, not {value!r}", "")
        return default

    def _note(self, param: Param, message: str, hint: str) -> None:
        self._notes.append(Diagnostic("L062", Severity.WARNING, message, param.origin, hint))
