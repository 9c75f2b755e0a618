"""The page's mover while the description has never been usable: an empty floor or world, without a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NoReturn

from kbot.messages import Bus, Clock
from kbot.messages.types import WORLD
from kbot.model import RobotModel
from kbot.text import Diagnostic, KbotError
from kbot.workbench.driving.mover import Moment, Mover, flat
from kbot.workbench.protocol import Action
from kbot.workbench.scene.scene import Control
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field
from kbot.world import World

NO_ROBOT = "there is no robot yet. Fix the errors in its description first"


@dataclass
class NoRobot:
    """Shows a world without a robot until a description is usable. `replace` then returns its mover."""

    make_motion: Callable[[RobotModel], Mover]
    place: World | None
    bus: Bus = field(default_factory=Bus, init=False)
    clock: Clock = field(default_factory=Clock, init=False)
    paused: bool = field(default=False, init=False)
    loop: bool = field(default=False, init=False)
    note: str = field(default="", init=False)
    seed: int = field(default=0, init=False)

    @property
    def world(self) -> str:
        return WORLD

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return ()

    def moment(self) -> Moment:
        bodies = self.place.bodies if self.place is not None else ()
        return Moment(0.0, {}, {}, flat(body.pose for body in bodies if not body.is_static))

    def replace(self, robot: RobotModel) -> Mover:
        motion = self.make_motion(robot)
        motion.paused = motion.paused or self.paused
        return motion

    def renewed(self, robot: RobotModel) -> NoReturn:
        _refuse()

    def run_errands(self) -> bool:
        return False

    def advance(self, seconds: float) -> float:
        return 0.0

    def reset(self) -> None:
        pass

    @property
    def controls(self) -> Mapping[str, Control]:
        return {}

    @property
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
        return self.place, {}

    @property
    def timeline(self) -> None:
        return None

    def series(self, fields: Sequence[Field], start: float, end: float) -> None:
        return None

    def save(self) -> None:
        return None

    def drive(self, linear: float, angular: float) -> None:
        if linear or angular:
            _refuse()

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> NoReturn:
        _refuse()

    def set_joint(self, name: str, position: float) -> NoReturn:
        _refuse()

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> NoReturn:
        _refuse()

    def act(self, action: Action) -> NoReturn:
        _refuse()

    def seek(self, at: float) -> NoReturn:
        _refuse()

    def record(self, recording: RunRecording) -> NoReturn:
        _refuse()

    def resume(self, saved: object) -> NoReturn:
        _refuse()

    def enter(self, world: str, seed: int) -> NoReturn:
        _refuse()


def _refuse() -> NoReturn:
    raise KbotError(NO_ROBOT)
