"""What a session offers to pages, such as worlds and whether the robot can drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from kbot.model import RobotModel
from kbot.workbench.protocol import About, WorldChoice
from kbot.workbench.source.shown import ShownDescription
from kbot.world import built_in
from kbot.world.world import World

Mode: TypeAlias = Literal["view", "sim", "play"]


@dataclass(frozen=True, slots=True)
class Offers:
    """What pages may ask for. `cannot_drive` says why a robot cannot drive, or nothing; `limits` its greatest
    speed in m/s and turning speed in rad/s; `worlds` are those to choose from, with the parameters that the
    name of the present one, `named`, gives; `things` are what can be spawned."""

    cannot_drive: Callable[[RobotModel], str] = lambda robot: ""
    limits: Callable[[RobotModel], tuple[float, float]] = lambda robot: (0.0, 0.0)
    worlds: Callable[[str], tuple[WorldChoice, ...]] = lambda named: ()
    named: str = ""
    things: tuple[str, ...] = ()


def about(
    shown: ShownDescription,
    mode: Mode,
    world: World | None,
    offers: Offers,
    *,
    played: str,
    seed: int,
    folder: str,
    client: int,
) -> About:
    """What the page of that number is told."""
    linear, angular = offers.limits(shown.robot)
    return About(
        file=shown.file,
        played=played,
        mode=mode,
        world=(built_in(offers.named) or offers.named) if offers.named else world.name if world else "",
        cannot_drive=offers.cannot_drive(shown.robot),
        linear_limit=linear,
        angular_limit=angular,
        files=shown.files,
        worlds=offers.worlds(offers.named),
        things=offers.things,
        seed=seed,
        folder=folder,
        client=client,
    )
