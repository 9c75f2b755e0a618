"""What drives by hand in a launch: teleop_twist_keyboard, and teleop_twist_joy with its joy_node."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from kbot.ros import names
from kbot.ros.launch.known_packages import Role
from kbot.ros.launch.node_arguments import split
from kbot.ros.launch.plan import Node, Param, Plan
from kbot.ros.nodes.teleop_twist_keyboard import Keys
from kbot.text import Diagnostic, Severity
from kbot.text.suggest import did_you_mean

DEVICE = "/dev/input/js0"
DEADZONE = 0.05
SLOWEST, FASTEST = 0.01, 1000.0
"""Hz at which joy_node may say all again."""
_JOY = (
    *("dev", "device_id", "device_name", "dev_name", "dev_ff", "deadzone", "autorepeat_rate"),
    *("coalesce_interval", "coalesce_interval_ms", "default_trig_val", "sticky_buttons", "use_sim_time"),
)
_TELEOP = (
    *("axis_linear", "axis_angular", "scale_linear", "scale_linear_turbo", "scale_angular"),
    *("scale_angular_turbo", "enable_button", "enable_turbo_button", "require_enable_button"),
    *("inverted_reverse", "publish_stamped_twist", "frame", "use_sim_time"),
)


@dataclass(frozen=True, slots=True)
class Stick:
    """An axis of a gamepad, and what it is multiplied by, also with the turbo button: m/s or rad/s."""

    axis: int
    scale: float
    turbo: float


@dataclass(frozen=True, slots=True)
class Driver:
    """teleop_twist_joy: hears `joy`, says commands on `topic` while a button is held. A button below 0 is
    none."""

    joy: str
    topic: str
    linear: Stick
    angular: Stick
    enable: int = 0
    turbo: int = -1
    requires_enable: bool = True


@dataclass(frozen=True, slots=True)
class Gamepad:
    """joy_node: the device that it reads, and the topic on which it tells of it. What is within the
    `deadzone` of an axis, of 1, is 0; it says all again `repeat` times a second, 0 for changes alone."""

    topic: str
    device: str = DEVICE
    deadzone: float = DEADZONE
    repeat: float = 0.0


@dataclass(frozen=True, slots=True)
class HandDriving:
    keys: Keys | None = None
    gamepads: tuple[Gamepad, ...] = ()
    drivers: tuple[Driver, ...] = field(default=())


def read_hand_driving(
    plan: Plan, cast: Mapping[Role | None, Iterable[Node]]
) -> tuple[HandDriving, list[Diagnostic]]:
    """What drives by hand, and what is wrong with its parameters."""
    notes: list[Diagnostic] = []
    keys = [_keys(_Params(plan, node, notes)) for node in cast.get(Role.TELEOP, ())]
    gamepads = [_gamepad(_Params(plan, node, notes)) for node in cast.get(Role.GAMEPAD, ())]
    drivers = [_driver(_Params(plan, node, notes)) for node in cast.get(Role.GAMEPAD_TELEOP, ())]
    return HandDriving(keys[0] if keys else None, tuple(gamepads), tuple(drivers)), notes


def _keys(params: _Params) -> Keys:
    return Keys(params.topic("cmd_vel"), params.number("speed", 0.5), params.number("turn", 1.0))


def _gamepad(params: _Params) -> Gamepad:
    params.refuse_unknown(_JOY)
    number = params.whole("device_id", 0)
    device = str(params.value("dev", f"/dev/input/js{number}"))
    deadzone = min(max(params.number("deadzone", DEADZONE), 0.0), 0.9)
    return Gamepad(params.topic("joy"), device, deadzone, _repeat(params))


def _repeat(params: _Params) -> float:
    default = 20.0 if params.plan.is_ros_2 else 0.0
    rate = params.number("autorepeat_rate", default)
    if rate == 0.0 or SLOWEST <= rate <= FASTEST:
        return rate
    params.refuse("autorepeat_rate", f"is 0, or from {SLOWEST:g} to {FASTEST:g} Hz, not {rate:g}")
    return default


def _driver(params: _Params) -> Driver:
    """The defaults are those of either ROS."""
    params.refuse_unknown(_TELEOP)
    is_2 = params.plan.is_ros_2
    linear, angular = (5, 2) if is_2 else (1, 0)
    turn = params.number("scale_angular", 0.5, "yaw")
    return Driver(
        params.topic("joy"),
        params.topic("cmd_vel"),
        Stick(
            params.whole("axis_linear", linear, "x"),
            params.number("scale_linear", 0.5, "x"),
            params.number("scale_linear_turbo", 1.0, "x"),
        ),
        Stick(
            params.whole("axis_angular", angular, "yaw"),
            turn,
            params.number("scale_angular_turbo", 1.0 if is_2 else turn, "yaw"),
        ),
        params.whole("enable_button", 5 if is_2 else 0),
        params.whole("enable_turbo_button", -1),
        bool(params.value("require_enable_button", True)),
    )


class _Params:
    """A node's own parameters; those of ROS 1 may be words of its command line, too."""

    def __init__(self, plan: Plan, node: Node, notes: list[Diagnostic]) -> None:
        self.plan, self._node, self._notes = plan, node, notes
        prefix = f"{node.full_name}/"
        own = {n.removeprefix(prefix): p for n, p in plan.params.items() if n.startswith(prefix)}
        # ROS 2 writes nested names with dots
        self._params: dict[str, Param] = {name.replace(".", "/"): param for name, param in own.items()}
        self._words: dict[str, str] = {}
        for word in split(node):
            name, mark, value = word.partition(":=")
            if mark and name.startswith("_") and not name.startswith("__"):
                self._words[name[1:].replace(".", "/")] = value

    def topic(self, name: str) -> str:
        """Where a topic of the node is, after its remaps."""
        words = dict(word.split(":=", 1) for word in split(self._node) if ":=" in word)
        remaps = {
            self._full(source): self._full(target)
            for source, target in (*self._node.remaps, *words.items())
            if not source.startswith("_")
        }
        return remaps.get(self._full(name), self._full(name))

    def _full(self, name: str) -> str:
        return names.canonical(names.join(self._node.namespace, name))

    def value(self, name: str, default: Any) -> Any:
        if name in self._words:
            return self._words[name]
        return self._params[name].value if name in self._params else default

    def number(self, name: str, default: float, below: str = "") -> float:
        """A number, by its name or, of a map, by what stands `below` it."""
        found = (
            self.value(f"{name}/{below}", self.value(name, default)) if below else self.value(name, default)
        )
        try:
            number = float(found)
        except (TypeError, ValueError):
            number = math.nan
        if math.isfinite(number) and not isinstance(found, bool):
            return number
        self._note(name, f"{name} is a finite number, not {found!r}", "")
        return default

    def whole(self, name: str, default: int, below: str = "") -> int:
        return round(self.number(name, default, below))

    def refuse(self, name: str, why: str) -> None:
        """Say what is wrong with a parameter."""
        self._note(name, f"{name} {why}", "")

    def refuse_unknown(self, known: tuple[str, ...]) -> None:
        for name in (*self._params, *self._words):
            first = name.split("/")[0]
            if first not in known:
                hint = did_you_mean(first, known) or f"there are {', '.join(known)}"
                self._note(name, f"{self._node.type} has no parameter '{first}'", hint)

    def _note(self, name: str, message: str, hint: str) -> None:
        fitting = (param for own, param in self._params.items() if own.split("/")[0] == name.split("/")[0])
        param = next(fitting, None)
        where = param.origin if param is not None else self._node.spans.get("args", self._node.origin)
        self._notes.append(Diagnostic("L062", Severity.WARNING, message, where, hint))
