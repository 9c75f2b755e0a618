"""Joint sliders that move the robot in the page, without a simulation."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from kbot.kinematics.frames import FrameTree
from kbot.messages import Bus, Clock, Header, JointState
from kbot.model import Joint, JointType, RobotModel
from kbot.model.extensions import initial_positions
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.tf.robot_state_publisher import RobotStatePublisher
from kbot.workbench.driving.mover import Moment, Mover
from kbot.workbench.protocol import Action, Timeline
from kbot.workbench.scene.scene import Control, slider_range
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field
from kbot.world import World

PUBLISH_RATE = 10.0
"""Publishing rate of joint states and transforms in Hz: the default of joint_state_publisher."""


@dataclass(frozen=True, slots=True)
class SliderSetting:
    """What stays the same when the robot changes.

    Joints start at `zeros` (rad or m), as in joint_state_publisher, or without `zeros` where ros2_control's
    hardware starts. `rate` is the publishing rate in Hz. `on_start` is called with each robot that is
    displayed.
    """

    zeros: Mapping[str, float] | None = None
    rate: float = PUBLISH_RATE
    on_start: Callable[[Sliders], None] = lambda sliders: None


@dataclass
class Sliders:
    """Joints at the positions of the sliders. Nothing moves by itself.

    It publishes `joint_states`, `/tf` and `/tf_static` while there are subscribers.
    """

    robot: RobotModel
    positions: dict[str, float] = field(default_factory=dict)
    choice: random.Random = field(default_factory=random.Random)
    clock: Clock = field(default_factory=Clock)
    paused: bool = False
    setting: SliderSetting = SliderSetting()
    bus: Bus = field(default_factory=Bus, init=False)
    loop: bool = field(default=False, init=False)
    note: str = field(default="", init=False)
    errands: list[Callable[[], bool]] = field(default_factory=list, init=False)
    seed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._tree = FrameTree(self.robot)
        self._joint_states = self.bus.advertise("joint_states", JointState, rate=self.setting.rate)
        RobotStatePublisher(self.robot, self.bus, self.clock)
        self._timer = self.clock.every(self.setting.rate, self._publish)
        self._joints = {j.name: j for j in self.robot.movable_joints if j.mimic is None}
        kept = {name: self.positions[name] for name in self._joints if name in self.positions}
        zeros = self.setting.zeros
        start = {**(initial_positions(self.robot) if zeros is None else zeros), **kept}
        self.positions = {name: _clamped(j, start.get(name, 0.0)) for name, j in self._joints.items()}
        self.setting.on_start(self)

    @property
    def world(self) -> str:
        return self.robot.root

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return ()

    def run_errands(self) -> bool:
        return sum(errand() for errand in self.errands) > 0

    def moment(self) -> Moment:
        return Moment(0.0, self._all_positions(), self._tree.poses(self.positions))

    def advance(self, seconds: float) -> float:
        self.clock.advance_to(self.clock.nanoseconds + round(seconds * 1e9))
        return 0.0

    def reset(self) -> None:
        self.set_joints("zero")

    def drive(self, linear: float, angular: float) -> None:
        raise KbotError("the robot cannot drive, because nothing is simulated here. Use kbot sim")

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        raise KbotError("nothing can be pushed, because nothing is simulated here. Use kbot sim")

    def act(self, action: Action) -> None:
        raise KbotError("there is no world to change, because nothing is simulated here. Use kbot sim")

    @property
    def controls(self) -> Mapping[str, Control]:
        return dict.fromkeys(self._joints, "position")

    @property
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
        return None, {}

    @property
    def timeline(self) -> Timeline | None:
        return None

    def series(self, fields: Sequence[Field], start: float, end: float) -> None:
        return None

    def seek(self, at: float) -> None:
        raise KbotError("cannot seek: nothing is simulated here, so there is no timeline")

    def save(self) -> None:
        return None

    def resume(self, saved: object) -> None:
        raise KbotError("there is nothing to resume, because nothing is simulated here")

    def record(self, recording: RunRecording) -> None:
        raise KbotError("there is nothing to record, because nothing is simulated here. Use kbot sim")

    def renewed(self, robot: RobotModel) -> Mover:
        raise KbotError("there is no run to start again, because nothing is simulated here. Use kbot sim")

    def enter(self, world: str, seed: int) -> tuple[Mover, World]:
        raise KbotError("there is no world to choose, because nothing is simulated here. Use kbot sim")

    def set_joint(self, name: str, position: float) -> None:
        joint = self._joints.get(name)
        if joint is None:
            hint = did_you_mean(name, self._joints)
            raise KbotError(f"there is no joint {name!r} to set by hand" + (f": {hint}" if hint else ""))
        self.positions[name] = _clamped(joint, position)

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        for name, joint in self._joints.items():
            lower, upper = slider_range(joint)
            match preset:
                case "zero":
                    wanted = (self.setting.zeros or {}).get(name, 0.0)
                case "centre":
                    wanted = (lower + upper) / 2
                case "random":
                    wanted = self.choice.uniform(lower, upper)
            self.positions[name] = _clamped(joint, wanted)

    def replace(self, robot: RobotModel) -> Sliders:
        self._timer.cancel()
        return Sliders(robot, self.positions, self.choice, self.clock, self.paused, self.setting)

    def _publish(self) -> None:
        header = Header(self.clock.stamp)
        if self._joint_states.has_subscribers:
            positions = self._all_positions()
            self._joint_states.publish(JointState(header, tuple(positions), tuple(positions.values())))

    def _all_positions(self) -> dict[str, float]:
        """Return all positions, including those of mimic joints."""
        found = dict(self.positions)
        for joint in self.robot.movable_joints:
            scale, offset, at, seen = 1.0, 0.0, joint, {joint.name}
            while at.mimic is not None and (leader := self.robot.joints.get(at.mimic.joint)) is not None:
                if leader.name in seen:
                    break
                seen.add(leader.name)
                offset += scale * at.mimic.offset
                scale *= at.mimic.multiplier
                at = leader
            if joint.mimic is not None:
                found[joint.name] = scale * self.positions.get(at.name, 0.0) + offset
        return found


def _clamped(joint: Joint, position: float) -> float:
    """Return the position clamped to the joint's range. A continuous joint has no range."""
    if joint.type is JointType.CONTINUOUS:
        return position
    lower, upper = slider_range(joint)
    return min(max(position, lower), upper)
